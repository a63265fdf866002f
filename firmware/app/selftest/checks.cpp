#include "firmware/app/selftest/checks.hpp"

#include "firmware/board/g431/cortex.hpp"
#include "firmware/board/g431/flash.hpp"
#include "firmware/board/g431/pwr.hpp"

namespace rotorloop::selftest {
namespace {

using firmware::B_G431B_ESC1_Scales;

// Of millivolts at a converter's pin, at a supply of 3.3 V.
constexpr std::int32_t counts(std::int32_t mV) { return (mV * 4096 + 1650) / 3300; }

// The bus behind its divider of 18 k and 169 k.
constexpr std::int32_t kBus_mV = kSupply_mV * 18 / (18 + 169);
// A room of 10 to 40 C by the straight line of the board's constants.
constexpr std::int32_t thermistor_mV(std::int32_t celsius) { return 1400 + 19 * (celsius - 25); }

// The frame of the loop back: 128 bits, none of them stuffed, and 3 to the next one.
constexpr CanFrame kLoopFrame{.id = 0x15555555, .extended = true, .length = 8, .data = {0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55}};
constexpr std::uint32_t kTries = 20'000;  // more than 1 ms; a frame takes 131 us
constexpr std::int32_t kLoopBits = 131, kLoopFrames = 8;

void begin_loop_back() {
  g431::FdcanRegisters& f = g431::fdcan();
  f.cccr.set(g431::fdcan_bits::kInit);
  g431::wait_for([&] { return f.cccr.has(g431::fdcan_bits::kInit); }, kTries);
  f.cccr.set(g431::fdcan_bits::kConfigure);
  f.cccr.set(g431::fdcan_bits::kTest | g431::fdcan_bits::kMonitor);
  f.test.write(g431::fdcan_bits::kLoopBack);
  f.cccr.clear(g431::fdcan_bits::kInit);
  g431::wait_for([&] { return !f.cccr.has(g431::fdcan_bits::kInit); }, kTries);
}

// Cycles from the arrival of one frame to that of the next; 0: none came, or another.
std::uint32_t loop_once() {
  while (the_board.can().receive()) {
  }
  std::uint32_t arrived[2]{};
  for (int n = 0; n < 2; ++n) {
    if (!the_board.can().send(kLoopFrame)) return 0;
  }
  for (std::uint32_t& at : arrived) {
    if (!g431::wait_for([] { return (g431::fdcan().rxf0s.read() & 0xFu) != 0; }, kTries)) return 0;
    at = g431::dwt().cyccnt.read();
    the_board.on_can_interrupt();
    const auto received = the_board.can().receive();
    if (!received || received->frame != kLoopFrame) return 0;
  }
  return arrived[1] - arrived[0];
}

}  // namespace

void wait_us(std::uint32_t us) {
  const std::uint64_t until = the_board.time_us() + us;
  while (the_board.time_us() < until) g431::feed_iwdg();
}

void check_chip(Report& report, b_g431b_esc1::StartReport start) {
  const g431::OptionBytes options = g431::read_options();
  report.tell({"clocks", static_cast<std::int32_t>(start.clocks), 0, 0, "code"});
  report.tell({"converters", static_cast<std::int32_t>(start.adc), 0, 0, "code"});
  report.tell({"wait_states", static_cast<std::int32_t>(g431::flash_registers().acr.read() & 15u), 4, 4, "cycles"});
  const bool boost = !g431::pwr().cr5.has(g431::pwr_bits::kNotBoost);
  report.tell({"boost", boost ? 1 : 0, 1, 1, "on"});
  report.tell({"brown_out", static_cast<std::int32_t>((options.optr & g431::kBorMask) >> 8u), 4, 4, "level"});
  report.tell({"button", the_board.button() ? 1 : 0, 0, 0, "pressed"});
}

void check_converters(Report& report) {
  const auto reference = static_cast<std::int32_t>(g431::vrefint_calibration() * 30u / 33u);
  report.tell({"vrefint", the_board.reference_counts(), reference * 97 / 100, reference * 103 / 100, "counts"});
  report.tell({"ntc", the_board.adc().temperature, counts(thermistor_mV(10)), counts(thermistor_mV(40)), "counts"});
  report.tell({"vbus", the_board.adc().bus, counts((kBus_mV * 98 + 50) / 100), counts((kBus_mV * 102 + 50) / 100), "counts"});
  constexpr auto kZero = static_cast<std::int32_t>(B_G431B_ESC1_Scales::kCurrentZero_counts),
                 kTolerance = static_cast<std::int32_t>(B_G431B_ESC1_Scales::kCurrentZeroTolerance_counts);
  std::int32_t sum[3]{};
  for (int n = 0; n < 16; ++n) {
    wait_us(50);  // more than a sample period
    const firmware::AdcCounts c = the_board.adc();
    for (std::size_t k = 0; k < 3; ++k) sum[k] += c.phase[k];
  }
  constexpr const char* kNames[3]{"zero_u", "zero_v", "zero_w"};
  for (std::size_t k = 0; k < 3; ++k) report.tell({kNames[k], sum[k] / 16, kZero - kTolerance, kZero + kTolerance, "counts"});
}

// Inside the controller; nothing reaches the pin. The controller is left where start() takes it from.
CanLoop loop_back() {
  begin_loop_back();
  CanLoop loop;
  for (std::int32_t n = 0; n < kLoopFrames / 2; ++n) {
    const std::uint32_t one = loop_once();
    loop.cycles += one;
    loop.frames += one != 0 ? 2 : 0;
  }
  g431::fdcan().cccr.set(g431::fdcan_bits::kInit);
  g431::fdcan().cccr.clear(g431::fdcan_bits::kTest | g431::fdcan_bits::kMonitor);
  return loop;
}

// Crystal and PLL make core and bits alike: a bit of 1 us is 170 cycles of the core. Whether it is 1 us, an oscilloscope says at the pin.
void check_can_loop(Report& report, const CanLoop& loop) {
  report.tell({"can_loop", loop.frames, kLoopFrames, kLoopFrames, "frames"});
  const std::int32_t bits = kLoopBits * (kLoopFrames / 2);
  report.tell({"can_bit", (static_cast<std::int32_t>(loop.cycles) + bits / 2) / bits, 170, 170, "cycles"});
}

}  // namespace rotorloop::selftest
