// Inputs: capture, slave modes, encoders, external triggers, breaks (RM0440, 28.3.7, 28.3.19, 28.3.26).
#include "sim/mcu/g431/timer.hpp"
#include "sim/mcu/g431/timer_registers.hpp"

namespace rotorloop::mcu::g431 {

using namespace tim;

namespace {
constexpr uint32_t kComparators = 4;

// The trigger inputs tim_itr0 to tim_itr8 are the same for every timer (RM0440, 28.3.2).
Signal internal_trigger(uint32_t n) {
  constexpr uint32_t kBy[] = {1, 2, 3, 4, 5, 8, 15};
  if (n < 7) return timer_signal(kBy[n], TimerWire::trgo);
  return n == 7 || n == 8 ? timer_signal(n + 9, TimerWire::oc1) : Signal::none;
}
}  // namespace

Signal Timer::input_source(uint32_t channel) const {
  const uint32_t select = field(TISEL, 8 * channel, 4);
  return select >= 1 && select <= kComparators && kind_.number < 15 ? Signal::comp1_out + (select - 1) : wire(TimerWire::ti1, channel);
}

Signal Timer::etr_source() const {
  const uint32_t select = field(AF1, 14, 4);
  if (select == 0) return wire(TimerWire::etr);
  if (select <= kComparators) return Signal::comp1_out + (select - 1);
  return kind_.advanced && select >= 8 && select <= 10 ? Signal::adc1_awd1 + (select - 8) : Signal::none;
}

Signal Timer::trigger_source() const {
  const uint32_t ts = field(SMCR, 4, 3) | field(SMCR, 20, 2) << 3;
  if (ts < 4) return internal_trigger(ts);
  if (ts == 4 || ts == 5) return input_source(0);
  if (ts == 6) return input_source(1);
  return ts == 7 ? etr_source() : internal_trigger(ts - 4);
}

bool Timer::listens(Signal signal) const {
  if (signal == Signal::none) return false;
  const uint32_t n = index(signal), first = index(wire(TimerWire::ti1)), last = index(wire(TimerWire::bkin2));
  if (n >= first && n <= last) return kind_.channels != 0;
  if (n >= index(Signal::comp1_out) && n < index(Signal::exti0)) return kind_.channels != 0;
  if (!kind_.slave) return false;
  for (uint32_t t = 0; t < 9; ++t)
    if (signal == internal_trigger(t)) return signal != Signal::none && signal != wire(TimerWire::trgo);
  return false;
}

void Timer::on_signal(Signal signal, bool high) {
  const uint32_t n = index(signal);
  const bool own = n - index(first_wire_) < static_cast<uint32_t>(TimerWire::count);
  const bool comparator = n >= index(Signal::comp1_out) && n < index(Signal::exti0);
  if (!own && !comparator && signal != trigger_source()) return;  // a trigger of another timer, which this one has not chosen
  advance(wires_.now());
  if (kind_.breaks) follow_breaks();
  if (kind_.slave && signal == etr_source() && !(field(SMCR, 0, 3) != 0 && trigger_source() == signal)) {
    s.more.cleared = high != bit(SMCR, 15);
    follow_references();
  }
  if (kind_.slave && signal == trigger_source()) {
    const uint32_t ts = field(SMCR, 4, 3) | field(SMCR, 20, 2) << 3;
    if (ts == 4) {
      trigger_level(true);  // TI1F_ED: every edge is a pulse
      trigger_level(false);
    } else {
      const bool inverted = ts == 5 ? bit(CCER, 1) : ts == 6 ? bit(CCER, 5) : ts == 7 && bit(SMCR, 15);
      trigger_level(high != inverted);
    }
  }
  for (uint32_t c = 0; c < kind_.channels; ++c)
    if (signal == input_source(c)) input_changed(c, high);
  interrupts();
}

// CCxP and CCxNP choose the edge: none set rising, CCxP alone falling, both every edge.
bool Timer::takes_edge(uint32_t channel, bool high) const {
  const uint32_t e = reg(CCER) >> (4 * channel);
  return (e & 10) == 10 || ((e & 2) != 0) != high;
}

void Timer::input_changed(uint32_t channel, bool high) {
  TimerMore& m = s.more;
  if (m.input[channel] == high) return;
  m.input[channel] = high;
  const uint32_t sms = field(SMCR, 0, 3);
  if (sms >= 1 && sms <= 3 && !bit(SMCR, 16) && channel < 2 && running()) {  // mode 1 counts TI1, 2 counts TI2, 3 both
    const bool ahead = (m.input[0] == m.input[1]) == (channel == 1);
    if (sms == 3 || sms == (channel == 0 ? 1u : 2u)) count_edge(!ahead);
  }
  for (uint32_t c = 0; c < kind_.channels; ++c) {
    const uint32_t select = m.mode[c] & 3;
    const bool heard = (select == 1 && c == channel) || (select == 2 && (c ^ 1) == channel);
    if (!heard || (reg(CCER) >> (4 * c) & 1) == 0 || !takes_edge(c, high)) continue;
    m.captures[c] = static_cast<uint8_t>(m.captures[c] + 1);
    if (m.captures[c] < 1u << (m.mode[c] >> 2 & 3)) continue;
    m.captures[c] = 0;
    capture(c);
  }
}

void Timer::capture(uint32_t channel) {
  reg(compare_register(channel)) = s.more.counter;
  const uint32_t flag = CC1IF << channel;
  if ((reg(SR) & flag) != 0) reg(SR) |= CC1OF << channel;
  raise(flag);
  if ((reg(DIER) >> (9 + channel) & 1) != 0) request_dma(kind_.dma_compare + channel);
  if (channel == 0) trigger_out(3);
}

void Timer::count_edge(bool down) {
  TimerMore& m = s.more;
  m.down = down;
  if (down && m.counter == 0) {
    m.counter = m.reload;
    update_event(false);
  } else if (!down && m.counter >= m.reload) {
    m.counter = 0;
    update_event(false);
  } else {
    m.counter = down ? m.counter - 1 : m.counter + 1;
  }
  for (uint32_t c = 0; c < kind_.channels; ++c)
    if (is_output(c) && m.compare[c] == m.counter) match(c, down);
  follow_references();
}

void Timer::trigger_level(bool high) {
  TimerMore& m = s.more;
  const bool rose = high && !m.trigger;
  m.trigger = high;
  const uint32_t sms = field(SMCR, 0, 3) | field(SMCR, 16, 1) << 3;
  if (sms == 5) {
    m.gate_open = high;
    m.tick_at = wires_.now();
    raise(TIF);
  }
  if (rose) triggered();
}

void Timer::triggered() {
  const uint32_t sms = field(SMCR, 0, 3) | field(SMCR, 16, 1) << 3;
  for (uint32_t c = 0; c < kind_.channels; ++c)
    if ((s.more.mode[c] & 3) == 3 && (reg(CCER) >> (4 * c) & 1) != 0) capture(c);
  if (kind_.breaks && bit(CR2, 2) && bit(CR2, 0)) com_event();  // CCUS
  if (sms == 0 && !bit(SMCR, 7) && !bit(DIER, kTrigger) && !bit(CR2, 2)) return;
  if (sms != 5) raise(TIF);
  if (bit(DIER, 14)) request_dma(kind_.dma_trigger);
  if (sms == 4 || sms == 8) generate(1);
  if (sms == 6 || sms == 8) {
    if ((reg(CR1) & CEN) == 0) {
      reg(CR1) |= CEN;
      s.more.tick_at = wires_.now();
      trigger_out(1);
    }
  }
  if (sms == 7 && running()) count_edge(false);
  if (sms > 8) wires_.refuse("slave modes above 8 are not modelled");
}

// AF1 and AF2: bit 0 the pin, bits 1 to 4 comparators; bits 9 and 10 to 13 turn them over.
bool Timer::break_level(uint32_t af, uint32_t enable, uint32_t polarity) const {
  if ((reg(BDTR) & enable) == 0) return false;
  const bool active_high = (reg(BDTR) & polarity) != 0;
  bool active = bit(af, 0) && (wires_.signal(wire(af == AF1 ? TimerWire::bkin : TimerWire::bkin2)) != bit(af, 9)) == active_high;
  for (uint32_t n = 0; n < kComparators; ++n)
    if (bit(af, 1 + n)) active = active || (wires_.signal(Signal::comp1_out + n) != bit(af, 10 + n)) == active_high;
  return active;
}

void Timer::follow_breaks() {
  TimerMore& m = s.more;
  if (!kind_.breaks) return;
  const bool first = break_level(AF1, BKE, BKP), second = kind_.advanced && break_level(AF2, BK2E, BK2P);
  const bool now = first && !m.break_in, now2 = second && !m.break2_in;
  m.break_in = first;
  m.break2_in = second;
  if (now) break_now(BIF);
  if (now2) break_now(B2IF);
}

// Outputs go to their idle states at once, without the clock.
void Timer::break_now(uint32_t sr_bit) {
  reg(BDTR) &= ~MOE;
  raise(sr_bit);
  follow_references();
}

}  // namespace rotorloop::mcu::g431
