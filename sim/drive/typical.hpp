// One drawn board and motor: what differs from the drawing on every real one, by the spread that parts and processes have. Every
// range is typical data; none is known to the firmware.
#pragma once
#include "host/base/random.hpp"
#include "sim/drive/drive.hpp"

namespace rotorloop::sim {

struct TypicalDrive {
  DriveParameters drive;
  double clock_ppm = 0.0;  // of its crystal: +-50 with all tolerances and ageing
  double pwm_phase = 0.0;  // 0..1 of a sample period, against the other ESCs
};

// `nominal`: motor as its file says, stage as the board's name says. Drawn, uniformly unless said:
//   effective dead time 5/8 to 11/8 of the board's (500 to 1 100 ns for 800), node capacitance 2 to 6 nF at 45 A, by current
//   L_q/L_d 1.0 to 1.4, their mean kept; knee of the saturation at 1 to 2 times flux/L, inductance at the end 60 to 90 %
//   current gains 1 %, offsets 12 counts standard deviation; drift +-20 counts in 3 to 10 s; reference and divider +-1 %
//   one nonsense conversion in 4 s on average
// Temperatures follow the losses, scaled to the motor's size by its motor constant.
TypicalDrive typical_drive(const DriveParameters& nominal, double most_phase_A, const RandomStream& random);

}  // namespace rotorloop::sim
