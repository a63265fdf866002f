// The register blocks as plain memory, with what hardware does by itself played on each access: ready flags follow their enable bits,
// counters count. Records the writes in their order.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "firmware/board/g431/adc.hpp"
#include "firmware/board/g431/cortex.hpp"
#include "firmware/board/g431/fdcan_registers.hpp"
#include "firmware/board/g431/flash.hpp"
#include "firmware/board/g431/gpio.hpp"
#include "firmware/board/g431/information.hpp"
#include "firmware/board/g431/opamp.hpp"
#include "firmware/board/g431/pwr.hpp"
#include "firmware/board/g431/rcc.hpp"
#include "firmware/board/g431/timer.hpp"
#include "firmware/board/g431/usart.hpp"
#include "firmware/board/g431/watchdog.hpp"

namespace rotorloop::g431 {

struct Write {
  const Register* at;
  std::uint32_t value;
};

class ChipFake : public ::testing::Test {
 protected:
  ChipFake() {
    clear(rcc(), pwr(), syscfg(), dbgmcu(), gpio_a(), gpio_b(), gpio_c(), scb(), nvic(), mpu(), flash_registers(), fdcan(), fdcan_memory());
    clear(tim1(), tim2(), iwdg(), wwdg(), usart2(), opamp(), adc1(), adc2(), adc_common(), dma1(), dmamux(), vrefint_word());
    std::fill_n(flash_memory(), kFlashBytes, std::uint8_t{0xFF});
    flash_registers().cr.hardware(flash_bits::kLock);
    register_hook = {
        this, [](void* self, const Register& r) { static_cast<ChipFake*>(self)->reads(const_cast<Register&>(r)); },
        [](void* self, const Register& r, std::uint32_t v) { static_cast<ChipFake*>(self)->written(const_cast<Register&>(r), v); }};
  }
  ~ChipFake() override { register_hook = {}; }

  template <class... Blocks>
  static void clear(Blocks&... blocks) {
    const auto zero = [](auto& block) {
      auto* r = reinterpret_cast<Register*>(&block);
      for (std::size_t i = 0; i < sizeof block / 4; ++i) r[i].hardware(0);
    };
    (zero(blocks), ...);
  }

  void reads(Register& r) {
    if (&r == &tim2().cnt) r.hardware(r.peek() + 1);  // each look takes a microsecond
    for (AdcRegisters* adc : {&adc1(), &adc2()}) {
      if (&r == &adc->isr && converters_answer)
        r.hardware(r.peek() | ((adc->cr.peek() & adc_bits::kOn) != 0 ? adc_bits::kReady : 0u) |
                   ((adc->cr.peek() & adc_bits::kStart) != 0 ? adc_bits::kEndOfConversion : 0u));
    }
  }
  void written(Register& r, std::uint32_t value) {
    writes.push_back({&r, value});
    if (&r == &rcc().cr) {
      if (crystal_starts && (value & rcc_bits::kHseOn) != 0) value |= rcc_bits::kHseReady;
      if ((value & rcc_bits::kPllOn) != 0) value |= rcc_bits::kPllReady;
      r.hardware(value);
    }
    if (&r == &rcc().cfgr) r.hardware((value & ~12u) | (value & 3u) << 2u);
    for (AdcRegisters* adc : {&adc1(), &adc2()}) {
      if (&r == &adc->cr && converters_answer) r.hardware(value & ~adc_bits::kCalibrate);
    }
    if (&r == &fdcan().txbar) fdcan().txbrp.hardware(fdcan().txbrp.peek() | value);
    if (&r == &fdcan().rxf0a) fdcan().rxf0s.hardware(0);  // the one frame is taken
    if (&r == &flash_registers().sr) r.hardware(0);       // flags are cleared by ones
    if (on_write) on_write(r, value);
  }

  // The first write of the record, from `from` on, that fits; the record's size when none does.
  template <class Fits>
  std::size_t first(Fits&& fits, std::size_t from = 0) const {
    return static_cast<std::size_t>(std::find_if(writes.begin() + static_cast<std::ptrdiff_t>(from), writes.end(), fits) - writes.begin());
  }
  std::size_t first_with(const Register& r, std::uint32_t bits, std::size_t from = 0) const {
    return first([&](const Write& w) { return w.at == &r && (w.value & bits) == bits; }, from);
  }

  std::vector<Write> writes;
  std::function<void(Register&, std::uint32_t)> on_write;
  bool crystal_starts = true, converters_answer = true;
};

}  // namespace rotorloop::g431
