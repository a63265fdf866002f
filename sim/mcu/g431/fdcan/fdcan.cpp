// Registers of FDCAN1: who may write what and when, requests, interrupt flags and lines.
#include "sim/mcu/g431/fdcan/fdcan.hpp"

#include <algorithm>
#include <cmath>

#include "sim/mcu/g431/fdcan/fdcan_bits.hpp"
#include "sim/world/virtual_time.hpp"

namespace rotorloop::mcu::g431 {
namespace {

using namespace fdcan;

constexpr Register kRegisters[] = {
    {CREL, "CREL", 0x32141218, 0},
    {ENDN, "ENDN", 0x87654321, 0},
    {DBTP, "DBTP", 0x00000A33, 0x009F1FFF},
    {TEST, "TEST", 0, 0x70},
    {RWD, "RWD", 0, 0xFF},
    {CCCR, "CCCR", 1, 0xF3F7},
    {NBTP, "NBTP", 0x06000A03, 0xFFFFFF7F},
    {TSCC, "TSCC", 0, 0x000F0003},
    {TSCV, "TSCV", 0, 0},
    {TOCC, "TOCC", 0xFFFF0000, 0xFFFF0007},
    {TOCV, "TOCV", 0x0000FFFF, 0},
    {ECR, "ECR", 0, 0},
    {PSR, "PSR", 0x707, 0},
    {TDCR, "TDCR", 0, 0x7F7F},
    {IR, "IR", 0, 0},
    {IE, "IE", 0, kInterrupts},
    {ILS, "ILS", 0, 0x7F},
    {ILE, "ILE", 0, 3},
    {RXGFC, "RXGFC", 0, 0x0F1F033F},
    {XIDAM, "XIDAM", 0x1FFFFFFF, 0x1FFFFFFF},
    {HPMS, "HPMS", 0, 0},
    {RXF0S, "RXF0S", 0, 0},
    {RXF0A, "RXF0A", 0, 7},
    {RXF1S, "RXF1S", 0, 0},
    {RXF1A, "RXF1A", 0, 7},
    {TXBC, "TXBC", 0, 1u << 24},
    {TXFQS, "TXFQS", 3, 0},
    {TXBRP, "TXBRP", 0, 0},
    {TXBAR, "TXBAR", 0, 0},
    {TXBCR, "TXBCR", 0, 0},
    {TXBTO, "TXBTO", 0, 0},
    {TXBCF, "TXBCF", 0, 0},
    {TXBTIE, "TXBTIE", 0, 7},
    {TXBCIE, "TXBCIE", 0, 7},
    {TXEFS, "TXEFS", 0, 0},
    {TXEFA, "TXEFA", 0, 3},
    {CKDIV, "CKDIV", 0, 15},
};

// Every word of the message RAM is one register by name.
constexpr std::array<Register, 212> kRamWords = [] {
  std::array<Register, 212> words{};
  for (uint32_t n = 0; n < words.size(); ++n) words[n] = {static_cast<uint16_t>(4 * n), "RAM"};
  return words;
}();

constexpr uint32_t kLine0 = 21, kLine1 = 22;
// Interrupts of each group of ILS (44.4.18).
constexpr uint32_t kGroups[] = {0x7, 0x38, 0x1C0, 0x1E00, 0xE000, 0x30000, 0xFC0000};

}  // namespace

MessageRam::MessageRam(Wires& wires) : RegisterBlock(wires, "FDCAN_RAM", 0x4000A400, 848, kRamWords, {0x58, 25}) {}

Fdcan::Fdcan(Wires& wires, MessageRam& ram) : RegisterBlock(wires, "FDCAN1", 0x40006400, 0x104, kRegisters, {0x58, 25}), ram_(ram) {
  reset(true);
}

void Fdcan::reset(bool power_up) {
  RegisterBlock::reset(power_up);
  interrupt(kLine0, false);
  interrupt(kLine1, false);
}

bool Fdcan::configurable() const { return (reg(CCCR) & (INIT | CCE)) == (INIT | CCE); }
bool Fdcan::started() const { return (reg(CCCR) & INIT) == 0 && s.more.recovery_left == 0 && bit_ns() > 0; }
bool Fdcan::loops_back() const { return (reg(CCCR) & TESTEN) != 0 && (reg(TEST) & LBCK) != 0; }
bool Fdcan::queue_mode() const { return bit(TXBC, 24); }
bool Fdcan::sends_frames() const { return (reg(CCCR) & ASM) == 0 && (loops_back() || (reg(CCCR) & MON) == 0); }

double Fdcan::bit_ns() const {
  const uint32_t kernel_Hz = wires_.clocks().fdcan_Hz, divider = std::max(1u, 2 * field(CKDIV, 0, 4));
  const uint32_t quanta = 1 + field(NBTP, 8, 8) + 1 + field(NBTP, 0, 7) + 1;  // SYNC_SEG, NTSEG1, NTSEG2
  return kernel_Hz == 0 ? 0.0 : 1e9 * divider * (field(NBTP, 16, 9) + 1) * quanta / kernel_Hz;
}
int64_t Fdcan::bits_ns(int64_t bits) const { return std::llround(static_cast<double>(bits) * bit_ns()); }
int64_t Fdcan::time_ns(uint64_t cycle) const { return std::llround(1e9 * wires_.time_s_at(cycle)); }
int64_t Fdcan::now_ns() const { return time_ns(wires_.now()); }

// The counter runs in bit times by TCP + 1 while TSS = 1; frames take it at their start (44.3.2).
uint16_t Fdcan::time_stamp(int64_t at_ns) const {
  if (field(TSCC, 0, 2) != 1 || bit_ns() <= 0) return 0;
  return static_cast<uint16_t>(static_cast<double>(at_ns - s.more.stamp_zero_ns) / (bit_ns() * (field(TSCC, 16, 4) + 1)));
}

void Fdcan::write_cccr(uint32_t value) {
  const uint32_t old = reg(CCCR);
  // ASM, MON and TEST are set under CCE and cleared at any time; the rest of the modes changes under CCE alone (44.4.7).
  constexpr uint32_t kModes = DAR | FDOE | BRSE | PXHD | EFBI | TXP | NISO, kSetOnly = ASM | MON | TESTEN;
  uint32_t next = (old & CSA) | (value & (INIT | CSR));
  if (configurable())
    next |= value & (kModes | kSetOnly);
  else
    next |= (old & kModes) | (old & value & kSetOnly);
  if ((old & INIT) != 0 && (next & INIT) != 0) next |= value & CCE;
  if ((value & CSR) != 0) next |= INIT | CSA;  // a clock stop waits for nothing here: a frame on the wire runs to its end
  if ((value & CSR) == 0) next &= ~CSA;
  if ((next & (TESTEN)) == 0) reg(TEST) &= ~LBCK;
  if (wires_.clocks().fdcan_Hz == 0) next = (next & ~INIT) | (old & INIT);  // INIT passes to the clock domain of the bus and back
  reg(CCCR) = next;
  if ((next & CCE & ~old) != 0) clear_by_cce();
  if ((next & INIT & ~old) != 0) stop();
  if ((old & INIT & ~next) != 0) begin();
}

// Setting CCE resets the state of FIFOs and requests (44.3.1).
void Fdcan::clear_by_cce() {
  FdcanMore& m = s.more;
  m.rx = {};
  m.events = {};
  m.tx_get = m.tx_fill = 0;
  m.pending = m.sent = m.cancelled = m.cancelling = 0;
  reg(HPMS) = 0;
}

void Fdcan::stop() {
  s.more.loop_end_ns = 0;
  s.more.hearing = s.more.hearing || s.more.sending;  // what is on the wire runs to its end
  s.more.sending = false;
}

// Out of INIT it waits for 11 recessive bits, after bus-off for 129 times as many (44.3.1, ISO 11898-1).
void Fdcan::begin() {
  s.more.recovery_left = s.more.bus_off ? kRecoverySequences : 1;
  s.more.recessive_from_ns = now_ns();
}

void Fdcan::ask_for(uint32_t buffers) {
  if ((reg(CCCR) & CCE) != 0) return;  // requests need CCE = 0 (44.4.32)
  FdcanMore& m = s.more;
  const int64_t now = now_ns();
  for (uint32_t b = 0; b < 3; ++b) {
    if ((buffers & ~m.pending & (1u << b)) == 0) continue;
    const uint32_t first = ram_.word(kTxBuffers + b * kElementBytes), second = ram_.word(kTxBuffers + b * kElementBytes + 4);
    if ((first & kRemote) != 0) wires_.refuse("remote frames are not built: no bus here carries them");
    if ((second & kFd) != 0 && (reg(CCCR) & FDOE) != 0) wires_.refuse("CAN FD frames are not built: the bus carries classic frames");
    m.pending |= 1u << b;
    m.sent &= ~(1u << b);
    m.cancelled &= ~(1u << b);
    m.asked_ns[b] = now;
    if (m.tx_fill == 0) m.tx_get = static_cast<uint8_t>(b);
    m.tx_fill = static_cast<uint8_t>(std::max<uint32_t>(m.tx_fill, (b + 3 - m.tx_get) % 3 + 1));
  }
  if (medium_ != nullptr && ready_ns() != sim::kNever_ns) medium_->has_frame(ready_ns());
}

void Fdcan::cancel(uint32_t buffers) {
  for (uint32_t b = 0; b < 3; ++b) {
    if ((buffers & s.more.pending & (1u << b)) == 0) continue;
    if (s.more.sending && s.more.offered == static_cast<int>(b))
      s.more.cancelling |= 1u << b;
    else
      not_sent(b);
  }
}

// A request is over. The FIFO's get index goes on to the next that is pending.
void Fdcan::finish_request(uint32_t buffer, bool was_sent) {
  FdcanMore& m = s.more;
  const uint32_t bit = 1u << buffer;
  m.pending &= ~bit;
  m.cancelling &= ~bit;
  (was_sent ? m.sent : m.cancelled) |= bit;
  if (was_sent && (reg(TXBTIE) & bit) != 0) flag(TC);
  if (!was_sent && (reg(TXBCIE) & bit) != 0) flag(TCF);
  while (m.tx_fill > 0 && (m.pending >> m.tx_get & 1) == 0) {
    m.tx_get = static_cast<uint8_t>((m.tx_get + 1) % 3);
    --m.tx_fill;
  }
  if (m.pending == 0) flag(TFE);
}

void Fdcan::not_sent(uint32_t buffer) { finish_request(buffer, false); }

uint32_t Fdcan::transmit_status() const {
  const FdcanMore& m = s.more;
  const uint32_t full = m.pending == 7 ? 1u << 21 : 0;
  if (queue_mode()) {  // queue: the lowest free buffer; TFFL and TFGI read 0
    const uint32_t put = (m.pending & 1) == 0 ? 0 : (m.pending & 2) == 0 ? 1 : (m.pending & 4) == 0 ? 2 : 0;
    return full | put << 16;
  }
  const uint32_t put = (m.tx_get + m.tx_fill) % 3;
  return (m.tx_fill == 3 ? 1u << 21 : 0) | put << 16 | uint32_t{m.tx_get} << 8 | (3u - m.tx_fill);
}

uint32_t Fdcan::fifo_status(const FdcanMore::Fifo& fifo, bool lost) const {
  return (lost ? 1u << 25 : 0) | (fifo.fill == 3 ? 1u << 24 : 0) | uint32_t{fifo.put()} << 16 | uint32_t{fifo.get} << 8 | fifo.fill;
}

// An index that is acknowledged frees its element and those before it.
void Fdcan::acknowledge(uint32_t which, uint32_t index) {
  FdcanMore::Fifo& fifo = which < 2 ? s.more.rx[which] : s.more.events;
  const uint32_t freed = (index + 3 - fifo.get) % 3 + 1;
  if (index > 2) return wires_.refuse("the FIFO has elements 0 to 2");
  if (freed > fifo.fill) return;
  fifo.get = static_cast<uint8_t>((index + 1) % 3);
  fifo.fill = static_cast<uint8_t>(fifo.fill - freed);
}

uint32_t Fdcan::error_status() {
  FdcanMore& m = s.more;
  const uint32_t activity = !started() ? 0u : m.sending ? 3u : m.hearing ? 2u : 1u;
  const bool warning = m.transmit_errors >= 96 || m.receive_errors >= 96;
  const uint32_t value =
      m.last_error | activity << 3 | uint32_t{passive()} << 5 | uint32_t{warning} << 6 | uint32_t{m.bus_off} << 7 | 7u << 8;
  m.last_error = kNoChange;  // reading sets it
  return value;
}

uint32_t Fdcan::read(uint32_t offset) {
  FdcanMore& m = s.more;
  advance(wires_.now());
  switch (offset) {
    case TEST:
      return reg(TEST) | RX;  // the pin is recessive between bits
    case TSCV:
      return time_stamp(now_ns());
    case ECR: {
      const uint32_t value = static_cast<uint32_t>(std::min(m.transmit_errors, 255)) |
                             static_cast<uint32_t>(std::min(m.receive_errors, 127)) << 8 | uint32_t{m.receive_errors > 127} << 15 |
                             uint32_t{m.logged_errors} << 16;
      m.logged_errors = 0;
      return value;
    }
    case PSR:
      return error_status();
    case RXF0S:
      return fifo_status(m.rx[0], (reg(IR) & RF0L) != 0);
    case RXF1S:
      return fifo_status(m.rx[1], (reg(IR) & RF1L) != 0);
    case TXEFS:
      return fifo_status(m.events, (reg(IR) & TEFL) != 0);
    case TXFQS:
      return transmit_status();
    case TXBRP:
      return m.pending;
    case TXBTO:
      return m.sent;
    case TXBCF:
      return m.cancelled;
    case TXBCR:
      return m.cancelling;
    default:
      return reg(offset);
  }
}

void Fdcan::write(uint32_t offset, uint32_t value, uint32_t mask) {
  advance(wires_.now());
  switch (offset) {
    case CCCR:
      write_cccr((reg(CCCR) & ~mask) | value);
      break;
    case TEST:
      if ((reg(CCCR) & TESTEN) != 0) keep(offset, value, mask);
      break;
    case TSCV:
      s.more.stamp_zero_ns = now_ns();
      break;
    case IR:
      reg(IR) &= ~value;
      break;
    case RXF0A:
      acknowledge(0, value & 7);
      break;
    case RXF1A:
      acknowledge(1, value & 7);
      break;
    case TXEFA:
      acknowledge(2, value & 3);
      break;
    case TXBAR:
      ask_for(value & 7);
      break;
    case TXBCR:
      cancel(value & 7);
      break;
    case IE:
    case ILS:
    case ILE:
    case TXBTIE:
    case TXBCIE:
      keep(offset, value, mask);
      break;
    default:
      if (!configurable()) break;  // protected: the write has no effect (44.3.1)
      if (offset == TSCC && (value & 3) == 2) wires_.refuse("time stamps from TIM3 are not built");
      if (offset == TOCC && (value & 1) != 0) wires_.refuse("the timeout counter is not built");
      keep(offset, value, mask);
      if (offset == TSCC) s.more.stamp_zero_ns = now_ns();
  }
  update_lines();
}

void Fdcan::flag(uint32_t interrupts) {
  reg(IR) |= interrupts;
  update_lines();
}

void Fdcan::update_lines() {
  const uint32_t active = reg(IR) & reg(IE);
  uint32_t on_line1 = 0;
  for (uint32_t g = 0; g < std::size(kGroups); ++g)
    if (bit(ILS, g)) on_line1 |= kGroups[g];
  interrupt(kLine0, (active & ~on_line1) != 0 && bit(ILE, 0));
  interrupt(kLine1, (active & on_line1) != 0 && bit(ILE, 1));
}

void Fdcan::advance(uint64_t cycle) {
  const int64_t until_ns = time_ns(cycle);
  if (medium_ != nullptr) medium_->advance_to(until_ns);
  hear_recessive(until_ns);
  run_internal_loop(until_ns);
  const double wrap_ns = 65536.0 * bit_ns() * (field(TSCC, 16, 4) + 1);
  if (field(TSCC, 0, 2) == 1 && wrap_ns > 0)
    while (static_cast<double>(until_ns - s.more.stamp_zero_ns) >= wrap_ns) {
      s.more.stamp_zero_ns += std::llround(wrap_ns);
      flag(TSW);
    }
}

uint64_t Fdcan::next_event() const {
  int64_t next_ns = medium_ != nullptr ? medium_->next_event_ns() : sim::kNever_ns;
  const FdcanMore& m = s.more;
  if (m.loop_end_ns != 0) next_ns = std::min(next_ns, m.loop_end_ns);
  if (m.recovery_left > 0 && (reg(CCCR) & INIT) == 0 && !m.hearing && bit_ns() > 0)
    next_ns = std::min(next_ns, m.recessive_from_ns + bits_ns(kRecessiveBits) * m.recovery_left);
  if (field(TSCC, 0, 2) == 1 && (reg(IE) & TSW) != 0)
    next_ns = std::min<int64_t>(next_ns, m.stamp_zero_ns + std::llround(65536.0 * bit_ns() * (field(TSCC, 16, 4) + 1)));
  return next_ns == sim::kNever_ns ? kNever : std::max(wires_.now(), wires_.cycle_at(1e-9 * static_cast<double>(next_ns)) + 1);
}

}  // namespace rotorloop::mcu::g431
