// What is wrong with one ESC as a box, unknown to its firmware and to the flight computer.
#pragma once
#include <cstdint>

namespace rotorloop::sim {

struct EscSetup {
  double speed_scale = 1.0;          // speed that it measures, holds and reports, over the true one
  double speed_noise_rad_s = 0.0;    // on the reported speed, standard deviation of each report
  std::int64_t report_delay_ns = 0;  // of all frames that it sends
  double lag_s = 0.0;                // above 0: speed follows the command as a first-order lag, in place of firmware and motor
};

}  // namespace rotorloop::sim
