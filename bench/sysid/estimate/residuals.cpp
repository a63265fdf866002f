#include "bench/sysid/estimate/residuals.hpp"

#include <algorithm>
#include <cmath>

#include "bench/sysid/estimate/model/rotations.hpp"

namespace rotorloop::estimate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

bool of_the_model(int p) { return p <= kTiltY || p >= kRotorDelay; }

Columns model_columns(const Columns& all) {
  Columns out;
  for (const int p : all) {
    if (of_the_model(p)) out.push_back(p);
  }
  return out;
}

using StepWithSlopes = BodyState (Model::*)(const BodyState&, const RotorInput&, std::size_t&, double, double, int, StateJacobian&,
                                            ParameterJacobian&) const;

RotorInput prepared(RotorInput input, const ModelValues& values) {
  input.prepare(values);
  return input;
}

}  // namespace

Residuals::Residuals(const GridFlight& flight, const ModelValues& values, const NoiseModel& noise, const Columns& columns,
                     const ExtraColumns* extra)
    : flight_(flight),
      input_(prepared(flight.input, values)),
      noise_(noise),
      columns_(columns),
      model_(values, model_columns(columns)),
      extra_(extra && extra->count > 0 ? extra : nullptr),
      inverse_inertia_(values.inertia_kg_m2().inverse()) {
  places_.fill(-1);
  reads_ = has_measurement_terms(values.terms);
  if (reads_) {
    for (const int p : measurement_parameters(values.terms)) {
      const auto found = std::find(columns.begin(), columns.end(), p);
      if (found == columns.end()) continue;
      measurement_parameters_.push_back(p);
      measurement_places_.push_back(static_cast<int>(found - columns.begin()));
    }
    measurement_by_.resize(measurement_parameters_.size());
  }
  for (std::size_t c = 0; c < columns.size(); ++c) {
    if (of_the_model(columns[c])) dynamic_.push_back(static_cast<int>(c));
    if (columns[c] < kCoreParameters) places_[static_cast<std::size_t>(columns[c])] = static_cast<int>(c);
  }
}

int Residuals::place_of(int parameter) const { return places_[static_cast<std::size_t>(parameter)]; }

// Rows (p, v) and (φ, Ω) of each axis are correlated by [h³/3, h²/2; h²/2, h] q²; this is its inverse Cholesky factor.
// In a flight that reads no position nothing depends on it. Its tight rows (weight² 1e10) would then only round: false measurements of the
// place that shrank standard errors by 0.3 % after 10 s and more with the cube of time. There p wanders by q √s³ a step, apart from v.
void Residuals::whiten(Eigen::Ref<Eigen::MatrixXd> rows) const {
  struct Weights {
    double place, rate, mix;
  };
  const double h = flight_.step_s;
  const Weights tied{1.0 / std::sqrt(h * h * h / 3.0), 2.0 / std::sqrt(h), 1.5 / h}, apart{1.0, 1.0 / std::sqrt(h), 0.0};
  const bool reads_place = !flight_.pose.empty() || !flight_.position.empty();
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double q[] = {1.0 / noise_.force_m_s2_rtHz[i], 1.0 / noise_.angular_rad_s2_rtHz[i]};
    for (Eigen::Index b = 0; b < 2; ++b) {
      const Weights& w = b == 1 || reads_place ? tied : apart;
      auto place = rows.row(6 * b + i);
      auto rate = rows.row(6 * b + 3 + i);
      rate = (w.rate * q[b]) * (rate - w.mix * place);
      place *= w.place * q[b];
    }
  }
}

Eigen::Matrix<double, 12, 1> Residuals::process(std::size_t k, const BodyState& from, const BodyState& to) const {
  const BodyState f = model_.step(from, input_, hint_, flight_.time_s(k), flight_.time_s(k + 1), flight_.substeps);
  Eigen::MatrixXd r = difference(f, to);
  whiten(r);
  return r;
}

void Residuals::process(std::size_t k, const BodyState& from, const BodyState& to, ProcessRows& out) const {
  ParameterJacobian by;
  const double t0 = flight_.time_s(k), t1 = flight_.time_s(k + 1);
  const BodyState f = flight_.slopes_by_middle ? model_.step_by_middle(from, input_, hint_, t0, t1, flight_.substeps, out.from, by)
                                               : model_.step(from, input_, hint_, t0, t1, flight_.substeps, out.from, by);
  out.r = difference(f, to);
  const Vector3d turn = out.r.segment<3>(6);
  const Matrix3d by_prediction = -inverse_left_jacobian(turn);
  const auto through_prediction = [&](auto& j) {
    const auto rows = (by_prediction * j.template middleRows<3>(6)).eval();
    j = -j;
    j.template middleRows<3>(6) = rows;
  };
  through_prediction(out.from);
  through_prediction(by);
  out.to.setIdentity();
  out.to.block<3, 3>(6, 6) = inverse_right_jacobian(turn);
  out.columns.setZero(12, width());
  for (std::size_t c = 0; c < dynamic_.size(); ++c) out.columns.col(dynamic_[c]) = by.col(static_cast<Eigen::Index>(c));
  if (extra_) {
    const double h = flight_.step_s;
    const Matrix3d rot = (from.q_WB * exp_q(0.5 * h * from.w_B_rad_s)).toRotationMatrix();
    const auto wrench = extra_->at<6>(extra_->wrench, k);
    const Eigen::Matrix3Xd push = -h / model_.values()[kMass] * (rot * wrench.topRows<3>());
    const Eigen::Matrix3Xd turn_rate = -h * (inverse_inertia_ * wrench.bottomRows<3>());
    auto place = out.columns.rightCols(extra_->count);
    place.middleRows<3>(0) = 0.5 * h * push;
    place.middleRows<3>(3) = push;
    place.middleRows<3>(6) = 0.5 * h * turn_rate;
    place.middleRows<3>(9) = turn_rate;
  }
  // One call per matrix: rows of different matrices share no memory.
  Eigen::Matrix<double, 12, 12 + 12 + 1 + kMaxColumns> all;
  const Eigen::Index width = 25 + this->width();
  all.leftCols<12>() = out.from;
  all.middleCols<12>(12) = out.to;
  all.col(24) = out.r;
  all.middleCols(25, width - 25) = out.columns;
  whiten(all.leftCols(width));
  out.from = all.leftCols<12>();
  out.to = all.middleCols<12>(12);
  out.r = all.col(24);
  out.columns = all.middleCols(25, width - 25);
}

Residuals::Moment Residuals::moment_of(const VectorFix& fix, const BodyState& x, bool derivatives) const {
  constexpr double kAtNode_s = 1e-6;  // below: rounding of stamps, which moves nothing that a sensor shows
  const double node_s = flight_.time_s(fix.node), t_s = node_s + fix.late_s;
  if (std::fabs(fix.late_s) < kAtNode_s) return {x, node_s, false};
  if (!derivatives) return {model_.step(x, input_, hint_, node_s, t_s, 1), t_s, true};
  const auto step = flight_.slopes_by_middle ? &Model::step_by_middle : static_cast<StepWithSlopes>(&Model::step);
  return {(model_.*step)(x, input_, hint_, node_s, t_s, 1, moment_by_state_, moment_by_), t_s, true};
}

// The series holds means over steps, which belong to their middles: between the two about the measurement, or that of the linked one.
Residuals::ExtraWrench Residuals::extra_wrench(const VectorFix& fix) const {
  const std::size_t k = fix.node;
  const bool before = k > 0 && flight_.linked[k - 1], after = k + 1 < flight_.nodes && flight_.linked[k];
  const double share = before && after ? std::clamp(0.5 + fix.late_s / flight_.step_s, 0.0, 1.0) : after || !before ? 1.0 : 0.0;
  if (share >= 1.0) return extra_->at<6>(extra_->wrench, std::min(k, flight_.nodes - 2));
  return (1.0 - share) * extra_->at<6>(extra_->wrench, k - 1) + share * extra_->at<6>(extra_->wrench, std::min(k, flight_.nodes - 2));
}

void Residuals::back_to_node(const VectorFix& fix, const Moment& at, RowsBy<3>& out) const {
  if (!at.moved) return;
  for (std::size_t c = 0; c < dynamic_.size(); ++c)
    out.columns.col(dynamic_[c]) += out.state * moment_by_.col(static_cast<Eigen::Index>(c));
  if (extra_) {
    const ExtraWrench wrench = extra_wrench(fix);
    const Matrix3d push = fix.late_s / model_.values()[kMass] * at.x.q_WB.toRotationMatrix();
    out.columns.rightCols(extra_->count) += out.state.middleCols<3>(3) * (push * wrench.topRows<3>()) +
                                            out.state.middleCols<3>(9) * (fix.late_s * inverse_inertia_ * wrench.bottomRows<3>());
  }
  out.state *= moment_by_state_;
}

MeasurementChange Residuals::terms_read(const BodyState& x, double t_s, bool derivatives) const {
  const RotorInputSample u = input_.at(t_s, hint_, false);
  const SensedMoment at = sensed_moment(model_, x, u, t_s, t_s - flight_.time_s(0));
  if (!derivatives) return measurement_change(model_.values(), x, u, at, {}, {});
  measurement_slope_ = measurement_by_state(model_.values(), x, u, at);
  return measurement_change(model_.values(), x, u, at, measurement_parameters_, measurement_by_);
}

void Residuals::pose(const PoseFix& fix, const BodyState& x, RowsBy<6>& out, bool derivatives) const {
  const ModelValues& v = model_.values();
  const double ahead = fix.late_s - v[kPoseDelay];
  const Vector3d r(v[kOffsetX], v[kOffsetY], v[kOffsetZ]), turn = ahead * x.w_B_rad_s;
  const Eigen::Quaterniond q = x.q_WB * exp_q(turn), q_BS = v.q_BS();
  const Matrix3d rot = q.toRotationMatrix();
  const MeasurementChange change = reads_ ? terms_read(x, flight_.time_s(fix.node), derivatives) : MeasurementChange{};
  out.r.head<3>() = fix.value.p_W_m - (x.p_W_m + ahead * x.v_W_m_s + rot * r) - change.position_W_m;
  out.r.tail<3>() = log_q((q * exp_q(change.turn_B_rad) * q_BS).conjugate() * fix.value.q_WS);
  if (derivatives) {
    const Matrix3d lever = rot * skew(r), from_body = -inverse_left_jacobian(out.r.tail<3>()) * q_BS.toRotationMatrix().transpose();
    const Matrix3d start = exp_q(turn).toRotationMatrix().transpose(), rate = ahead * right_jacobian(turn);
    out.state.setZero();
    out.state.block<3, 3>(0, 0) = -Matrix3d::Identity();
    out.state.block<3, 3>(0, 3) = -ahead * Matrix3d::Identity();
    out.state.block<3, 3>(0, 6) = lever * start;
    out.state.block<3, 3>(0, 9) = lever * rate;
    out.state.block<3, 3>(3, 6) = from_body * start;
    out.state.block<3, 3>(3, 9) = from_body * rate;
    out.columns.setZero(6, width());
    Matrix3d by_offset = rot;
    if (reads_) {
      // Terms read the place at the node, not at the moment the pose shows.
      by_offset += measurement_slope_.position_W_m.leftCols<3>() * x.q_WB.toRotationMatrix();
      out.state.topRows<3>() -= measurement_slope_.position_W_m;
      out.state.bottomRows<3>() -= q_BS.toRotationMatrix().transpose() * measurement_slope_.turn_B_rad;
    }
    const Matrix3d sensor_turn = -inverse_left_jacobian(out.r.tail<3>()) * right_jacobian(Vector3d(v[kTurnX], v[kTurnY], v[kTurnZ]));
    for (int i = 0; i < 3; ++i) {
      if (const int c = place_of(kOffsetX + i); c >= 0) out.columns.col(c).head<3>() = -by_offset.col(i);
      if (const int c = place_of(kTurnX + i); c >= 0) out.columns.col(c).tail<3>() = sensor_turn.col(i);
    }
    if (const int c = place_of(kPoseDelay); c >= 0) {
      out.columns.col(c).head<3>() = x.v_W_m_s - lever * x.w_B_rad_s;
      out.columns.col(c).tail<3>() = -from_body * x.w_B_rad_s;
    }
    for (std::size_t k = 0; k < measurement_places_.size(); ++k) {
      out.columns.col(measurement_places_[k]).head<3>() = -measurement_by_[k].position_W_m;
      out.columns.col(measurement_places_[k]).tail<3>() = -(q_BS.conjugate() * measurement_by_[k].turn_B_rad);
    }
    const std::ptrdiff_t index = &fix - flight_.pose.data();  // a position alone comes as a fix of its own
    if (extra_ && !extra_->pose.empty() && index >= 0 && index < static_cast<std::ptrdiff_t>(flight_.pose.size())) {
      out.columns.rightCols(extra_->count) = -extra_->at<6>(extra_->pose, static_cast<std::size_t>(index));
    }
  }
  for (Eigen::Index i = 0; i < 6; ++i) {
    const double weight = 1.0 / (i < 3 ? noise_.position_m[i] : noise_.attitude_rad[i - 3]);
    out.r[i] *= weight;
    if (!derivatives) continue;
    out.state.row(i) *= weight;
    out.columns.row(i) *= weight;
  }
}

void Residuals::position(const VectorFix& fix, const BodyState& x, RowsBy<3>& out, bool derivatives) const {
  RowsBy<6> six;
  pose({fix.node, fix.late_s, {fix.value, x.q_WB * model_.values().q_BS()}}, x, six, derivatives);
  out.r = six.r.head<3>();
  if (!derivatives) return;
  out.state = six.state.topRows<3>();
  out.columns = six.columns.topRows<3>();
}

// Velocity of the sensor in W: that of the centre of mass plus Ω x r.
void Residuals::velocity(const VectorFix& fix, const BodyState& node, RowsBy<3>& out, bool derivatives) const {
  const ModelValues& v = model_.values();
  const Moment at = moment_of(fix, node, derivatives);
  const BodyState& x = at.x;
  const Vector3d r(v[kOffsetX], v[kOffsetY], v[kOffsetZ]), swing = x.w_B_rad_s.cross(r);
  const Matrix3d rot = x.q_WB.toRotationMatrix();
  const Vector3d weight = noise_.velocity_m_s.cwiseInverse();
  const MeasurementChange change = reads_ ? terms_read(x, at.t_s, derivatives) : MeasurementChange{};
  out.r = weight.cwiseProduct(fix.value - x.v_W_m_s - rot * swing - change.velocity_W_m_s);
  if (!derivatives) return;
  out.state.setZero();
  out.state.block<3, 3>(0, 3) = -Matrix3d(weight.asDiagonal());
  out.state.block<3, 3>(0, 6) = weight.asDiagonal() * (rot * skew(swing));
  out.state.block<3, 3>(0, 9) = weight.asDiagonal() * (rot * skew(r));
  if (reads_) out.state -= weight.asDiagonal() * measurement_slope_.velocity_W_m_s;
  out.columns.setZero(3, width());
  for (std::size_t k = 0; k < measurement_places_.size(); ++k)
    out.columns.col(measurement_places_[k]) = -weight.cwiseProduct(measurement_by_[k].velocity_W_m_s);
  Matrix3d by_offset = -(weight.asDiagonal() * (rot * skew(x.w_B_rad_s)));
  if (reads_) by_offset -= weight.asDiagonal() * (measurement_slope_.velocity_W_m_s.middleCols<3>(3) * (rot * skew(x.w_B_rad_s)));
  for (int i = 0; i < 3; ++i) {
    if (const int c = place_of(kOffsetX + i); c >= 0) out.columns.col(c) = by_offset.col(i);
  }
  back_to_node(fix, at, out);
}

void Residuals::gyro(const VectorFix& fix, const BodyState& node, RowsBy<3>& out, bool derivatives) const {
  const ModelValues& v = model_.values();
  const Moment at = moment_of(fix, node, derivatives);
  const BodyState& x = at.x;
  const Vector3d weight = noise_.gyro_rad_s.cwiseInverse();
  const MeasurementChange change = reads_ ? terms_read(x, at.t_s, derivatives) : MeasurementChange{};
  out.r = weight.cwiseProduct(fix.value - x.w_B_rad_s - Vector3d(v[kGyroBiasX], v[kGyroBiasY], v[kGyroBiasZ]) - change.gyro_B_rad_s);
  if (!derivatives) return;
  out.state.setZero();
  out.state.block<3, 3>(0, 9) = -Matrix3d(weight.asDiagonal());
  if (reads_) out.state -= weight.asDiagonal() * measurement_slope_.gyro_B_rad_s;
  out.columns.setZero(3, width());
  for (int i = 0; i < 3; ++i) {
    if (const int c = place_of(kGyroBiasX + i); c >= 0) out.columns(i, c) = -weight[i];
  }
  for (std::size_t k = 0; k < measurement_places_.size(); ++k)
    out.columns.col(measurement_places_[k]) = -weight.cwiseProduct(measurement_by_[k].gyro_B_rad_s);
  if (extra_ && !extra_->gyro.empty()) {
    out.columns.rightCols(extra_->count) =
        -(weight.asDiagonal() * extra_->at<3>(extra_->gyro, static_cast<std::size_t>(&fix - flight_.gyro.data())));
  }
  back_to_node(fix, at, out);
}

// Specific force at the sensor's place: F/m + Ω̇ x r + Ω x (Ω x r), plus bias.
void Residuals::accel(const VectorFix& fix, const BodyState& node, RowsBy<3>& out, bool derivatives) const {
  const ModelValues& v = model_.values();
  const Moment at = moment_of(fix, node, derivatives);
  const BodyState& x = at.x;
  const double t = at.t_s;
  bool input_columns = false;
  for (const int p : kRotorInputParameters) input_columns = input_columns || place_of(p) >= 0;
  const RotorInputSample u = input_.at(t, hint_, derivatives && input_columns);
  InstantJacobian j;
  const Instant now = model_.instant(x, u, t, derivatives ? &j : nullptr);
  const Vector3d r(v[kImuX], v[kImuY], v[kImuZ]), &w = x.w_B_rad_s, weight = noise_.accel_m_s2.cwiseInverse();
  const Vector3d expected = specific_force_at_imu(v, x, now);
  const MeasurementChange change = reads_ ? terms_read(x, t, derivatives) : MeasurementChange{};
  out.r = weight.cwiseProduct(fix.value - expected - Vector3d(v[kAccelBiasX], v[kAccelBiasY], v[kAccelBiasZ]) - change.accel_B_m_s2);
  if (!derivatives) return;
  Matrix3d minus = -Matrix3d(weight.asDiagonal()), as_read = minus;
  const Matrix3d lever = skew(r);
  if (reads_) minus *= Matrix3d::Identity() + measurement_slope_.accel_by_specific_force;  // of what depends on the force itself
  out.state = minus * (j.force_by_state - lever * j.angular_by_state);
  out.state.block<3, 3>(0, 9) -= minus * (skew(w.cross(r)) + skew(w) * lever);
  if (reads_) out.state += as_read * measurement_slope_.accel_B_m_s2;
  out.columns.setZero(3, width());
  for (std::size_t c = 0; c < dynamic_.size(); ++c) {
    const auto from = static_cast<Eigen::Index>(c);
    out.columns.col(dynamic_[c]) = minus * (j.force_by.col(from) - lever * j.angular_by.col(from));
  }
  for (std::size_t k = 0; k < measurement_places_.size(); ++k)
    out.columns.col(measurement_places_[k]) += as_read * measurement_by_[k].accel_B_m_s2;
  const Matrix3d by_place = minus * (skew(now.angular_acceleration_B_rad_s2) + skew(w) * skew(w));
  for (int i = 0; i < 3; ++i) {
    if (const int c = place_of(kAccelBiasX + i); c >= 0) out.columns(i, c) = -weight[i];
    if (const int c = place_of(kImuX + i); c >= 0) out.columns.col(c) = by_place.col(i);
  }
  if (extra_) {
    const ExtraWrench wrench = extra_wrench(fix);
    auto place = out.columns.rightCols(extra_->count);
    place = minus * (wrench.topRows<3>() / v[kMass] - lever * (inverse_inertia_ * wrench.bottomRows<3>()));
    if (!extra_->accel.empty()) place += as_read * extra_->at<3>(extra_->accel, static_cast<std::size_t>(&fix - flight_.accel.data()));
  }
  back_to_node(fix, at, out);
}

Eigen::Matrix<double, 12, 1> Residuals::anchor(const BodyState& guess, const BodyState& x, StateJacobian& by_state) const {
  Eigen::Matrix<double, 12, 1> r = difference(guess, x);
  by_state.setIdentity();
  by_state.block<3, 3>(6, 6) = inverse_right_jacobian(r.segment<3>(6));
  for (Eigen::Index i = 0; i < 12; ++i) {
    const double weight = flight_.anchor[i] > 0.0 ? 1.0 / flight_.anchor[i] : 0.0;
    r[i] *= weight;
    by_state.row(i) *= weight;
  }
  return r;
}

}  // namespace rotorloop::estimate
