#include "bench/sysid/estimate/model/model.hpp"

#include <algorithm>
#include <array>

#include "bench/sysid/estimate/model/load_input.hpp"
#include "bench/sysid/estimate/model/rotations.hpp"
#include "host/base/constants.hpp"
#include "host/effects/loads.hpp"
#include "host/effects/term.hpp"

namespace rotorloop::estimate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using host::ExtraDual;
using host::LoadInput;
using host::LoadParameters;
using host::LoadState;
using host::MotionDual;
using host::PlaceDual;

template <class S>
constexpr int kDirParameters = std::is_same_v<S, MotionDual> ? 6 : 12;
constexpr std::array<int, host::kLoadParameters> kLoadOrder{kK1, kK2, kCq, kComX, kComY, kCdh, kCdxy, kCdz};
constexpr std::size_t kExtraWidth = 8;

template <class S>
void seed_parameters(LoadParameters<S>& p) {
  S* const all[] = {&p.k1_N_s2, &p.k2_N_s2_m, &p.c_q_N_m_s2, &p.com_x_m, &p.com_y_m, &p.c_dh_s_m, &p.c_dxy_N_s2_m2, &p.c_dz_N_s2_m2};
  for (std::size_t j = 0; j < std::size(all); ++j) all[j]->d[static_cast<std::size_t>(kDirParameters<S>) + j] = 1.0;
}

bool is_dynamics(int p) { return p <= kTiltY; }
int input_place(int p) {
  for (std::size_t j = 0; j < kRotorInputParameters.size(); ++j) {
    if (kRotorInputParameters[j] == p) return static_cast<int>(j);
  }
  return -1;
}

// Load and its derivatives by motion and core parameters, in dual numbers S; `finish` takes the load.
template <class S, class Partials, class Finish>
void load_by_motion(const ModelValues& values, const Columns& columns, const BodyState& x, const RotorInputSample& u, double t_s,
                    Partials& out, Finish&& finish) {
  const Matrix3d world_B = x.q_WB.toRotationMatrix().transpose();
  const Vector3d v_B = world_B * x.v_W_m_s;
  LoadInput<S> in = load_input<S>(x, world_B, v_B, u, t_s);
  LoadParameters<S> p = load_parameters<S>(values);
  seed_motion(in);
  seed_parameters(p);
  LoadState<S> s{in, p, values.geometry, {}, {}, {}, {}, {}, {}, {}};
  if constexpr (std::is_same_v<S, PlaceDual>) {
    const double* term_values = values.values.data() + kCoreParameters;
    std::array<S, host::kMaxTermParameters> c;
    for (std::size_t k = 0; k < values.terms.parameters(); ++k) c[k] = S(term_values[k]);
    std::array<S, host::kMaxMemory> memory;
    for (std::size_t k = 0; k < values.terms.memory(); ++k) memory[k] = S(u.memory[k]);
    const host::TermSet<S> set(values.terms, c.data(), memory.data());
    host::loads(s, &set);
  } else {
    host::loads<S>(s, nullptr);
  }
  finish(s);
  const S* const rows[] = {&s.force_B_N.x, &s.force_B_N.y, &s.force_B_N.z, &s.torque_B_N_m.x, &s.torque_B_N_m.y, &s.torque_B_N_m.z};
  out.attitude.setZero();
  out.place.setZero();
  for (int i = 0; i < 6; ++i) {
    const auto& d = rows[i]->d;
    for (int j = 0; j < 3; ++j) {
      const auto at = [&](int first) { return d[static_cast<std::size_t>(first + j)]; };
      out.velocity(i, j) = at(kDirVelocity);
      out.rates(i, j) = at(kDirRates);
      if constexpr (std::is_same_v<S, PlaceDual>) {
        out.attitude(i, j) = at(kDirAttitude);
        out.place(i, j) = at(kDirPlace);
      }
    }
    for (std::size_t c = 0; c < columns.size(); ++c) {
      for (std::size_t k = 0; k < kLoadOrder.size(); ++k) {
        if (kLoadOrder[k] == columns[c]) out.columns(i, static_cast<Eigen::Index>(c)) = d[static_cast<std::size_t>(kDirParameters<S>) + k];
      }
    }
  }
}

}  // namespace

BodyState moved(const BodyState& x, const StateError& d) {
  return {x.p_W_m + d.segment<3>(0), x.v_W_m_s + d.segment<3>(3), (x.q_WB * exp_q(d.segment<3>(6))).normalized(),
          x.w_B_rad_s + d.segment<3>(9)};
}

StateError difference(const BodyState& from, const BodyState& to) {
  StateError d;
  d << to.p_W_m - from.p_W_m, to.v_W_m_s - from.v_W_m_s, log_q(from.q_WB.conjugate() * to.q_WB), to.w_B_rad_s - from.w_B_rad_s;
  return d;
}

// Derivatives of force (rows 0-2) and torque (rows 3-5) by velocity in B, attitude, rates, place, and the columns.
struct Model::Partials {
  Eigen::Matrix<double, 6, 3> velocity, attitude, rates, place;
  Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, kMaxColumns> columns;
};

Model::Model(const ModelValues& values, const Columns& columns) : values_(values), columns_(columns) {
  inertia_ = values.inertia_kg_m2();
  inverse_inertia_ = inertia_.inverse();
  has_terms_ = values.terms.size() > 0;
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const bool input = input_place(columns[c]) >= 0;
    needs_input_derivatives_ = needs_input_derivatives_ || input;
    if (!input && columns[c] < kCoreParameters) continue;
    if (extras_.empty() || extras_.back().columns.size() == kExtraWidth) extras_.emplace_back();
    extras_.back().columns.push_back(static_cast<int>(c));
  }
  for (ExtraGroup& group : extras_) {
    for (std::size_t t = 0; t < values_.terms.size(); ++t) {
      const host::TermInfo& info = values_.terms.term(t).info;
      const std::size_t first = values_.terms.first_parameter(t), count = info.parameters.size() + info.memory.size();
      bool acts = false;
      for (std::size_t k = first; k < first + count; ++k) {
        const int parameter = kCoreParameters + static_cast<int>(k);
        acts = acts || values_[parameter] != values_.terms.parameter(k).neutral;
        for (const int c : group.columns) acts = acts || columns_[static_cast<std::size_t>(c)] == parameter;
      }
      if (!acts) continue;
      group.terms.add(values_.terms.term(t));
      for (std::size_t k = first; k < first + count; ++k) group.flat.push_back(k);
      for (std::size_t k = 0; k < info.memory.size(); ++k) group.memory.push_back(values_.terms.first_memory(t) + k);
    }
  }
}

void Model::load(const BodyState& x, const RotorInputSample& u, double t_s, Vector3d& force, Vector3d& torque, Partials* out,
                 bool* beyond) const {
  const auto finish = [&]<class S>(const LoadState<S>& s) {
    force = {host::value_of(s.force_B_N.x), host::value_of(s.force_B_N.y), host::value_of(s.force_B_N.z)};
    torque = {host::value_of(s.torque_B_N_m.x), host::value_of(s.torque_B_N_m.y), host::value_of(s.torque_B_N_m.z)};
    if (beyond) {
      for (const auto& r : s.rotor) *beyond = *beyond || host::value_of(r.through_m_s) <= 0.0;
    }
  };
  if (!out) {
    const Matrix3d world_B = x.q_WB.toRotationMatrix().transpose();
    const Vector3d v_B = world_B * x.v_W_m_s;
    const LoadInput<double> in = load_input<double>(x, world_B, v_B, u, t_s);
    const LoadParameters<double> p = load_parameters<double>(values_);
    LoadState<double> s{in, p, values_.geometry, {}, {}, {}, {}, {}, {}, {}};
    const host::TermSet<double> set(values_.terms, values_.values.data() + kCoreParameters, u.memory.data());
    host::loads(s, has_terms_ ? &set : nullptr);
    finish(s);
    return;
  }
  out->columns.setZero(6, static_cast<Eigen::Index>(columns_.size()));
  if (has_terms_) {
    load_by_motion<PlaceDual>(values_, columns_, x, u, t_s, *out, finish);
  } else {
    load_by_motion<MotionDual>(values_, columns_, x, u, t_s, *out, finish);
  }
  if (!extras_.empty()) wrench_by_extras(x, u, t_s, out->columns);
}

void Model::wrench_by_extras(const BodyState& x, const RotorInputSample& u, double t_s, Eigen::Ref<Eigen::MatrixXd> by) const {
  const Matrix3d world_B = x.q_WB.toRotationMatrix().transpose();
  const Vector3d v_B = world_B * x.v_W_m_s;
  const double* term_values = values_.values.data() + kCoreParameters;
  const auto place_in = [](const std::vector<std::size_t>& list, std::size_t flat) {
    return static_cast<std::size_t>(std::find(list.begin(), list.end(), flat) - list.begin());
  };
  for (const ExtraGroup& group : extras_) {
    LoadInput<ExtraDual> in = load_input<ExtraDual>(x, world_B, v_B, u, t_s);
    const LoadParameters<ExtraDual> p = load_parameters<ExtraDual>(values_);
    std::array<ExtraDual, host::kMaxTermParameters> c;
    for (std::size_t k = 0; k < group.flat.size(); ++k) c[k] = ExtraDual(term_values[group.flat[k]]);
    std::array<ExtraDual, host::kMaxMemory> memory;
    for (std::size_t k = 0; k < group.memory.size(); ++k) memory[k] = ExtraDual(u.memory[group.memory[k]]);
    for (std::size_t j = 0; j < group.columns.size(); ++j) {
      const int parameter = columns_[static_cast<std::size_t>(group.columns[j])];
      if (const int place = input_place(parameter); place >= 0) {
        for (std::size_t r = 0; r < 4; ++r) {
          in.omega_rad_s[r].d[j] = u.omega_by[static_cast<std::size_t>(place)][r];
          in.omega_dot_rad_s2[r].d[j] = u.omega_dot_by[static_cast<std::size_t>(place)][r];
        }
      } else {
        c[place_in(group.flat, static_cast<std::size_t>(parameter - kCoreParameters))].d[j] = 1.0;
        if (u.dynamic_term_input) {
          u.dynamic_term_input->derivatives(u.memory_row, u.memory_share, parameter, [&](std::size_t i, double slope) {
            if (const std::size_t at = place_in(group.memory, i); at < group.memory.size()) memory[at].d[j] = slope;
          });
        }
      }
    }
    LoadState<ExtraDual> s{in, p, values_.geometry, {}, {}, {}, {}, {}, {}, {}};
    const host::TermSet<ExtraDual> set(group.terms, c.data(), memory.data());
    host::loads(s, group.terms.size() > 0 ? &set : nullptr);
    const ExtraDual* const rows[] = {&s.force_B_N.x,    &s.force_B_N.y,    &s.force_B_N.z,
                                     &s.torque_B_N_m.x, &s.torque_B_N_m.y, &s.torque_B_N_m.z};
    for (int i = 0; i < 6; ++i) {
      for (std::size_t j = 0; j < group.columns.size(); ++j) by(i, group.columns[j]) = rows[i]->d[j];
    }
  }
}

Instant Model::instant(const BodyState& x, const RotorInputSample& u, double t_s, InstantJacobian* jacobian) const {
  Instant now;
  Partials partials;
  load(x, u, t_s, now.force_B_N, now.torque_B_N_m, jacobian ? &partials : nullptr, &now.beyond_equations);
  const double m = values_[kMass];
  const Vector3d& w = x.w_B_rad_s;
  const Vector3d momentum = inertia_ * w;
  now.specific_force_B_m_s2 = now.force_B_N / m;
  now.angular_acceleration_B_rad_s2 = inverse_inertia_ * (now.torque_B_N_m - w.cross(momentum));
  if (!jacobian) return now;

  const Matrix3d world_B = x.q_WB.toRotationMatrix().transpose();
  const Eigen::Matrix<double, 6, 3> attitude = partials.velocity * skew(world_B * x.v_W_m_s) + partials.attitude;
  const Eigen::Matrix<double, 6, 3> velocity = partials.velocity * world_B;
  const auto fill = [&](auto& by_state, auto& by_columns, int first, const Matrix3d& gain) {
    by_state.template block<3, 3>(0, 0) = gain * partials.place.middleRows<3>(first);
    by_state.template block<3, 3>(0, 3) = gain * velocity.middleRows<3>(first);
    by_state.template block<3, 3>(0, 6) = gain * attitude.middleRows<3>(first);
    by_state.template block<3, 3>(0, 9) = gain * partials.rates.middleRows<3>(first);
    by_columns = gain * partials.columns.middleRows<3>(first);
  };
  fill(jacobian->force_by_state, jacobian->force_by, 0, Matrix3d(Matrix3d::Identity() / m));
  fill(jacobian->angular_by_state, jacobian->angular_by, 3, inverse_inertia_);
  jacobian->angular_by_state.block<3, 3>(0, 9) += inverse_inertia_ * (skew(momentum) - skew(w) * inertia_);
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    const auto col = static_cast<Eigen::Index>(c);
    if (columns_[c] == kMass) {
      jacobian->force_by.col(col) = -now.specific_force_B_m_s2 / m;
    } else if (columns_[c] >= kIxx && columns_[c] <= kIyz) {
      constexpr std::array<std::array<int, 2>, 6> kPlace{{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};
      const auto [a, b] = kPlace[static_cast<std::size_t>(columns_[c] - kIxx)];
      Matrix3d unit = Matrix3d::Zero();
      unit(a, b) = unit(b, a) = 1.0;
      jacobian->angular_by.col(col) = -inverse_inertia_ * (w.cross(unit * w) + unit * now.angular_acceleration_B_rad_s2);
    }
  }
  return now;
}

namespace {

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
