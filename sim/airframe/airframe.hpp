// The rigid body of the plant: six degrees of freedom under rotor loads, parasitic drag, gravity and further loads on the body.
//
// Loop of one step (one evaluation of the blade-element model per rotor):
//   for each rotor i:  loads[i] = bem(airframe.rotor_condition(i, omega[i], air));   // at the start of the step
//   the drives turn omega[i] over the step; omega_dot[i] = their mean angular acceleration over it;
//   airframe.step(loads, omega at the start, omega_dot, air, body_loads);
// sim/plant/flight_dynamics.hpp does this, with the effects of the plant.
//
// Equations: m dv/dt = R f_B + m g;  I dOmega/dt = tau - Omega x I Omega (paper eq. 7, written correctly);
// dq/dt = q (x) (0, Omega) / 2.  Hubs are given from the geometric centre; moments are taken about the centre of mass.
// Integrator: classical Runge-Kutta over the step. Rotor loads are continued linearly from the last two evaluations (as in
// the two-step Adams-Bashforth rule), so that the whole is of second order in the step at one evaluation per step.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <span>

#include "host/base/constants.hpp"
#include "sim/airframe/body_loads.hpp"
#include "sim/airframe/parasitic_drag.hpp"
#include "sim/rotor/rotor_loads.hpp"

namespace rotorloop::sim {

inline constexpr std::size_t kAirframeRotors = 4;  // 1 front-right, 2 rear-left, 3 front-left, 4 rear-right
struct RotorMount {
  Eigen::Vector3d hub_m = Eigen::Vector3d::Zero();  // from the geometric centre, axes of B
  int spin = 1;                                     // +1: counter-clockwise seen from above, reaction on the body along -z
  // R_BR = Rx(tilt[0]) Ry(tilt[1]): positive tilt[0] leans the thrust to the right (-y), positive tilt[1] forward (+x).
  Eigen::Vector2d tilt_rad = Eigen::Vector2d::Zero();
  double spin_inertia_kg_m2 = 0.0;  // bell, shaft and blades about the shaft
};

struct AirframeConfig {
  double mass_kg = 0.0;
  Eigen::Matrix3d inertia_kg_m2 = Eigen::Matrix3d::Zero();  // about the centre of mass, axes of B, rotors at rest included
  Eigen::Vector3d com_offset_m = Eigen::Vector3d::Zero();   // centre of mass, from the geometric centre
  // Coefficients of parasitic_drag.hpp, at density_kg_m3; the force acts at the centre of mass.
  double drag_xy_N_s2_m2 = 0.0;
  double drag_z_N_s2_m2 = 0.0;
  std::array<RotorMount, kAirframeRotors> rotors{};
  double density_kg_m3 = 1.225;
  Eigen::Vector3d wind_W_m_s = Eigen::Vector3d::Zero();
  double gravity_m_s2 = kGravity_m_s2;
  std::int64_t step_ns = 500'000;  // 2 kHz; not above
  double ground_z_m = 0.0;         // the flight is over when the centre of mass is below this height

  ParasiticDrag drag() const { return {drag_xy_N_s2_m2, drag_z_N_s2_m2, density_kg_m3}; }
};

struct AirframeState {
  std::int64_t time_ns = 0;
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();  // centre of mass
  Eigen::Vector3d v_W_m_s = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d w_B_rad_s = Eigen::Vector3d::Zero();
  // What an accelerometer at the centre of mass feels: mean over the last step, +g on z at rest.
  Eigen::Vector3d specific_force_B_m_s2 = Eigen::Vector3d(0.0, 0.0, kGravity_m_s2);
};

// Forces and moments at the start of the last step, about the centre of mass, frame B. On the launch stand they are what the
// stand has to hold (gravity apart).
struct AirframeWrench {
  Eigen::Vector3d rotor_force_B_N = Eigen::Vector3d::Zero();
  Eigen::Vector3d rotor_moment_B_N_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d drag_force_B_N = Eigen::Vector3d::Zero();
  Wrench further;  // what BodyLoads added
};

enum class AirframeStatus : std::uint8_t {
  clamped,  // held by the launch stand
  flying,
  below_ground,  // ended: the state is that of the first step below ground_z_m
  diverged,      // ended: an input or the result was not finite or beyond the bounds below; the state is the last good one
};

// Bounds of a credible flight; beyond them the simulation has diverged, whatever the cause.
inline constexpr double kMaxSpeed_m_s = 150.0;
inline constexpr double kMaxRate_rad_s = 200.0;
inline constexpr double kMaxDistance_m = 1e5;

class Airframe {
 public:
  // Held on the launch stand at the pose of `initial` until release_ns (stand: velocity and rate are zero); with
  // release_ns <= initial.time_ns it is free from the start, with initial's velocity and rate.
  // Throws Error for a mass, inertia, step or rotor that no body can have.
  Airframe(const AirframeConfig& config, const AirframeState& initial, std::int64_t release_ns = 0);

  const AirframeConfig& config() const { return config_; }
  const AirframeState& state() const { return state_; }
  AirframeStatus status() const { return status_; }
  bool ended() const { return status_ == AirframeStatus::below_ground || status_ == AirframeStatus::diverged; }
  const AirframeWrench& wrench() const { return wrench_; }

  // The still air and wind of the configuration, the same everywhere.
  Air air() const { return {config_.wind_W_m_s, config_.density_kg_m3}; }
  // Where the hub of rotor `i` (0-based) is now.
  Eigen::Vector3d hub_W_m(std::size_t i) const { return state_.p_W_m + state_.q_WB * arm_B_m_[i]; }
  const Eigen::Vector3d& hub_B_m(std::size_t i) const { return arm_B_m_[i]; }  // from the centre of mass
  const Eigen::Matrix3d& R_BR(std::size_t i) const { return R_BR_[i]; }
  // The body at the start of the next step.
  BodyMotion motion(const Air& air_at_body, const RotorMomentum& rotors) const { return motion_of(state_, air_at_body, rotors); }
  RotorMomentum momentum(std::span<const double, kAirframeRotors> omega_rad_s,
                         std::span<const double, kAirframeRotors> omega_dot_rad_s2) const;

  // What rotor `i` meets now, in its own frame: v + w x r of its hub through the air there, and the body rate.
  RotorCondition rotor_condition(std::size_t i, double omega_rad_s, const Air& air_at_hub) const;
  RotorCondition rotor_condition(std::size_t i, double omega_rad_s) const { return rotor_condition(i, omega_rad_s, air()); }

  // Advances by config().step_ns. `loads` on the hubs in frame R, `omega` at the start of the step, `omega_dot` the mean over
  // it; `air_at_body` drags the body all step long; `further` may be null. After the end of a flight the state stays and time
  // runs on.
  AirframeStatus step(std::span<const RotorLoads, kAirframeRotors> loads, std::span<const double, kAirframeRotors> omega_rad_s,
                      std::span<const double, kAirframeRotors> omega_dot_rad_s2, const Air& air_at_body, const BodyLoads* further);
  AirframeStatus step(std::span<const RotorLoads, kAirframeRotors> loads, std::span<const double, kAirframeRotors> omega_rad_s,
                      std::span<const double, kAirframeRotors> omega_dot_rad_s2) {
    return step(loads, omega_rad_s, omega_dot_rad_s2, air(), nullptr);
  }

 private:
  struct Loads {
    Eigen::Vector3d force_B_N = Eigen::Vector3d::Zero();
    Eigen::Vector3d moment_B_N_m = Eigen::Vector3d::Zero();
  };
  struct Rate;
  Loads sum_of_rotors(std::span<const RotorLoads, kAirframeRotors> loads) const;
  Eigen::Vector3d drag_force_B_N(const BodyMotion& m) const { return config_.drag().force_B_N(m.v_air_B_m_s, m.density_kg_m3); }
  BodyMotion motion_of(const AirframeState& s, const Air& air, const RotorMomentum& rotors) const;
  Rate rate(const AirframeState& s, const Loads& loads, const RotorMomentum& rotors, const Air& air, const BodyLoads* further) const;

  AirframeConfig config_;
  AirframeState state_;
  std::int64_t release_ns_;
  AirframeStatus status_;
  AirframeWrench wrench_;
  Eigen::Matrix3d inverse_inertia_;
  std::array<Eigen::Matrix3d, kAirframeRotors> R_BR_;
  std::array<Eigen::Vector3d, kAirframeRotors> arm_B_m_;  // centre of mass to hub
  Loads last_loads_;
  bool has_last_loads_ = false;
};

}  // namespace rotorloop::sim
