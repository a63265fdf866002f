#include "sim/mcu/g431/dma.hpp"

#include <algorithm>

namespace rotorloop::mcu::g431 {
namespace {

constexpr uint32_t ISR = 0x00, IFCR = 0x04;
constexpr uint32_t ccr(uint32_t c) { return 0x08 + 20 * c; }
constexpr uint32_t cndtr(uint32_t c) { return 0x0C + 20 * c; }
constexpr uint32_t cpar(uint32_t c) { return 0x10 + 20 * c; }
constexpr uint32_t cmar(uint32_t c) { return 0x14 + 20 * c; }
constexpr uint32_t EN = 1, DIR = 16, CIRC = 32, PINC = 64, MINC = 128, MEM2MEM = 1u << 14;
constexpr uint32_t GIF = 1, TCIF = 2, HTIF = 4, TEIF = 8;
constexpr uint64_t kFirstCycles = 4, kTransferCycles = 5;  // arbitration; bus accesses of one transfer. Estimates: AN2548 gives the order

// clang-format off
#define RL_CHANNEL(N) \
  {ccr(N - 1), "CCR" #N, 0, 0x7FFF}, {cndtr(N - 1), "CNDTR" #N, 0, 0xFFFF}, {cpar(N - 1), "CPAR" #N}, {cmar(N - 1), "CMAR" #N}
constexpr Register kDma[] = {{ISR, "ISR", 0, 0}, {IFCR, "IFCR", 0, 0},
    RL_CHANNEL(1), RL_CHANNEL(2), RL_CHANNEL(3), RL_CHANNEL(4), RL_CHANNEL(5), RL_CHANNEL(6)};
#define RL_SELECT(N) {4 * N, "C" #N "CR", 0, 0x1FFF037F}
constexpr Register kMux[] = {
    RL_SELECT(0), RL_SELECT(1), RL_SELECT(2), RL_SELECT(3), RL_SELECT(4), RL_SELECT(5), RL_SELECT(6), RL_SELECT(7), RL_SELECT(8),
    RL_SELECT(9), RL_SELECT(10), RL_SELECT(11), {0x80, "CSR", 0, 0}, {0x84, "CFR", 0, 0}, {0x100, "RG0CR", 0, 0xF9011F},
    {0x104, "RG1CR", 0, 0xF9011F}, {0x108, "RG2CR", 0, 0xF9011F}, {0x10C, "RG3CR", 0, 0xF9011F}, {0x140, "RGSR", 0, 0},
    {0x144, "RGCFR", 0, 0},
};
// clang-format on

}  // namespace

Dmamux::Dmamux(Wires& wires) : RegisterBlock(wires, "DMAMUX", 0x40020800, 0x148, kMux, {0x48, 2}) { RegisterBlock::reset(true); }

void Dmamux::reset(bool power_up) {
  const DmamuxMore before = s.more;
  RegisterBlock::reset(power_up);
  if (!power_up) s.more = before;
}

void Dmamux::write(uint32_t offset, uint32_t value, uint32_t mask) {
  keep(offset, value, mask);
  if (offset < 0x30 && (reg(offset) & (1u << 16 | 1u << 9)) != 0) wires_.refuse("synchronisation and events of DMAMUX are not modelled");
  if (offset >= 0x100 && (reg(offset) & 1u << 16) != 0) wires_.refuse("request generators of DMAMUX are not modelled");
}

void Dmamux::on_dma_request(uint32_t request, bool high) {
  uint64_t& word = s.more.high[request >> 6];
  const uint64_t bit = uint64_t{1} << (request & 63);
  word = high ? word | bit : word & ~bit;
}

Dma::Dma(Wires& wires, const Dmamux& mux, uint32_t number)
    : RegisterBlock(wires, number == 1 ? "DMA1" : "DMA2", number == 1 ? 0x40020000 : 0x40020400, 0x80, kDma,
                    {0x48, static_cast<uint8_t>(number - 1)}),
      mux_(mux),
      first_channel_(number == 1 ? 0 : 6) {
  RegisterBlock::reset(true);
}

void Dma::on_dma_request(uint32_t request, bool pulse) {
  bool any = false;
  for (uint32_t c = 0; c < 6; ++c) {
    if (mux_.request_of(first_channel_ + c) != request || (reg(ccr(c)) & EN) == 0) continue;
    if (pulse && s.more.pulses[c] < 0xFFFF) ++s.more.pulses[c];
    any = true;
  }
  if (!any) return;
  s.more.free_at = std::max(s.more.free_at, wires_.now() + kFirstCycles);
  wires_.reschedule(*this);
}

int Dma::ready() const {
  int best = -1;
  uint32_t priority = 0;
  for (uint32_t c = 0; c < 6; ++c) {
    const uint32_t r = reg(ccr(c)), request = mux_.request_of(first_channel_ + c);
    if ((r & EN) == 0 || reg(cndtr(c)) == 0) continue;
    if ((r & MEM2MEM) == 0 && s.more.pulses[c] == 0 && (request == 0 || !mux_.held(request))) continue;
    const uint32_t p = r >> 12 & 3;
    if (best >= 0 && p <= priority) continue;
    best = static_cast<int>(c);
    priority = p;
  }
  return best;
}

uint64_t Dma::next_event() const { return ready() < 0 ? kNever : std::max(s.more.free_at, wires_.now()); }

void Dma::advance(uint64_t cycle) {
  const int channel = ready();
  if (channel < 0 || s.more.free_at > cycle) return;
  s.more.free_at = cycle + kTransferCycles;
  transfer(static_cast<uint32_t>(channel));
  follow();
}

void Dma::transfer(uint32_t c) {
  DmaMore& m = s.more;
  const uint32_t r = reg(ccr(c));
  if (m.pulses[c] != 0) --m.pulses[c];
  const uint32_t peripheral_bytes = 1u << (r >> 8 & 3), memory_bytes = 1u << (r >> 10 & 3);
  const bool to_peripheral = (r & DIR) != 0;
  uint32_t value = 0;
  const bool done = to_peripheral ? wires_.bus_read(m.to[c], memory_bytes, value) && wires_.bus_write(m.from[c], peripheral_bytes, value)
                                  : wires_.bus_read(m.from[c], peripheral_bytes, value) && wires_.bus_write(m.to[c], memory_bytes, value);
  if (!done) {
    reg(ccr(c)) &= ~EN;
    reg(ISR) |= (TEIF | GIF) << (4 * c);
    return;
  }
  if ((r & PINC) != 0) m.from[c] += peripheral_bytes;
  if ((r & MINC) != 0) m.to[c] += memory_bytes;
  const uint32_t left = --reg(cndtr(c));
  if (left == m.reload[c] / 2) reg(ISR) |= (HTIF | GIF) << (4 * c);
  if (left != 0) return;
  reg(ISR) |= (TCIF | GIF) << (4 * c);
  if ((r & CIRC) == 0 || (r & MEM2MEM) != 0) return;
  reg(cndtr(c)) = m.reload[c];
  m.from[c] = reg(cpar(c));
  m.to[c] = reg(cmar(c));
}

void Dma::write(uint32_t offset, uint32_t value, uint32_t mask) {
  if (offset == ISR) return;
  if (offset == IFCR) {
    for (uint32_t c = 0; c < 6; ++c) {
      const uint32_t clear = value >> (4 * c) & 15;
      reg(ISR) &= ~(((clear & GIF) != 0 ? 15u : clear) << (4 * c));
      if ((reg(ISR) >> (4 * c) & 14) == 0) reg(ISR) &= ~(GIF << (4 * c));
    }
    follow();
    return;
  }
  const uint32_t c = (offset - 8) / 20, field_at = (offset - 8) % 20;
  const bool enabled = (reg(ccr(c)) & EN) != 0;
  if (enabled && field_at != 0) return;  // count and addresses stand while the channel is enabled
  keep(offset, value, enabled ? mask & 0x2F : mask);
  if (!enabled && (reg(ccr(c)) & EN) != 0) {
    s.more.reload[c] = reg(cndtr(c));
    s.more.from[c] = reg(cpar(c));
    s.more.to[c] = reg(cmar(c));
    s.more.pulses[c] = 0;
    s.more.free_at = std::max(s.more.free_at, wires_.now() + kFirstCycles);
  }
  follow();
}

void Dma::follow() {
  for (uint32_t c = 0; c < 6; ++c) {
    const uint32_t flags = reg(ISR) >> (4 * c) & reg(ccr(c)) & 14;
    interrupt(first_channel_ == 0 ? 11 + c : c < 5 ? 56 + c : 97, flags != 0);
  }
}

}  // namespace rotorloop::mcu::g431
