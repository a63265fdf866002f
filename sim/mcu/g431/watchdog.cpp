#include "sim/mcu/g431/watchdog.hpp"

#include "sim/mcu/g431/rcc.hpp"

namespace rotorloop::mcu::g431 {
namespace {

constexpr uint32_t KR = 0x00, PR = 0x04, RLR = 0x08, IWDG_SR = 0x0C, WINR = 0x10;
constexpr Register kIwdg[] = {
    {KR, "KR", 0, 0}, {PR, "PR", 0, 7}, {RLR, "RLR", 0xFFF, 0xFFF}, {IWDG_SR, "SR", 0, 0}, {WINR, "WINR", 0xFFF, 0xFFF}};
constexpr uint32_t CR = 0x00, CFR = 0x04, SR = 0x08, WDGA = 0x80;
constexpr Register kWwdg[] = {{CR, "CR", 0x7F, 0x7F}, {CFR, "CFR", 0x7F, 0x3A7F}, {SR, "SR", 0, 0}};

}  // namespace

Iwdg::Iwdg(Wires& wires) : RegisterBlock(wires, "IWDG", 0x40003000, 0x400, kIwdg) { RegisterBlock::reset(true); }

// Ticks to the reset: the counter goes from RLR through 0.
void Iwdg::reload() {
  const uint64_t ticks = uint64_t{reg(RLR) + 1} * (4u << std::min(6u, field(PR, 0, 3)));
  s.more.reset_at = wires_.now() + cycles_of(ticks, kLsi_Hz, wires_.clocks().hclk_Hz);
}

uint32_t Iwdg::counter() const {
  const uint64_t left = ticks_in(s.more.reset_at - wires_.now(), kLsi_Hz, wires_.clocks().hclk_Hz);
  return static_cast<uint32_t>(left / (4u << std::min(6u, field(PR, 0, 3))));
}

void Iwdg::clocks_change() {
  if (s.more.started)
    s.more.ticks_left = ticks_in(s.more.reset_at - std::min(s.more.reset_at, wires_.now()), kLsi_Hz, wires_.clocks().hclk_Hz);
}

void Iwdg::clocks_changed() {
  if (s.more.started) s.more.reset_at = wires_.now() + cycles_of(s.more.ticks_left + 1, kLsi_Hz, wires_.clocks().hclk_Hz);
}

void Iwdg::advance(uint64_t cycle) {
  if (cycle < s.more.reset_at) return;
  s.more.reset_at = kNever;
  wires_.reset_chip(kIwdgReset);
}

uint32_t Iwdg::read(uint32_t offset) {
  if (offset == IWDG_SR) return wires_.now() < s.more.updated_at ? 7 : 0;
  return reg(offset);
}

void Iwdg::write(uint32_t offset, uint32_t value, uint32_t mask) {
  IwdgMore& m = s.more;
  if (offset != KR) {
    if (!m.open) return;
    keep(offset, value, mask);
    m.updated_at = wires_.now() + cycles_of(5, kLsi_Hz, wires_.clocks().hclk_Hz);
    if (offset == WINR && m.started) reload();  // a write of the window refreshes too
    return;
  }
  m.open = value == 0x5555;
  if (value == 0xCCCC && !m.started) {
    m.started = true;
    reload();
  }
  if (value == 0xAAAA && m.started) {
    if (reg(WINR) != 0xFFF && counter() > reg(WINR))
      wires_.reset_chip(kIwdgReset);  // refreshed before the window
    else
      reload();
  }
}

Wwdg::Wwdg(Wires& wires) : RegisterBlock(wires, "WWDG", 0x40002C00, 0x400, kWwdg, {0x58, 11}) { RegisterBlock::reset(true); }

uint64_t Wwdg::step() const {
  const Clocks& c = wires_.clocks();
  return cycles_of(uint64_t{4096} << field(CFR, 11, 3), c.pclk1_Hz, c.hclk_Hz);
}

uint32_t Wwdg::counter(uint64_t cycle) const {
  return static_cast<uint32_t>(s.more.from - std::min<uint64_t>(s.more.from, (cycle - s.more.started_at) / step()));
}

uint64_t Wwdg::next_event() const {
  if (!bit(CR, 7) || s.more.from < 0x40) return kNever;
  const uint64_t warn = s.more.started_at + (s.more.from - 0x40) * step();
  return warn > wires_.now() ? warn : s.more.started_at + (s.more.from - 0x3F) * step();
}

void Wwdg::advance(uint64_t cycle) {
  if (!bit(CR, 7)) return;
  const uint32_t t = counter(cycle);
  if (t == 0x40) reg(SR) |= 1;
  interrupt(0, bit(CFR, 9) && bit(SR, 0));
  if (t < 0x40) {
    reg(CR) &= ~WDGA;
    wires_.reset_chip(kWwdgReset);
  }
}

void Wwdg::clocks_change() {
  advance(wires_.now());
  s.more.from = counter(wires_.now());
  s.more.started_at = wires_.now();
}

uint32_t Wwdg::read(uint32_t offset) {
  if (offset != CR) return reg(offset);
  return (reg(CR) & WDGA) | (bit(CR, 7) ? counter(wires_.now()) : s.more.from);
}

void Wwdg::write(uint32_t offset, uint32_t value, uint32_t mask) {
  switch (offset) {
    case CR:
      if (bit(CR, 7) && counter(wires_.now()) > field(CFR, 0, 7)) wires_.reset_chip(kWwdgReset);  // refreshed before the window
      if ((value & WDGA) != 0 && (value & 0x40) == 0) wires_.reset_chip(kWwdgReset);
      reg(CR) |= value & WDGA;  // set-only
      s.more.from = value & 0x7F;
      s.more.started_at = wires_.now();
      break;
    case SR:
      reg(SR) &= value | ~mask;
      break;
    default:
      keep(offset, value, mask);
  }
  interrupt(0, bit(CFR, 9) && bit(SR, 0));
}

}  // namespace rotorloop::mcu::g431
