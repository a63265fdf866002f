// References, outputs with dead time and idle states, trigger outputs (RM0440, 28.3.8 to 28.3.17, 28.3.25).
#include <algorithm>
#include <bit>

#include "sim/mcu/g431/timer.hpp"
#include "sim/mcu/g431/timer_registers.hpp"

namespace rotorloop::mcu::g431 {

using namespace tim;

// With CCPC the modes and enables wait for the COM event; what is no preload bit follows at once.
void Timer::follow_preload(bool com) {
  TimerMore& m = s.more;
  const bool preloaded = kind_.breaks && bit(CR2, 0) && !com;
  for (uint32_t c = 0; c < 6; ++c) {
    const uint32_t r = reg(mode_register(c)) >> mode_shift(c), mode = (r & 0xFF) | (r >> 8 & 0x100);
    m.mode[c] = preloaded ? (m.mode[c] & 0x170) | (mode & 0x8F) : mode;
    const uint32_t ocm = (mode >> 4 & 7) | (mode >> 5 & 8);
    if ((mode & 3) == 0 && ocm >= 8 && ocm < 12) wires_.refuse("output modes 8 to 11 (retriggerable pulses) are not modelled");
  }
  choose_outputs();
  if (!preloaded) m.ccer = reg(CCER);
  for (uint32_t c = 0; c < kind_.channels; ++c) wires_.set_signal(wire(TimerWire::input1, c), (m.mode[c] & 3) != 0);
}

void Timer::com_event() {
  raise(COMIF);
  if ((reg(DIER) >> 13 & 1) != 0) request_dma(kind_.dma_com);
  if (bit(CR2, 0)) follow_preload(true);
  follow_references();
}

// OCxREF by the mode (OCxM). Modes 1 to 3 change it at a match only.
bool Timer::compare_reference(uint32_t channel, bool matched) const {
  const TimerMore& m = s.more;
  const uint32_t mode = (m.mode[channel] >> 4 & 7) | (m.mode[channel] >> 5 & 8);
  const auto below = [&](uint32_t c) { return m.down ? m.counter <= m.compare[c] : m.counter < m.compare[c]; };
  const uint32_t other = channel ^ 1;
  switch (mode) {
    case 1:
      return matched || m.reference[channel];
    case 2:
      return !matched && m.reference[channel];
    case 3:
      return matched != m.reference[channel];
    case 4:
      return false;
    case 5:
      return true;
    case 6:
      return below(channel);
    case 7:
      return !below(channel);
    case 12:
      return below(channel) || below(other);
    case 13:
      return !below(channel) && !below(other);
    case 14:
      return below(m.down ? other : channel);
    case 15:
      return !below(m.down ? other : channel);
    default:
      return m.reference[channel];
  }
}

void Timer::follow_references(uint32_t matched) {
  TimerMore& m = s.more;
  const uint32_t count = kind_.advanced ? 6 : kind_.channels;
  uint32_t changed = 0;
  for (uint32_t c = 0; c < count; ++c) {
    if (!is_output(c)) continue;
    bool level = compare_reference(c, matched == c);
    if ((m.mode[c] & 0x80) != 0 && m.cleared) level = false;  // OCxCE
    changed |= static_cast<uint32_t>(m.reference[c] != level) << c;
    m.reference[c] = level;
  }
  for (uint32_t left = changed; left != 0; left &= left - 1) {
    const auto c = static_cast<uint32_t>(std::countr_zero(left));
    wires_.set_signal(wire(TimerWire::oc1, c), m.reference[c]);
    trigger_out(4 + c);
  }
  if (changed != 0 || matched == kAll) follow_outputs();
}

uint64_t Timer::dead_time(uint32_t dtg) const {
  const uint32_t ticks = dtg < 0x80   ? dtg
                         : dtg < 0xC0 ? 2 * (64 + (dtg & 0x3F))
                         : dtg < 0xE0 ? 8 * (32 + (dtg & 0x1F))
                                      : 16 * (32 + (dtg & 0x1F));
  return uint64_t{ticks} << field(CR1, 8, 2) << s.more.cycles_of_a_tick / 2;
}

void Timer::follow_outputs() {
  const TimerMore& m = s.more;
  const bool main_enable = !kind_.breaks || (reg(BDTR) & MOE) != 0;
  const uint64_t rise = kind_.complementary != 0 ? dead_time(field(BDTR, 0, 8)) : 0;
  const uint64_t fall = kind_.complementary != 0 && bit(DTR2, 16) ? dead_time(field(DTR2, 0, 8)) : rise;
  for (uint32_t c = 0; c < kind_.channels; ++c) {
    if (!is_output(c)) continue;
    const uint32_t e = m.ccer >> (4 * c);
    const bool on = (e & 1) != 0, on_n = (e & 4) != 0 && c < kind_.complementary;
    const bool active_low = (e & 2) != 0, active_low_n = (e & 8) != 0, ref = m.reference[c];
    if (!main_enable) {  // idle states with OSSI, else the pins are let go, which boards pull low
      const bool idle = (reg(BDTR) & OSSI) != 0 && (on || on_n);
      want(c, idle && bit(CR2, 8 + 2 * c), 0);
      if (c < kind_.complementary) want(4 + c, idle && bit(CR2, 9 + 2 * c), rise);
      continue;
    }
    const bool both = on && on_n, off_driven = kind_.breaks && (reg(BDTR) & OSSR) != 0 && (on || on_n);
    want(c, on ? ref != active_low : off_driven && active_low, both ? rise : 0);
    if (c < kind_.complementary) want(4 + c, on_n ? (both ? !ref : ref) != active_low_n : off_driven && active_low_n, both ? fall : 0);
  }
}

// A rising edge waits for the dead time, a falling one does not.
void Timer::want(uint32_t output, bool high, uint64_t delay) {
  TimerMore& m = s.more;
  if (m.wanted[output] == high) return;
  m.wanted[output] = high;
  rise_at(output, high && delay != 0 ? wires_.now() + delay : kNever);
  if (!high || delay == 0) set_output(output, high);
}

void Timer::rise_at(uint32_t output, uint64_t cycle) {
  TimerMore& m = s.more;
  if (m.rise_at[output] == cycle) return;
  m.rise_at[output] = cycle;
  m.next_rise = *std::min_element(m.rise_at.begin(), m.rise_at.end());
}

void Timer::set_output(uint32_t output, bool high) {
  if (s.more.output[output] == high) return;
  s.more.output[output] = high;
  const bool few = kind_.number >= 15;  // their complementary output stands beside channel 1
  wires_.set_signal(few && output >= 4 ? wire(TimerWire::ch1n) : wire(TimerWire::ch1, output), high);
}

// event: 0 UG, 1 enable changed, 2 update, 3 compare 1, 4 to 9 OC1REF to OC6REF changed.
void Timer::trigger_out(uint32_t event) {
  const auto drive = [&](Signal out, uint32_t select) {
    if (select != event) return;
    if (event == 1)
      wires_.set_signal(out, (reg(CR1) & CEN) != 0);
    else if (event < 4)
      wires_.pulse(out);
    else
      wires_.set_signal(out, s.more.reference[event - 4]);
  };
  drive(wire(TimerWire::trgo), field(CR2, 4, 3));
  if (!kind_.advanced) return;
  const uint32_t second = field(CR2, 20, 4);
  if (second < 10) {
    drive(wire(TimerWire::trgo2), second);
    return;
  }
  if (event != 7 && event != 8 && event != 9) return;  // pulses at edges of OC4REF, OC5REF and OC6REF
  struct Edges {
    uint8_t rise, fall;  // bit 0: OC4REF, 1: OC5REF, 2: OC6REF
  };
  constexpr Edges kEdges[] = {{1, 1}, {4, 4}, {5, 0}, {1, 4}, {6, 0}, {2, 4}};
  const Edges take = kEdges[second - 10];
  const bool high = s.more.reference[event - 4];
  if (((high ? take.rise : take.fall) >> (event - 7) & 1) != 0) wires_.pulse(wire(TimerWire::trgo2));
}

}  // namespace rotorloop::mcu::g431
