// Operating points of motor, ESC and propeller as a motor's data sheet prints them: thrust, current, power and what they cost each other,
// over rotor speed and over the voltage that the motor was given.
#pragma once
#include <vector>

#include "bench/stand/evaluate/estimate/coefficient.hpp"
#include "bench/stand/evaluate/estimate/motor_constants.hpp"
#include "bench/stand/evaluate/estimate/stand_run.hpp"

namespace rotorloop::stand {

// Of one rotor; not-a-number where it was not measured. Thrust and torque are the rotor's own: without zero, drift, running offset and
// hysteresis of the stand, as the joint fit has them.
struct OperatingPoint {
  double omega_rad_s = 0.0;
  double thrust_N = kNotMeasured, torque_N_m = kNotMeasured;
  double supply_V = kNotMeasured, current_A = kNotMeasured;  // of the supply
  double motor_V = kNotMeasured;                             // amplitude between two lines: a supply of less cannot hold this point
  double electrical_W() const { return supply_V * current_A; }
  double shaft_W() const { return torque_N_m * omega_rad_s; }
  double thrust_g() const;  // grams of force, 9.80665 m/s²
  double grams_per_watt() const { return thrust_g() / electrical_W(); }
  double newtons_per_ampere() const { return thrust_N / current_A; }
  double drive_efficiency() const { return shaft_W() / electrical_W(); }  // of motor and ESC together
};

// The measured value of a row without what the fit takes for zero, running offset, drift and hysteresis; N or N m.
double of_rotor_alone(const CoefficientEstimate& c, Eigen::Index row);

// Steps that turn in still air, in the order of the run. Either coefficient may be missing.
std::vector<OperatingPoint> operating_points(const StandRun& run, const CoefficientEstimate* thrust, const CoefficientEstimate* torque);

// Means over steps of like speed, slowest first: the rows of a table. At most `kMostLevels`.
inline constexpr std::size_t kMostLevels = 24;
std::vector<OperatingPoint> levels_of(std::vector<OperatingPoint> points);

}  // namespace rotorloop::stand
