// gs_usb adapters that are plugged in, with who uses them, as the kernel's tree of USB devices tells it; no permission is needed.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace rotorloop::gs_usb {

// Vendor and product of adapters that speak gs_usb: gs_usb and candleLight, candleLight, CES CANext FD, ABE CAN Debugger FD (gs_usb.c of
// Linux). 70-rotorloop-can.rules names the same ones.
inline constexpr std::array<std::array<std::uint16_t, 2>, 4> kKnownAdapters{
    {{0x1D50, 0x606F}, {0x1209, 0x2323}, {0x1CD2, 0x606F}, {0x16D0, 0x10B8}}};

struct UsbAdapter {
  std::string path;               // "1-1.2": bus and ports; stays the same over a replug in the same place
  unsigned bus = 0, address = 0;  // /dev/bus/usb/001/004
  std::uint16_t vendor = 0, product = 0;
  std::string serial, product_name;
  // The interface with a bulk endpoint each way.
  unsigned interface = 0;
  std::uint8_t endpoint_in = 0, endpoint_out = 0;
  std::string driver;                   // "gs_usb", "usbfs" (a program), or empty
  std::vector<std::string> interfaces;  // of Linux's CAN, that the kernel's driver made of it: "can0"
  std::vector<std::string> up;          // those of them that are up

  std::string name() const { return serial.empty() ? path : serial; }  // as in "gsusb:NAME"
  // "kernel driver gs_usb: can0 (up), can1", "a program", or "nobody".
  std::string user_text() const;
};

// In order of their paths. What is unplugged meanwhile, or has no such interface, is left out.
std::vector<UsbAdapter> plugged_in(const std::filesystem::path& tree = "/sys/bus/usb/devices");

// Programs that have the device open, "candump (1234)"; only those of the same user are seen. Empty: nobody is seen.
std::string programs_with(const UsbAdapter& adapter);

}  // namespace rotorloop::gs_usb
