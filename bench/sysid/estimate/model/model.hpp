// One step of the rigid body under the model's loads (eq. 1-8 of the paper plus terms), with its exact derivatives by state and
// parameters: what the fit, its check and the predictor integrate.
// State x = (p, v in W; q; Ω in B). Error δx = (δp, δv, δφ, δΩ) in R^12, q = q̂ Exp(δφ).
// Classical Runge-Kutta of fourth order over (p, v, ξ, Ω) with q = q0 Exp(ξ), so that the quaternion never leaves the sphere and
// the derivative of the discrete map is exact.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "bench/sysid/estimate/model/body_state.hpp"
#include "bench/sysid/estimate/model/parameters.hpp"
#include "bench/sysid/estimate/model/rotor_input.hpp"

namespace rotorloop::estimate {

using StateError = Eigen::Matrix<double, 12, 1>;
BodyState moved(const BodyState& x, const StateError& d);           // x ⊞ δ
StateError difference(const BodyState& from, const BodyState& to);  // to ⊟ from

// The parameters by which derivatives are wanted, in the order of the columns.
using Columns = std::vector<int>;
inline constexpr int kMaxColumns = 384;  // of a sweep that also screens terms; a fit frees some twenty
using StateJacobian = Eigen::Matrix<double, 12, 12>;
using ParameterJacobian = Eigen::Matrix<double, 12, Eigen::Dynamic, Eigen::ColMajor, 12, kMaxColumns>;

// Acceleration at a moment; derivatives by state error (12) and columns.
struct Instant {
  Eigen::Vector3d specific_force_B_m_s2;  // force over mass, gravity not included
  Eigen::Vector3d angular_acceleration_B_rad_s2;
  Eigen::Vector3d force_B_N, torque_B_N_m;
  bool beyond_equations = false;  // a rotor descends faster than eq. (2) holds, v_z + v_i <= 0
};
struct InstantJacobian {
  Eigen::Matrix<double, 3, 12> force_by_state, angular_by_state;  // of specific force, angular acceleration
  Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMaxColumns> force_by, angular_by;
};

class Model {
 public:
  // The values are copied; `columns` may hold dynamics, rotor input and term parameters, others get zero columns.
  Model(const ModelValues& values, const Columns& columns = {});

  Instant instant(const BodyState& x, const RotorInputSample& input, double t_s, InstantJacobian* jacobian = nullptr) const;

  // Derivatives of force (rows 0-2, N) and torque (rows 3-5, N m) in B by the columns that are parameters of terms or of the rotor
  // input, at this moment and state; those of other columns stay 0. `by`: 6 x columns.
  void wrench_by_extras(const BodyState& x, const RotorInputSample& input, double t_s, Eigen::Ref<Eigen::MatrixXd> by) const;

  // x(t1) from x(t0) in `substeps` equal steps. `memory`: that of the terms, instead of the input's.
  BodyState step(const BodyState& x, const RotorInput& input, std::size_t& hint, double t0_s, double t1_s, int substeps,
                 const TermStateEnds* memory = nullptr) const;
  // The same with Jacobians: of the error at t1 by the error at t0, and by the columns.
  BodyState step(const BodyState& x, const RotorInput& input, std::size_t& hint, double t0_s, double t1_s, int substeps,
                 StateJacobian& by_state, ParameterJacobian& by_columns) const;
  // The same end state, with Jacobians of the error's linear motion about the middle of the step: one evaluation for all substeps.
  // Off by the third order of the step: 1e-3 of their size at 50 Hz, where this takes a quarter of the time.
  BodyState step_by_middle(const BodyState& x, const RotorInput& input, std::size_t& hint, double t0_s, double t1_s, int substeps,
                           StateJacobian& by_state, ParameterJacobian& by_columns) const;

  const ModelValues& values() const { return values_; }
  const Columns& columns() const { return columns_; }

 private:
  struct Partials;
  void load(const BodyState& x, const RotorInputSample& input, double t_s, Eigen::Vector3d& force, Eigen::Vector3d& torque,
            Partials* partials, bool* beyond) const;

  ModelValues values_;
  Columns columns_;
  // Parameters that go through ExtraDual, some at a time, with the terms that act then: those of the parameters, and all that are not
  // at their neutral values.
  struct ExtraGroup {
    std::vector<int> columns;  // positions in columns_
    host::TermList terms;
    std::vector<std::size_t> flat, memory;  // of each of their parameters and numbers of memory, its place in values_.terms
  };
  std::vector<ExtraGroup> extras_;
  Eigen::Matrix3d inertia_, inverse_inertia_;
  bool has_terms_ = false, needs_input_derivatives_ = false;
};

}  // namespace rotorloop::estimate
