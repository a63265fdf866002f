#include "sim/mcu/g431/analogue.hpp"

#include <algorithm>

namespace rotorloop::mcu::g431 {
namespace {

constexpr uint32_t PA = 0, PB = 16, PC = 32, PF = 80, kNoPin = 255;

// DAC: offsets and bits
constexpr uint32_t CR = 0x00, SWTRIGR = 0x04, DHR12R1 = 0x08, DHR12L1 = 0x0C, DHR8R1 = 0x10, DHR12RD = 0x20, DOR1 = 0x2C;
// clang-format off
constexpr Register kDac[] = {
    {CR, "CR", 0, 0x7FFF7FFF}, {SWTRIGR, "SWTRIGR", 0, 0}, {DHR12R1, "DHR12R1", 0, 0xFFF0FFF}, {DHR12L1, "DHR12L1", 0, 0xFFF0FFF0},
    {DHR8R1, "DHR8R1", 0, 0xFFFF}, {0x14, "DHR12R2", 0, 0xFFF0FFF}, {0x18, "DHR12L2", 0, 0xFFF0FFF0}, {0x1C, "DHR8R2", 0, 0xFFFF},
    {DHR12RD, "DHR12RD", 0, 0xFFF0FFF}, {0x24, "DHR12LD", 0, 0xFFF0FFF0}, {0x28, "DHR8RD", 0, 0xFFFF}, {DOR1, "DOR1", 0, 0},
    {0x30, "DOR2", 0, 0}, {0x34, "SR", 0, 0}, {0x38, "CCR", 0x00100010, 0x1F001F}, {0x3C, "MCR", 0, 0xC7070307},
    {0x40, "SHSR1", 0, 0x3FF}, {0x44, "SHSR2", 0, 0x3FF}, {0x48, "SHHR", 0x10001, 0x3FF03FF}, {0x4C, "SHRR", 0x10001, 0xFF00FF},
    {0x58, "STR1", 0, 0xFFFF1FFF}, {0x5C, "STR2", 0, 0xFFFF1FFF}, {0x60, "STMODR", 0, 0x0F0F0F0F},
};
constexpr Register kOpamp[] = {
    {0x00, "OPAMP1_CSR", 0, 0xBFFFFFFF}, {0x04, "OPAMP2_CSR", 0, 0xBFFFFFFF}, {0x08, "OPAMP3_CSR", 0, 0xBFFFFFFF},
    {0x18, "OPAMP1_TCMR"}, {0x1C, "OPAMP2_TCMR"}, {0x20, "OPAMP3_TCMR"},
};
constexpr Register kComp[] = {
    {0x00, "COMP1_CSR", 0, 0x80FFFFF1}, {0x04, "COMP2_CSR", 0, 0x80FFFFF1}, {0x08, "COMP3_CSR", 0, 0x80FFFFF1},
    {0x0C, "COMP4_CSR", 0, 0x80FFFFF1},
};
// Pins of inputs (DS12589, pin table; RM0440, tables of OPAMP and COMP inputs).
constexpr uint8_t kPlus[3][3] = {{PA + 1, PA + 3, PA + 7}, {PA + 7, PB + 14, PB + 0}, {PB + 0, PB + 13, PA + 1}};
constexpr uint8_t kOut[3] = {PA + 2, PA + 6, PB + 1};
constexpr uint8_t kCompPlus[4][2] = {{PA + 1, PB + 1}, {PA + 7, PA + 3}, {PA + 0, PC + 1}, {PB + 0, PC + 0xF}};
constexpr uint8_t kCompMinus[4][2] = {{PA + 4, PA + 0}, {PA + 5, PA + 2}, {PF + 1, PC + 0}, {PC + 0xF, PB + 2}};
constexpr uint8_t kChannels[2][19] = {
    {kNoPin, PA + 0, PA + 1, PA + 2, PA + 3, PB + 14, PC + 0, PC + 1, PC + 2, PC + 3, PF + 0, PB + 12, PB + 1, kNoPin, PB + 11, PB + 0,
    kNoPin, kNoPin, kNoPin},
    {kNoPin, PA + 0, PA + 1, PA + 6, PA + 7, PC + 4, PC + 0, PC + 1, PC + 2, PC + 3, PF + 1, PC + 5, PB + 2, PA + 5, PB + 11, PB + 15,
    kNoPin, PA + 4, kNoPin},
};
// clang-format on

}  // namespace

Dac::Dac(Wires& wires, uint32_t number)
    : RegisterBlock(wires, number == 1 ? "DAC1" : "DAC3", number == 1 ? 0x50000800 : 0x50001000, 0x400, kDac,
                    {0x4C, static_cast<uint8_t>(number == 1 ? 16 : 18)}),
      number_(number) {
  RegisterBlock::reset(true);
}

double Dac::out_V(uint32_t channel) const { return bit(CR, 16 * channel) ? s.more.out[channel] * kReference_V / 4096.0 : 0.0; }

uint32_t Dac::read(uint32_t offset) {
  if (offset == DOR1 || offset == DOR1 + 4) return s.more.out[(offset - DOR1) / 4];
  if (offset == 0x34) return (bit(CR, 0) ? 1u << 11 : 0) | (bit(CR, 16) ? 1u << 27 : 0);  // ready
  return reg(offset);
}

void Dac::load(uint32_t channel) {
  s.more.out[channel] = static_cast<uint16_t>(reg(DHR12R1 + 12 * channel) & 0xFFF);
  // Comparators listen to this wire as the sign that something analogue moved.
  wires_.pulse(Signal::analogue_moved);
}

void Dac::write(uint32_t offset, uint32_t value, uint32_t mask) {
  keep(offset, value, mask);
  const uint32_t held = reg(offset);
  const auto hold = [&](uint32_t channel, uint32_t v) { reg(DHR12R1 + 12 * channel) = v & 0xFFF; };
  for (uint32_t c = 0; c < 2; ++c) {
    if (offset == DHR12L1 + 12 * c) hold(c, held >> 4);
    if (offset == DHR8R1 + 12 * c) hold(c, (held & 0xFF) << 4);
  }
  if (offset == DHR12RD || offset == DHR12RD + 4 || offset == DHR12RD + 8) {
    const uint32_t up = offset == DHR12RD + 8 ? 4 : 0, down = offset == DHR12RD + 4 ? 4 : 0, second = offset == DHR12RD + 8 ? 8 : 16;
    hold(0, (held & (up != 0 ? 0xFF : 0xFFFF)) >> down << up);
    hold(1, held >> second >> down << up);
  }
  for (uint32_t c = 0; c < 2; ++c) {
    if ((field(CR, 6 + 16 * c, 2)) != 0 && offset == CR) wires_.refuse("waves of the DAC are not modelled");
    if (!bit(CR, 1 + 16 * c) || (offset == SWTRIGR && (value >> c & 1) != 0 && field(CR, 2 + 16 * c, 4) == 0)) load(c);
  }
}

// Triggers of the DAC (RM0440, table of DAC triggers): timers only.
bool Dac::listens(Signal signal) const {
  for (const uint32_t t : {1u, 2u, 3u, 4u, 6u, 7u, 8u, 15u})
    if (signal == timer_signal(t, TimerWire::trgo)) return true;
  return false;
}

void Dac::on_signal(Signal signal, bool high) {
  const uint32_t by[] = {0, number_ == 3 ? 1u : 8u, 7, 15, 2, 4, 0, 0, 6, 3};
  for (uint32_t c = 0; high && c < 2; ++c) {
    const uint32_t select = field(CR, 2 + 16 * c, 4);
    if (bit(CR, 1 + 16 * c) && select < 10 && by[select] != 0 && signal == timer_signal(by[select], TimerWire::trgo)) load(c);
  }
}

Opamp::Opamp(Wires& wires, const Dac& dac3) : RegisterBlock(wires, "OPAMP", 0x40010300, 0x24, kOpamp, {0x60, 0}), dac3_(dac3) {
  RegisterBlock::reset(true);
}

void Opamp::write(uint32_t offset, uint32_t value, uint32_t mask) {
  if (offset < 0x0C && bit(offset, 31)) return;  // LOCK
  keep(offset, value, mask);
  if (offset >= 0x18 && (reg(offset) & 0x38) != 0) wires_.refuse("input multiplexers that timers switch are not modelled");
  if (offset < 0x0C && (reg(offset) & 1u << 11) != 0) wires_.refuse("calibration of the amplifiers is not modelled");
}

// The gain is that from the plus input; with VINM0 as the bias of an outer network it is the same. Stand-alone: the board's network.
double Opamp::out_V(uint32_t n) const {
  const uint32_t at = 4 * n, plus = field(at, 2, 2), minus = field(at, 5, 2);
  if (!enabled(n)) return wires_.pin_V(kOut[n]);
  if (minus < 2) return wires_.pin_V(kOut[n]);
  const double in_V = plus < 3 ? wires_.pin_V(kPlus[n][plus]) : n == 1 ? 0.0 : dac3_.out_V(n / 2);
  const double gain = minus == 3 ? 1.0 : static_cast<double>(2u << field(at, 14, 3));
  return std::clamp(gain * in_V, 0.0, kReference_V);
}

Comp::Comp(Wires& wires, const Dac& dac1, const Dac& dac3)
    : RegisterBlock(wires, "COMP", 0x40010200, 0x10, kComp, {0x60, 0}), dac1_(dac1), dac3_(dac3) {
  RegisterBlock::reset(true);
}

bool Comp::listens(Signal signal) const {
  if (signal == Signal::analogue_moved) return true;
  for (const uint32_t t : {1u, 2u, 3u, 8u, 15u})
    for (uint32_t c = 0; c < 5; ++c)
      if (signal == timer_signal(t, TimerWire::oc1) + c) return true;
  return false;
}

double Comp::minus_V(uint32_t n) const {
  constexpr double kBand_V = 1.212;
  const uint32_t select = field(4 * n, 4, 3);
  if (select < 4) return kBand_V * (select + 1) / 4.0;
  if (select == 4) return dac3_.out_V(n & 1);           // DAC3 channel 1 for COMP1 and 3, 2 for COMP2 and 4
  if (select == 5) return dac1_.out_V(n == 1 ? 1 : 0);  // DAC1 channel 2 for COMP2
  return wires_.pin_V(kCompMinus[n][select - 6]);
}

// BLANKSEL (RM0440, 24.3.6).
bool Comp::blanked(uint32_t n) const {
  struct By {
    uint8_t timer, channel;
  };
  constexpr By kBy[4][7] = {{{1, 5}, {2, 3}, {3, 3}, {8, 5}, {20, 5}, {15, 1}, {4, 3}},
                            {{1, 5}, {2, 3}, {3, 3}, {8, 5}, {20, 5}, {15, 1}, {4, 3}},
                            {{1, 5}, {3, 3}, {2, 4}, {8, 5}, {20, 5}, {15, 1}, {4, 3}},
                            {{3, 4}, {8, 5}, {15, 1}, {1, 5}, {20, 5}, {15, 1}, {4, 3}}};
  const uint32_t select = field(4 * n, 19, 3);
  if (select == 0) return false;
  const By by = kBy[n][select - 1];
  const Signal reference = timer_signal(by.timer, TimerWire::oc1);
  return reference != Signal::none && wires_.signal(reference + (by.channel - 1u));
}

void Comp::follow() {
  for (uint32_t n = 0; n < 4; ++n) {
    const uint32_t at = 4 * n;
    bool high = bit(at, 0) && !blanked(n) && wires_.pin_V(kCompPlus[n][field(at, 8, 1)]) > minus_V(n);
    if (bit(at, 0)) high = high != bit(at, 15);  // POLARITY
    const auto mask = static_cast<uint8_t>(1u << n);
    s.more.high = static_cast<uint8_t>(high ? s.more.high | mask : s.more.high & ~mask);
    wires_.set_signal(Signal::comp1_out + n, high);
  }
}

uint32_t Comp::read(uint32_t offset) {
  follow();
  return reg(offset) | (s.more.high >> (offset / 4) & 1u) << 30;
}

void Comp::write(uint32_t offset, uint32_t value, uint32_t mask) {
  if (!bit(offset, 31)) keep(offset, value, mask);
  follow();
}

double AnalogueInputs::channel_V(uint32_t adc, uint32_t channel) const {
  constexpr double kTemperature_V = 0.7514, kBattery_V = 1.1, kBand_V = 1.212;  // 25 degC by TS_CAL1 and its slope; VBAT / 3; DS12589
  if (channel > 18) return 0.0;
  const uint8_t pin = kChannels[adc - 1][channel];
  if (pin != kNoPin) {
    for (uint32_t n = 0; n < 3; ++n)
      if (pin == kOut[n] && opamp.drives_pin(n)) return opamp.out_V(n);
    return wires.pin_V(pin);
  }
  if (adc == 1)
    return channel == 13 ? opamp.out_V(0) : channel == 16 ? kTemperature_V : channel == 17 ? kBattery_V : channel == 18 ? kBand_V : 0.0;
  return channel == 16 ? opamp.out_V(1) : channel == 18 ? opamp.out_V(2) : 0.0;
}

}  // namespace rotorloop::mcu::g431
