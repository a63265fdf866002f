// Cycles of the product's sample interrupt by the core's own counter: the same code at the same places (link.ld), with the bridge off.
// Entry and return of the exception, 22 cycles, are not in it; on the emulated chip they are in the figure of docs/acceptance/silicon.md.
#include "firmware/app/selftest/checks.hpp"
#include "firmware/board/g431/cortex.hpp"

using namespace rotorloop;
using namespace rotorloop::selftest;

namespace {

struct Cycles {
  volatile std::uint32_t count = 0, sum = 0, most = 0;
};
Cycles cycles;
firmware::EscControl<QuietEscBoard>* control = nullptr;

}  // namespace

extern "C" {

void sample_interrupt();

void sample_interrupt() {
  const std::uint32_t begun = g431::dwt().cyccnt.read();
  g431::adc1().isr.write(g431::adc_bits::kInjectedEnd);
  control->on_sample(the_board);
  const std::uint32_t passed = g431::dwt().cyccnt.read() - begun;
  cycles.count = cycles.count + 1;
  cycles.sum = cycles.sum + passed;
  if (passed > cycles.most) cycles.most = passed;
}

}  // extern "C"

namespace rotorloop::selftest {

// 100 ms are 2 400 periods: 1 percent more or less and the converters or their trigger are not what they should be.
void check_interrupt(Report& report) {
  static firmware::EscControl<QuietEscBoard> product{firmware::Parameters{}};
  control = &product;
  g431::enable_interrupt(g431::kIrqAdc12, 1);
  g431::allow_interrupts();
  wait_us(100'000);
  g431::nvic().icer[0].write(g431::bit(g431::kIrqAdc12));
  const std::uint32_t count = cycles.count;
  report.tell({"samples", static_cast<std::int32_t>(count), 2376, 2424, "per 0.1 s"});
  report.tell({"path_mean", static_cast<std::int32_t>(count == 0 ? 0 : cycles.sum / count), 1500, 2700, "cycles"});
  report.tell({"path_longest", static_cast<std::int32_t>(cycles.most), 1500, 3600, "cycles"});
}

}  // namespace rotorloop::selftest
