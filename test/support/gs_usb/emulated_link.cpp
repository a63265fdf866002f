#include "test/support/gs_usb/emulated_link.hpp"

#include <algorithm>
#include <utility>

namespace rotorloop::emulated {
namespace {

using gs_usb::UsbAnswer;
using gs_usb::UsbCompletion;
using gs_usb::UsbStatus;

constexpr std::int64_t kTimeout_ns = 1'000'000'000;
constexpr std::int64_t kTick_ns = 1'000'000;

}  // namespace

EmulatedLink::EmulatedLink(UsbPlug& plug) : plug_(plug) { plug_.claimed = true; }

EmulatedLink::~EmulatedLink() {
  plug_.transfers_pending -= static_cast<std::int64_t>(in_.size() + out_.size());
  plug_.claimed = false;
}

UsbAnswer EmulatedLink::control(bool in, std::uint8_t request, std::uint16_t value, std::span<std::uint8_t> data) {
  ++plug_.transfers;
  if (plug_.unplugged()) return {.status = UsbStatus::gone, .bytes = 0};
  plug_.wire.step(plug_.now_ns);
  const EmulatedCandlelight::Setup setup{static_cast<std::uint8_t>(in ? 0xC1 : 0x41),
                                         request,
                                         static_cast<std::uint8_t>(value),
                                         static_cast<std::uint8_t>(value >> 8),
                                         plug_.device->options().interface,
                                         0,
                                         static_cast<std::uint8_t>(data.size()),
                                         static_cast<std::uint8_t>(data.size() >> 8)};
  const auto answer = plug_.device->control(setup, in ? std::span<const std::uint8_t>() : data);
  if (!answer) return {.status = UsbStatus::stall, .bytes = 0};
  std::copy(answer->begin(), answer->end(), data.begin());
  return {.status = UsbStatus::ok, .bytes = in ? answer->size() : data.size()};
}

UsbStatus EmulatedLink::submit_in(unsigned slot) {
  ++plug_.transfers;
  if (plug_.unplugged()) return UsbStatus::gone;
  in_.push_back({.slot = slot, .bytes = {}, .since_ns = plug_.now_ns});
  ++plug_.transfers_pending;
  return UsbStatus::ok;
}

UsbStatus EmulatedLink::submit_out(unsigned slot, std::span<const std::uint8_t> data) {
  ++plug_.transfers;
  if (plug_.unplugged()) return UsbStatus::gone;
  if (std::any_of(out_.begin(), out_.end(), [&](const Pending& p) { return p.slot == slot; })) return UsbStatus::busy;
  out_.push_back({.slot = slot, .bytes = Bytes(data.begin(), data.end()), .since_ns = plug_.now_ns});
  ++plug_.transfers_pending;
  return UsbStatus::ok;
}

void EmulatedLink::end(bool in, unsigned slot, UsbStatus status, Bytes bytes) {
  --plug_.transfers_pending;
  ended_.push_back({.in = in, .slot = slot, .status = status, .bytes = std::move(bytes)});
}

void EmulatedLink::run_out() {
  for (std::size_t i = 0; i < out_.size();) {
    Pending& p = out_[i];
    const auto taken = p.never ? EmulatedCandlelight::Out::never : plug_.device->bulk_out(p.bytes, plug_.now_ns);
    p.never = taken == EmulatedCandlelight::Out::never;
    const bool stays = p.never || taken == EmulatedCandlelight::Out::no_room;
    const bool late = plug_.now_ns - p.since_ns >= kTimeout_ns;
    if (stays && !late) {
      if (!p.never) return;  // those behind it wait, too
      ++i;
      continue;
    }
    end(false, p.slot, stays ? UsbStatus::timed_out : taken == EmulatedCandlelight::Out::stall ? UsbStatus::stall : UsbStatus::ok);
    out_.erase(out_.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

void EmulatedLink::run_in() {
  while (!in_.empty()) {
    auto message = plug_.device->bulk_in();
    if (!message) return;
    end(true, in_.front().slot, message->stalled ? UsbStatus::stall : UsbStatus::ok, std::move(message->bytes));
    in_.pop_front();
  }
}

void EmulatedLink::run() {
  if (plug_.unplugged()) {
    for (const Pending& p : out_) end(false, p.slot, UsbStatus::gone);
    for (const Pending& p : in_) end(true, p.slot, UsbStatus::gone);
    out_.clear();
    in_.clear();
    return;
  }
  run_out();
  plug_.wire.step(plug_.now_ns);
  run_in();
}

std::optional<UsbCompletion> EmulatedLink::next_completion() {
  if (ended_.empty()) run();
  if (ended_.empty()) return std::nullopt;
  Ended first = std::move(ended_.front());
  ended_.pop_front();
  current_ = std::move(first.bytes);
  return UsbCompletion{.in = first.in, .slot = first.slot, .status = first.status, .bytes = current_.size(), .data = current_};
}

void EmulatedLink::wait(std::int64_t most_ns) {
  const std::int64_t end_ns = plug_.now_ns + most_ns;
  run();
  while (ended_.empty() && plug_.now_ns < end_ns) {
    plug_.now_ns = std::min(plug_.now_ns + kTick_ns, end_ns);
    run();
  }
}

}  // namespace rotorloop::emulated
