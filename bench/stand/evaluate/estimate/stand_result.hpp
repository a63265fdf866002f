// What one run comes to, and what may be asked of it.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bench/stand/evaluate/estimate/coefficient.hpp"
#include "bench/stand/evaluate/estimate/motor_constants.hpp"
#include "bench/stand/evaluate/estimate/operating_points.hpp"
#include "bench/stand/evaluate/estimate/run_dynamics.hpp"
#include "bench/stand/evaluate/estimate/stand_run.hpp"

namespace rotorloop::stand {

struct EstimateOptions {
  std::optional<std::array<double, 2>> window_rad_s;  // where the coefficients are wanted; else all speeds of the run
  double reference_density_kg_m3 = 1.225;
  double inductance_H = 0.0;  // of one phase, where known: its drop stands across the voltage that makes torque
  int draws = 1000;           // of the bootstrap
  std::uint64_t seed = 1;
  std::set<std::string, std::less<>> accepted;  // checks of credibility.hpp that the user answers for
};

inline constexpr double kAicLoss = 6.0;  // evidence of 1 to 20 against a law (Burnham and Anderson 2002)

struct StandEstimate {
  std::string name;
  RunFacts facts;
  std::array<double, 2> window_rad_s{};
  double centre_rad_s = 0.0;
  std::optional<CoefficientEstimate> thrust, torque;
  std::vector<std::string> faults, remarks;
  std::size_t steps = 0, zeros = 0;
  // Derived, where diameter and density are known; u relative is that of the coefficients.
  double C_T = kNotMeasured, C_Q = kNotMeasured, C_P = kNotMeasured, figure_of_merit = kNotMeasured;
  double reduced_c_t = kNotMeasured, reduced_c_q = kNotMeasured;  // at the reference density
  double grams_per_watt = kNotMeasured;                           // electrical, at the middle
  std::vector<OperatingPoint> points;                             // each step that turns in still air
  std::optional<MotorConstants> motor;
  std::optional<RunDynamics> dynamics;
  SampleSeries samples;  // as they were read, to be drawn; empty where the file has steps only
};

}  // namespace rotorloop::stand
