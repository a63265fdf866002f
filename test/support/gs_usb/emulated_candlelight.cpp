#include "test/support/gs_usb/emulated_candlelight.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace rotorloop::emulated {
namespace {

constexpr std::size_t kToHost = 512, kFromHost = 64;  // messages that it holds
constexpr std::uint32_t kOfOthers = 0xFFFFFFFF, kExtended = 0x80000000, kError = 0x20000000;
constexpr std::uint32_t kListen = 1, kStamps = 1 << 4, kIdentify = 1 << 5, kFd = 1 << 8, kExtendedLimits = 1 << 10, kTermination = 1 << 11,
                        kState = 1 << 13;
constexpr std::array<std::uint8_t, 16> kLength{0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};

void put(Bytes& bytes, std::uint32_t value) {
  for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> 8 * i));
}
Bytes words(std::initializer_list<std::uint32_t> values) {
  Bytes bytes;
  for (const std::uint32_t v : values) put(bytes, v);
  return bytes;
}
std::uint32_t word(std::span<const std::uint8_t> bytes, std::size_t index) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8 | bytes[4 * index + i];
  return value;
}

Bytes text_descriptor(const std::string& text) {
  Bytes bytes{static_cast<std::uint8_t>(2 + 2 * text.size()), 3};
  for (const char c : text) bytes.insert(bytes.end(), {static_cast<std::uint8_t>(c), 0});
  return bytes;
}

}  // namespace

struct EmulatedCandlelight::Channel final : WireController {
  Channel(EmulatedCandlelight& d, unsigned n) : device(d), number(n) {}
  EmulatedCandlelight& device;
  unsigned number;
  std::uint32_t flags = 0;
  bool termination = false, identify = false;

  void push(std::uint32_t echo_id, std::uint32_t id, std::uint8_t code, std::uint8_t frame_flags, std::span<const std::uint8_t> data,
            std::int64_t time_ns) {
    Bytes m;
    put(m, echo_id);
    put(m, id);
    m.insert(m.end(), {code, static_cast<std::uint8_t>(number), frame_flags, 0});
    m.insert(m.end(), data.begin(), data.begin() + ((frame_flags & 2) != 0 ? 64 : 8));
    if ((flags & kStamps) != 0) put(m, static_cast<std::uint32_t>(time_ns / 1000));
    device.push(m);
  }
  void push_frame(std::uint32_t echo_id, const BusFrame& f, std::int64_t time_ns) {
    const auto code = std::find(kLength.begin(), kLength.end(), f.length) - kLength.begin();
    push(echo_id, f.id | (f.extended ? kExtended : 0u), static_cast<std::uint8_t>(code),
         static_cast<std::uint8_t>(f.fd ? 2 + (f.bit_rate_switch ? 4 : 0) : 0), f.data, time_ns);
  }
  void heard(const BusFrame& f, std::int64_t time_ns) override { push_frame(kOfOthers, f, time_ns); }
  void confirmed(const Waiting& sent, std::int64_t time_ns) override {
    if (device.faults.lost_echoes > 0) {
      --device.faults.lost_echoes;
    } else {
      push_frame(sent.echo_id, sent.frame, time_ns);
    }
  }
  void report(Report what) override {
    std::array<std::uint8_t, 64> data{};
    std::uint32_t classes = 0x4;
    const bool sending = transmit_errors >= receive_errors;
    switch (what) {
      case Report::warning:
        data[1] = sending ? 8 : 4;
        break;
      case Report::passive:
        data[1] = sending ? 0x20 : 0x10;
        break;
      case Report::active:
        data[1] = 0x40;
        break;
      case Report::bus_off:
        classes = 0x40;
        break;
      case Report::no_acknowledge:
        classes = 0x20;
        break;
    }
    data[6] = static_cast<std::uint8_t>(std::min(transmit_errors, 255));
    data[7] = static_cast<std::uint8_t>(std::min(receive_errors, 255));
    push(kOfOthers, kError | classes, 8, 0, data, 0);
  }
};

EmulatedCandlelight::EmulatedCandlelight(std::vector<CanWire*> wires, CandlelightOptions options)
    : wires_(std::move(wires)), options_(std::move(options)) {
  for (unsigned n = 0; n < options_.channels; ++n) {
    channels_.push_back(std::make_unique<Channel>(*this, n));
    wire_of(n).join(*channels_.back());
  }
}

EmulatedCandlelight::~EmulatedCandlelight() {
  for (const auto& c : channels_) wire_of(c->number).leave(*c);
}

WireController& EmulatedCandlelight::controller(unsigned channel) { return *channels_[channel]; }
bool EmulatedCandlelight::terminated(unsigned channel) const { return channels_[channel]->termination; }
bool EmulatedCandlelight::identifying(unsigned channel) const { return channels_[channel]->identify; }

std::uint32_t EmulatedCandlelight::features() const {
  return kListen | kIdentify | kTermination | kState | (options_.stamps ? kStamps : 0) | (options_.fd ? kFd | kExtendedLimits : 0);
}

Bytes EmulatedCandlelight::device_descriptor() const { return {18, 1, 0, 2, 0, 0, 0, 64, 0x50, 0x1D, 0x6F, 0x60, 0, 0, 1, 2, 3, 1}; }

// One interface of vendor class with two bulk endpoints; before it, for another number than 0, one of firmware update.
Bytes EmulatedCandlelight::configuration_descriptor() const {
  const bool second = options_.interface != 0;
  Bytes all{9, 2, 0, 0, static_cast<std::uint8_t>(second ? 2 : 1), 1, 0, 0x80, 75};
  if (second) all.insert(all.end(), {9, 4, 0, 0, 0, 0xFE, 1, 1, 0});
  all.insert(all.end(), {9, 4, options_.interface, 0, 2, 0xFF, 0xFF, 0xFF, 0, 7, 5, 0x81, 2, 64, 0, 0, 7, 5, 0x02, 2, 64, 0, 0});
  all[2] = static_cast<std::uint8_t>(all.size());
  return all;
}

std::optional<Bytes> EmulatedCandlelight::control(const Setup& s, std::span<const std::uint8_t> out) {
  const unsigned value = s[2] | static_cast<unsigned>(s[3]) << 8, length = s[6] | static_cast<unsigned>(s[7]) << 8;
  std::optional<Bytes> answer;
  if ((s[0] & 0x60) == 0) {
    answer = standard_request(s);
  } else if ((s[0] & 0x60) == 0x40 && s[4] == options_.interface) {
    if (faults.stalled_request == s[1]) return std::nullopt;
    if ((s[0] & 0x80) == 0) return vendor_out(s[1], value, out) ? std::optional<Bytes>(Bytes{}) : std::nullopt;
    answer = faults.garbled_request == s[1] ? faults.garbage : vendor_in(s[1], value);
  }
  if (answer && answer->size() > length) answer->resize(length);
  return answer;
}

std::optional<Bytes> EmulatedCandlelight::standard_request(const Setup& s) const {
  enum { get_status = 0, clear_feature = 1, get_descriptor = 6, get_configuration = 8, set_configuration = 9, set_interface = 11 };
  switch (s[1]) {
    case get_status:
      return Bytes{0, 0};
    case clear_feature:
    case set_configuration:
    case set_interface:
      return Bytes{};
    case get_configuration:
      return Bytes{1};
    case get_descriptor:
      break;
    default:
      return std::nullopt;
  }
  if (s[3] == 1) return device_descriptor();
  if (s[3] == 2) return configuration_descriptor();
  if (s[3] != 3 || s[2] > 3) return std::nullopt;  // a device of full speed has no qualifier
  if (s[2] == 0) return Bytes{4, 3, 9, 4};
  return text_descriptor(s[2] == 1 ? "rotorloop" : s[2] == 2 ? "emulated candleLight" : options_.serial);
}

std::optional<Bytes> EmulatedCandlelight::vendor_in(std::uint8_t request, unsigned value) const {
  const unsigned told = options_.reported_channels.value_or(options_.channels);
  if (request == 5) return words({(told - 1) << 24, 2, 1});
  if (request == 6) return words({0});
  if (value >= channels_.size()) return std::nullopt;
  const Channel& c = *channels_[value];
  Bytes limits = words({features(), options_.clock_Hz, 1, 256, 1, 128, 128, 1, 512, 1});
  switch (request) {
    case 4:
      return limits;
    case 11: {
      const Bytes data = words({1, 32, 1, 16, 16, 1, 32, 1});
      limits.insert(limits.end(), data.begin(), data.end());
      return options_.fd ? std::optional(limits) : std::nullopt;
    }
    case 13:
      return words({c.termination ? 1u : 0u});
    case 14: {
      const bool passive = std::max(c.transmit_errors, c.receive_errors) >= 128;
      return words({c.transmit_errors >= 256 ? 3u
                    : !c.on                  ? 4u
                    : passive                ? 2u
                                             : 0u,
                    static_cast<std::uint32_t>(c.receive_errors), static_cast<std::uint32_t>(c.transmit_errors)});
    }
    default:
      return std::nullopt;
  }
}

bool EmulatedCandlelight::vendor_out(std::uint8_t request, unsigned value, std::span<const std::uint8_t> data) {
  if (request == 0) return data.size() == 4 && word(data, 0) == 0xBEEF;
  if (value >= channels_.size()) return false;
  Channel& c = *channels_[value];
  const auto rate = [&] { return options_.clock_Hz / (word(data, 4) * (1.0 + word(data, 0) + word(data, 1) + word(data, 2))); };
  switch (request) {
    case 1:
    case 10:
      if (data.size() != 20 || word(data, 4) == 0) return false;
      (request == 1 ? c.rate_Hz : c.data_rate_Hz) = rate();
      return true;
    case 2:
      if (data.size() != 8) return false;
      set_mode(c, word(data, 0), word(data, 1));
      return true;
    case 7:
      if (data.size() != 4) return false;
      c.identify = word(data, 0) != 0;
      return true;
    case 12:
      if (data.size() != 4) return false;
      c.termination = word(data, 0) != 0;
      return true;
    default:
      return false;
  }
}

void EmulatedCandlelight::set_mode(Channel& c, std::uint32_t mode, std::uint32_t flags) {
  c.on = mode == 1;
  c.flags = flags;
  c.fd = (flags & kFd) != 0;
  c.listen_only = (flags & kListen) != 0;
  c.transmit_errors = c.receive_errors = 0;
  if (!c.on) c.to_send.clear();
}

EmulatedCandlelight::Out EmulatedCandlelight::bulk_out(std::span<const std::uint8_t> transfer, std::int64_t now_ns) {
  const auto happens = [](int& count) { return count > 0 && count-- > 0; };
  if (happens(faults.lost_out)) return Out::never;
  if (happens(faults.stalled_out)) return Out::stall;
  if (transfer.size() < 20) return Out::taken;  // and thrown away
  const unsigned channel = transfer[9];
  if (channel >= channels_.size()) return Out::taken;
  Channel& c = *channels_[channel];
  if (!c.on) return Out::taken;
  if (c.to_send.size() >= kFromHost) return Out::no_room;
  BusFrame f;
  f.fd = (transfer[10] & 2) != 0;
  f.bit_rate_switch = (transfer[10] & 4) != 0;
  const std::uint32_t id = word(transfer, 1);
  f.extended = (id & kExtended) != 0;
  f.id = id & (f.extended ? 0x1FFFFFFF : 0x7FF);
  f.length = kLength[transfer[8] & 15];
  if (f.length > transfer.size() - 12 || (f.fd && !c.fd)) return Out::taken;
  std::copy_n(transfer.begin() + 12, f.length, f.data.begin());
  c.to_send.push_back({.frame = f, .echo_id = word(transfer, 0), .since_ns = now_ns});
  return Out::taken;
}

void EmulatedCandlelight::push(const Bytes& message) {
  if (to_host_.size() >= kToHost) {
    overflowed_ = true;
    return;
  }
  to_host_.push_back(message);
  const bool told = faults.overflows > 0 && faults.overflows-- > 0;
  if (std::exchange(overflowed_, false) || told) to_host_.back()[10] |= 1;
}

std::optional<EmulatedCandlelight::In> EmulatedCandlelight::bulk_in() {
  const auto happens = [](int& count) { return count > 0 && count-- > 0; };
  while (!to_host_.empty()) {
    if (happens(faults.stalled_in)) return In{.stalled = true, .bytes = {}};
    In in{.stalled = false, .bytes = std::move(to_host_.front())};
    to_host_.pop_front();
    if (happens(faults.swallowed_in)) continue;
    if (happens(faults.cut_in)) in.bytes.resize(in.bytes.size() / 2);
    return in;
  }
  return std::nullopt;
}

}  // namespace rotorloop::emulated
