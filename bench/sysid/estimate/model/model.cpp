#include "bench/sysid/estimate/model/model.hpp"

#include <algorithm>
#include <array>

#include "bench/sysid/estimate/model/column_kinds.hpp"
#include "bench/sysid/estimate/model/load_input.hpp"
#include "bench/sysid/estimate/model/rotations.hpp"
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

}  // namespace rotorloop::estimate
