// A serial CAN adapter, "slcan:/dev/ttyACM0[@BITRATE[,BAUD]]": opens the adapter at the bit rate and speaks SLCAN with it.
#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "host/bus/live/slcan_stream.hpp"
#include "host/bus/timed_bus.hpp"

namespace rotorloop {

struct SlcanSettings {
  std::string device;                      // "/dev/ttyACM0"
  long bit_rate_Hz = 1'000'000;            // of the CAN bus
  long baud = 3'000'000;                   // of the serial line; adapters with USB of their own do not care
  std::int64_t answer_ns = 1'000'000'000;  // how long the adapter may take to answer while it is opened
};

// "/dev/ttyACM0@500000,921600". Throws Error (exit 2); `where` is what the message points at.
SlcanSettings parse_slcan_settings(const std::string& text, const std::string& where);

class SlcanPort final : public TimedBus {
 public:
  // Throws Error (exit 3) when the device cannot be opened, or does not answer as an SLCAN adapter within the time.
  explicit SlcanPort(const SlcanSettings& settings);
  ~SlcanPort() override;  // closes the channel

  SendStatus send_any(const BusFrame& frame) override;
  std::optional<StampedBusFrame> receive_any() override;  // throws Error (exit 3) when the adapter was unplugged
  std::int64_t now_ns() const override;
  void wait_until(std::int64_t deadline_ns) override;
  BusState state() const override { return state_; }  // as the adapter last told; asked once a second
  PortCounters counters() const override { return counted_; }
  LinkCounters link_counters() const override;
  std::string name() const override { return "slcan:" + settings_.device; }
  int descriptor() const override { return stream_.descriptor(); }
  bool output_waits() const override { return stream_.output_waits(); }
  void flush() override { stream_.flush(); }

 private:
  enum class Answer { ok, error, none };
  Answer command(const std::string& text);
  void drain();
  void open_channel();
  void on_answer(const std::string& line);

  SlcanSettings settings_;
  SlcanStream stream_;
  PortCounters counted_;
  LinkCounters link_;
  BusState state_ = BusState::error_active;
  std::int64_t next_question_ns_ = 0;
};

}  // namespace rotorloop
