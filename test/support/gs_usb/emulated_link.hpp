// An emulated adapter in the place of libusb, within one program; time is the test's. It can be unplugged at any transfer.
#pragma once
#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include "host/bus/live/gs_usb/usb_link.hpp"
#include "test/support/gs_usb/emulated_candlelight.hpp"

namespace rotorloop::emulated {

// A port of a computer with an adapter in it.
struct UsbPlug {
  UsbPlug(bool paced, CandlelightOptions options) : wire(paced), device(std::make_unique<EmulatedCandlelight>(wire, std::move(options))) {}
  CanWire wire;
  std::unique_ptr<EmulatedCandlelight> device;
  std::int64_t now_ns = 1'800'000'000'000'000'000;
  std::uint64_t transfers = 0;              // begun, requests among them
  std::uint64_t unplugged_at = UINT64_MAX;  // that transfer, and all after it, find no adapter
  bool claimed = false;                     // by a program; else the kernel's driver has it
  std::int64_t transfers_pending = 0;       // of all links together
  bool unplugged() const { return transfers >= unplugged_at; }
};

class EmulatedLink final : public gs_usb::UsbLink {
 public:
  explicit EmulatedLink(UsbPlug& plug);
  ~EmulatedLink() override;
  EmulatedLink(const EmulatedLink&) = delete;
  EmulatedLink& operator=(const EmulatedLink&) = delete;

  gs_usb::UsbAnswer control(bool in, std::uint8_t request, std::uint16_t value, std::span<std::uint8_t> data) override;
  gs_usb::UsbStatus submit_in(unsigned slot) override;
  gs_usb::UsbStatus submit_out(unsigned slot, std::span<const std::uint8_t> data) override;
  gs_usb::UsbStatus clear_stall(bool) override { return gs_usb::UsbStatus::ok; }
  std::optional<gs_usb::UsbCompletion> next_completion() override;
  bool completion_waits() const override { return !ended_.empty(); }
  void wait(std::int64_t most_ns) override;  // moves the test's time
  int descriptor() const override { return -1; }

 private:
  struct Pending {
    unsigned slot = 0;
    Bytes bytes;
    std::int64_t since_ns = 0;
    bool never = false, taken = false;
  };
  struct Ended {
    bool in = false;
    unsigned slot = 0;
    gs_usb::UsbStatus status = gs_usb::UsbStatus::ok;
    Bytes bytes;
  };
  void run();
  void run_out();
  void run_in();
  void end(bool in, unsigned slot, gs_usb::UsbStatus status, Bytes bytes = {});

  UsbPlug& plug_;
  std::deque<Pending> in_, out_;
  std::deque<Ended> ended_;
  Bytes current_;  // of the completion that was given last
};

}  // namespace rotorloop::emulated
