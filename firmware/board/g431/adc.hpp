// The two converters (RM0440, section 21), their DMA (sections 12, 13) and how three shunts, bus and thermistor come out of them:
//   TIM1 TRGO, the crest: injected group. ADC1: U, then W; ADC2: V. The interrupt comes when ADC1 has both.
//   TIM1 TRGO2, the trough: regular group. ADC1: U, W, bus, thermistor, VREFINT, by DMA; ADC2: V. The shunts carry nothing there: their
//   zeros.
// An injected trigger in the middle of a regular conversion stops it and it begins anew after: the slow channels lose nothing but time.
#pragma once
#include <cstdint>

#include "firmware/board/g431/register.hpp"

namespace rotorloop::g431 {

struct AdcRegisters {
  Register isr, ier, cr, cfgr, cfgr2, smpr1, smpr2;
  Reserved<1> reserved_1c;
  Register tr1, tr2, tr3;
  Reserved<1> reserved_2c;
  Register sqr1, sqr2, sqr3, sqr4, dr;
  Reserved<2> reserved_44;
  Register jsqr;
  Reserved<4> reserved_50;
  Register ofr[4];
  Reserved<4> reserved_70;
  Register jdr[4];
  Reserved<4> reserved_90;
  Register awd2cr, awd3cr;
  Reserved<2> reserved_a8;
  Register difsel, calfact;
};
static_assert(offsetof(AdcRegisters, tr1) == 0x20 && offsetof(AdcRegisters, sqr1) == 0x30 && offsetof(AdcRegisters, dr) == 0x40 &&
              offsetof(AdcRegisters, jsqr) == 0x4C && offsetof(AdcRegisters, ofr) == 0x60 && offsetof(AdcRegisters, jdr) == 0x80 &&
              offsetof(AdcRegisters, awd2cr) == 0xA0 && offsetof(AdcRegisters, calfact) == 0xB4);
inline AdcRegisters& adc1() { return block<AdcRegisters, 0x50000000>(); }
inline AdcRegisters& adc2() { return block<AdcRegisters, 0x50000100>(); }

struct AdcCommonRegisters {
  Register csr;
  Reserved<1> reserved_04;
  Register ccr, cdr;
};
static_assert(offsetof(AdcCommonRegisters, ccr) == 0x08);
inline AdcCommonRegisters& adc_common() { return block<AdcCommonRegisters, 0x50000300>(); }

struct DmaChannelRegisters {
  Register ccr, cndtr, cpar, cmar;
  Reserved<1> reserved;
};
struct DmaRegisters {
  Register isr, ifcr;
  DmaChannelRegisters channel[8];
};
static_assert(offsetof(DmaRegisters, channel) == 0x08 && sizeof(DmaChannelRegisters) == 0x14);
inline DmaRegisters& dma1() { return block<DmaRegisters, 0x40020000>(); }
struct DmamuxRegisters {
  Register ccr[16];
};
inline DmamuxRegisters& dmamux() { return block<DmamuxRegisters, 0x40020800>(); }

namespace adc_bits {
inline constexpr std::uint32_t kReady = bit(0), kEndOfConversion = bit(2), kInjectedEnd = bit(6);  // ISR, IER
inline constexpr std::uint32_t kOn = bit(0), kStart = bit(2), kInjectedStart = bit(3), kStop = bit(4), kInjectedStop = bit(5),
                               kRegulator = bit(28), kDeepPowerDown = bit(29),
                               kCalibrate = bit(31);  // CR: bits that are set by ones and never cleared by zeros
inline constexpr std::uint32_t kInjectedQueueOff = bit(31), kOverwrite = bit(12), kDma = bit(0), kDmaCircular = bit(1),
                               kRisingEdge = field(1, 10);  // CFGR
inline constexpr std::uint32_t kRegularByTrgo2 = field(10, 5);
inline constexpr std::uint32_t kInjectedByTrgo = field(0, 2) | field(1, 7);               // JSQR: TIM1_TRGO, rising edge
inline constexpr std::uint32_t kSynchronousQuarter = field(3, 16), kVrefintOn = bit(22);  // CCR: 42.5 MHz
}  // namespace adc_bits

// Channels on the B-G431B-ESC1's pins are given by the board; VREFINT is ADC1's 18.
struct AdcWiring {
  std::uint8_t u_adc1, w_adc1, v_adc2, bus_adc1, thermistor_adc1;
};
inline constexpr std::uint32_t kVrefintChannel = 18;
// Codes of SMPRx: 12.5, 47.5 and 247.5 cycles of 42.5 MHz, which are 0.29, 1.1 and 5.8 us. VREFINT wants 4 us, the amplifiers 0.2.
inline constexpr std::uint32_t kFastSampling = 2, kSlowSampling = 4, kReferenceSampling = 6;

enum class AdcFault : std::uint8_t { none, regulator, calibration, not_ready, no_conversion };

// Where the DMA puts a trough's round, in its order.
struct SlowSamples {
  volatile std::uint16_t u = 0, w = 0, bus = 0, thermistor = 0, vrefint = 0;
};
static_assert(sizeof(SlowSamples) == 10);

// Regulator, calibration, enabling, sequences; the groups wait for their triggers. Amplifiers and clocks run.
AdcFault start_adc(const AdcWiring& wiring, SlowSamples& into);

}  // namespace rotorloop::g431
