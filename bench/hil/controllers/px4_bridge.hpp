// PX4's simulator build as a controller, over its MAVLink interface for simulators. Built from the documented messages and flown by a
// stand-in alone: not run here with PX4 itself.
#pragma once

namespace rotorloop::hil {

// As serve_betaflight(); ROTORLOOP_PX4 names a program or script that starts PX4 with this interface.
int serve_px4();

}  // namespace rotorloop::hil
