// The solve of one rotor: its condition made ready for the kernel, the loads summed over the annuli that the kernel has balanced.
#include "sim/rotor/bem.hpp"

#include <cmath>
#include <numbers>

#include "sim/rotor/annulus_flow.hpp"

namespace rotorloop::sim {
namespace {
constexpr double kStoppedTip_m_s = 1.0;  // below this tip speed chord Reynolds numbers are under 1000: no polar holds
constexpr double kMaxSpeed_m_s = 1e5;    // beyond, squares lose their meaning; refused as not finite

bool usable(const RotorCondition& c) {
  const auto fine = [](double x, double most) { return std::isfinite(x) && std::fabs(x) <= most; };
  for (int i = 0; i < 3; ++i)
    if (!fine(c.v_R_m_s[i], kMaxSpeed_m_s) || !fine(c.w_R_rad_s[i], kMaxSpeed_m_s)) return false;
  return fine(c.omega_rad_s, kMaxSpeed_m_s) && c.omega_rad_s >= 0.0 && std::isfinite(c.density_kg_m3) && c.density_kg_m3 >= 0.0;
}

// A clockwise rotor is solved as its mirror image in the xz plane: velocity is a vector, body rate an axial vector.
double mirror_of(const RotorCondition& condition) { return condition.spin >= 0 ? 1.0 : -1.0; }

void pose(const Rotor& rotor, const RotorCondition& condition, const RotorWarmStart& warm, kernel::Problem& p) {
  const double mirror = mirror_of(condition);
  const double vx = condition.v_R_m_s.x(), vy = mirror * condition.v_R_m_s.y();
  const double wx = mirror * condition.w_R_rad_s.x(), wy = condition.w_R_rad_s.y(), wz = mirror * condition.w_R_rad_s.z();
  p.annuli = &rotor.lanes();
  p.count = rotor.resolution().radial;
  p.half_azimuth = rotor.resolution().azimuth / 2;
  p.max_iterations = rotor.resolution().max_iterations;
  p.omega_rad_s = condition.omega_rad_s + wz;
  p.climb_m_s = condition.v_R_m_s.z();
  p.edge_m_s = std::sqrt(vx * vx + vy * vy);
  p.rate_rad_s = std::sqrt(wx * wx + wy * wy);
  p.radius_m = rotor.radius_m();
  p.reynolds_per_m2_s = condition.density_kg_m3 / kViscosity_Pa_s;
  p.cosine = rotor.cos_psi();
  p.sine = rotor.sin_psi();
  const double ex = p.edge_m_s > 0.0 ? vx / p.edge_m_s : 0.0, ey = p.edge_m_s > 0.0 ? vy / p.edge_m_s : 0.0;
  for (int k = 0; k < p.half_azimuth; ++k) {
    p.tangential[k] = vy * p.cosine[k] - vx * p.sine[k];
    p.radial[k] = vx * p.cosine[k] + vy * p.sine[k];
    p.flap[k] = wx * p.sine[k] - wy * p.cosine[k];
    p.skew[k] = -(ex * p.cosine[k] + ey * p.sine[k]);
  }
  p.guess_m_s = 0.1 * std::fabs(p.omega_rad_s) * rotor.radius_m();  // a typical inflow ratio in hover
  p.slope_m_s = 3.0 * p.guess_m_s + 0.5 * p.edge_m_s + std::fabs(p.climb_m_s) + kTiny;
  p.warm = warm.valid && warm.omega_rad_s > 1.0 && p.omega_rad_s < 1.5 * warm.omega_rad_s && p.omega_rad_s > 0.5 * warm.omega_rad_s;
  p.settled = p.warm && warm.solves >= 2;
  p.omega_ratio = p.warm ? p.omega_rad_s / warm.omega_rad_s : 1.0;
  p.climbed_m_s = p.climb_m_s - warm.climb_m_s;
}

// Sums over the disk, before the common factor rho/2 * blades / azimuth.
struct Disk {
  double thrust = 0, torque = 0, x = 0, y = 0, roll = 0, pitch = 0, induced_area = 0, ring_area = 0;
};
Disk sum(const Rotor& rotor, const RotorWarmStart& warm, const kernel::Solution& solution) {
  Disk s;
  std::size_t i = 0;
  for (const Annulus& a : rotor.annuli()) {
    const double cw = a.chord_m * a.weight_m, crw = cw * a.r_m;
    s.thrust += cw * solution.sums[kernel::kUp][i];
    s.torque += crw * solution.sums[kernel::kDrag][i];
    s.x += cw * solution.sums[kernel::kInPlaneX][i];
    s.y += cw * solution.sums[kernel::kInPlaneY][i];
    s.roll += crw * solution.sums[kernel::kRoll][i];
    s.pitch += crw * solution.sums[kernel::kPitch][i];
    s.induced_area += a.r_m * a.weight_m * warm.induced_m_s[i];
    s.ring_area += a.r_m * a.weight_m * solution.ring[i];
    ++i;
  }
  return s;
}

void run(RotorKernel kernel, const kernel::Problem& problem, RotorWarmStart& warm, kernel::Solution& solution) {
  const kernel::Memory memory = {warm.induced_m_s.data(), warm.missed_m_s.data(), warm.last_missed_m_s.data(), warm.slope_m_s.data(),
                                 warm.through_m_s.data()};
#if defined(__x86_64__)
  if (kernel == RotorKernel::v4) return kernel::solve_v4(problem, memory, solution);
  if (kernel == RotorKernel::v3) return kernel::solve_v3(problem, memory, solution);
#else
  (void)kernel;
#endif
  kernel::solve_baseline(problem, memory, solution);
}
}  // namespace

bool runs_here(RotorKernel kernel) {
  if (kernel == RotorKernel::baseline) return true;
#if defined(__x86_64__)
  if (kernel == RotorKernel::v3) return __builtin_cpu_supports("avx2");
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
#else
  return false;
#endif
}
RotorKernel fastest_rotor_kernel() {
  static const RotorKernel fastest =
      runs_here(RotorKernel::v4) ? RotorKernel::v4 : (runs_here(RotorKernel::v3) ? RotorKernel::v3 : RotorKernel::baseline);
  return fastest;
}

RotorLoads solve_rotor(const Rotor& rotor, const RotorCondition& condition, RotorWarmStart& warm, RotorKernel kernel) {
  RotorLoads loads;
  if (!usable(condition)) {
    warm.valid = false;
    loads.status = InflowStatus::not_converged;
    return loads;
  }
  kernel::Problem problem;
  pose(rotor, condition, warm, problem);
  kernel::Solution solution;
  solution.evaluations = 0;
  solution.converged = true;
  run(kernel, problem, warm, solution);
  warm.solves = problem.warm ? warm.solves + 1 : 0;
  warm.valid = solution.converged;
  warm.omega_rad_s = problem.omega_rad_s;
  warm.climb_m_s = problem.climb_m_s;

  const Disk s = sum(rotor, warm, solution);
  const double mirror = mirror_of(condition), scale = 0.5 * condition.density_kg_m3 * rotor.blades() / rotor.resolution().azimuth;
  loads.iterations = solution.evaluations;
  loads.shaft_torque_N_m = scale * s.torque;
  loads.force_R_N = {scale * s.x, mirror * scale * s.y, scale * s.thrust};
  loads.moment_R_N_m = {mirror * scale * s.roll, scale * s.pitch, -mirror * loads.shaft_torque_N_m};
  const double area = rotor.disk_area_m2() / (2.0 * std::numbers::pi);
  loads.induced_m_s = s.induced_area / area;
  if (!solution.converged) {
    loads.status = InflowStatus::not_converged;
  } else if (condition.omega_rad_s * rotor.radius_m() < kStoppedTip_m_s) {
    loads.status = InflowStatus::stopped;
  } else if (s.ring_area > 0.5 * area) {
    loads.status = InflowStatus::vortex_ring;
  } else if (loads.shaft_torque_N_m < 0.0 || loads.force_R_N.z() * (problem.climb_m_s + loads.induced_m_s) < 0.0) {
    loads.status = InflowStatus::windmill;
  }
  return loads;
}

void solve_rotors(std::span<RotorJob> jobs, RotorKernel kernel) {
  for (RotorJob& job : jobs) job.loads = solve_rotor(*job.rotor, job.condition, *job.warm_start, kernel);
}

}  // namespace rotorloop::sim
