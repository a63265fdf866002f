// What start.cpp gives to main.cpp.
#pragma once

namespace rotorloop::b_g431b_esc1 {

[[noreturn]] void reset_chip();

}  // namespace rotorloop::b_g431b_esc1
