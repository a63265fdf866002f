// What is wrong with a stand's file, reported before any fit: a coefficient through a speed sensor that counts every pole twice, or
// through a load cell with a wrong zero, looks like physics. Judged by the file's own figures alone.
#pragma once
#include "bench/stand/evaluate/checked_stand.hpp"

namespace rotorloop::stand {

CheckedStand check_stand(StandRecord record);

// The zero of thrust or torque: both proportional to speed squared, give or take some per cent of speed exponent; a constant that
// does far better than any exponent is none of the rotor's. Adds a fault and marks the channel.
void check_zero(CheckedStand& stand, StandQuantity channel);

}  // namespace rotorloop::stand
