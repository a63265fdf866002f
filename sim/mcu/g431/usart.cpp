#include "sim/mcu/g431/usart.hpp"

#include <algorithm>

namespace rotorloop::mcu::g431 {
namespace {

constexpr uint32_t CR1 = 0x00, CR2 = 0x04, CR3 = 0x08, BRR = 0x0C, RQR = 0x18, ISR = 0x1C, ICR = 0x20, RDR = 0x24, TDR = 0x28, PRESC = 0x2C;
constexpr Register kRegisters[] = {
    {CR1, "CR1"},
    {CR2, "CR2"},
    {CR3, "CR3"},
    {BRR, "BRR", 0, 0xFFFFF},
    {0x10, "GTPR", 0, 0xFFFF},
    {0x14, "RTOR"},
    {RQR, "RQR", 0, 0},
    {ISR, "ISR", 0, 0},
    {ICR, "ICR", 0, 0},
    {RDR, "RDR", 0, 0},
    {TDR, "TDR", 0, 0},
    {PRESC, "PRESC", 0, 15},
};
constexpr uint32_t ORE = 8, IDLE = 16, RXNE = 32, TC = 64, TXE = 128;
constexpr uint32_t UE = 1, RE = 4, TE = 8;

struct Kind {
  uint32_t number;
  const char* name;
  uint32_t base;
  Gate gate;
  uint8_t irq, dma_rx;  // transmit: one more
};
constexpr Kind kKinds[] = {{1, "USART1", 0x40013800, {0x60, 14}, 37, 24},
                           {2, "USART2", 0x40004400, {0x58, 17}, 38, 26},
                           {3, "USART3", 0x40004800, {0x58, 18}, 39, 28},
                           {4, "UART4", 0x40004C00, {0x58, 19}, 52, 30},
                           {6, "LPUART1", 0x40008000, {0x5C, 0}, 91, 34}};
const Kind& kind(uint32_t number) { return kKinds[std::min(number, 5u) - 1]; }

}  // namespace

Usart::Usart(Wires& wires, uint32_t number)
    : RegisterBlock(wires, kind(number).name, kind(number).base, 0x400, kRegisters, kind(number).gate), number_(number) {
  RegisterBlock::reset(true);
}

uint64_t Usart::frame_cycles() const {
  constexpr uint16_t kPrescalers[] = {1, 2, 4, 6, 8, 10, 12, 16, 32, 64, 128, 256, 256, 256, 256, 256};
  const Clocks& c = wires_.clocks();
  const uint64_t kernel = c.usart_Hz[number_ - 1] / kPrescalers[field(PRESC, 0, 4)], brr = reg(BRR);
  if (brr == 0 || kernel == 0) return 0;
  const uint64_t halves[] = {2, 1, 4, 3};  // stop bits, in halves
  const uint32_t data = bit(CR1, 28) ? 7 : bit(CR1, 12) ? 9 : 8;
  const uint64_t half_bits = 2 * (1 + data) + halves[field(CR2, 12, 2)];
  const bool over8 = bit(CR1, 15) && number_ != 6;
  const uint64_t divider = over8 ? ((brr & ~7u) | (brr & 7) << 1) : brr;
  const uint64_t ticks = number_ == 6 ? half_bits * divider / 256 / 2 : half_bits * divider / (over8 ? 4 : 2);
  return std::max<uint64_t>(1, cycles_of(ticks, static_cast<uint32_t>(kernel), c.hclk_Hz));
}

uint64_t Usart::next_event() const { return std::min(s.more.sent_at, s.more.idle_at); }

void Usart::next_frame() {
  UsartMore& m = s.more;
  if (m.shifting || m.tx_count == 0 || (reg(CR1) & (UE | TE)) != (UE | TE)) return;
  const uint64_t cycles = frame_cycles();
  if (cycles == 0) return;
  m.shift = m.tx[0];
  std::copy(m.tx.begin() + 1, m.tx.end(), m.tx.begin());
  --m.tx_count;
  m.shifting = true;
  m.sent_at = wires_.now() + cycles;
}

void Usart::advance(uint64_t cycle) {
  UsartMore& m = s.more;
  if (m.sent_at <= cycle) {
    m.sent_at = kNever;
    m.shifting = false;
    wires_.uart_sent(number_, static_cast<uint8_t>(m.shift));
    next_frame();
    if (!m.shifting) reg(ISR) |= TC;
  }
  if (m.idle_at <= cycle) {
    m.idle_at = kNever;
    reg(ISR) |= IDLE;
  }
  follow();
}

void Usart::receive(uint8_t byte) {
  UsartMore& m = s.more;
  if (!receiving()) return;
  if (m.rx_count >= depth()) {
    if (!bit(CR3, 12)) reg(ISR) |= ORE;  // unless OVRDIS
    if (bit(CR3, 12)) m.rx[m.rx_count - 1] = byte;
  } else {
    m.rx[m.rx_count++] = byte;
  }
  m.idle_at = wires_.now() + frame_cycles();
  follow();
  wires_.reschedule(*this);
}

uint32_t Usart::read(uint32_t offset) {
  UsartMore& m = s.more;
  if (offset == ISR) {
    uint32_t isr = reg(ISR) & ~(RXNE | TXE);
    if (m.rx_count != 0) isr |= RXNE;
    if (m.tx_count < depth()) isr |= TXE;
    if ((reg(CR1) & TE) != 0) isr |= 1u << 21;
    if ((reg(CR1) & RE) != 0) isr |= 1u << 22;
    if (bit(CR1, 29)) isr |= (m.tx_count == 0 ? 1u << 23 : 0) | (m.rx_count == 8 ? 1u << 24 : 0);
    return isr | (reg(CR1) & UE ? 0 : TC);
  }
  if (offset == RDR) {
    const uint32_t byte = m.rx[0];
    if (m.rx_count != 0) {
      std::copy(m.rx.begin() + 1, m.rx.end(), m.rx.begin());
      --m.rx_count;
    }
    follow();
    return byte;
  }
  return reg(offset);
}

void Usart::write(uint32_t offset, uint32_t value, uint32_t mask) {
  UsartMore& m = s.more;
  switch (offset) {
    case ICR:
      reg(ISR) &= ~value;
      break;
    case RQR:
      if ((value & 8) != 0) m.rx_count = 0;
      if ((value & 16) != 0) m.tx_count = 0;
      break;
    case TDR:
      reg(ISR) &= ~TC;
      if (m.tx_count < m.tx.size() && m.tx_count < depth()) m.tx[m.tx_count++] = static_cast<uint16_t>(value & 0x1FF);
      next_frame();
      break;
    default: {
      const bool was_off = (reg(CR1) & (UE | TE)) != (UE | TE);
      keep(offset, value, mask);
      if (was_off && (reg(CR1) & (UE | TE)) == (UE | TE)) reg(ISR) |= TC;
      if ((reg(CR1) & UE) == 0) {
        m = UsartMore{};
        reg(ISR) = 0;
      }
      next_frame();
    }
  }
  follow();
}

void Usart::follow() {
  const UsartMore& m = s.more;
  const uint32_t cr1 = reg(CR1), isr = reg(ISR);
  const bool txe = m.tx_count < depth() && (cr1 & UE) != 0, rxne = m.rx_count != 0;
  const bool error = bit(CR3, 0) && (isr & ORE) != 0;
  const bool raised = (bit(CR1, 7) && txe) || (bit(CR1, 6) && (isr & TC) != 0) || (bit(CR1, 5) && (rxne || (isr & ORE) != 0)) ||
                      (bit(CR1, 4) && (isr & IDLE) != 0) || error;
  interrupt(kind(number_).irq, raised && (cr1 & UE) != 0);
  wires_.set_dma_request(kind(number_).dma_rx, bit(CR3, 6) && rxne);
  wires_.set_dma_request(kind(number_).dma_rx + 1u, bit(CR3, 7) && txe);
}

}  // namespace rotorloop::mcu::g431
