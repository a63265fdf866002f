#include "host/bus/live/gs_usb/usb_tree.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <optional>

namespace rotorloop::gs_usb {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kInterfaceUp = 1;  // IFF_UP
constexpr unsigned kBulk = 2, kVendorClass = 0xFF, kDirectionIn = 0x80;

std::string line_of(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

std::optional<unsigned> number_of(const fs::path& file, int base) {
  const std::string line = line_of(file);
  char* end = nullptr;
  const unsigned long value = std::strtoul(line.c_str(), &end, base);
  if (end == line.c_str() || value > 0xFFFF'FFFF) return std::nullopt;
  return static_cast<unsigned>(value);
}

std::vector<fs::path> children(const fs::path& folder) {
  std::vector<fs::path> all;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) all.push_back(it->path());
  std::sort(all.begin(), all.end());
  return all;
}

void read_endpoints(const fs::path& interface, UsbAdapter& a) {
  for (const fs::path& endpoint : children(interface)) {
    if (!endpoint.filename().string().starts_with("ep_")) continue;
    const auto address = number_of(endpoint / "bEndpointAddress", 16), attributes = number_of(endpoint / "bmAttributes", 16);
    if (!address || !attributes || (*attributes & 3) != kBulk || *address > 0xFF) continue;
    std::uint8_t& which = (*address & kDirectionIn) != 0 ? a.endpoint_in : a.endpoint_out;
    if (which == 0) which = static_cast<std::uint8_t>(*address);
  }
}

bool read_interface(const fs::path& interface, UsbAdapter& a) {
  const auto number = number_of(interface / "bInterfaceNumber", 16);
  if (!number || *number > 0xFF || number_of(interface / "bInterfaceClass", 16) != kVendorClass) return false;
  UsbAdapter found = a;
  read_endpoints(interface, found);
  if (found.endpoint_in == 0 || found.endpoint_out == 0) return false;
  found.interface = *number;
  std::error_code error;
  found.driver = fs::read_symlink(interface / "driver", error).filename().string();
  for (const fs::path& link : children(interface / "net")) {
    found.interfaces.push_back(link.filename().string());
    if ((number_of(link / "flags", 16).value_or(0) & kInterfaceUp) != 0) found.up.push_back(link.filename().string());
  }
  a = found;
  return true;
}

std::optional<UsbAdapter> read_device(const fs::path& device) {
  const auto vendor = number_of(device / "idVendor", 16), product = number_of(device / "idProduct", 16);
  const auto bus = number_of(device / "busnum", 10), address = number_of(device / "devnum", 10);
  if (!vendor || !product || !bus || !address) return std::nullopt;
  const auto known = [&](const auto& k) { return k[0] == *vendor && k[1] == *product; };
  if (std::none_of(kKnownAdapters.begin(), kKnownAdapters.end(), known)) return std::nullopt;
  UsbAdapter a;
  a.path = device.filename().string();
  a.bus = *bus;
  a.address = *address;
  a.vendor = static_cast<std::uint16_t>(*vendor);
  a.product = static_cast<std::uint16_t>(*product);
  a.serial = line_of(device / "serial");
  a.product_name = line_of(device / "product");
  for (const fs::path& child : children(device)) {
    if (child.filename().string().starts_with(a.path + ":") && read_interface(child, a)) return a;
  }
  return std::nullopt;
}

}  // namespace

std::string UsbAdapter::user_text() const {
  if (driver.empty()) return "nobody";
  if (driver == "usbfs") return "a program";
  std::string text = "kernel driver " + driver;
  for (const std::string& i : interfaces) {
    const bool is_up = std::find(up.begin(), up.end(), i) != up.end();
    text += (&i == &interfaces.front() ? ": " : ", ") + i + (is_up ? " (up)" : "");
  }
  return text;
}

std::vector<UsbAdapter> plugged_in(const fs::path& tree) {
  std::vector<UsbAdapter> found;
  for (const fs::path& device : children(tree)) {
    if (auto a = read_device(device)) found.push_back(std::move(*a));
  }
  return found;
}

std::string programs_with(const UsbAdapter& adapter) {
  std::array<char, 40> node{};
  std::snprintf(node.data(), node.size(), "/dev/bus/usb/%03u/%03u", adapter.bus, adapter.address);
  std::string programs;
  for (const fs::path& process : children("/proc")) {
    const std::string id = process.filename().string();
    if (id.find_first_not_of("0123456789") != std::string::npos) continue;
    for (const fs::path& open : children(process / "fd")) {
      std::error_code error;
      if (fs::read_symlink(open, error) != fs::path(node.data())) continue;
      programs += (programs.empty() ? "" : ", ") + line_of(process / "comm") + " (" + id + ")";
      break;
    }
  }
  return programs;
}

}  // namespace rotorloop::gs_usb
