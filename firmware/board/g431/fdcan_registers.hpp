// FDCAN1 (RM0440, section 44) and its message RAM, whose layout is fixed in this chip and which takes words only.
#pragma once
#include "firmware/board/g431/register.hpp"

namespace rotorloop::g431 {

struct FdcanRegisters {
  Register crel, endn;
  Reserved<1> reserved_08;
  Register dbtp, test, rwd, cccr, nbtp, tscc, tscv, tocc, tocv;
  Reserved<4> reserved_30;
  Register ecr, psr, tdcr;
  Reserved<1> reserved_4c;
  Register ir, ie, ils, ile;
  Reserved<8> reserved_60;
  Register rxgfc, xidam, hpms;
  Reserved<1> reserved_8c;
  Register rxf0s, rxf0a, rxf1s, rxf1a;
  Reserved<8> reserved_a0;
  Register txbc, txfqs, txbrp, txbar, txbcr, txbto, txbcf, txbtie, txbcie, txefs, txefa;
  Reserved<5> reserved_ec;
  Register ckdiv;
};
static_assert(offsetof(FdcanRegisters, dbtp) == 0x0C && offsetof(FdcanRegisters, cccr) == 0x18 && offsetof(FdcanRegisters, ecr) == 0x40 &&
              offsetof(FdcanRegisters, ir) == 0x50 && offsetof(FdcanRegisters, rxgfc) == 0x80 && offsetof(FdcanRegisters, rxf0s) == 0x90 &&
              offsetof(FdcanRegisters, txbc) == 0xC0 && offsetof(FdcanRegisters, txefa) == 0xE8 &&
              offsetof(FdcanRegisters, ckdiv) == 0x100);
inline FdcanRegisters& fdcan() { return block<FdcanRegisters, 0x40006400>(); }

struct FdcanElement {
  Register word[18];
};
struct FdcanMemory {
  Register standard_filter[28];
  Register extended_filter[8][2];
  FdcanElement fifo0[3], fifo1[3];
  Register events[3][2];
  FdcanElement transmit[3];
};
static_assert(offsetof(FdcanMemory, extended_filter) == 0x070 && offsetof(FdcanMemory, fifo0) == 0x0B0 &&
              offsetof(FdcanMemory, fifo1) == 0x188 && offsetof(FdcanMemory, events) == 0x260 && offsetof(FdcanMemory, transmit) == 0x278 &&
              sizeof(FdcanMemory) == 848);
inline FdcanMemory& fdcan_memory() { return block<FdcanMemory, 0x4000A400>(); }

namespace fdcan_bits {
inline constexpr std::uint32_t kInit = bit(0), kConfigure = bit(1), kMonitor = bit(5), kTest = bit(7);  // CCCR
inline constexpr std::uint32_t kLoopBack = bit(4);                           // TEST; inside of the controller together with kMonitor
inline constexpr std::uint32_t kNewInFifo0 = bit(0), kLostInFifo0 = bit(2);  // IR, IE
inline constexpr std::uint32_t kPassive = bit(5), kBusOff = bit(7);          // PSR
inline constexpr std::uint32_t kQueueMode = bit(24);                         // TXBC: the smallest identifier first
inline constexpr std::uint32_t kExtended = bit(30), kRemote = bit(29), kFd = bit(21);
inline constexpr std::uint32_t kAcceptOthers = 0, kRejectOthers = field(2, 2) | field(2, 4),
                               kRejectRemote = 3;  // RXGFC: others: FIFO 0 or nowhere
}  // namespace fdcan_bits

}  // namespace rotorloop::g431
