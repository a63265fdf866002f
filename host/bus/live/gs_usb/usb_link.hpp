// One claimed interface of a USB device, as the backend needs it: requests that wait for their answer, and bulk transfers that do not.
// libusb_link.hpp is the real one; tests have one over an emulated adapter.
#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace rotorloop::gs_usb {

enum class UsbStatus : std::uint8_t { ok, stall, timed_out, overflow, busy, no_permission, gone, failed };

constexpr const char* text_of(UsbStatus s) {
  switch (s) {
    case UsbStatus::ok:
      return "done";
    case UsbStatus::stall:
      return "refused by the adapter (stall)";
    case UsbStatus::timed_out:
      return "no answer in time";
    case UsbStatus::overflow:
      return "more data than asked for";
    case UsbStatus::busy:
      return "another program or driver uses it";
    case UsbStatus::no_permission:
      return "no permission";
    case UsbStatus::gone:
      return "the adapter is gone";
    case UsbStatus::failed:
      break;
  }
  return "input/output error";
}

struct UsbAnswer {
  UsbStatus status = UsbStatus::ok;
  std::size_t bytes = 0;
};

struct UsbCompletion {
  bool in = false;
  unsigned slot = 0;
  UsbStatus status = UsbStatus::ok;
  std::size_t bytes = 0;               // that went over the line
  std::span<const std::uint8_t> data;  // that came in; until the slot is submitted again
};

class UsbLink {
 public:
  // Number of transfers that can be on their way at once.
  static constexpr unsigned kInSlots = 16, kOutSlots = 160;

  virtual ~UsbLink() = default;  // ends all transfers and gives the interface back to the driver that had it
  // A vendor request to the interface. Waits a second at most.
  virtual UsbAnswer control(bool in, std::uint8_t request, std::uint16_t value, std::span<std::uint8_t> data) = 0;
  // Starts a transfer of a slot that has none; it ends with a completion, after a second at the latest for one that goes out. What is no
  // `ok` has not started.
  virtual UsbStatus submit_in(unsigned slot) = 0;
  virtual UsbStatus submit_out(unsigned slot, std::span<const std::uint8_t> data) = 0;
  virtual UsbStatus clear_stall(bool in) = 0;
  // The next transfer that ended, or none now.
  virtual std::optional<UsbCompletion> next_completion() = 0;
  // Completions were taken from the system: polling says nothing of them.
  virtual bool completion_waits() const = 0;
  // Returns when there is a completion, or after `most_ns`.
  virtual void wait(std::int64_t most_ns) = 0;
  // Readable when next_completion() may have one.
  virtual int descriptor() const = 0;
};

}  // namespace rotorloop::gs_usb
