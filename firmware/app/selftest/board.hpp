// The board of the self-test: that of the product, whose bridge the motor control alone does not reach.
#pragma once
#include "firmware/app/b_g431b_esc1/board.hpp"
#include "firmware/app/esc_control.hpp"

namespace rotorloop::selftest {

// The product's interrupt runs on it to be timed, with the bridge off whatever it asks for. Its name ends as the linker script wants it.
class QuietEscBoard : public b_g431b_esc1::EscBoard {
 public:
  void bridge_on() noexcept {}
  void gates_on(std::uint8_t) noexcept {}
};
static_assert(firmware::EscBoard<QuietEscBoard>);

extern QuietEscBoard the_board;

}  // namespace rotorloop::selftest
