// Measured propeller coefficients of the UIUC database: static thrust and power over rotor speed, and sweeps of the advance ratio.
// C_T = T / (rho n^2 D^4), C_P = P / (rho n^3 D^5), J = V / (n D), n in revolutions per second, D the diameter.
#pragma once
#include <vector>

#include "bench/propeller/text_file.hpp"

namespace rotorloop::propeller {

struct MeasuredRow {
  double rpm;
  double j;  // 0: static
  double ct, cp;
};

// RPM CT CP, rising RPM.
std::vector<MeasuredRow> read_uiuc_static(const TextFile& file);
// J CT CP eta; the file does not say the rotor speed, its name does. eta must be J CT / CP as far as the digits go: it detects
// swapped columns.
std::vector<MeasuredRow> read_uiuc_sweep(const TextFile& file, double rpm);

}  // namespace rotorloop::propeller
