// Two configurations of a stand measured in turn (A B A B …) at the same speeds: what B takes of the coefficient, from pairs of neighbours,
// so that whatever drifts slowly falls out.
#pragma once
#include <optional>
#include <vector>

namespace rotorloop::stand_run {

struct PairedStep {
  char configuration = 'A';
  double wanted_rad_s = 0.0;                        // 0: a zero; neighbours are compared at the same wanted speed
  double t_s = 0.0, omega_rad_s = 0.0, load = 0.0;  // load: thrust or torque, any zero
};

struct PairedDifference {
  double share = 0.0;                     // 1 - c_B / c_A
  double u = 0.0, low = 0.0, high = 0.0;  // standard error over pairs, 95 % interval (Student)
  std::size_t pairs = 0;
};

// In the order of time. Nothing for fewer than two pairs, or without zeros in each block.
std::optional<PairedDifference> paired_difference(const std::vector<PairedStep>& steps);

}  // namespace rotorloop::stand_run
