#include "bench/identify/reading_terms.hpp"

#include <algorithm>

#include "bench/identify/load_input.hpp"
#include "host/effects/term.hpp"

namespace rotorloop::bench {
namespace {

using Eigen::Vector3d;
using host::ExtraDual;
constexpr std::size_t kWidth = 8;  // directions of ExtraDual

bool reads(const host::Term& term) { return term.plain.reading != nullptr; }

}  // namespace

bool has_readings(const host::TermList& terms) {
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (reads(terms.term(i))) return true;
  }
  return false;
}

std::vector<int> reading_parameters(const host::TermList& terms) {
  std::vector<int> out;
  for (std::size_t k = 0; k < terms.parameters(); ++k) {
    if (reads(terms.term(terms.term_of(k)))) out.push_back(kCoreParameters + static_cast<int>(k));
  }
  return out;
}

ReadingChange reading_change(const ModelValues& v, const BodyState& x, const RotorInputSample& u, double t_s, const Vector3d& angular,
                             std::span<const int> parameters, std::span<ReadingChange> by) {
  const Eigen::Matrix3d rot = x.q_WB.toRotationMatrix(), world_B = rot.transpose();
  const Vector3d lever(v[kOffsetX], v[kOffsetY], v[kOffsetZ]);
  const Vector3d place = x.p_W_m + rot * lever, speed = x.v_W_m_s + rot * x.w_B_rad_s.cross(lever);
  const auto in = load_input<ExtraDual>(x, world_B, world_B * x.v_W_m_s, u, t_s);
  ReadingChange out;
  for (std::size_t first = 0; first == 0 || first < parameters.size(); first += kWidth) {
    const std::size_t count = std::min(kWidth, parameters.size() - first);
    std::array<ExtraDual, host::kMaxTermParameters> c;
    for (std::size_t k = 0; k < v.terms.parameters(); ++k) c[k] = ExtraDual(v.values[kCoreParameters + k]);
    for (std::size_t j = 0; j < count; ++j) c[static_cast<std::size_t>(parameters[first + j] - kCoreParameters)].d[j] = 1.0;
    const auto vec = [](const Vector3d& a) { return host::Vec3<ExtraDual>{ExtraDual(a[0]), ExtraDual(a[1]), ExtraDual(a[2])}; };
    host::ReadingState<ExtraDual> r{in, vec(place), vec(speed), vec(angular)};
    std::array<ExtraDual, host::kMaxMemory> memory;
    for (std::size_t k = 0; k < v.terms.memory(); ++k) memory[k] = ExtraDual(u.memory[k]);
    const host::TermSet<ExtraDual> set(v.terms, c.data(), memory.data());
    host::readings(r, set);
    const auto take = [&](const host::Vec3<ExtraDual>& from, Vector3d ReadingChange::*to) {
      out.*to = {from.x.a, from.y.a, from.z.a};
      for (std::size_t j = 0; j < count; ++j) by[first + j].*to = {from.x.d[j], from.y.d[j], from.z.d[j]};
    };
    take(r.position_W_m, &ReadingChange::position_W_m);
    take(r.velocity_W_m_s, &ReadingChange::velocity_W_m_s);
    take(r.turn_B_rad, &ReadingChange::turn_B_rad);
    take(r.gyro_B_rad_s, &ReadingChange::gyro_B_rad_s);
    take(r.accel_B_m_s2, &ReadingChange::accel_B_m_s2);
  }
  return out;
}

}  // namespace rotorloop::bench
