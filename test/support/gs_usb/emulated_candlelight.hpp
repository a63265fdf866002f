// A candleLight adapter as a plain class: descriptors, requests, frames of its channels, and the faults that an adapter can have. It knows
// no transport: emulated_link.hpp and the USB/IP server of test/vm bring bytes to it.
#pragma once
#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "test/support/gs_usb/can_wire.hpp"

namespace rotorloop::emulated {

using Bytes = std::vector<std::uint8_t>;

struct CandlelightOptions {
  unsigned channels = 2;
  std::string serial = "0042001A";
  std::uint32_t clock_Hz = 80'000'000;
  bool fd = true, stamps = true;
  std::uint8_t interface = 0;
  std::optional<unsigned> reported_channels = {};  // more, or fewer, than there are
};

// What goes wrong, counted down as it happens.
struct CandlelightFaults {
  std::optional<std::uint8_t> stalled_request;
  std::optional<std::uint8_t> garbled_request;  // its answer is `garbage`
  Bytes garbage;
  int stalled_out = 0, stalled_in = 0;  // transfers
  int cut_in = 0;                       // messages of which only the first half comes
  int swallowed_in = 0;                 // messages that never come
  int lost_out = 0;                     // transfers that never end
  int lost_echoes = 0;
  int overflows = 0;  // messages that tell of lost ones
};

class EmulatedCandlelight {
 public:
  // Channel n is on bus n, counted round: one bus connects all channels of an adapter, two keep a pair of them apart.
  EmulatedCandlelight(std::vector<CanWire*> wires, CandlelightOptions options);
  EmulatedCandlelight(CanWire& wire, CandlelightOptions options) : EmulatedCandlelight(std::vector{&wire}, std::move(options)) {}
  ~EmulatedCandlelight();
  EmulatedCandlelight(const EmulatedCandlelight&) = delete;
  EmulatedCandlelight& operator=(const EmulatedCandlelight&) = delete;

  using Setup = std::array<std::uint8_t, 8>;
  // Endpoint 0, standard and vendor requests. The answer of a request in, empty for one out; none: STALL.
  std::optional<Bytes> control(const Setup& setup, std::span<const std::uint8_t> out);
  enum class Out { taken, no_room, stall, never };
  Out bulk_out(std::span<const std::uint8_t> transfer, std::int64_t now_ns);
  // The next message for the host. stall: `stalled`.
  struct In {
    bool stalled = false;
    Bytes bytes;
  };
  std::optional<In> bulk_in();

  Bytes device_descriptor() const, configuration_descriptor() const;
  const CandlelightOptions& options() const { return options_; }
  CandlelightFaults faults;

  // From outside: the channel's controller, and what happens to it.
  WireController& controller(unsigned channel);
  bool terminated(unsigned channel) const;
  bool identifying(unsigned channel) const;
  std::size_t messages_waiting() const { return to_host_.size(); }

 private:
  struct Channel;
  std::optional<Bytes> standard_request(const Setup& setup) const;
  std::optional<Bytes> vendor_in(std::uint8_t request, unsigned value) const;
  bool vendor_out(std::uint8_t request, unsigned value, std::span<const std::uint8_t> data);
  void set_mode(Channel& c, std::uint32_t mode, std::uint32_t flags);
  std::uint32_t features() const;
  void push(const Bytes& message);

  CanWire& wire_of(unsigned channel) { return *wires_[channel % wires_.size()]; }

  std::vector<CanWire*> wires_;
  CandlelightOptions options_;
  std::vector<std::unique_ptr<Channel>> channels_;
  std::deque<Bytes> to_host_;
  bool overflowed_ = false;
};

}  // namespace rotorloop::emulated
