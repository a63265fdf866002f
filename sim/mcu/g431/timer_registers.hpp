// Offsets and bits of the timers' registers (RM0440, 28.6), shared by timer*.cpp.
#pragma once
#include <cstdint>

namespace rotorloop::mcu::g431::tim {

inline constexpr uint32_t CR1 = 0x00, CR2 = 0x04, SMCR = 0x08, DIER = 0x0C, SR = 0x10, EGR = 0x14, CCMR1 = 0x18, CCMR2 = 0x1C, CCER = 0x20,
                          CNT = 0x24, PSC = 0x28, ARR = 0x2C, RCR = 0x30, CCR1 = 0x34, BDTR = 0x44, CCR5 = 0x48, CCR6 = 0x4C, CCMR3 = 0x50,
                          DTR2 = 0x54, ECR = 0x58, TISEL = 0x5C, AF1 = 0x60, AF2 = 0x64, OR1 = 0x68, DCR = 0x3DC, DMAR = 0x3E0;
inline constexpr uint32_t CEN = 1, UDIS = 2, URS = 4, OPM = 8, DIR = 16, ARPE = 128, UIFREMAP = 1u << 11, DITHEN = 1u << 12;
inline constexpr uint32_t UIF = 1, CC1IF = 2, COMIF = 32, TIF = 64, BIF = 128, B2IF = 256, CC1OF = 1u << 9, SBIF = 1u << 13,
                          CC5IF = 1u << 16;
inline constexpr uint32_t kUpdate = 0, kCompareBase = 1, kCom = 5, kTrigger = 6;  // bits in DIER for interrupts; + 8 for DMA
inline constexpr uint32_t OSSI = 1u << 10, OSSR = 1u << 11, BKE = 1u << 12, BKP = 1u << 13, AOE = 1u << 14, MOE = 1u << 15, BK2E = 1u << 24,
                          BK2P = 1u << 25;
inline constexpr uint32_t compare_register(uint32_t channel) { return channel < 4 ? CCR1 + 4 * channel : CCR5 + 4 * (channel - 4); }
// Register and place of the mode byte of a channel: CCxS, OCxPE, OCxM, OCxCE.
inline constexpr uint32_t mode_register(uint32_t channel) { return channel < 2 ? CCMR1 : channel < 4 ? CCMR2 : CCMR3; }
inline constexpr uint32_t mode_shift(uint32_t channel) { return 8 * (channel & 1); }

}  // namespace rotorloop::mcu::g431::tim
