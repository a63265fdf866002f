// The model over one step of the grid: Runge-Kutta of fourth order with its derivatives, and the cheaper step by the middle.
#include <array>

#include "bench/sysid/estimate/model/column_kinds.hpp"
#include "bench/sysid/estimate/model/model.hpp"
#include "bench/sysid/estimate/model/rotations.hpp"
#include "host/base/constants.hpp"

namespace rotorloop::estimate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

using Sensitivity = Eigen::Matrix<double, 12, Eigen::Dynamic, Eigen::RowMajor, 12, kMaxColumns + 12>;

// Slope of (p, v, ξ, Ω) at a stage, and that of its sensitivities: rows of the stage by rows of the start.
struct StageSlope {
  Eigen::Matrix<double, 12, 1> y;
  Sensitivity m;
};

// `start`: where the step began; `at`: the stage; `by_start`: its sensitivity.
void slope_at(const Model& model, const BodyState& start, const Eigen::Matrix<double, 12, 1>& at, const Sensitivity& by_start,
              const RotorInputSample& u, double t, InstantJacobian& j, StageSlope& out) {
  const ModelValues& values = model.values();
  const Columns& columns = model.columns();
  const Vector3d xi = at.segment<3>(6), w = at.segment<3>(9);
  const BodyState s{at.segment<3>(0), at.segment<3>(3), start.q_WB * exp_q(xi), w};
  const Instant now = model.instant(s, u, t, &j);
  const Vector3d gravity = kGravity_m_s2 * Vector3d(values[kTiltX], values[kTiltY], -1.0);
  const Eigen::Index width = by_start.cols();
  const Matrix3d r = s.q_WB.toRotationMatrix(), jr = right_jacobian(xi), jri = inverse_right_jacobian(xi);
  out.y << s.v_W_m_s, r * now.specific_force_B_m_s2 + gravity, jri * w, now.angular_acceleration_B_rad_s2;

  // Derivatives of the slope by (p, v, ξ, Ω) of the stage. Of ξ' = Jr⁻¹(ξ) Ω: to third order in ξ, which is at most the
  // angle of one step (the term left out is below 1e-9 for 0.1 rad).
  Eigen::Matrix<double, 3, 12> accel = r * j.force_by_state, angular = j.angular_by_state;
  accel.block<3, 3>(0, 6) -= r * skew(now.specific_force_B_m_s2);
  accel.block<3, 3>(0, 6) *= jr;
  angular.block<3, 3>(0, 6) *= jr;
  const Matrix3d turn = -0.5 * skew(w) - (skew(xi.cross(w)) + skew(xi) * skew(w)) / 12.0;

  out.m.resize(12, width);
  out.m.topRows<3>() = by_start.middleRows<3>(3);
  // Rows as sums of rows: the compiler vectorises along the columns.
  const auto combine = [&](Eigen::Index row, const double* weights, Eigen::Index first, Eigen::Index count) {
    double* o = &out.m(row, 0);
    for (Eigen::Index c = 0; c < width; ++c) o[c] = 0.0;
    for (Eigen::Index k = 0; k < count; ++k) {
      const double a = weights[k];
      const double* in = &by_start(first + k, 0);
      for (Eigen::Index c = 0; c < width; ++c) o[c] += a * in[c];
    }
  };
  const Eigen::Index first = values.terms.size() > 0 ? 0 : 3;  // without terms nothing depends on the place
  for (Eigen::Index i = 0; i < 3; ++i) {
    std::array<double, 12> a{}, b{}, q{};
    for (Eigen::Index k = 0; k < 12; ++k) {
      a[static_cast<std::size_t>(k)] = accel(i, k);
      b[static_cast<std::size_t>(k)] = angular(i, k);
    }
    for (Eigen::Index k = 0; k < 3; ++k) {
      q[static_cast<std::size_t>(k)] = turn(i, k);
      q[static_cast<std::size_t>(k + 3)] = jri(i, k);
    }
    combine(3 + i, a.data() + first, first, 12 - first);
    combine(6 + i, q.data(), 6, 6);
    combine(9 + i, b.data() + first, first, 12 - first);
  }
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const auto col = static_cast<Eigen::Index>(c);
    if (columns[c] == kTiltX || columns[c] == kTiltY) {
      out.m(3 + columns[c] - kTiltX, 12 + col) += kGravity_m_s2;
    } else if (is_dynamics(columns[c]) || columns[c] >= kCoreParameters || input_place(columns[c]) >= 0) {
      const Vector3d f = r * j.force_by.col(col);
      for (Eigen::Index i = 0; i < 3; ++i) {
        out.m(3 + i, 12 + col) += f[i];
        out.m(9 + i, 12 + col) += j.angular_by(i, col);
      }
    }
  }
}

}  // namespace

BodyState Model::step(const BodyState& x, const RotorInput& input, std::size_t& hint, double t0, double t1, int substeps,
                      const TermStateEnds* memory) const {
  const double h = (t1 - t0) / substeps;
  const Vector3d gravity = kGravity_m_s2 * Vector3d(values_[kTiltX], values_[kTiltY], -1.0);
  Eigen::Matrix<double, 12, 1> y;
  y << x.p_W_m, x.v_W_m_s, Vector3d::Zero(), x.w_B_rad_s;
  const auto slope = [&](const Eigen::Matrix<double, 12, 1>& at, const RotorInputSample& u, double t) {
    const Vector3d xi = at.segment<3>(6), w = at.segment<3>(9);
    const BodyState s{at.segment<3>(0), at.segment<3>(3), x.q_WB * exp_q(xi), w};
    const Instant now = instant(s, u, t);
    Eigen::Matrix<double, 12, 1> d;
    d << s.v_W_m_s, s.q_WB * now.specific_force_B_m_s2 + gravity, inverse_right_jacobian(xi) * w, now.angular_acceleration_B_rad_s2;
    return d;
  };
  const auto input_at = [&](double t) {
    RotorInputSample u = input.at(t, hint, false);
    if (memory) {
      const double share = (t - t0) / (t1 - t0);
      for (std::size_t i = 0; i < u.memory.size(); ++i) u.memory[i] = memory->from[i] + share * (memory->to[i] - memory->from[i]);
    }
    return u;
  };
  RotorInputSample u0 = input_at(t0);
  for (int k = 0; k < substeps; ++k) {
    const double t = t0 + k * h;
    const RotorInputSample um = input_at(t + 0.5 * h), u1 = input_at(t + h);
    const auto k1 = slope(y, u0, t);
    const auto k2 = slope(y + 0.5 * h * k1, um, t + 0.5 * h);
    const auto k3 = slope(y + 0.5 * h * k2, um, t + 0.5 * h);
    const auto k4 = slope(y + h * k3, u1, t + h);
    y += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    u0 = u1;
  }
  return {y.segment<3>(0), y.segment<3>(3), (x.q_WB * exp_q(y.segment<3>(6))).normalized(), y.segment<3>(9)};
}

BodyState Model::step(const BodyState& x, const RotorInput& input, std::size_t& hint, double t0, double t1, int substeps,
                      StateJacobian& by_state, ParameterJacobian& by_columns) const {
  const double h = (t1 - t0) / substeps;
  const auto parameters = static_cast<Eigen::Index>(columns_.size());
  const Eigen::Index width = 12 + parameters;

  Eigen::Matrix<double, 12, 1> y;
  y << x.p_W_m, x.v_W_m_s, Vector3d::Zero(), x.w_B_rad_s;
  Sensitivity m(12, width);
  m.setZero();
  m.leftCols<12>().setIdentity();

  InstantJacobian j;
  RotorInputSample u0 = input.at(t0, hint, needs_input_derivatives_);
  StageSlope k1, k2, k3, k4;
  for (int k = 0; k < substeps; ++k) {
    const double t = t0 + k * h;
    const RotorInputSample um = input.at(t + 0.5 * h, hint, needs_input_derivatives_), u1 = input.at(t + h, hint, needs_input_derivatives_);
    slope_at(*this, x, y, m, u0, t, j, k1);
    slope_at(*this, x, y + 0.5 * h * k1.y, m + 0.5 * h * k1.m, um, t + 0.5 * h, j, k2);
    slope_at(*this, x, y + 0.5 * h * k2.y, m + 0.5 * h * k2.m, um, t + 0.5 * h, j, k3);
    slope_at(*this, x, y + h * k3.y, m + h * k3.m, u1, t + h, j, k4);
    y += h / 6.0 * (k1.y + 2.0 * k2.y + 2.0 * k3.y + k4.y);
    m += h / 6.0 * (k1.m + 2.0 * k2.m + 2.0 * k3.m + k4.m);
    u0 = u1;
  }
  const Matrix3d jr = right_jacobian(y.segment<3>(6));
  by_state = m.leftCols<12>();
  by_state.middleRows<3>(6) = jr * m.block(6, 0, 3, 12);
  by_columns = m.rightCols(parameters);
  by_columns.middleRows<3>(6) = jr * m.block(6, 12, 3, parameters);
  return {y.segment<3>(0), y.segment<3>(3), (x.q_WB * exp_q(y.segment<3>(6))).normalized(), y.segment<3>(9)};
}

BodyState Model::step_by_middle(const BodyState& x, const RotorInput& input, std::size_t& hint, double t0, double t1, int substeps,
                                StateJacobian& by_state, ParameterJacobian& by_columns) const {
  const BodyState end = step(x, input, hint, t0, t1, substeps);
  const double h = t1 - t0;
  const BodyState middle{0.5 * (x.p_W_m + end.p_W_m), 0.5 * (x.v_W_m_s + end.v_W_m_s), x.q_WB.slerp(0.5, end.q_WB),
                         0.5 * (x.w_B_rad_s + end.w_B_rad_s)};
  InstantJacobian j;
  const Instant now = instant(middle, input.mean(t0, t1, substeps, hint, needs_input_derivatives_), 0.5 * (t0 + t1), &j);
  const Matrix3d r = middle.q_WB.toRotationMatrix();

  // δẋ = A δx + B δθ, with A and B as in the middle: Φ = exp(A h), Γ = ∫ exp(A s) ds B.
  StateJacobian a = StateJacobian::Zero();
  a.block<3, 3>(0, 3).setIdentity();
  a.middleRows<3>(3) = r * j.force_by_state;
  a.block<3, 3>(3, 6) -= r * skew(now.specific_force_B_m_s2);
  a.block<3, 3>(6, 6) = -skew(middle.w_B_rad_s);
  a.block<3, 3>(6, 9).setIdentity();
  a.middleRows<3>(9) = j.angular_by_state;
  const StateJacobian one = h * a, two = one * one, three = two * one;
  by_state = StateJacobian::Identity() + one + two / 2.0 + three / 6.0;
  const StateJacobian sum = h * (StateJacobian::Identity() + one / 2.0 + two / 6.0 + three / 24.0);

  const auto parameters = static_cast<Eigen::Index>(columns_.size());
  Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, kMaxColumns> b(6, parameters);
  b.setZero();
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    const auto col = static_cast<Eigen::Index>(c);
    if (columns_[c] == kTiltX || columns_[c] == kTiltY) {
      b(columns_[c] - kTiltX, col) = kGravity_m_s2;
    } else if (is_dynamics(columns_[c]) || columns_[c] >= kCoreParameters || input_place(columns_[c]) >= 0) {
      b.col(col) << r * j.force_by.col(col), j.angular_by.col(col);
    }
  }
  by_columns = sum.middleCols<3>(3) * b.topRows<3>() + sum.rightCols<3>() * b.bottomRows<3>();
  return end;
}

}  // namespace rotorloop::estimate
