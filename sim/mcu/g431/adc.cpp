#include "sim/mcu/g431/adc.hpp"

#include <algorithm>

namespace rotorloop::mcu::g431 {
namespace {

constexpr uint32_t ISR = 0x00, IER = 0x04, CR = 0x08, CFGR = 0x0C, CFGR2 = 0x10, SMPR1 = 0x14, TR1 = 0x20, SQR1 = 0x30, DR = 0x40,
                   JSQR = 0x4C, OFR1 = 0x60, JDR1 = 0x80, AWD2CR = 0xA0;
constexpr uint32_t ADRDY = 1, EOSMP = 2, EOC = 4, EOS = 8, OVR = 16, JEOC = 32, JEOS = 64, AWD1 = 128, JQOVF = 1u << 10;
constexpr uint32_t ADEN = 1, ADDIS = 2, ADSTART = 4, JADSTART = 8, ADSTP = 16, JADSTP = 32, ADVREGEN = 1u << 28, DEEPPWD = 1u << 29,
                   ADCAL = 1u << 31;
constexpr uint32_t JAUTO = 25, JQM = 21, JQDIS = 31, CONT = 13, DISCEN = 16, JDISCEN = 20;  // bits of CFGR
constexpr uint32_t kInterrupt = 18;
// clang-format off
constexpr Register kAdc[] = {
    {ISR, "ISR", 0, 0}, {IER, "IER", 0, 0x7FF}, {CR, "CR", DEEPPWD, 0}, {CFGR, "CFGR", 0x80000000, 0xFFFFFFFB},
    {CFGR2, "CFGR2", 0, 0x0E0107FF}, {SMPR1, "SMPR1", 0, 0xBFFFFFFF}, {0x18, "SMPR2", 0, 0x07FFFFFF},
    {TR1, "TR1", 0x0FFF0000, 0x0FFF7FFF}, {0x24, "TR2", 0x00FF0000, 0x00FF00FF}, {0x28, "TR3", 0x00FF0000, 0x00FF00FF},
    {SQR1, "SQR1", 0, 0x1F7DF7CF}, {0x34, "SQR2", 0, 0x1F7DF7DF}, {0x38, "SQR3", 0, 0x1F7DF7DF}, {0x3C, "SQR4", 0, 0x7DF},
    {DR, "DR", 0, 0}, {JSQR, "JSQR", 0, 0}, {OFR1, "OFR1", 0, 0xFF000FFF}, {0x64, "OFR2", 0, 0xFF000FFF}, {0x68, "OFR3", 0, 0xFF000FFF},
    {0x6C, "OFR4", 0, 0xFF000FFF}, {JDR1, "JDR1", 0, 0}, {0x84, "JDR2", 0, 0}, {0x88, "JDR3", 0, 0}, {0x8C, "JDR4", 0, 0},
    {AWD2CR, "AWD2CR", 0, 0x7FFFF}, {0xA4, "AWD3CR", 0, 0x7FFFF}, {0xB0, "DIFSEL", 0, 0x7FFFE}, {0xB4, "CALFACT", 0, 0x7F007F},
    {0xC0, "GCOMP", 0, 0x3FFF},
};
constexpr Register kCommon[] = {{0x00, "CSR", 0, 0}, {0x08, "CCR", 0, 0x01FFEF1F}, {0x0C, "CDR", 0, 0}};

struct Trigger {
  uint8_t timer;  // 0: EXTI line `wire`; 255: nothing that is built
  uint8_t wire;
};
constexpr uint8_t kTrgo = static_cast<uint8_t>(TimerWire::trgo), kTrgo2 = static_cast<uint8_t>(TimerWire::trgo2),
    kOc = static_cast<uint8_t>(TimerWire::oc1);
// RM0440, tables "ADC1/2: external triggers for regular and for injected channels".
constexpr Trigger kRegular[] = {{1, kOc}, {1, kOc + 1}, {1, kOc + 2}, {2, kOc + 1}, {3, kTrgo}, {4, kOc + 3}, {0, 11}, {8, kTrgo},
    {8, kTrgo2}, {1, kTrgo}, {1, kTrgo2}, {2, kTrgo}, {4, kTrgo}, {6, kTrgo}, {15, kTrgo}, {3, kOc + 3}};
constexpr Trigger kInjected[] = {{1, kTrgo}, {1, kOc + 3}, {2, kTrgo}, {2, kOc}, {3, kOc + 3}, {4, kTrgo}, {0, 15}, {8, kOc + 3},
    {1, kTrgo2}, {8, kTrgo}, {8, kTrgo2}, {3, kOc + 2}, {3, kTrgo}, {3, kOc}, {6, kTrgo}, {15, kTrgo}};
// clang-format on

Signal trigger(bool injected, uint32_t select) {
  if (select == 30) return timer_signal(7, TimerWire::trgo);
  if (injected && select == 27) return timer_signal(16, TimerWire::oc1);
  if (select >= std::size(kRegular)) return Signal::none;
  const Trigger t = injected ? kInjected[select] : kRegular[select];
  return t.timer == 0 ? Signal::exti0 + t.wire : timer_signal(t.timer, TimerWire::ch1) + t.wire;
}

// EXTEN: 1 rising, 2 falling, 3 both.
bool takes(uint32_t exten, bool high) { return (exten & (high ? 1 : 2)) != 0; }

}  // namespace

AdcCommon::AdcCommon(Wires& wires) : RegisterBlock(wires, "ADC12_COMMON", 0x50000300, 0x10, kCommon, {0x4C, 13}) {
  RegisterBlock::reset(true);
}

void AdcCommon::write(uint32_t offset, uint32_t value, uint32_t mask) {
  keep(offset, value, mask);
  if ((reg(0x08) & 0x1F) != 0) wires_.refuse("dual modes are not modelled");
}

double AdcCommon::clock_Hz() const {
  constexpr uint16_t kPrescalers[] = {1, 2, 4, 6, 8, 10, 12, 16, 32, 64, 128, 256, 256, 256, 256, 256};
  const uint32_t mode = field(0x08, 16, 2);
  if (mode != 0) return static_cast<double>(wires_.clocks().hclk_Hz) / (1u << (mode - 1));
  return static_cast<double>(wires_.clocks().adc_Hz) / kPrescalers[field(0x08, 18, 4)];
}

Adc::Adc(Wires& wires, uint32_t number, const AdcCommon& common, const Opamp& opamp)
    : RegisterBlock(wires, number == 1 ? "ADC1" : "ADC2", number == 1 ? 0x50000000 : 0x50000100, 0x100, kAdc, {0x4C, 13}),
      number_(number),
      common_(common),
      inputs_{opamp, wires} {
  RegisterBlock::reset(true);
}

uint64_t Adc::in_cycles(double adc_cycles) const {
  const double clock_Hz = common_.clock_Hz();
  if (clock_Hz <= 0.0) return kNever - wires_.now();
  return std::max<uint64_t>(1, static_cast<uint64_t>(adc_cycles * wires_.clocks().hclk_Hz / clock_Hz + 0.5));
}

uint64_t Adc::next_event() const {
  const AdcMore& m = s.more;
  return std::min({m.sampled_at, m.converted_at, m.ready_at, m.calibrated_at});
}

void Adc::advance(uint64_t cycle) {
  AdcMore& m = s.more;
  if (m.calibrated_at <= cycle) {
    m.calibrated_at = kNever;
    reg(CR) &= ~ADCAL;
    reg(0xB4) = 0x40;
  }
  if (m.ready_at <= cycle) {
    m.ready_at = kNever;
    reg(ISR) |= ADRDY;
  }
  if (m.sampled_at <= cycle) sample();
  if (m.converted_at <= cycle) finish();
  follow();
}

bool Adc::listens(Signal signal) const {
  for (uint32_t n = 0; n < 31; ++n)
    if (signal != Signal::none && (signal == trigger(false, n) || signal == trigger(true, n))) return true;
  return false;
}

void Adc::on_signal(Signal signal, bool high) {
  if ((reg(CR) & ADSTART) != 0 && takes(field(CFGR, 10, 2), high) && signal == trigger(false, field(CFGR, 5, 5))) start_regular();
  const uint32_t context = jsqr();
  if ((reg(CR) & JADSTART) != 0 && takes(context >> 7 & 3, high) && signal == trigger(true, context >> 2 & 31)) start_injected();
}

void Adc::start_regular() {
  if (s.more.regular_under_way) return;  // a trigger while it converts is lost
  s.more.regular_under_way = true;
  if (s.more.converting == Kind::none) begin(Kind::regular);
}

// Injected ones come first: a regular conversion under way is given up and done again after them.
void Adc::start_injected() {
  AdcMore& m = s.more;
  if (m.injected_under_way) return;
  m.injected_under_way = true;
  begin(Kind::injected);
}

uint32_t Adc::regular_channel() const {
  const uint32_t place = s.more.rank + 1u;  // fields of 6 bits, five a register, the first one L
  return field(SQR1 + 4 * (place / 5), 6 * (place % 5), 5);
}
uint32_t Adc::injected_channel() const { return jsqr() >> (9 + 6 * s.more.injected_rank) & 31; }

uint32_t Adc::oversampling() const {
  const bool on = bit(CFGR2, s.more.converting == Kind::injected ? 1 : 0);
  return on ? 2u << field(CFGR2, 2, 3) : 1;
}

void Adc::begin(Kind kind) {
  constexpr double kSampling[] = {2.5, 6.5, 12.5, 24.5, 47.5, 92.5, 247.5, 640.5};
  AdcMore& m = s.more;
  m.converting = kind;
  const uint32_t c = std::min(channel(), 18u);
  const uint32_t smp = c < 10 ? field(SMPR1, 3 * c, 3) : field(0x18, 3 * (c - 10), 3);
  const double sampling = kSampling[smp] + (smp == 0 && bit(SMPR1, 31) ? 1.0 : 0.0), conversion = 12.5 - 2.0 * field(CFGR, 3, 2);
  const uint32_t times = oversampling();
  m.sampled = false;
  m.sampled_at = wires_.now() + in_cycles(sampling);
  m.converted_at = wires_.now() + in_cycles((sampling + conversion) * times);
}

void Adc::sample() {
  s.more.sampled_at = kNever;
  s.more.sampled = true;
  reg(ISR) |= EOSMP;
  const double counts = inputs_.channel_V(number_, channel()) * (4096.0 / kReference_V);
  s.more.raw = static_cast<uint16_t>(std::clamp(counts, 0.0, 4095.0));
}

// What DR and JDR show of the 12 bits: oversampling, offset, resolution, alignment (RM0440, 21.4.26 and figures there).
uint32_t Adc::data(uint32_t raw) const {
  const uint32_t times = oversampling(), resolution = field(CFGR, 3, 2);
  int value = static_cast<int>(times > 1 ? (raw * times) >> field(CFGR2, 5, 4) : raw >> (2 * resolution));
  bool is_signed = false;
  for (uint32_t n = 0; n < 4; ++n) {
    const uint32_t ofr = OFR1 + 4 * n;
    if (!bit(ofr, 31) || field(ofr, 26, 5) != channel()) continue;
    const int offset = static_cast<int>(field(ofr, 0, 12) >> (2 * resolution));
    value = bit(ofr, 24) ? value + offset : value - offset;
    is_signed = !bit(ofr, 25);
    if (!is_signed) value = std::clamp(value, 0, static_cast<int>(0xFFFu >> (2 * resolution)));
    break;
  }
  const bool left = bit(CFGR, 15) && times == 1;
  if (left) value = resolution == 3 ? value << (is_signed ? 1 : 2) : value << (4 + 2 * resolution - (is_signed ? 1 : 0));
  return static_cast<uint32_t>(value) & 0xFFFF;
}

void Adc::watch(uint32_t raw) {
  const bool injected = s.more.converting == Kind::injected;
  const bool first = bit(CFGR, injected ? 24 : 23) && (!bit(CFGR, 22) || field(CFGR, 26, 5) == channel());
  for (uint32_t n = 0; n < 3; ++n) {
    const uint32_t tr = TR1 + 4 * n;
    if (n == 0 ? !first : !bit(AWD2CR + 4 * (n - 1), channel())) continue;
    const uint32_t value = n == 0 ? raw : raw >> 4, low = field(tr, 0, n == 0 ? 12 : 8), high = field(tr, 16, n == 0 ? 12 : 8);
    const bool outside = value < low || value > high;
    if (outside) reg(ISR) |= AWD1 << n;
    wires_.set_signal(Signal::adc1_awd1 + (3 * (number_ - 1) + n), outside);
  }
}

void Adc::finish() {
  AdcMore& m = s.more;
  m.converted_at = kNever;
  watch(m.raw);
  const uint32_t value = data(m.raw);
  const bool injected = m.converting == Kind::injected;
  injected ? finish_injected(value) : finish_regular(value);
  m.converting = Kind::none;
  if (m.injected_under_way)
    begin(Kind::injected);
  else if (m.regular_under_way)
    begin(Kind::regular);
}

void Adc::finish_regular(uint32_t value) {
  AdcMore& m = s.more;
  const bool lost = (reg(ISR) & EOC) != 0 && (bit(CFGR, 0) || bit(CFGR, 12) || (reg(IER) & OVR) != 0 || (reg(IER) & EOC) != 0);
  if (lost) reg(ISR) |= OVR;
  if (!lost || bit(CFGR, 12)) reg(DR) = value;
  reg(ISR) |= EOC;
  const bool last = m.rank >= field(SQR1, 0, 4);
  m.rank = static_cast<uint8_t>(last ? 0 : m.rank + 1);
  if (last) reg(ISR) |= EOS;
  if (last && bit(CFGR, JAUTO)) m.injected_under_way = true;
  const bool pause = bit(CFGR, DISCEN) && ++m.discontinuous > field(CFGR, 17, 3);
  if ((last && !bit(CFGR, CONT)) || pause) {
    m.regular_under_way = false;
    if (field(CFGR, 10, 2) == 0) reg(CR) &= ~ADSTART;
  }
  if (last || pause) m.discontinuous = 0;
}

void Adc::finish_injected(uint32_t value) {
  AdcMore& m = s.more;
  const uint32_t context = jsqr();
  reg(JDR1 + 4 * m.injected_rank) = value;
  reg(ISR) |= JEOC;
  const bool last = m.injected_rank >= (context & 3);
  m.injected_rank = static_cast<uint8_t>(last ? 0 : m.injected_rank + 1);
  if (bit(CFGR, JDISCEN)) m.injected_under_way = false;
  if (!last) return;
  reg(ISR) |= JEOS;
  m.injected_under_way = false;
  if ((context >> 7 & 3) == 0) reg(CR) &= ~JADSTART;
  if (bit(CFGR, JQDIS)) return;
  if (m.queued == 2) {  // the next context; without one the last stays, or with JQM the queue is empty
    m.queue[0] = m.queue[1];
    m.queued = 1;
  } else if (bit(CFGR, JQM)) {
    m.queued = 0;
  }
}

uint32_t Adc::read(uint32_t offset) {
  if (offset == JSQR) return jsqr();
  if (offset == DR) {
    reg(ISR) &= ~EOC;
    follow();
  }
  return reg(offset);
}

void Adc::write_jsqr(uint32_t value) {
  AdcMore& m = s.more;
  if (bit(CFGR, JQDIS)) {  // the register itself, while no injected conversion is started
    if ((reg(CR) & JADSTART) != 0 && (jsqr() >> 7 & 3) != 0) return;
    m.queue[0] = value;
    m.queued = 1;
  } else if (m.queued < 2) {
    m.queue[m.queued++] = value;
  } else {
    reg(ISR) |= JQOVF;
  }
}

void Adc::stop(Kind kind) {
  AdcMore& m = s.more;
  (kind == Kind::injected ? m.injected_under_way : m.regular_under_way) = false;
  (kind == Kind::injected ? m.injected_rank : m.rank) = 0;
  reg(CR) &= ~(kind == Kind::injected ? JADSTART : ADSTART);
  if (kind == Kind::injected && !bit(CFGR, JQDIS)) m.queued = 0;
  if (m.converting != kind) return;
  m.converting = Kind::none;
  m.sampled_at = m.converted_at = kNever;
  if (kind == Kind::injected && m.regular_under_way) begin(Kind::regular);
}

// Nearly all bits are set-only: writing 0 does nothing.
void Adc::write_cr(uint32_t value) {
  AdcMore& m = s.more;
  uint32_t& cr = reg(CR);
  if ((cr & ADEN) == 0) cr = (cr & ~(ADVREGEN | DEEPPWD | 1u << 30)) | (value & (ADVREGEN | DEEPPWD | 1u << 30));
  const bool powered = (cr & ADVREGEN) != 0 && (cr & DEEPPWD) == 0;
  if ((value & ADCAL) != 0 && powered && (cr & (ADEN | ADCAL)) == 0) {
    cr |= ADCAL;
    m.calibrated_at = wires_.now() + in_cycles(116.0);
  }
  if ((value & ADEN) != 0 && powered && (cr & (ADEN | ADCAL)) == 0) {
    cr |= ADEN;
    m.ready_at = wires_.now() + in_cycles(10.0);
  }
  if ((value & ADDIS) != 0 && (cr & (ADSTART | JADSTART)) == 0) {
    cr &= ~ADEN;
    m.ready_at = kNever;
    reg(ISR) &= ~ADRDY;
  }
  if ((cr & ADEN) == 0) return;
  if ((value & ADSTP) != 0) stop(Kind::regular);
  if ((value & JADSTP) != 0) stop(Kind::injected);
  if ((value & ADSTART) != 0 && (cr & ADSTART) == 0) {
    cr |= ADSTART;
    if (field(CFGR, 10, 2) == 0) start_regular();
  }
  if ((value & JADSTART) != 0 && (cr & JADSTART) == 0 && !bit(CFGR, JAUTO)) {
    cr |= JADSTART;
    if (m.queued != 0 && (jsqr() >> 7 & 3) == 0) start_injected();
  }
}

void Adc::write(uint32_t offset, uint32_t value, uint32_t mask) {
  switch (offset) {
    case ISR:
      reg(ISR) &= ~value;
      break;
    case CR:
      write_cr(value);
      break;
    case JSQR:
      write_jsqr(value);
      break;
    case CFGR:
      keep(offset, value, mask);
      if (!bit(CFGR, JQDIS) || (reg(CR) & JADSTART) != 0) break;
      if (s.more.queued == 2) s.more.queued = 1;  // JQDIS: the last written one stays
      break;
    default:
      keep(offset, value, mask);
  }
  follow();
}

void Adc::follow() {
  interrupt(kInterrupt, (reg(ISR) & reg(IER)) != 0);
  wires_.set_dma_request(number_ == 1 ? 5 : 36, bit(CFGR, 0) && (reg(ISR) & EOC) != 0);
}

}  // namespace rotorloop::mcu::g431
