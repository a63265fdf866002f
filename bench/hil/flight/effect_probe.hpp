// How large an effect is at one defined point, against the size that measurements or theory give: the plant in a virtual wind
// tunnel, with the effect and without it. A probe outside twice or half the reference is a miss.
#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bench/hil/flight/flight.hpp"
#include "sim/effects/effect_set.hpp"

namespace rotorloop::hil {

// A point of the tunnel. Level attitude; heights from the ground of the plant.
struct ProbePoint {
  Eigen::Vector3d v_B_m_s = Eigen::Vector3d::Zero();  // through still air
  Eigen::Vector3d w_B_rad_s = Eigen::Vector3d::Zero();
  double omega_rad_s = 0.0;  // 0: hover thrust at this velocity, without the effect
  std::array<double, 4> speed_ratio{1.0, 1.0, 1.0, 1.0};
  double omega_dot_1_rad_s2 = 0.0;  // of rotor 1
  double disk_z_m = 2.0;            // height of the rotor disks
  double speed_step = 0.0;          // share by which all speeds jump once all is settled; on the launch stand, so at rest
};

struct ProbeLoads {
  Eigen::Vector3d force_B_N = Eigen::Vector3d::Zero(), moment_B_N_m = Eigen::Vector3d::Zero();  // all, weight apart
  std::array<sim::RotorLoads, 4> rotor{};
  std::array<double, 4> thrust_after_step_N{};  // of all rotors, 0, 0.5, 1 and 1.5 ms after the jump; zero without one
};

// Loads on the plant at the point, effects included, rotors settled. `effects` replaces those of the plant file.
ProbeLoads loads_at(const Inputs& inputs, const std::vector<sim::PlantEffect>& effects, const ProbePoint& point);

struct Probe {
  std::string_view effect;
  std::string_view source;  // number of the survey or library that gives the size
  std::string_view where;   // the point, and what is compared, in words
  std::string_view unit;
  double low = 0.0, high = 0.0;  // reference; equal when it is one number
  ProbePoint point;
  double (*size)(const ProbeLoads& with, const ProbeLoads& without);
  std::optional<double> value = {};  // of the parameter, when the reference is not for the typical value
  std::string_view deviation = {};   // why the plant is known to be outside; such a probe is reported and not counted
};
const std::vector<Probe>& probes();

struct ProbeResult {
  std::string effect, source, where, unit;
  double value = 0.0;  // of the effect's parameter
  double low = 0.0, high = 0.0, measured = 0.0;
  double ratio = 0.0;     // to the nearest point of the reference; 1 inside it
  bool within = false;    // ratio from 1/2 to 2
  std::string deviation;  // Probe::deviation
  bool missed() const { return !within && deviation.empty(); }
};

inline constexpr double kProbeFactor = 2.0;

// All probes of these effects, in the order of the table.
std::vector<ProbeResult> probe_effects(const Inputs& inputs, const std::vector<const sim::EffectInfo*>& effects);

}  // namespace rotorloop::hil
