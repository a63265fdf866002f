// An interface of a USB device through libusb 1.0. libusb has several descriptors, whose number changes; one epoll descriptor stands for
// them (decision 0176). libusb makes a thread of its own that hears of plugging; nothing of ours runs on it.
#pragma once
#include <memory>

#include "host/bus/live/gs_usb/usb_link.hpp"
#include "host/bus/live/gs_usb/usb_tree.hpp"

namespace rotorloop::gs_usb {

// The interface, taken from the driver that has it, which gets it back. None, and why, where it cannot be had.
struct OpenedLink {
  std::unique_ptr<UsbLink> link;
  UsbStatus status = UsbStatus::ok;
};
OpenedLink open_libusb(const UsbAdapter& adapter);

}  // namespace rotorloop::gs_usb
