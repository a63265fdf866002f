// Emulated candleLight adapters on the USB of this machine's kernel: the host's end of USB/IP is vhci_hcd, this is the other end, over a
// socket pair; no network. Channels of all adapters meet on simulated CAN buses: all on one, or those of each number on one.
#pragma once
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "test/support/gs_usb/emulated_candlelight.hpp"

namespace rotorloop::emulated {

class UsbIpServer {
 public:
  UsbIpServer(bool paced, unsigned buses) : wires_(buses, CanWire(paced)) {}
  ~UsbIpServer();
  UsbIpServer(const UsbIpServer&) = delete;
  UsbIpServer& operator=(const UsbIpServer&) = delete;

  // Plugs an adapter in; false where the kernel has no vhci_hcd or refuses.
  bool plug(CandlelightOptions options);
  // Pulls the adapter of this serial number; false: there is none.
  bool unplug(const std::string& serial);
  EmulatedCandlelight* adapter(const std::string& serial);
  // Serves until `command` (a descriptor) is readable.
  void serve(int command);

 private:
  struct Urb {
    std::uint32_t sequence = 0;
    std::uint32_t length = 0;
    Bytes data;  // of one that goes out
    bool never = false;
  };
  struct Plug {
    std::unique_ptr<EmulatedCandlelight> device;
    int socket = -1;
    unsigned port = 0;
    std::deque<Urb> in, out;
  };
  void step();
  void run_out(Plug& p);
  void run_in(Plug& p);
  bool take_request(Plug& p);  // false: the kernel has let go of it
  bool take_submit(Plug& p, const std::uint8_t* header);
  bool take_unlink(Plug& p, std::uint32_t sequence, std::uint32_t victim);
  bool reply(Plug& p, std::uint32_t command, std::uint32_t sequence, std::int32_t status, std::uint32_t length, const Bytes& data);

  std::optional<std::int64_t> next_event_ns() const;

  std::vector<CanWire> wires_;  // of a number that does not change
  std::vector<std::unique_ptr<Plug>> plugs_;
};

}  // namespace rotorloop::emulated
