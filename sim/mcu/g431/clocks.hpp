// Frequencies of the chip's clock tree as RCC has set them, and how times of other clocks become cycles of HCLK.
#pragma once
#include <array>
#include <cstdint>

namespace rotorloop::mcu::g431 {

struct Clocks {
  uint32_t hse_Hz = 8'000'000;  // the board's crystal; 0: none
  uint32_t lse_Hz = 0;
  uint32_t sysclk_Hz = 16'000'000, hclk_Hz = 16'000'000, pclk1_Hz = 16'000'000, pclk2_Hz = 16'000'000;
  uint32_t tim1_Hz = 16'000'000;        // kernel of the timers on APB1 (2, 3, 4, 6, 7)
  uint32_t tim2_Hz = 16'000'000;        // … and on APB2 (1, 8, 15, 16, 17)
  uint32_t pll_p_Hz = 0, pll_q_Hz = 0;  // 0: off
  uint32_t adc_Hz = 0;                  // asynchronous clock of the ADCs; 0: none chosen
  uint32_t fdcan_Hz = 0;                // 0: none chosen, or off
  uint32_t rtc_Hz = 0;
  std::array<uint32_t, 6> usart_Hz{16'000'000, 16'000'000, 16'000'000, 16'000'000, 0, 16'000'000};  // USART1 to 3, UART4, -, LPUART1
  bool operator==(const Clocks&) const = default;
};
inline constexpr uint32_t kHsi_Hz = 16'000'000, kLsi_Hz = 32'000, kHsi48_Hz = 48'000'000;

// Cycles of HCLK that `ticks` of another clock take, and the ticks in so many cycles. Exact to one cycle over a day.
inline uint64_t cycles_of(uint64_t ticks, uint32_t tick_Hz, uint32_t hclk_Hz) {
  return static_cast<uint64_t>((static_cast<unsigned __int128>(ticks) * hclk_Hz + tick_Hz - 1) / tick_Hz);
}
inline uint64_t ticks_in(uint64_t cycles, uint32_t tick_Hz, uint32_t hclk_Hz) {
  return static_cast<uint64_t>(static_cast<unsigned __int128>(cycles) * tick_Hz / hclk_Hz);
}

}  // namespace rotorloop::mcu::g431
