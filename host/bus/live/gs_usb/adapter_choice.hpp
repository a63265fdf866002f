// Which adapter and channel a bus name means, and the refusals that can be seen before a frame is sent. Pure.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "host/base/error.hpp"
#include "host/bus/live/gs_usb/usb_link.hpp"
#include "host/bus/live/gs_usb/usb_tree.hpp"
#include "host/bus/live/gs_usb/wire.hpp"

namespace rotorloop::gs_usb {

// Installed with the command; lets whoever is logged in use the adapters.
inline constexpr const char* kUdevRule = "70-rotorloop-can.rules";

struct Settings {
  std::string adapter;  // serial number, or path of the port; empty: the only one there is
  unsigned channel = 0;
  std::uint32_t bit_rate_Hz = 1'000'000;  // of DroneCAN
  std::optional<std::uint32_t> data_rate_Hz;
  std::string name() const { return "gsusb:" + adapter + (channel == 0 ? "" : "/" + std::to_string(channel)); }
};

// "", "0042001A", "0042001A/1@500000", "/1@1000000,4000000" (the last: of CAN FD's data, which asks for CAN FD). Throws Error (exit 2);
// `where` is what the message points at.
Settings parse_settings(const std::string& text, const std::string& where);

Error refusal(const Settings& settings, std::string what, std::string likely, std::string remedy);  // exit 3

// The adapter. Throws Error (exit 3): not there (with those that are), several and none named, used by an interface that is up.
UsbAdapter choose_adapter(const Settings& settings, std::span<const UsbAdapter> there);
// What opening or claiming it failed by. `programs`: who has it open (programs_with()).
Error open_refusal(const Settings& settings, UsbStatus status, const std::string& programs);

// What the channel is to be set to. Throws Error (exit 3): limits that no controller has, a rate that it cannot reach within 0.1 % (with
// the nearest), no CAN FD.
struct ChannelTiming {
  BitTiming nominal;
  std::optional<BitTiming> data;
};
ChannelTiming choose_timing(const Settings& settings, const ChannelInfo& channel);

}  // namespace rotorloop::gs_usb
