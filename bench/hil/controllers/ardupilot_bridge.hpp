// ArduPilot's simulator (ArduCopter, JSON backend) as a controller. Built from the documented packets and flown by a stand-in alone:
// not run here with ArduPilot itself.
#pragma once
#include <string>

namespace rotorloop::hil {

// As serve_betaflight(); the program is named by ROTORLOOP_ARDUPILOT.
int serve_ardupilot();
// The parameters that it is started with.
std::string ardupilot_parameters();

}  // namespace rotorloop::hil
