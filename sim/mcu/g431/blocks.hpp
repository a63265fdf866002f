// Every register block that is built, in the order in which events of one cycle are taken; and what is not built, by name.
#pragma once
#include <span>

#include "sim/mcu/g431/adc.hpp"
#include "sim/mcu/g431/analogue.hpp"
#include "sim/mcu/g431/cordic.hpp"
#include "sim/mcu/g431/dma.hpp"
#include "sim/mcu/g431/exti.hpp"
#include "sim/mcu/g431/fdcan/fdcan.hpp"
#include "sim/mcu/g431/flash.hpp"
#include "sim/mcu/g431/gpio.hpp"
#include "sim/mcu/g431/rcc.hpp"
#include "sim/mcu/g431/system.hpp"
#include "sim/mcu/g431/timer.hpp"
#include "sim/mcu/g431/usart.hpp"
#include "sim/mcu/g431/watchdog.hpp"

namespace rotorloop::mcu::g431 {

struct Blocks {
  explicit Blocks(Wires& wires) : w(wires) {}
  template <class Visit>
  void visit(Visit&& visit) {
    for (Block* block : std::initializer_list<Block*>{&pwr, &rcc, &syscfg, &exti, &iwdg, &wwdg, &rtc, &tamp, &dbgmcu, &crc, &cordic})
      visit(*block);
    for (Block& block : timers) visit(block);
    for (Block* block : std::initializer_list<Block*>{&dac1, &dac3, &opamp, &comp, &adc_common, &adc1, &adc2, &dmamux, &dma1, &dma2})
      visit(*block);
    for (Block* block : std::initializer_list<Block*>{&flash, &message_ram, &fdcan}) visit(*block);
    for (Block& block : usarts) visit(block);
    for (Block& block : ports) visit(block);
  }
  Timer& timer(uint32_t number) {
    for (uint32_t n = 0; n < timers.size(); ++n)
      if (kTimers[n] == number) return timers[n];
    return timers[0];
  }
  Gpio& port_of(uint32_t pin) { return ports[pin / 16]; }

  Wires& w;
  Pwr pwr{w};
  Rcc rcc{w, pwr};
  Syscfg syscfg{w};
  Exti exti{w, syscfg};
  Iwdg iwdg{w};
  Wwdg wwdg{w};
  Rtc rtc{w, pwr};
  Tamp tamp{w, pwr};
  Dbgmcu dbgmcu{w};
  Crc crc{w};
  Cordic cordic{w};
  std::array<Timer, 10> timers{Timer{w, timer_kinds()[0]}, Timer{w, timer_kinds()[1]}, Timer{w, timer_kinds()[2]},
                               Timer{w, timer_kinds()[3]}, Timer{w, timer_kinds()[4]}, Timer{w, timer_kinds()[5]},
                               Timer{w, timer_kinds()[6]}, Timer{w, timer_kinds()[7]}, Timer{w, timer_kinds()[8]},
                               Timer{w, timer_kinds()[9]}};
  Dac dac1{w, 1}, dac3{w, 3};
  Opamp opamp{w, dac3};
  Comp comp{w, dac1, dac3};
  AdcCommon adc_common{w};
  Adc adc1{w, 1, adc_common, opamp}, adc2{w, 2, adc_common, opamp};
  Dmamux dmamux{w};
  Dma dma1{w, dmamux, 1}, dma2{w, dmamux, 2};
  Flash flash{w};
  MessageRam message_ram{w};
  Fdcan fdcan{w, message_ram};
  std::array<Usart, 5> usarts{Usart{w, 1}, Usart{w, 2}, Usart{w, 3}, Usart{w, 4}, Usart{w, 6}};
  std::array<Gpio, 7> ports{Gpio{w, 0}, Gpio{w, 1}, Gpio{w, 2}, Gpio{w, 3}, Gpio{w, 4}, Gpio{w, 5}, Gpio{w, 6}};
};

struct NotBuilt {
  const char* name;
  uint32_t base, size_bytes;
};
std::span<const NotBuilt> not_built();

}  // namespace rotorloop::mcu::g431
