// The three files of the program share these: the board, and the motor side that the sample interrupt runs.
#pragma once
#include "firmware/app/b_g431b_esc1/board.hpp"
#include "firmware/app/esc_application.hpp"

namespace rotorloop::firmware {
// Compiled for size in commissioning.cpp; the interrupt calls it while somebody commissions and at no other time.
extern template class Commissioning<b_g431b_esc1::EscBoard>;
}  // namespace rotorloop::firmware

namespace rotorloop::b_g431b_esc1 {

using Control = firmware::EscControl<EscBoard>;
extern EscBoard the_board;
extern Control* the_control;  // before it is set no interrupt is allowed

}  // namespace rotorloop::b_g431b_esc1
