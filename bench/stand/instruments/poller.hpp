// The bus master: reads the channels of all devices on one bus in turn, decodes them, and says at once when a channel has been silent for
// too long. Fast reads every cycle, slow ones spread over `slow_divider` cycles, those of rate `once` when a device is found (again). A
// device that does not answer is left out but for a try now and then, so that it does not hold up the others.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "bench/stand/instruments/channel_value.hpp"
#include "bench/stand/instruments/poll_plan.hpp"

namespace rotorloop::modbus {

struct PolledDevice {
  std::string name;  // in the stand file, or of the profile
  Profile profile;
  std::uint8_t slave = 1;
  std::vector<std::string> channels;  // empty: all
  ExchangeTiming timing;
  std::int64_t stale_ns = 200'000'000;  // a fast channel older than this is stale
  std::int64_t slow_stale_ns = 5'000'000'000;
};

struct PollerSettings {
  int slow_divider = 20;                      // one slow read of each in so many cycles
  int failures_until_lost = 3;                // in a row
  std::int64_t retry_ns = 1'000'000'000;      // of a lost device, while others on its bus answer
  std::int64_t retry_alone_ns = 100'000'000;  // while none does
};

// A value with the time at which the device had it: it was sampled within sampled_ns ± uncertainty_ns, however late it came.
struct Sample {
  std::size_t device = 0, channel = 0;  // channel: index into the profile
  ChannelValue value;
  std::int64_t sampled_ns = 0, uncertainty_ns = 0;
};

// A channel that is read gave no good value for longer than its limit; said once, until it is good again.
struct Stale {
  std::size_t device = 0, channel = 0;
  std::int64_t now_ns = 0, age_ns = 0;
};

struct ChannelStatistics {
  std::uint64_t good = 0, bad = 0;  // bad: came in, and is no measurement (Quality)
  std::uint64_t stale = 0;          // times it became stale
  std::int64_t first_ns = 0, last_ns = 0, greatest_interval_ns = 0;
  double rate_Hz() const;
};
struct DeviceStatistics {
  std::uint64_t exchanges = 0;
  std::array<std::uint64_t, 7> failures{};  // by Failure
  int last_exception = 0;
  std::int64_t round_trip_sum_ns = 0, round_trip_max_ns = 0;  // of answers
  std::vector<ChannelStatistics> channels;
  std::uint64_t failed() const;
};

class Poller {
 public:
  Poller(Exchanger& bus, std::vector<PolledDevice> devices, PollerSettings settings);

  std::function<void(const Sample&)> on_sample;
  std::function<void(const Stale&)> on_stale;  // may be called while an exchange waits

  // The next exchange. Waits when every device is lost, until one is tried again.
  void step();
  void run_until(std::int64_t time_ns);

  const std::vector<PolledDevice>& devices() const { return devices_; }
  const DeviceStatistics& statistics(std::size_t device) const { return states_[device].statistics; }
  bool lost(std::size_t device) const { return states_[device].phase == Phase::lost; }
  bool read_by_plan(std::size_t device, std::size_t channel) const { return states_[device].tracks[channel].polled; }
  // Cycle of all fast reads as byte times, gaps and typical turnarounds allow.
  std::int64_t cycle_ns() const;

 private:
  enum class Phase : std::uint8_t { new_found, running, lost };
  struct Track {  // of one channel
    bool polled = false, stale = false;
    std::int64_t limit_ns = 0, good_since_ns = 0;  // the earliest that the newest good value can have been sampled
    std::optional<std::uint64_t> raw;
  };
  struct State {
    PollPlan plan;
    Phase phase = Phase::new_found;
    std::size_t once_done = 0;
    int failures = 0;
    std::int64_t retry_at_ns = 0;
    std::vector<Track> tracks;
    DeviceStatistics statistics;
  };
  struct Turn {
    std::size_t device, group;
    bool slow;
  };

  void begin_cycle();
  bool read(std::size_t device, const ReadGroup& group);
  void take(std::size_t device, const ReadGroup& group, const Exchanged& exchanged);
  void note_failure(std::size_t device, const Exchanged& exchanged);
  std::int64_t look_for_stale(std::int64_t now_ns);

  Exchanger& bus_;
  std::vector<PolledDevice> devices_;
  PollerSettings settings_;
  std::vector<State> states_;
  std::vector<Turn> turns_;
  std::size_t next_turn_ = 0;
  std::uint64_t cycle_ = 0;
};

}  // namespace rotorloop::modbus
