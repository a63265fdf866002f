// The other end of SLCAN, "slcan-server:[PATH]": a pseudo terminal that behaves as a serial CAN adapter, so that any program that knows
// such adapters (pydronecan, the DroneCAN GUI tool, slcand) can join. Frames that it sends are received here, frames sent here reach it
// while its channel is open.
#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "host/bus/live/slcan_stream.hpp"
#include "host/bus/timed_bus.hpp"

namespace rotorloop {

class SlcanServer final : public TimedBus {
 public:
  // `link`: a symbolic link to make to the terminal, or empty. Throws Error (exit 3) when there is no terminal or the link exists.
  explicit SlcanServer(std::string link);
  ~SlcanServer() override;  // removes the link

  const std::string& terminal() const { return terminal_; }  // "/dev/pts/4"
  bool open() const { return open_; }                        // the program has opened the channel

  SendStatus send_any(const BusFrame& frame) override;
  std::optional<StampedBusFrame> receive_any() override;
  std::int64_t now_ns() const override;
  void wait_until(std::int64_t deadline_ns) override;
  BusState state() const override { return BusState::error_active; }
  PortCounters counters() const override { return counted_; }
  LinkCounters link_counters() const override;
  std::string name() const override { return "slcan-server:" + (link_.empty() ? terminal_ : link_); }
  std::string device_for_programs() const override { return terminal_; }
  int descriptor() const override { return stream_.descriptor(); }
  bool output_waits() const override { return stream_.output_waits(); }
  void flush() override { stream_.flush(); }

 private:
  void on_command(const std::string& line);
  void answer(std::string_view text) { stream_.write(text); }

  std::string link_;
  std::string terminal_;
  SlcanStream stream_;
  int held_ = -1;  // our own end of the program's side: without it the terminal reports an error whenever no program has it open
  bool open_ = false, listen_only_ = false, stamps_ = false;
  PortCounters counted_;
  LinkCounters link_counted_;
};

}  // namespace rotorloop
