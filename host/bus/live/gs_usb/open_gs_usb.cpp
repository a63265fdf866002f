#include <map>

#include "host/bus/live/gs_usb/gs_usb_port.hpp"
#include "host/bus/live/gs_usb/libusb_link.hpp"
#include "host/bus/live/gs_usb/usb_tree.hpp"
#include "host/bus/live/live_clock.hpp"

namespace rotorloop::gs_usb {
namespace {

// Adapters of this program, by the path of their port: a second channel of one goes through the same transfers.
std::map<std::string, std::weak_ptr<Adapter>>& adapters_of_this_program() {
  static std::map<std::string, std::weak_ptr<Adapter>> adapters;
  return adapters;
}

}  // namespace

std::shared_ptr<Adapter> open_adapter(const Settings& settings) {
  const UsbAdapter plugged = choose_adapter(settings, plugged_in());
  std::weak_ptr<Adapter>& known = adapters_of_this_program()[plugged.path];
  auto adapter = known.lock();
  if (!adapter || adapter->lost()) {
    OpenedLink opened = open_libusb(plugged);
    if (!opened.link) throw open_refusal(settings, opened.status, programs_with(plugged));
    adapter = std::make_shared<Adapter>(settings, std::move(opened.link));
    known = adapter;
  }
  return adapter;
}

std::unique_ptr<GsUsbPort> open_gs_usb(const Settings& settings) {
  return std::make_unique<GsUsbPort>(settings, open_adapter(settings), live_now_ns);
}

}  // namespace rotorloop::gs_usb
