// What the checks of a stand file leave.
#pragma once
#include <string>
#include <vector>

#include "bench/stand/evaluate/stand_file.hpp"

namespace rotorloop::stand {

enum class StandChannelState { absent, good, faulty };  // faulty: no coefficient from it is to be trusted

struct StandFault {
  std::string channel;       // "rotor 1 speed", "thrust", "torque"
  std::string what;          // in words, with figures and units
  std::string likely;        // cause; may be empty
  bool zero = false;         // the channel's constant: what a fit with a constant of its own may allow for
  double beyond_rest = 0.0;  // of such a constant: how far it is from the reading at rest, of the largest reading
};

struct CheckedStand {
  StandRecord record;  // points that may be fitted; thrust and torque positive
  StandChannelState speed = StandChannelState::good, thrust = StandChannelState::absent, torque = StandChannelState::absent;
  std::vector<StandFault> faults;
  std::vector<std::string> notes;                                       // tolerated: signs turned, points left out
  double thrust_sign = 1.0, torque_sign = 1.0;                          // -1: turned
  double rest_thrust_N = kNotMeasured, rest_torque_N_m = kNotMeasured;  // with the rotors at rest, when the file has that
};

}  // namespace rotorloop::stand
