// Offsets and bits of FDCAN1 (RM0440, 44.4), for its source files.
#pragma once
#include <cstdint>

namespace rotorloop::mcu::g431::fdcan {

inline constexpr uint32_t CREL = 0x000, ENDN = 0x004, DBTP = 0x00C, TEST = 0x010, RWD = 0x014, CCCR = 0x018, NBTP = 0x01C, TSCC = 0x020,
                          TSCV = 0x024, TOCC = 0x028, TOCV = 0x02C, ECR = 0x040, PSR = 0x044, TDCR = 0x048, IR = 0x050, IE = 0x054,
                          ILS = 0x058, ILE = 0x05C, RXGFC = 0x080, XIDAM = 0x084, HPMS = 0x088, RXF0S = 0x090, RXF0A = 0x094, RXF1S = 0x098,
                          RXF1A = 0x09C, TXBC = 0x0C0, TXFQS = 0x0C4, TXBRP = 0x0C8, TXBAR = 0x0CC, TXBCR = 0x0D0, TXBTO = 0x0D4,
                          TXBCF = 0x0D8, TXBTIE = 0x0DC, TXBCIE = 0x0E0, TXEFS = 0x0E4, TXEFA = 0x0E8, CKDIV = 0x100;

// CCCR
inline constexpr uint32_t INIT = 1u << 0, CCE = 1u << 1, ASM = 1u << 2, CSA = 1u << 3, CSR = 1u << 4, MON = 1u << 5, DAR = 1u << 6,
                          TESTEN = 1u << 7, FDOE = 1u << 8, BRSE = 1u << 9, PXHD = 1u << 12, EFBI = 1u << 13, TXP = 1u << 14,
                          NISO = 1u << 15;
// TEST
inline constexpr uint32_t LBCK = 1u << 4, RX = 1u << 7;
// IR, IE
inline constexpr uint32_t RF0N = 1u << 0, RF0F = 1u << 1, RF0L = 1u << 2, RF1N = 1u << 3, RF1F = 1u << 4, RF1L = 1u << 5, HPM = 1u << 6,
                          TC = 1u << 7, TCF = 1u << 8, TFE = 1u << 9, TEFN = 1u << 10, TEFF = 1u << 11, TEFL = 1u << 12, TSW = 1u << 13,
                          ELO = 1u << 16, EP = 1u << 17, EW = 1u << 18, BO = 1u << 19, PEA = 1u << 21, ARA = 1u << 23;
inline constexpr uint32_t kInterrupts = 0x00FFFFFF;
// PSR.LEC
inline constexpr uint8_t kNoError = 0, kStuffError = 1, kAckError = 3, kBit1Error = 4, kBit0Error = 5, kNoChange = 7;

// Message RAM: where each part begins and how long its elements are, in bytes (44.3.3).
inline constexpr uint32_t kStandardFilters = 0x000, kExtendedFilters = 0x070, kRxFifo0 = 0x0B0, kRxFifo1 = 0x188, kTxEvents = 0x260,
                          kTxBuffers = 0x278, kElementBytes = 72, kEventBytes = 8;
inline constexpr uint32_t kRemote = 1u << 29, kExtended = 1u << 30;  // first word of an element
inline constexpr uint32_t kFd = 1u << 21, kEventWanted = 1u << 23;   // second word

inline constexpr int kRecessiveBits = 11;  // that end a frame, integrate a node and count towards the end of bus-off
inline constexpr int kRecoverySequences = 129;

}  // namespace rotorloop::mcu::g431::fdcan
