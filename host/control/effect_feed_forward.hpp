// What the vehicle file's added terms ([[effect]]s, host/effects) do to the vehicle, countered before it shows as an error:
// forces beside the thrust are taken off the demand for thrust, and the speeds are those at which the whole model, not only
// eq. (1)-(3), gives the wanted thrust and torque.
//
// The loads are evaluated at the state estimate and at commanded rotor speeds: always there, never stale, and a loop of 10 ms
// away from the measured ones (decision 0048). Speeds are taken as steady: what terms say about their derivatives is left out.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "host/control/mixer.hpp"
#include "host/effects/loads.hpp"
#include "host/effects/vehicle_terms.hpp"

namespace rotorloop::host {

// Where and how the vehicle moves, as far as loads depend on it.
struct EffectMotion {
  Eigen::Matrix3d R_WB = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();  // centre of mass
  Eigen::Vector3d v_B_m_s = Eigen::Vector3d::Zero(), w_B_rad_s = Eigen::Vector3d::Zero();
  double t_s = 0.0;
};

// What the terms make of one set of rotor speeds.
struct EffectLoad {
  Eigen::Vector3d force_B_N = Eigen::Vector3d::Zero();  // added to drag, eq. (4)-(5): everything but the rotors' thrust
  // What a demand must be raised by so that the mixer's own model, asked for it, finds the speeds of the whole model.
  double thrust_N = 0.0;
  Eigen::Vector3d torque_B_N_m = Eigen::Vector3d::Zero();
  bool finite = true;    // false: everything above is zero, eq. (1)-(5) fly
  bool bounded = false;  // a part was cut to kEffectShare
};

// No part of a correction exceeds this share of the weight; of the weight at the rotors' arms; of the hover's drag torques. A
// term that asks for more is wrong, and what is left still flies.
inline constexpr double kEffectShare = 0.5;

class EffectFeedForward {
 public:
  // `mixer` is copied from for its model of arms and inflow. Without terms any() is false and nothing else may be called.
  EffectFeedForward(const VehicleModel& vehicle, const VehicleTerms& terms, const MixerConfig& mixer);
  bool any() const { return !terms_.empty(); }

  EffectLoad load(const Mixer& mixer, const EffectMotion& motion, const std::array<double, kRotors>& omega_rad_s) const;

  // Speeds for the demand under the whole model: the mixer is asked again with the difference between the two models at its last
  // answer, until that stands. Each round leaves of the error what the effect is of the thrust (a tenth, say).
  struct Mixed {
    MixerResult result;
    int rounds = 0;
    bool converged = false;
    EffectLoad at_result;
  };
  static constexpr int kMaxRounds = 6;
  static constexpr double kThrustTolerance = 2e-4, kTorqueTolerance = 2e-4;  // of the weight; of the weight at the arms
  Mixed solve(const Mixer& mixer, const MixerDemand& demand, const EffectMotion& motion, const EffectLoad& at_guess,
              const std::array<double, kRotors>& guess_rad_s) const;

 private:
  VehicleTerms terms_;
  LoadGeometry geometry_;
  LoadParameters<double> parameters_;
  DragModel drag_;
  double weight_N_ = 0.0;
  Eigen::Vector3d torque_scale_N_m_ = Eigen::Vector3d::Zero();
};

}  // namespace rotorloop::host
