// Points whose rotor speed was misread: a sensor that counted twice, missed every other mark, or slipped. Thrust and torque over speed
// squared change little over the speeds of a propeller, so that such a point stands off in both by the square of the factor.
#pragma once
#include "bench/stand/evaluate/checked_stand.hpp"

namespace rotorloop::stand {

// Takes such points out of a stand with one rotor and names them; where they are more than a quarter, the speed is faulty. Looked at before
// any fit, for a doubled speed has four times the weight of its neighbours there.
void check_misread_speed(CheckedStand& stand);

}  // namespace rotorloop::stand
