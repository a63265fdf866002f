// A run on a thrust stand with known errors, written apart from the estimator: the rotor is the blade-element model, the motor a sine
// drive, and between them and the file stands a measuring chain whose errors are drawn anew for every seed. The file tells the
// estimator standard uncertainties alone, never what was drawn.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "sim/rotor/blade.hpp"

namespace rotorloop::test {

struct SimulatedStandOptions {
  double centre_rad_s = 942.5;  // 9000 RPM
  double thrust_lost = 0.0;     // share that a strut behind the rotor takes
  bool steps = true, chirp = false;
  bool errors = true;  // false: a chain without any, for what the truth is
};

struct StandTruth {
  double c_t_N_s2 = 0.0, c_q_N_m_s2 = 0.0;  // at the centre and the reference density
  double speed_constant_rpm_V = 0.0, resistance_ohm = 0.0, inertia_kg_m2 = 0.0, up_s = 0.0, down_s = 0.0;
};

inline constexpr double kSimulatedDensity_kg_m3 = 1.2;

class SimulatedStand {
 public:
  explicit SimulatedStand(const sim::Blade& blade);  // tabulates thrust and torque over speed

  StandTruth truth(const SimulatedStandOptions& options) const;
  // Writes samples.csv and run.toml into `folder`.
  void write_run(const std::filesystem::path& folder, const SimulatedStandOptions& options, std::uint64_t seed) const;

 private:
  double table(const std::vector<double>& over_square, double omega_rad_s) const;
  double radius_m_;
  std::vector<double> thrust_N_s2_, torque_N_m_s2_;
};

}  // namespace rotorloop::test
