// The three identification flights of the paper's section V-B as references over time, and a controller that follows them closely
// enough to reach their speeds and rates. It knows the truth's thrust equations and uses them backwards.
// None of this is judged: identification must not care who flew.
#pragma once
#include <functional>

#include "test/support/model_true_airframe.hpp"

namespace rotorloop::model_true {

enum class Manoeuvre {
  vertical,    // up and down with 3.5 m/s
  horizontal,  // fast in the plane, 10.5 m/s
  rotation,    // about all three axes at once, 6.5 rad/s
};
const char* name_of(Manoeuvre manoeuvre);

// What is wanted at a time; a pure function, differentiable, at rest in the origin at t = 0.
struct Reference {
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;
  Eigen::Vector3d tilt_B_rad = Eigen::Vector3d::Zero();  // rotation vector on top of the attitude that the position asks for
};
Reference reference(Manoeuvre manoeuvre, double t_s);
using Path = std::function<Reference(double t_s)>;  // any other

// Rotor speeds to command for the next millisecond, rad/s; `now_rad_s`: present speeds (a lead of 2 halves the motors' lag).
// `loose`: sideways motion that a tilt of the reference causes is let pass.
RotorSpeeds command(const Truth& truth, const Path& path, bool loose, double t_s, const State& state, const RotorSpeeds& now_rad_s);
RotorSpeeds command(const Truth& truth, Manoeuvre manoeuvre, double t_s, const State& state, const RotorSpeeds& now_rad_s);

// Speeds that hold the vehicle level and still.
RotorSpeeds hover_speeds(const Truth& truth);

}  // namespace rotorloop::model_true
