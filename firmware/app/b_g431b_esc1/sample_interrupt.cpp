// The interrupt of the converters, 24 000 times a second: motor control. Compiled for speed; what runs in every period lies in CCM
// (link.ld).
#include "firmware/app/b_g431b_esc1/program.hpp"

using namespace rotorloop;
using namespace rotorloop::b_g431b_esc1;

extern "C" {

void sample_interrupt();

void sample_interrupt() {
  g431::adc1().isr.write(g431::adc_bits::kInjectedEnd);
  the_control->on_sample(the_board);
  g431::feed_wwdg();  // last: an interrupt that does not end is one that has stopped
}

}  // extern "C"
