#include "firmware/core/commission/commissioning.hpp"

#include "firmware/app/b_g431b_esc1/board.hpp"

template class rotorloop::firmware::Commissioning<rotorloop::b_g431b_esc1::EscBoard>;
