// The map is made from the induced velocities that the solve leaves in its warm start. Written a second time in plain scalar code,
// so that its integral checks the solve's vector code (test: Disk.*).
#include "sim/rotor/disk.hpp"

#include <cmath>
#include <numbers>

#include "host/base/elementary.hpp"
#include "sim/rotor/annulus_flow.hpp"

namespace rotorloop::sim {
namespace {
// Of the chord line against the flow (x towards the leading edge, y up through the chord), in (-pi, pi].
double angle_of_attack_rad(double x, double y) { return x == 0.0 && y == 0.0 ? 0.0 : atan2_exact(y, x); }
}  // namespace

RotorDisk solve_rotor_disk(const Rotor& rotor, const RotorCondition& condition) {
  RotorDisk disk;
  RotorWarmStart solved;
  disk.loads = solve_rotor(rotor, condition, solved);
  if (disk.loads.status == InflowStatus::not_converged) return disk;
  disk.radial = rotor.resolution().radial;
  disk.azimuth = rotor.resolution().azimuth;
  // As in the solve: a clockwise rotor is the mirror image in the xz plane.
  const double mirror = condition.spin >= 0 ? 1.0 : -1.0;
  const double vx = condition.v_R_m_s.x(), vy = mirror * condition.v_R_m_s.y(), climb = condition.v_R_m_s.z();
  const double wx = mirror * condition.w_R_rad_s.x(), wy = condition.w_R_rad_s.y();
  const double omega = condition.omega_rad_s + mirror * condition.w_R_rad_s.z();
  const double edge = std::sqrt(vx * vx + vy * vy);
  const int n = disk.azimuth;
  for (int i = 0; i < disk.radial; ++i) {
    const Annulus& a = rotor.annuli()[static_cast<std::size_t>(i)];
    const double v = solved.induced_m_s[static_cast<std::size_t>(i)], w = climb + v, tip = omega * a.r_m;
    const double swirl = induced_swirl(v, w, tip), skew = wake_skew(v, w, edge) * (a.r_m / rotor.radius_m());
    for (int k = 0; k < n; ++k) {
      const double c = rotor.cos_psi()[k], s = rotor.sin_psi()[k];
      const double upstream = edge > 0.0 ? (vx * c + vy * s) / edge : 0.0;
      const double induced = v - skew * upstream;
      const double t = tip - swirl + vy * c - vx * s;
      const double u = climb + induced + a.r_m * (wx * s - wy * c);
      const double x = t * a.cos_twist + u * a.sin_twist, y = t * a.sin_twist - u * a.cos_twist;
      const double speed = std::sqrt(t * t + u * u);
      const double reynolds = speed * a.chord_m * condition.density_kg_m3 / kViscosity_Pa_s;
      const double p = u / (std::fabs(t) + std::fabs(u) + kTiny);
      const double q = t < 0.0 ? (u < 0.0 ? -2.0 : 2.0) - p : p;
      const SectionForce section = lookup(rotor.table(a.table), q, reynolds);
      // Blades pass this circle blades / (2 pi r) times per metre.
      const double scale = 0.5 * condition.density_kg_m3 * a.solidity * speed * speed;
      const double cell_rad = 2.0 * std::numbers::pi / n;
      const double psi = cell_rad * (k + 0.5);
      disk.cells.push_back({.r_m = a.r_m,
                            .psi_rad = mirror > 0.0 ? psi : 2.0 * std::numbers::pi - psi,
                            .area_m2 = cell_rad * a.r_m * a.weight_m,
                            .thrust_N_per_m2 = scale * section.up,
                            .torque_N_m_per_m2 = scale * a.r_m * section.drag,
                            .alpha_rad = angle_of_attack_rad(x, y),
                            .reynolds = reynolds,
                            .through_m_s = u,
                            .induced_m_s = induced,
                            .tangential_m_s = t});
    }
  }
  return disk;
}

}  // namespace rotorloop::sim
