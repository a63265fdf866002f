#include "host/bus/live/gs_usb/adapter_choice.hpp"

#include <charconv>
#include <cmath>
#include <utility>

namespace rotorloop::gs_usb {
namespace {

std::uint32_t number(std::string_view text, const std::string& where, const char* what, std::uint32_t least, std::uint32_t most) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value < least || value > most)
    throw Error(
        {where,
         std::string(what) + " \"" + std::string(text) + "\" is out of range: " + std::to_string(least) + " to " + std::to_string(most), "",
         "write gsusb:, gsusb:SERIAL, gsusb:SERIAL/1@1000000, or gsusb:SERIAL@1000000,4000000 for CAN FD"});
  return value;
}

std::string list_of(std::span<const UsbAdapter> there) {
  std::string list;
  for (const UsbAdapter& a : there) list += (list.empty() ? "gsusb:" : ", gsusb:") + a.name();
  return list;
}

std::string nearest_text(const BitTiming& t) {
  const auto rate = static_cast<long>(std::lround(t.rate_Hz));
  return std::to_string(rate) + " bit/s, " + std::to_string(std::lround(t.rate_error_ppm)) + " ppm off";
}

BitTiming timing(const Settings& s, const ChannelInfo& channel, std::uint32_t rate_Hz, double sample_point, const BitTimingLimits& limits) {
  const std::string clock = "its clock of " + std::to_string(channel.clock_Hz) + " Hz";
  const auto chosen = choose_bit_timing(channel.clock_Hz, rate_Hz, sample_point, limits);
  if (!chosen)
    throw refusal(s, "the adapter tells limits of its bit timing that no controller has, with " + clock,
                  "its firmware is damaged, or is no gs_usb", "update the adapter's firmware");
  if (chosen->rate_error_ppm > kMostRateError_ppm)
    throw refusal(s,
                  "the adapter cannot do " + std::to_string(rate_Hz) + " bit/s with " + clock + ": the nearest is " +
                      nearest_text(*chosen) + ", " + std::to_string(static_cast<int>(kMostRateError_ppm)) + " ppm are allowed",
                  "", "choose a rate that divides its clock; 1000000, 500000, 250000 and 125000 bit/s fit most");
  return *chosen;
}

}  // namespace

Settings parse_settings(const std::string& text, const std::string& where) {
  Settings s;
  const std::size_t at = text.find('@');
  const std::string_view place = std::string_view(text).substr(0, at);
  const std::size_t slash = place.find('/');
  s.adapter = place.substr(0, slash);
  if (s.adapter.find_first_of(" \t,") != std::string::npos)
    throw Error({where, "\"" + s.adapter + "\" cannot be the serial number of an adapter: no blank and no comma", "",
                 "rotorloop bus list shows the adapters that are there"});
  if (slash != std::string_view::npos) s.channel = number(place.substr(slash + 1), where, "channel", 0, kMostChannels - 1);
  if (at == std::string::npos) return s;
  const std::string_view rates = std::string_view(text).substr(at + 1);
  const std::size_t comma = rates.find(',');
  s.bit_rate_Hz = number(rates.substr(0, comma), where, "bit rate", 10'000, 1'000'000);
  if (comma != std::string_view::npos)
    s.data_rate_Hz = number(rates.substr(comma + 1), where, "bit rate of CAN FD's data", 10'000, 8'000'000);
  return s;
}

Error refusal(const Settings& s, std::string what, std::string likely, std::string remedy) {
  return Error({s.name(), std::move(what), std::move(likely), std::move(remedy)}, ExitCode::device);
}

UsbAdapter choose_adapter(const Settings& s, std::span<const UsbAdapter> there) {
  if (there.empty())
    throw refusal(s, "no gs_usb adapter is plugged in", "it is not plugged in, speaks another protocol, or is in its boot loader",
                  "see with lsusb; an adapter with a driver of Linux works as socketcan:can0, a serial one as slcan:/dev/ttyACM0");
  const UsbAdapter* found = nullptr;
  for (const UsbAdapter& a : there) {
    if (!s.adapter.empty() && s.adapter != a.serial && s.adapter != a.path) continue;
    if (found != nullptr)
      throw refusal(s,
                    s.adapter.empty() ? "several adapters are plugged in: " + list_of(there) : "several adapters have this serial number",
                    "", s.adapter.empty() ? "name one of them" : "name one by its port: gsusb:" + found->path + " or gsusb:" + a.path);
    found = &a;
  }
  if (found == nullptr) throw refusal(s, "there is no adapter of this serial number; there are: " + list_of(there), "", "use one of those");
  if (!found->up.empty())
    throw refusal(s, "the kernel's driver has this adapter as " + found->up.front() + ", which is up", "",
                  "use socketcan:" + found->up.front() + ", or free the adapter: sudo ip link set " + found->up.front() + " down");
  return *found;
}

Error open_refusal(const Settings& s, UsbStatus status, const std::string& programs) {
  if (status == UsbStatus::no_permission)
    return refusal(
        s, "no permission to use the adapter", "udev gives it to root alone where no rule names it",
        std::string("install the udev rule ") + kUdevRule +
            ": Debian's package has it; otherwise copy it from lib/udev/rules.d of the installation to /etc/udev/rules.d, then sudo "
            "udevadm control --reload; plug the adapter in again");
  if (status == UsbStatus::busy)
    return refusal(s, "another program uses the adapter" + (programs.empty() ? "" : ": " + programs), "",
                   "end that program, or use another adapter");
  return refusal(s, std::string("the adapter cannot be opened: ") + text_of(status), "it is being unplugged, or hangs", "plug it in again");
}

ChannelTiming choose_timing(const Settings& s, const ChannelInfo& channel) {
  ChannelTiming t{.nominal = timing(s, channel, s.bit_rate_Hz, kSamplePoint, channel.nominal), .data = {}};
  if (!s.data_rate_Hz) return t;
  if (!channel.has(kFd) || !channel.data)
    throw refusal(s, "the adapter carries no CAN FD", "its controller is classic, or its firmware has no CAN FD",
                  "leave the second bit rate out");
  t.data = timing(s, channel, *s.data_rate_Hz, kDataSamplePoint, *channel.data);
  return t;
}

}  // namespace rotorloop::gs_usb
