// Counting: prescaler, update, repetition, compare, one pulse (RM0440, 28.3.1 to 28.3.3).
#include "sim/mcu/g431/timer.hpp"

#include <algorithm>
#include <bit>

#include "sim/mcu/g431/timer_registers.hpp"

namespace rotorloop::mcu::g431 {
namespace {

using namespace tim;

// clang-format off
constexpr Register kAdvanced[] = {
    {CR1, "CR1", 0, 0xBFF}, {CR2, "CR2", 0, 0x02F5FFFD}, {SMCR, "SMCR", 0, 0x0331FFFF}, {DIER, "DIER", 0, 0x00F07FFF}, {SR, "SR", 0, 0},
    {EGR, "EGR", 0, 0}, {CCMR1, "CCMR1", 0, 0x0101FFFF}, {CCMR2, "CCMR2", 0, 0x0101FFFF}, {CCER, "CCER", 0, 0x0033FFFF}, {CNT, "CNT"},
    {PSC, "PSC", 0, 0xFFFF}, {ARR, "ARR", 0xFFFF}, {RCR, "RCR", 0, 0xFFFF}, {CCR1, "CCR1"}, {CCR1 + 4, "CCR2"}, {CCR1 + 8, "CCR3"},
    {CCR1 + 12, "CCR4"}, {BDTR, "BDTR", 0, 0x3FFF7FFF}, {CCR5, "CCR5", 0, 0xE00FFFFF}, {CCR6, "CCR6", 0, 0xFFFFF},
    {CCMR3, "CCMR3", 0, 0x0101FCFC}, {DTR2, "DTR2", 0, 0x300FF}, {ECR, "ECR", 0, 0x073707FF}, {TISEL, "TISEL", 0, 0x0F0F0F0F},
    {AF1, "AF1", 1, 0x0003FFFF}, {AF2, "AF2", 1, 0x00073FFF}, {DCR, "DCR", 0, 0x1F1F}, {DMAR, "DMAR", 0, 0},
};
constexpr Register kGeneral[] = {
    {CR1, "CR1", 0, 0xBFF}, {CR2, "CR2", 0, 0x020000F8}, {SMCR, "SMCR", 0, 0x0331FFFF}, {DIER, "DIER", 0, 0x00F05F5F}, {SR, "SR", 0, 0},
    {EGR, "EGR", 0, 0}, {CCMR1, "CCMR1", 0, 0x0101FFFF}, {CCMR2, "CCMR2", 0, 0x0101FFFF}, {CCER, "CCER", 0, 0xBBBB}, {CNT, "CNT"},
    {PSC, "PSC", 0, 0xFFFF}, {ARR, "ARR", 0xFFFFFFFF}, {CCR1, "CCR1"}, {CCR1 + 4, "CCR2"}, {CCR1 + 8, "CCR3"}, {CCR1 + 12, "CCR4"},
    {ECR, "ECR", 0, 0x073707FF}, {TISEL, "TISEL", 0, 0x0F0F0F0F}, {AF1, "AF1", 0, 0x0003C000}, {AF2, "AF2", 0, 0x00070000},
    {DCR, "DCR", 0, 0x1F1F}, {DMAR, "DMAR", 0, 0},
};
// Timers without a slave mode have nothing at SMCR, which the vendor's low-layer code writes in every timer all the same: it reads 0.
constexpr Register kBasic[] = {
    {CR1, "CR1", 0, 0x88F}, {CR2, "CR2", 0, 0x70}, {SMCR, "SMCR", 0, 0}, {DIER, "DIER", 0, 0x101}, {SR, "SR", 0, 0}, {EGR, "EGR", 0, 0},
    {CNT, "CNT"}, {PSC, "PSC", 0, 0xFFFF}, {ARR, "ARR", 0xFFFF},
};
constexpr Register kOneOrTwo[] = {
    {CR1, "CR1", 0, 0xB8F}, {CR2, "CR2", 0, 0x7FD}, {SMCR, "SMCR", 0, 0x00310FF7}, {DIER, "DIER", 0, 0x6FE7}, {SR, "SR", 0, 0},
    {EGR, "EGR", 0, 0}, {CCMR1, "CCMR1", 0, 0x0101FFFF}, {CCER, "CCER", 0, 0xBF}, {CNT, "CNT"}, {PSC, "PSC", 0, 0xFFFF},
    {ARR, "ARR", 0xFFFF}, {RCR, "RCR", 0, 0xFF}, {CCR1, "CCR1"}, {CCR1 + 4, "CCR2"}, {BDTR, "BDTR", 0, 0x3FFF7FFF},
    {DTR2, "DTR2", 0, 0x300FF}, {TISEL, "TISEL", 0, 0xF0F}, {AF1, "AF1", 1, 0x3FFF}, {AF2, "AF2", 0, 0x70000}, {DCR, "DCR", 0, 0x1F1F},
    {DMAR, "DMAR", 0, 0},
};
constexpr Register kOne[] = {
    {CR1, "CR1", 0, 0xB8F}, {CR2, "CR2", 0, 0x30D}, {SMCR, "SMCR", 0, 0}, {DIER, "DIER", 0, 0x2A3}, {SR, "SR", 0, 0}, {EGR, "EGR", 0, 0},
    {CCMR1, "CCMR1", 0, 0x000100FF}, {CCER, "CCER", 0, 0xF}, {CNT, "CNT"}, {PSC, "PSC", 0, 0xFFFF}, {ARR, "ARR", 0xFFFF},
    {RCR, "RCR", 0, 0xFF}, {CCR1, "CCR1"}, {BDTR, "BDTR", 0, 0x3FFF7FFF}, {DTR2, "DTR2", 0, 0x300FF}, {TISEL, "TISEL", 0, 0xF},
    {AF1, "AF1", 1, 0x3FFF}, {AF2, "AF2", 0, 0x70000}, {OR1, "OR1", 0, 1}, {DCR, "DCR", 0, 0x1F1F}, {DMAR, "DMAR", 0, 0},
};

constexpr TimerKind kKinds[] = {
    // number, name, base, gate, APB2, channels, complementary, wide, advanced, slave, breaks, interrupts, DMA requests
    {1, "TIM1", 0x40012C00, {0x60, 11}, true, 4, 4, false, true, true, true, 24, 25, 26, 27, 42, 46, 47, 48},
    {2, "TIM2", 0x40000000, {0x58, 0}, false, 4, 0, true, false, true, false, 28, 28, 28, 28, 56, 60, 0, 0},
    {3, "TIM3", 0x40000400, {0x58, 1}, false, 4, 0, false, false, true, false, 29, 29, 29, 29, 61, 65, 66, 0},
    {4, "TIM4", 0x40000800, {0x58, 2}, false, 4, 0, false, false, true, false, 30, 30, 30, 30, 67, 71, 0, 0},
    {6, "TIM6", 0x40001000, {0x58, 4}, false, 0, 0, false, false, false, false, 54, 54, 54, 54, 0, 8, 0, 0},
    {7, "TIM7", 0x40001400, {0x58, 5}, false, 0, 0, false, false, false, false, 55, 55, 55, 55, 0, 9, 0, 0},
    {8, "TIM8", 0x40013400, {0x60, 13}, true, 4, 4, false, true, true, true, 43, 44, 45, 46, 49, 53, 54, 55},
    {15, "TIM15", 0x40014000, {0x60, 16}, true, 2, 1, false, false, true, true, 24, 24, 24, 24, 78, 79, 80, 81},
    {16, "TIM16", 0x40014400, {0x60, 17}, true, 1, 1, false, false, false, true, 25, 25, 25, 25, 82, 83, 0, 0},
    {17, "TIM17", 0x40014800, {0x60, 18}, true, 1, 1, false, false, false, true, 26, 26, 26, 26, 84, 85, 0, 0},
};
// clang-format on

std::span<const Register> registers_of(const TimerKind& kind) {
  if (kind.advanced) return kAdvanced;
  if (kind.channels == 4) return kGeneral;
  if (kind.channels == 0) return kBasic;
  return kind.channels == 2 ? std::span<const Register>(kOneOrTwo) : kOne;
}

}  // namespace

std::span<const TimerKind> timer_kinds() { return kKinds; }

Timer::Timer(Wires& wires, const TimerKind& kind)
    : RegisterBlock(wires, kind.name, kind.base, 0x400, registers_of(kind), kind.gate),
      kind_(kind),
      first_wire_(timer_signal(kind.number, TimerWire::ch1)) {
  reset(true);
}

void Timer::reset(bool power_up) {
  RegisterBlock::reset(power_up);
  reg(ARR) &= top();
  s.more.reload = reg(ARR);
  choose_outputs();
  clocks_changed();
}

void Timer::clocks_changed() {
  const Clocks& c = wires_.clocks();
  s.more.cycles_of_a_tick = c.hclk_Hz / std::max(1u, kind_.apb2 ? c.tim2_Hz : c.tim1_Hz);
}

bool Timer::running() const { return (reg(CR1) & CEN) != 0 && s.more.reload != 0 && (field(SMCR, 0, 3) != 5 || s.more.gate_open); }

// Modes 1 to 3 count edges of an encoder, mode 7 edges of the trigger.
bool Timer::counts_by_itself() const {
  const uint32_t sms = field(SMCR, 0, 3);
  return running() && (sms == 0 || (sms >= 4 && sms != 7));
}

uint32_t Timer::frequency_Hz() const { return static_cast<uint32_t>(wires_.clocks().hclk_Hz / std::max<uint64_t>(1, tick())); }

void Timer::choose_outputs() {
  s.more.outputs = kind_.advanced ? 3u << 4 : 0;
  for (uint32_t c = 0; c < kind_.channels; ++c)
    if ((s.more.mode[c] & 3) == 0) s.more.outputs |= 1u << c;
}

// Whether anybody hears of what happens in a period. Else the flags are brought up to date when they are asked for.
bool Timer::seen_at_once() const {
  return (reg(DIER) & 0x7FFF) != 0 || s.more.ccer != 0 || (reg(CR2) & 0x02F00070) > 0x10 || (reg(CR1) & OPM) != 0 || kind_.channels == 1;
}

uint64_t Timer::ticks_to_boundary() const {
  const TimerMore& m = s.more;
  if (centred()) {
    if (m.down) return std::max(1u, m.counter);
    return m.counter < m.reload ? m.reload - m.counter : uint64_t{top()} - m.counter + 1;
  }
  if (m.down) return uint64_t{m.counter} + 1;
  return m.counter <= m.reload ? uint64_t{m.reload} - m.counter + 1 : uint64_t{top()} - m.counter + 1;
}

uint64_t Timer::ticks_to_event() const {
  const TimerMore& m = s.more;
  uint64_t ticks = ticks_to_boundary();
  for (uint32_t left = m.outputs; left != 0; left &= left - 1) {
    const uint32_t target = m.compare[static_cast<uint32_t>(std::countr_zero(left))];
    const bool ahead = m.down ? target < m.counter : target > m.counter && target <= m.reload;
    if (ahead) ticks = std::min<uint64_t>(ticks, m.down ? m.counter - target : target - m.counter);
  }
  return ticks;
}

uint64_t Timer::next_event() const {
  const uint64_t next = s.more.next_rise;
  if (!counts_by_itself() || !seen_at_once()) return next;
  return std::min(next, s.more.tick_at + ticks_to_event() * tick());
}

void Timer::advance(uint64_t cycle) {
  TimerMore& m = s.more;
  for (;;) {
    uint64_t ticks = kNever, at = kNever;
    if (counts_by_itself()) {
      ticks = ticks_to_event();
      at = m.tick_at + ticks * tick();
      // Nobody heard the periods that passed: the flags are those of the last ones.
      const uint64_t period = (uint64_t{m.reload} + 1) * tick() * 2;
      if (at < cycle && cycle - at > 4 * period && !seen_at_once() && m.counter <= m.reload) {
        for (uint32_t c = 0; c < 6; ++c)
          if (is_output(c) && m.compare[c] <= m.reload) reg(SR) |= c < 4 ? CC1IF << c : CC5IF << (c - 4);
        const uint64_t whole = centred() ? uint64_t{m.reload} * 2 * tick() : (uint64_t{m.reload} + 1) * tick();
        m.tick_at += (cycle - at) / whole * whole;
        at += (cycle - at) / whole * whole;
        if (at > cycle) return;
      }
    }
    if (m.next_rise > cycle && at > cycle) break;
    if (m.next_rise <= at) {
      const auto output = static_cast<uint32_t>(std::find(m.rise_at.begin(), m.rise_at.end(), m.next_rise) - m.rise_at.begin());
      rise_at(output, kNever);
      set_output(output, true);
      continue;
    }
    step(ticks);
  }
  if (!counts_by_itself() || cycle < m.tick_at) return;
  const uint64_t ticks = (cycle - m.tick_at) / tick();
  m.counter = m.down ? m.counter - static_cast<uint32_t>(ticks) : m.counter + static_cast<uint32_t>(ticks);
  m.tick_at += ticks * tick();
}

// To the next count at which something is: a boundary or a compare.
void Timer::step(uint64_t ticks) {
  TimerMore& m = s.more;
  m.tick_at += ticks * tick();
  const bool was_down = m.down, at_boundary = ticks == ticks_to_boundary();
  m.counter = m.down ? m.counter - static_cast<uint32_t>(ticks) : m.counter + static_cast<uint32_t>(ticks);
  if (at_boundary) boundary();
  for (uint32_t left = m.outputs; left != 0; left &= left - 1)
    if (const auto c = static_cast<uint32_t>(std::countr_zero(left)); m.compare[c] == m.counter) match(c, was_down);
  follow_references(at_boundary ? kAll : kWhatChanged);
  interrupts();
}

void Timer::boundary() {
  TimerMore& m = s.more;
  if (!m.down && m.counter != m.reload + (centred() ? 0 : 1)) {
    m.counter = 0;  // it ran past a reload value that had become smaller: no update
    return;
  }
  if (centred()) {
    if (!m.down) {
      m.down = true;
      m.counter = m.reload;
      wires_.pulse(wire(TimerWire::crest));
    } else {
      m.down = false;
      m.counter = 0;
    }
  } else {
    m.counter = m.down ? m.reload : 0;
    wires_.pulse(wire(TimerWire::crest));
  }
  if (m.repetitions != 0)
    --m.repetitions;
  else
    update_event(false);
}

// The update event loads what is preloaded. UG does so by software: a flag only without URS.
void Timer::update_event(bool by_software) {
  if ((reg(CR1) & UDIS) != 0) return;
  update();
  if (!by_software || (reg(CR1) & URS) == 0) {
    raise(UIF);
    if ((reg(DIER) & 0x100) != 0) request_dma(kind_.dma_update);
  }
  if (!by_software && (reg(CR1) & OPM) != 0) reg(CR1) &= ~CEN;
  if (kind_.breaks && (reg(BDTR) & AOE) != 0 && !s.more.break_in && !s.more.break2_in) reg(BDTR) |= MOE;
  trigger_out(2);
}

void Timer::update() {
  TimerMore& m = s.more;
  m.prescaler = reg(PSC);
  m.reload = reg(ARR) & top();
  m.repetitions = kind_.breaks ? reg(RCR) : 0;
  load_compares(true);
}

void Timer::load_compares(bool all) {
  for (uint32_t c = 0; c < 6; ++c) {
    const bool preload = (s.more.mode[c] & 8) != 0;
    if (all || !preload) s.more.compare[c] = reg(compare_register(c)) & (c >= 4 ? 0xFFFF : top());
  }
}

void Timer::match(uint32_t channel, bool while_down) {
  const uint32_t cms = field(CR1, 5, 2);
  if ((cms == 1 && !while_down) || (cms == 2 && while_down)) {
    follow_references(channel);
    return;
  }
  raise(channel < 4 ? CC1IF << channel : CC5IF << (channel - 4));
  if (channel < 4 && (reg(DIER) >> (9 + channel) & 1) != 0) request_dma(kind_.dma_compare + channel);
  if (channel == 0) trigger_out(3);
  follow_references(channel);
}

void Timer::raise(uint32_t bit) {
  reg(SR) |= bit;
  interrupts();
}

// A burst (DCR) is as many requests as registers are to be reached through DMAR.
void Timer::request_dma(uint32_t request) {
  if (request == 0) return;
  const uint32_t times = reg(DCR) != 0 ? field(DCR, 8, 5) + 1 : 1;
  for (uint32_t n = 0; n < times; ++n) wires_.pulse_dma_request(request);
}

void Timer::interrupts() {
  const uint32_t both = reg(SR) & reg(DIER);
  const bool update = (both & UIF) != 0, compare = (both & 0x1E) != 0, trigger = (both & (TIF | COMIF)) != 0;
  const bool broken = (reg(DIER) & BIF) != 0 && (reg(SR) & (BIF | B2IF | SBIF)) != 0;
  const auto lines = static_cast<uint8_t>(1 | (update ? 2 : 0) | (compare ? 4 : 0) | (trigger ? 8 : 0) | (broken ? 16 : 0));
  if (lines == s.more.lines) return;
  s.more.lines = lines;
  if (kind_.irq_update == kind_.irq_compare) {
    interrupt(kind_.irq_update, update || compare || trigger || broken);
    return;
  }
  interrupt(kind_.irq_update, update);
  interrupt(kind_.irq_compare, compare);
  interrupt(kind_.irq_trigger, trigger);
  interrupt(kind_.irq_break, broken);
}

uint32_t Timer::read(uint32_t offset) {
  advance(wires_.now());
  if (offset == CNT) return s.more.counter | ((reg(CR1) & UIFREMAP) != 0 ? (reg(SR) & UIF) << 31 : 0);
  if (offset == CR1) return (reg(CR1) & ~DIR) | (s.more.down ? DIR : 0);
  if (offset == DMAR) {
    const uint32_t value = reg(std::min(burst_register(), 0x64u));
    s.more.burst = s.more.burst >= field(DCR, 8, 5) ? 0 : static_cast<uint8_t>(s.more.burst + 1);
    return value;
  }
  for (uint32_t c = 0; c < 4; ++c)  // reading a capture clears its flag
    if (offset == compare_register(c) && c < kind_.channels && !is_output(c)) {
      reg(SR) &= ~(CC1IF << c);
      interrupts();
    }
  return reg(offset);
}

void Timer::write_cr1(uint32_t value, uint32_t mask) {
  const bool was_enabled = (reg(CR1) & CEN) != 0;
  keep(CR1, value, mask);
  if ((reg(CR1) & DITHEN) != 0) wires_.refuse("dithering is not modelled");
  if (!centred() && (mask & DIR) != 0) s.more.down = (reg(CR1) & DIR) != 0;
  if (was_enabled != ((reg(CR1) & CEN) != 0)) trigger_out(1);
}

void Timer::generate(uint32_t value) {
  if ((value & 1) != 0) {
    s.more.counter = !centred() && s.more.down ? reg(ARR) : 0;
    if (centred()) s.more.down = false;
    s.more.tick_at = wires_.now();
    update_event(true);
    trigger_out(0);
  }
  for (uint32_t c = 0; c < kind_.channels; ++c) {
    if ((value >> (1 + c) & 1) == 0) continue;
    is_output(c) ? match(c, s.more.down) : capture(c);
  }
  if ((value & COMIF) != 0 && kind_.breaks) com_event();
  if ((value & TIF) != 0) raise(TIF);
  if ((value & BIF) != 0) break_now(BIF);
  if ((value & B2IF) != 0) break_now(B2IF);
}

void Timer::write(uint32_t offset, uint32_t value, uint32_t mask) {
  advance(wires_.now());
  TimerMore& m = s.more;
  const bool was_running = running();
  const uint32_t lock = kind_.breaks ? field(BDTR, 8, 2) : 0;
  switch (offset) {
    case CR1:
      write_cr1(value, mask);
      break;
    case SR:
      reg(SR) &= value | ~mask;
      break;
    case EGR:
      generate(value);
      break;
    case CNT:
      m.counter = ((m.counter & ~mask) | value) & top();
      m.tick_at = wires_.now();
      break;
    case BDTR:  // LOCK is written once and then protects the rest by its level
      keep(BDTR, value, lock == 0 ? mask : mask & (lock == 1 ? 0x0C00u : 0u));
      if ((mask & MOE) != 0) {
        const bool on = (value & MOE) != 0 && !m.break_in && !m.break2_in;
        reg(BDTR) = (reg(BDTR) & ~MOE) | (on ? MOE : 0);
      }
      break;
    case DMAR: {
      const uint32_t to = burst_register();
      m.burst = m.burst >= field(DCR, 8, 5) ? 0 : static_cast<uint8_t>(m.burst + 1);
      if (to < DCR) write(to, value, mask);
      return;
    }
    default:
      keep(offset, value, lock >= 1 && offset == CR2 ? mask & ~0x5FF00u : mask);
  }
  if (offset == ARR && (reg(CR1) & ARPE) == 0) m.reload = reg(ARR) & top();
  if (offset == RCR && (reg(CR1) & CEN) == 0) m.repetitions = reg(RCR);
  if (offset == DCR) m.burst = 0;
  if (!was_running && running()) m.tick_at = wires_.now();
  if (offset == CCMR1 || offset == CCMR2 || offset == CCMR3 || offset == CCER || offset == CR2) follow_preload();
  load_compares(false);
  follow_breaks();
  follow_references();
  interrupts();
}

}  // namespace rotorloop::mcu::g431
