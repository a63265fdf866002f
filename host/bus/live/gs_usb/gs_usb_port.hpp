// A channel of a gs_usb adapter, "gsusb:[SERIAL][/CHANNEL][@BITRATE[,DATARATE]]", without a kernel driver. `sent` counts frames that the
// adapter echoed; candleLight's firmware does that when its controller takes the frame, others when it was on the bus.
#pragma once
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "host/bus/live/error_report.hpp"
#include "host/bus/live/gs_usb/adapter.hpp"
#include "host/bus/live/gs_usb/in_flight.hpp"
#include "host/bus/live/gs_usb/stamp_wrap.hpp"
#include "host/bus/live/stamp_clock.hpp"
#include "host/bus/live/transmit_queue.hpp"
#include "host/bus/timed_bus.hpp"

namespace rotorloop::gs_usb {

class GsUsbPort final : public TimedBus, private ChannelListener {
 public:
  static constexpr std::size_t kReceiveQueue = 65'536;         // frames that were taken from the adapter and not received
  static constexpr std::int64_t kRestart_ns = 1'000'000'000;   // after bus-off; beyond every command time-out
  static constexpr std::int64_t kLastFrames_ns = 100'000'000;  // that closing waits for frames on their way: a disarm among them

  // `now_ns`: the clock of the bus; nanoseconds since 1970. Throws Error (exit 3): see adapter.hpp and choose_timing().
  GsUsbPort(const Settings& settings, std::shared_ptr<Adapter> adapter, std::function<std::int64_t()> now_ns);
  ~GsUsbPort() override;
  GsUsbPort(const GsUsbPort&) = delete;
  GsUsbPort& operator=(const GsUsbPort&) = delete;

  SendStatus send_any(const BusFrame& frame) override;
  // Throws Error (exit 3) once the adapter is gone and what it sent before was received.
  std::optional<StampedBusFrame> receive_any() override;
  std::int64_t now_ns() const override { return now_ns_(); }
  void wait_until(std::int64_t deadline_ns) override;
  BusState state() const override { return errors_.state(); }
  PortCounters counters() const override { return counted_; }
  LinkCounters link_counters() const override;
  std::string name() const override { return settings_.name(); }
  int descriptor() const override { return adapter_->descriptor(); }
  void flush() override;
  std::int64_t next_flush_ns() const override { return restart_ns_; }
  bool input_waits() const override { return !received_.empty() || lost_ || adapter_->input_waits(); }
  std::optional<std::string> next_notice() override;

  const ChannelTiming& timing() const { return timing_; }

 private:
  void take(const Message& message) override;
  void malformed() override { ++link_.malformed; }
  void transferred(std::uint32_t echo_id, bool whole) override;
  void lost(const std::string& why) override;

  void start();
  void take_frame(const Message& message);
  void take_report(const ErrorReport& report);
  void restart_when_due();
  void submit_waiting();
  void send_waiting();
  void drop_waiting();  // and what the adapter has: none of it reaches the bus

  Settings settings_;
  std::shared_ptr<Adapter> adapter_;
  std::function<std::int64_t()> now_ns_;
  ChannelTiming timing_;
  FrameLayout layout_;
  std::uint32_t mode_flags_ = 0;
  TransmitQueue queue_;
  InFlight in_flight_;
  std::deque<StampedBusFrame> received_;
  ErrorState errors_{"it is started again after a second; \"rotorloop bus adapter " + settings_.name() +
                     " --listen\" tells the bus's bit rate"};
  std::deque<std::string> notices_;
  StampWrap stamps_;
  StampClock adapter_clock_;
  PortCounters counted_;
  LinkCounters link_;
  std::uint64_t lost_echoes_ = 0;
  std::int64_t restart_ns_ = INT64_MAX;
  std::optional<std::string> lost_;
};

// The adapter that a name means: the one that this program has already, or opened now. Throws Error (exit 3).
std::shared_ptr<Adapter> open_adapter(const Settings& settings);
// The port of a name behind "gsusb:". Throws Error (exit 3).
std::unique_ptr<GsUsbPort> open_gs_usb(const Settings& settings);

}  // namespace rotorloop::gs_usb
