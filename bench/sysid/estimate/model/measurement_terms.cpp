#include "bench/sysid/estimate/model/measurement_terms.hpp"

#include <algorithm>

#include "bench/sysid/estimate/model/load_input.hpp"
#include "bench/sysid/estimate/model/rotations.hpp"
#include "host/effects/loads.hpp"
#include "host/effects/term.hpp"

namespace rotorloop::estimate {
namespace {

using Eigen::Vector3d;
using host::ExtraDual;
constexpr std::size_t kWidth = 8;  // directions of ExtraDual

bool reads(const host::Term& term) { return term.plain.reading != nullptr; }

}  // namespace

bool has_measurement_terms(const host::TermList& terms) {
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (reads(terms.term(i))) return true;
  }
  return false;
}

std::vector<int> measurement_parameters(const host::TermList& terms) {
  std::vector<int> out;
  for (std::size_t k = 0; k < terms.parameters(); ++k) {
    if (reads(terms.term(terms.term_of(k)))) out.push_back(kCoreParameters + static_cast<int>(k));
  }
  return out;
}

Vector3d specific_force_at_imu(const ModelValues& v, const BodyState& x, const Instant& now) {
  const Vector3d r(v[kImuX], v[kImuY], v[kImuZ]), &w = x.w_B_rad_s;
  return now.specific_force_B_m_s2 + now.angular_acceleration_B_rad_s2.cross(r) + w.cross(w.cross(r));
}

SensedMoment sensed_moment(const Model& model, const BodyState& x, const RotorInputSample& u, double t_s, double since_start_s) {
  const Instant now = model.instant(x, u, t_s);
  return {t_s, since_start_s, now.angular_acceleration_B_rad_s2, specific_force_at_imu(model.values(), x, now)};
}

MeasurementChange measurement_change(const ModelValues& v, const BodyState& x, const RotorInputSample& u, const SensedMoment& at,
                                     std::span<const int> parameters, std::span<MeasurementChange> by) {
  const Eigen::Matrix3d rot = x.q_WB.toRotationMatrix(), world_B = rot.transpose();
  const Vector3d lever(v[kOffsetX], v[kOffsetY], v[kOffsetZ]);
  const Vector3d place = x.p_W_m + rot * lever, speed = x.v_W_m_s + rot * x.w_B_rad_s.cross(lever);
  const auto in = load_input<ExtraDual>(x, world_B, world_B * x.v_W_m_s, u, at.t_s);
  MeasurementChange out;
  for (std::size_t first = 0; first == 0 || first < parameters.size(); first += kWidth) {
    const std::size_t count = std::min(kWidth, parameters.size() - first);
    std::array<ExtraDual, host::kMaxTermParameters> c;
    for (std::size_t k = 0; k < v.terms.parameters(); ++k) c[k] = ExtraDual(v.values[kCoreParameters + k]);
    for (std::size_t j = 0; j < count; ++j) c[static_cast<std::size_t>(parameters[first + j] - kCoreParameters)].d[j] = 1.0;
    const auto vec = [](const Vector3d& a) { return host::Vec3<ExtraDual>{ExtraDual(a[0]), ExtraDual(a[1]), ExtraDual(a[2])}; };
    host::ReadingState<ExtraDual> r{in, vec(place), vec(speed), vec(at.angular_acceleration_B_rad_s2), v.geometry.mass_kg};
    r.specific_force_B_m_s2 = vec(at.specific_force_B_m_s2);
    r.since_start_s = at.since_start_s;
    std::array<ExtraDual, host::kMaxMemory> memory;
    for (std::size_t k = 0; k < v.terms.memory(); ++k) memory[k] = ExtraDual(u.memory[k]);
    const host::TermSet<ExtraDual> set(v.terms, c.data(), memory.data());
    host::readings(r, set);
    const auto take = [&](const host::Vec3<ExtraDual>& from, Vector3d MeasurementChange::*to) {
      out.*to = {from.x.a, from.y.a, from.z.a};
      for (std::size_t j = 0; j < count; ++j) by[first + j].*to = {from.x.d[j], from.y.d[j], from.z.d[j]};
    };
    take(r.position_W_m, &MeasurementChange::position_W_m);
    take(r.velocity_W_m_s, &MeasurementChange::velocity_W_m_s);
    take(r.turn_B_rad, &MeasurementChange::turn_B_rad);
    take(r.gyro_B_rad_s, &MeasurementChange::gyro_B_rad_s);
    take(r.accel_B_m_s2, &MeasurementChange::accel_B_m_s2);
  }
  return out;
}

MeasurementSlope measurement_by_state(const ModelValues& v, const BodyState& x, const RotorInputSample& u, const SensedMoment& at) {
  using host::PlaceDual;
  const Eigen::Matrix3d rot = x.q_WB.toRotationMatrix(), world_B = rot.transpose();
  const Vector3d lever(v[kOffsetX], v[kOffsetY], v[kOffsetZ]), v_B = world_B * x.v_W_m_s, swing = x.w_B_rad_s.cross(lever);
  auto in = load_input<PlaceDual>(x, world_B, v_B, u, at.t_s);
  seed_motion(in);
  // A vector with its derivatives by the directions that begin at `first`.
  const auto seeded = [](const Vector3d& a, std::initializer_list<std::pair<int, Eigen::Matrix3d>> by) {
    host::Vec3<PlaceDual> out{PlaceDual(a[0]), PlaceDual(a[1]), PlaceDual(a[2])};
    PlaceDual* const rows[] = {&out.x, &out.y, &out.z};
    for (const auto& [first, slope] : by) {
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) rows[i]->d[static_cast<std::size_t>(first + j)] = slope(i, j);
      }
    }
    return out;
  };
  // Directions of velocity and attitude are those of the loads: the one in body axes, the other with that held.
  host::ReadingState<PlaceDual> r{
      in, seeded(x.p_W_m + rot * lever, {{kDirPlace, Eigen::Matrix3d::Identity()}, {kDirAttitude, -rot * skew(lever)}}),
      seeded(x.v_W_m_s + rot * swing, {{kDirVelocity, rot}, {kDirAttitude, -rot * skew(v_B + swing)}, {kDirRates, -rot * skew(lever)}}),
      seeded(at.angular_acceleration_B_rad_s2, {}), v.geometry.mass_kg};
  // Directions of the loads' parameters, which nothing reads here.
  constexpr int kDirSpecificForce = kDirPlace + 3;
  r.specific_force_B_m_s2 = seeded(at.specific_force_B_m_s2, {{kDirSpecificForce, Eigen::Matrix3d::Identity()}});
  r.since_start_s = at.since_start_s;
  std::array<PlaceDual, host::kMaxTermParameters> c;
  for (std::size_t k = 0; k < v.terms.parameters(); ++k) c[k] = PlaceDual(v.values[kCoreParameters + k]);
  std::array<PlaceDual, host::kMaxMemory> memory;
  for (std::size_t k = 0; k < v.terms.memory(); ++k) memory[k] = PlaceDual(u.memory[k]);
  const host::TermSet<PlaceDual> set(v.terms, c.data(), memory.data());
  host::readings(r, set);
  const auto by = [](const host::Vec3<PlaceDual>& from, int first) {
    const PlaceDual* const rows[] = {&from.x, &from.y, &from.z};
    Eigen::Matrix3d out;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) out(i, j) = rows[i]->d[static_cast<std::size_t>(first + j)];
    }
    return out;
  };
  const auto slope = [&](const host::Vec3<PlaceDual>& from) {
    const Eigen::Matrix3d velocity = by(from, kDirVelocity);
    Eigen::Matrix<double, 3, 12> out;
    out << by(from, kDirPlace), velocity * world_B, velocity * skew(v_B) + by(from, kDirAttitude), by(from, kDirRates);
    return out;
  };
  return {slope(r.position_W_m), slope(r.velocity_W_m_s), slope(r.turn_B_rad),
          slope(r.gyro_B_rad_s), slope(r.accel_B_m_s2),   by(r.accel_B_m_s2, kDirSpecificForce)};
}

}  // namespace rotorloop::estimate
