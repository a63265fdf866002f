// An RS-485 bus in virtual time: several slaves, one master, every byte with its duration. The master's side is a ByteLink, so that the
// same master runs on it and on a port. Faults are drawn from a seed: lost bytes, flipped bits, late answers, absent slaves.
#pragma once
#include <deque>
#include <memory>
#include <queue>

#include "bench/stand/instruments/byte_link.hpp"
#include "bench/stand/instruments/slave_device.hpp"
#include "host/base/random.hpp"

namespace rotorloop::modbus {

struct LineFaults {
  double byte_lost = 0.0;      // probability of each byte on the line
  double frame_flipped = 0.0;  // probability that a frame has flipped bits: 1 to flips_max of them, anywhere in its 8-bit characters
  int flips_max = 3;
  double reply_late = 0.0;  // probability that an answer comes late: uniform from its turnaround to late_max_ns
  std::int64_t late_max_ns = 0;
  std::uint64_t seed = 1;
};

struct HubSlave {
  std::uint8_t id = 1;
  std::shared_ptr<Slave> slave;
  std::int64_t turnaround_ns = 2'000'000;           // from the end of the request to the start of the answer; never below 3.5 characters
  std::int64_t jitter_ns = 0;                       // added, uniform
  std::int64_t dies_at_ns = std::int64_t{1} << 62;  // says nothing from then on
};

class SerialHub : public ByteLink {
 public:
  SerialHub(SerialFormat format, LineFaults faults);
  void add(HubSlave slave);

  std::int64_t now_ns() override { return now_ns_; }
  bool send(std::span<const std::uint8_t> bytes) override;
  int receive(std::span<std::uint8_t> into, std::int64_t deadline_ns) override;

  // What the line did, for tests that must see that faults occurred.
  struct Counts {
    std::uint64_t frames = 0, flipped = 0, bytes_lost = 0, late = 0, collisions = 0;
  };
  const Counts& counts() const { return counts_; }

 private:
  static constexpr int kMaster = -1;
  struct Event {
    std::int64_t time_ns;
    std::uint64_t order;  // of events of one time
    enum class Kind : std::uint8_t { byte, silence, sample, reply } kind;
    int source;  // byte: who sent it; else: index of the slave
    std::uint8_t value;
    std::uint64_t ticket;  // silence: how many bytes the slave had heard
    bool operator>(const Event& other) const { return time_ns != other.time_ns ? time_ns > other.time_ns : order > other.order; }
  };
  struct Station {
    HubSlave setup;
    std::vector<std::uint8_t> heard, request, reply;
    std::uint64_t bytes = 0;
    std::int64_t last_ns = 0;
  };
  struct Transmission {
    int source;
    std::int64_t begin_ns, end_ns;
  };

  void put_on_line(std::span<const std::uint8_t> bytes, int source);
  void handle(const Event& event);
  void hear(const Event& event);
  void end_of_frame(std::size_t index, const Event& event);
  void push(std::int64_t time_ns, Event::Kind kind, int source, std::uint8_t value = 0, std::uint64_t ticket = 0);
  double uniform() { return random_.uniform(draws_++); }
  std::uint64_t below(std::uint64_t n) { return random_.bits(draws_++) % n; }

  SerialFormat format_;
  LineFaults faults_;
  std::int64_t character_ns_, silence_ns_;
  RandomStream random_;
  std::uint64_t draws_ = 0, events_ = 0;
  std::int64_t now_ns_ = 0;
  std::vector<Station> stations_;
  std::deque<Transmission> on_line_;
  std::deque<std::uint8_t> inbox_;  // of the master
  std::priority_queue<Event, std::vector<Event>, std::greater<>> events_queue_;
  Counts counts_;
};

}  // namespace rotorloop::modbus
