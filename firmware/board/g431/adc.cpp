#include "firmware/board/g431/adc.hpp"

#include <initializer_list>

#include "firmware/board/g431/rcc.hpp"

namespace rotorloop::g431 {
namespace {

using namespace adc_bits;

constexpr std::uint32_t kTries = 100'000;
constexpr std::uint32_t kDmaRequestAdc1 = 5;  // DMAMUX input (RM0440, table 91)

// ADVREGEN and its 20 us, calibration, then ADEN again and again until ADRDY: set once right after a calibration it may be lost (errata).
AdcFault wake(AdcRegisters& adc) {
  adc.cr.write(0);  // out of deep power-down
  adc.cr.write(kRegulator);
  wait_for([&] { return !adc.cr.has(kRegulator); }, 2000);  // runs out: the regulator's start
  if (!adc.cr.has(kRegulator)) return AdcFault::regulator;
  adc.cr.write(kRegulator | kCalibrate);
  if (!wait_for([&] { return !adc.cr.has(kCalibrate); }, kTries)) return AdcFault::calibration;
  adc.isr.write(kReady);
  const bool ready = wait_for(
      [&] {
        adc.cr.set(kOn);
        return adc.isr.has(kReady);
      },
      kTries);
  return ready ? AdcFault::none : AdcFault::not_ready;
}

void sampling(AdcRegisters& adc, std::uint32_t channel, std::uint32_t code) {
  Register& smpr = channel < 10 ? adc.smpr1 : adc.smpr2;
  const unsigned at = 3u * (channel % 10u);
  smpr.change(field(7, at), field(code, at));
}

// The first result after a calibration, or long after the last one, may be wrong, or of channel 0 (errata): one is thrown away.
bool throw_one_away(AdcRegisters& adc, std::uint32_t channel) {
  adc.cfgr.write(kInjectedQueueOff | kOverwrite);
  adc.sqr1.write(field(channel, 6));
  adc.cr.set(kStart);
  return wait_for([&] { return adc.isr.has(kEndOfConversion); }, kTries) && (adc.dr.read(), true);
}

void start_dma(SlowSamples& into) {
  rcc().ahb1enr.set(rcc_bits::kDma1 | rcc_bits::kDmamux);
  DmaChannelRegisters& c = dma1().channel[0];
  dmamux().ccr[0].write(kDmaRequestAdc1);
  c.cndtr.write(static_cast<std::uint32_t>(sizeof(SlowSamples) / 2));
  c.cpar.write(static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(&adc1().dr)));
  c.cmar.write(static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(&into)));
  c.ccr.write(field(1, 10) | field(1, 8) | bit(7) | bit(5) | bit(0));  // half words, memory goes on, circular
}

void start_first(const AdcWiring& w, SlowSamples& into) {
  AdcRegisters& adc = adc1();
  sampling(adc, w.u_adc1, kFastSampling);
  sampling(adc, w.w_adc1, kFastSampling);
  sampling(adc, w.bus_adc1, kSlowSampling);
  sampling(adc, w.thermistor_adc1, kSlowSampling);
  sampling(adc, kVrefintChannel, kReferenceSampling);
  start_dma(into);
  adc.cfgr.write(kInjectedQueueOff | kOverwrite | kRisingEdge | kRegularByTrgo2 | kDma | kDmaCircular);
  adc.sqr1.write(4u | field(w.u_adc1, 6) | field(w.w_adc1, 12) | field(w.bus_adc1, 18) | field(w.thermistor_adc1, 24));
  adc.sqr2.write(kVrefintChannel);
  adc.jsqr.write(1u | kInjectedByTrgo | field(w.u_adc1, 9) | field(w.w_adc1, 15));
  adc.ier.write(kInjectedEnd);
}

void start_second(const AdcWiring& w) {
  AdcRegisters& adc = adc2();
  sampling(adc, w.v_adc2, kFastSampling);
  adc.cfgr.write(kInjectedQueueOff | kOverwrite | kRisingEdge | kRegularByTrgo2);
  adc.sqr1.write(field(w.v_adc2, 6));
  adc.jsqr.write(kInjectedByTrgo | field(w.v_adc2, 9));
}

}  // namespace

AdcFault start_adc(const AdcWiring& w, SlowSamples& into) {
  rcc().ahb2enr.set(rcc_bits::kAdc12);
  adc_common().ccr.write(kSynchronousQuarter | kVrefintOn);
  for (AdcRegisters* adc : {&adc1(), &adc2()}) {
    const AdcFault fault = wake(*adc);
    if (fault != AdcFault::none) return fault;
    if (!throw_one_away(*adc, adc == &adc1() ? w.u_adc1 : w.v_adc2)) return AdcFault::no_conversion;
  }
  start_first(w, into);
  start_second(w);
  for (AdcRegisters* adc : {&adc1(), &adc2()}) adc->cr.set(kStart | kInjectedStart);
  return AdcFault::none;
}

}  // namespace rotorloop::g431
