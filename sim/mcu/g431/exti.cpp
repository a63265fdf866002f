#include "sim/mcu/g431/exti.hpp"

namespace rotorloop::mcu::g431 {
namespace {

constexpr uint32_t MEMRMP = 0x00, CFGR1 = 0x04, SCSR = 0x18, SKR = 0x24, VREFBUF_CSR = 0x30;
constexpr Register kSyscfg[] = {
    {MEMRMP, "MEMRMP", 0, 0x107},
    {CFGR1, "CFGR1", 0x7C000001, 0xFDFF0101},
    {0x08, "EXTICR1", 0, 0xFFFF},
    {0x0C, "EXTICR2", 0, 0xFFFF},
    {0x10, "EXTICR3", 0, 0xFFFF},
    {0x14, "EXTICR4", 0, 0xFFFF},
    {SCSR, "SCSR", 0, 0},
    {0x1C, "CFGR2", 0, 0xF},
    {0x20, "SWPR", 0, 0x3FF},
    {SKR, "SKR", 0, 0},
    {VREFBUF_CSR, "VREFBUF_CSR", 2, 0x37},
    {0x34, "VREFBUF_CCR", 0, 0x3F},
};

constexpr uint32_t IMR1 = 0x00, RTSR1 = 0x08, FTSR1 = 0x0C, SWIER1 = 0x10, PR1 = 0x14, IMR2 = 0x20;
constexpr Register kExti[] = {
    {IMR1, "IMR1", 0x1F840000},      {0x04, "EMR1"},           {RTSR1, "RTSR1", 0, 0xE07FFFFF},
    {FTSR1, "FTSR1", 0, 0xE07FFFFF}, {SWIER1, "SWIER1", 0, 0}, {PR1, "PR1", 0, 0},
    {IMR2, "IMR2", 0xFFFFFFF8},      {0x24, "EMR2"},           {0x28, "RTSR2", 0, 0x303},
    {0x2C, "FTSR2", 0, 0x303},       {0x30, "SWIER2", 0, 0},   {0x34, "PR2", 0, 0},
};
constexpr uint32_t kComparatorLine[] = {21, 22, 29, 30};  // COMP1 to 4

}  // namespace

Syscfg::Syscfg(Wires& wires) : RegisterBlock(wires, "SYSCFG", 0x40010000, 0x38, kSyscfg, {0x60, 0}) { RegisterBlock::reset(true); }

// The reference buffer is ready as soon as it is asked; the ADC's reference is VDDA in any case.
uint32_t Syscfg::read(uint32_t offset) {
  if (offset == VREFBUF_CSR) return (reg(offset) & ~8u) | (bit(offset, 0) ? 8 : 0);
  return reg(offset);
}

void Syscfg::write(uint32_t offset, uint32_t value, uint32_t mask) {
  keep(offset, value, mask);
  if (offset == MEMRMP && (reg(MEMRMP) & 7) != 0) wires_.refuse("only flash is at address 0: other maps are not modelled");
  if (offset == SCSR && (value & 1) != 0) wires_.refuse("erasing the CCM by hardware is not modelled");
}

Exti::Exti(Wires& wires, const Syscfg& syscfg) : RegisterBlock(wires, "EXTI", 0x40010400, 0x38, kExti), syscfg_(syscfg) {
  RegisterBlock::reset(true);
}

bool Exti::listens(Signal signal) const {
  const uint32_t n = index(signal);
  return (n >= index(Signal::pin0) && n < index(Signal::pin0) + 112) || (n >= index(Signal::comp1_out) && n < index(Signal::comp1_out) + 4);
}

void Exti::on_signal(Signal signal, bool high) {
  if (signal < Signal::pin0) {
    edge(kComparatorLine[index(signal) - index(Signal::comp1_out)], high);
    return;
  }
  const uint32_t pin = index(signal) - index(Signal::pin0), line = pin % 16;
  if (syscfg_.port_of(line) == pin / 16) edge(line, high);
}

// The pending bit is set by a selected edge of an unmasked line; the event goes out in any case.
void Exti::edge(uint32_t line, bool high) {
  if (!bit(high ? RTSR1 : FTSR1, line)) return;
  if (line < 16) wires_.pulse(Signal::exti0 + line);
  if (bit(IMR1, line)) reg(PR1) |= 1u << line;
  follow();
}

void Exti::write(uint32_t offset, uint32_t value, uint32_t mask) {
  switch (offset) {
    case PR1:
      reg(PR1) &= ~value;
      reg(SWIER1) &= ~value;
      break;
    case SWIER1:
      reg(PR1) |= value & ~reg(SWIER1) & reg(IMR1);
      reg(SWIER1) |= value;
      break;
    default:
      keep(offset, value, mask);
  }
  follow();
}

void Exti::follow() {
  const uint32_t pending = reg(PR1) & reg(IMR1);
  for (uint32_t line = 0; line < 5; ++line) interrupt(6 + line, (pending >> line & 1) != 0);
  interrupt(23, (pending & 0x3E0) != 0);
  interrupt(40, (pending & 0xFC00) != 0);
  interrupt(64, (pending & (1u << 21 | 1u << 22 | 1u << 29)) != 0);
  interrupt(65, (pending & 1u << 30) != 0);
}

}  // namespace rotorloop::mcu::g431
