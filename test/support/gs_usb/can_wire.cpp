#include "test/support/gs_usb/can_wire.hpp"

#include <algorithm>

#include "host/bus/frame_bits.hpp"

namespace rotorloop::emulated {
namespace {

constexpr int kWarning = 96, kPassive = 128, kBusOff = 256;

std::uint32_t priority(const BusFrame& f) { return arbitration_key(CanFrame{.id = f.id, .extended = f.extended, .length = 0, .data = {}}); }

int level(int transmit, int receive) {
  const int worst = std::max(transmit, receive);
  return transmit >= kBusOff ? 3 : worst >= kPassive ? 2 : worst >= kWarning ? 1 : 0;
}

}  // namespace

void WireController::count_errors(int transmit, int receive) {
  const int before = level(transmit_errors, receive_errors);
  transmit_errors = std::max(transmit_errors + transmit, 0);
  receive_errors = std::clamp(receive_errors + receive, 0, kPassive);
  const int after = level(transmit_errors, receive_errors);
  if (after == before) return;
  if (after == 3) {
    on = false;
    to_send.clear();
  }
  report(after == 3 ? Report::bus_off : after == 2 ? Report::passive : after == 1 ? Report::warning : Report::active);
}

void CanWire::leave(WireController& controller) {
  std::erase(controllers_, &controller);
  if (sender_ == &controller) sender_ = nullptr;
}

std::int64_t CanWire::length_ns(const WireController& sender, const BusFrame& f) const {
  const double rate = sender.rate_Hz > 0 ? sender.rate_Hz : 1e6;
  if (const auto classic = f.classic()) return static_cast<std::int64_t>((frame_bits(*classic) + kIntermissionBits) * 1e9 / rate);
  const double data_rate = f.bit_rate_switch && sender.data_rate_Hz > 0 ? sender.data_rate_Hz : rate;
  const double data_bits = (8.0 * f.length + 25.0) * 1.1;  // with CRC; a tenth of stuff bits
  return static_cast<std::int64_t>(((f.extended ? 49 : 30) + 13) * 1e9 / rate + data_bits * 1e9 / data_rate);
}

void CanWire::begin(std::int64_t now_ns) {
  const auto sends = [](const WireController& c) { return c.on && !c.listen_only && !c.to_send.empty(); };
  std::int64_t first_ns = INT64_MAX;
  for (const WireController* c : controllers_) {
    if (sends(*c)) first_ns = std::min(first_ns, c->to_send.front().since_ns);
  }
  // Those that are there when the bus gets free, or when the first of them comes, take part.
  const std::int64_t start_ns = std::max(free_ns_, first_ns);
  for (WireController* c : controllers_) {
    if (!sends(*c) || c->to_send.front().since_ns > start_ns) continue;
    if (sender_ == nullptr || priority(c->to_send.front().frame) < priority(sender_->to_send.front().frame)) sender_ = c;
  }
  if (sender_ == nullptr) return;
  current_ = sender_->to_send.front();
  acknowledged_ = false;
  bool disturbed = false;
  for (const WireController* c : controllers_) {
    if (c == sender_ || !c->on) continue;
    const bool same = c->rate_Hz == sender_->rate_Hz && (!current_.frame.fd || c->fd);
    disturbed = disturbed || (!same && !c->listen_only);
    acknowledged_ = acknowledged_ || (same && !c->listen_only);
  }
  succeeds_ = acknowledged_ && !disturbed;
  end_ns_ =
      (paced_ || !succeeds_ ? start_ns : std::max(free_ns_, now_ns)) + (paced_ || !succeeds_ ? length_ns(*sender_, current_.frame) : 0);
}

void CanWire::end() {
  WireController* const sender = std::exchange(sender_, nullptr);
  free_ns_ = end_ns_;
  const auto same = [&](const WireController::Waiting& w) { return w.echo_id == current_.echo_id && w.since_ns == current_.since_ns; };
  if (!sender->on || sender->to_send.empty() || !same(sender->to_send.front())) return;  // stopped meanwhile
  if (!succeeds_) {
    const bool alone =
        !acknowledged_ && std::none_of(controllers_.begin(), controllers_.end(), [&](auto* c) { return c != sender && c->on; });
    if (alone) sender->report(WireController::Report::no_acknowledge);
    sender->count_errors(alone && sender->transmit_errors >= kPassive ? 0 : 8,
                         0);  // nobody acknowledges: no bus-off (ISO 11898-1, 12.1.4.2)
    for (WireController* c : controllers_) {
      if (c != sender && c->on) c->count_errors(0, 1);
    }
    return;
  }
  const WireController::Waiting sent = current_;
  sender->to_send.pop_front();
  ++frames_;
  sender->count_errors(-1, 0);
  sender->confirmed(sent, end_ns_);
  for (WireController* c : controllers_) {
    if (c == sender || !c->on || c->rate_Hz != sender->rate_Hz) continue;
    c->count_errors(0, -1);
    c->heard(sent.frame, end_ns_);
  }
}

void CanWire::step(std::int64_t now_ns) {
  while (true) {
    if (sender_ == nullptr) begin(now_ns);
    if (sender_ == nullptr || end_ns_ > now_ns) return;
    end();
  }
}

std::optional<std::int64_t> CanWire::next_event_ns() const {
  if (sender_ != nullptr) return end_ns_;
  return std::nullopt;
}

}  // namespace rotorloop::emulated
