// The solve. Each annulus is one scalar equation in its induced velocity v,
//   g(v) = F v U(v) - t(v) = 0,   t = dT / (4 pi rho r dr) from the blades,
// with one sign at v far above and the other far below: a root always lies between, and a bracketed secant search finds it.
// The inner loops run over azimuth on fixed arrays, so that gcc turns them into vector code without reordering any sum.
#include "sim/rotor/bem.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "host/base/elementary.hpp"
#include "host/base/error.hpp"
#include "sim/rotor/annulus_flow.hpp"
#include "sim/rotor/inflow.hpp"
#include "sim/rotor/prandtl.hpp"

namespace rotorloop::sim {
namespace {
constexpr double kStoppedTip_m_s = 1.0;  // below this tip speed chord Reynolds numbers are under 1000: no polar holds
// A step times the one before bounds the next error of a secant search; relative to the speeds squared.
constexpr double kStepProduct = 7e-13;
constexpr double kStepAlone = 1e-11;
constexpr double kMaxSpeed_m_s = 1e5;  // beyond, squares lose their meaning; refused as not finite

// Arrays of the usual resolution are kept small: the solve works in the first level cache.
constexpr std::size_t capacity(int azimuth) { return static_cast<std::size_t>(azimuth > 0 ? azimuth : kMaxAzimuth); }

// Everything of a condition that does not depend on the annulus, for spin +1.
template <int kAzimuth>
struct Azimuth {
  alignas(16) double tangential[capacity(kAzimuth)];  // of hub velocity, against the blade's motion
  alignas(16) double radial[capacity(kAzimuth)];
  alignas(16) double flap[capacity(kAzimuth)];  // body rate: upward speed per metre of radius
  alignas(16) double skew[capacity(kAzimuth)];  // -1 upstream, +1 downstream
};

template <int kAzimuth>
struct Forces {
  alignas(16) double up[capacity(kAzimuth)];      // thrust per length, over rho/2
  alignas(16) double drag[capacity(kAzimuth)];    // against rotation
  alignas(16) double radial[capacity(kAzimuth)];  // against the spanwise flow
};

struct Condition {
  double omega, climb, edge2, edge, rate, reynolds_per_W_chord;
};

inline ClCd load2(const double* p) {
  ClCd x;
  std::memcpy(&x, p, sizeof x);
  return x;
}
inline void store2(double* p, ClCd x) { std::memcpy(p, &x, sizeof x); }

struct Evaluation {
  double residual = 0.0, through = 0.0, ring = 0.0;
};

// One annulus at a trial v: residual, and the section forces left in `f`.
template <int kAzimuth>
Evaluation evaluate(const Rotor& rotor, const Annulus& a, const Condition& c, const Azimuth<kAzimuth>& az, double v, Forces<kAzimuth>& f) {
  const int n = kAzimuth > 0 ? kAzimuth : rotor.resolution().azimuth;
  const double w = c.climb + v, tip = c.omega * a.r_m;
  const double axial2 = w * w + kTiny;
  const double swirl = induced_swirl(v, w, tip), skew = wake_skew(v, w, c.edge) * (a.r_m / rotor.radius_m());

  alignas(16) double ut[capacity(kAzimuth)], up[capacity(kAzimuth)], speed[capacity(kAzimuth)], in_cell[capacity(kAzimuth)],
      in_row[capacity(kAzimuth)];
  alignas(16) int node[capacity(kAzimuth)];
  const SectionTable& table = rotor.table(a.table);
  const double reynolds_scale = c.reynolds_per_W_chord * a.chord_m / table.reynolds_step;
  const double reynolds_zero = table.reynolds_min / table.reynolds_step;
  const double ct = a.cos_twist, st = a.sin_twist;
  const double ut0 = tip - swirl;
  constexpr int kStride = SectionTable::kStride;
  constexpr double kCells = SectionTable::kDirections, kTopRow = SectionTable::kRows - 1 - 1e-9;
  for (int k = 0; k < n; ++k) {
    const double t = ut0 + az.tangential[k];
    const double u = w + a.r_m * az.flap[k] + skew * az.skew[k];
    const double x = t * ct + u * st, y = t * st - u * ct;
    const double s = std::sqrt(t * t + u * u);
    const double p = y / (std::fabs(x) + std::fabs(y) + kTiny);
    const double q = x < 0.0 ? (y < 0.0 ? -2.0 : 2.0) - p : p;
    ut[k] = t;
    up[k] = u;
    speed[k] = s;
    const double cell = q * (kCells / 4.0) + kCells / 2.0;
    const double row0 = s * reynolds_scale - reynolds_zero;
    const double row1 = row0 < 0.0 ? 0.0 : row0;
    const double row = row1 > kTopRow ? kTopRow : row1;
    const int j = static_cast<int>(cell), i = static_cast<int>(row);
    in_cell[k] = cell - j;
    in_row[k] = row - i;
    node[k] = i * kStride + j;
  }
  const ClCd* nodes = table.nodes.data();
  const auto section = [&](int k) {
    const ClCd* low = nodes + node[k];
    const ClCd* high = low + kStride;
    const ClCd wq = {in_cell[k], in_cell[k]}, ws = {in_row[k], in_row[k]};
    const ClCd l = low[0] + wq * (low[1] - low[0]);
    const ClCd h = high[0] + wq * (high[1] - high[0]);
    return l + ws * (h - l);
  };
  // Two azimuths at a time, turned from (cl, cd) pairs into a pair of cl and a pair of cd.
  const ClCd scale2 = {0.25 * a.solidity / n, 0.25 * a.solidity / n};
  ClCd sum_even = {0.0, 0.0}, sum_odd = {0.0, 0.0};
  for (int k = 0; k < n; k += 2) {
    const ClCd first = section(k), second = section(k + 1);
    const ClCd cl = {first[0], second[0]}, cd = {first[1], second[1]};
    const ClCd s = load2(speed + k), t = load2(ut + k), u = load2(up + k);
    const ClCd sl = s * cl, sd = s * cd;
    const ClCd lift = sl * t - sd * u;
    store2(f.up + k, lift);
    store2(f.drag + k, sl * u + sd * t);
    store2(f.radial + k, sd * load2(az.radial + k));
    (k & 2 ? sum_odd : sum_even) += lift;
  }
  const ClCd blades2 = (sum_even + sum_odd) * scale2;
  const Through through = mass_flow(v, c.climb, c.edge2);
  const double sheets2 = axial2 + kSheetSpread * v * v;
  const double loss =
      prandtl_loss(std::sqrt(std::sqrt((tip * tip + 0.5 * c.edge2 + sheets2) / sheets2)), a.sqrt_tip_loss, a.sqrt_root_loss);
  return {loss * v * through.speed_m_s - (blades2[0] + blades2[1]), through.speed_m_s, through.ring};
}

// Sums over the disk, before the common factor rho/2 * blades / azimuth.
struct Sums {
  double thrust = 0, torque = 0, x = 0, y = 0, roll = 0, pitch = 0, induced_area = 0, ring_area = 0;
};

template <int kAzimuth>
void accumulate(const Rotor& rotor, const Annulus& a, const Forces<kAzimuth>& f, const Forces<kAzimuth>& before, double step, double v,
                double ring, Sums& s) {
  const int n = kAzimuth > 0 ? kAzimuth : rotor.resolution().azimuth;
  const double *cosine = rotor.cos_psi(), *sine = rotor.sin_psi();
  // Opposite azimuths are paired first: in axial flow they cancel to exact zeros. Two lanes per sum, in a fixed order.
  const int h = n / 2;
  double up[2] = {}, drag[2] = {}, x[2] = {}, y[2] = {}, roll[2] = {}, pitch[2] = {};
  for (int k = 0; k < h; k += 2) {
    for (int lane = 0; lane < 2; ++lane) {
      const int i = k + lane, j = i + h;
      const double up_i = f.up[i] + step * (f.up[i] - before.up[i]), up_j = f.up[j] + step * (f.up[j] - before.up[j]);
      const double drag_i = f.drag[i] + step * (f.drag[i] - before.drag[i]), drag_j = f.drag[j] + step * (f.drag[j] - before.drag[j]);
      const double radial_i = f.radial[i] + step * (f.radial[i] - before.radial[i]);
      const double radial_j = f.radial[j] + step * (f.radial[j] - before.radial[j]);
      const double up_odd = up_i - up_j, drag_odd = drag_i - drag_j, radial_odd = radial_i - radial_j;
      up[lane] += up_i + up_j;
      drag[lane] += drag_i + drag_j;
      x[lane] += drag_odd * sine[i] - radial_odd * cosine[i];
      y[lane] -= drag_odd * cosine[i] + radial_odd * sine[i];
      roll[lane] += up_odd * sine[i];
      pitch[lane] -= up_odd * cosine[i];
    }
  }
  const double cw = a.chord_m * a.weight_m, crw = cw * a.r_m;
  s.thrust += cw * (up[0] + up[1]);
  s.torque += crw * (drag[0] + drag[1]);
  s.x += cw * (x[0] + x[1]);
  s.y += cw * (y[0] + y[1]);
  s.roll += crw * (roll[0] + roll[1]);
  s.pitch += crw * (pitch[0] + pitch[1]);
  s.induced_area += a.r_m * a.weight_m * v;
  s.ring_area += a.r_m * a.weight_m * ring;
}

struct Root {
  double v, slope, through, ring, extrapolate;  // extrapolate: how far past the last two evaluations the root lies
  int last;                                     // which of the two Forces buffers was filled last
  int evaluations;
  bool converged;
};

template <int kAzimuth>
Root find_root(const Rotor& rotor, const Annulus& a, const Condition& c, const Azimuth<kAzimuth>& az, double guess, double slope,
               Forces<kAzimuth> (&f)[2]) {
  const double tip = std::fabs(c.omega) * a.r_m;
  // At these ends all flow comes from one side of the disk, so the sign of the residual is known without evaluation.
  const double far = 2.0 * (std::fabs(c.climb) + c.edge + tip + c.rate * rotor.radius_m()) + 1e-3;
  const double scale = 0.05 * tip + 0.1 * (std::fabs(c.climb) + c.edge) + 1e-6;
  double low = -far, high = far;
  double v = std::clamp(guess, low, high);
  int last = 0;
  Evaluation e = evaluate<kAzimuth>(rotor, a, c, az, v, f[0]);
  int count = 1;
  (e.residual < 0.0 ? low : high) = v;
  double step = -e.residual / slope;  // the slope of a cold start is a rough one; the secant takes over
  if (std::fabs(step) <= kStepAlone * scale) return {v + step, slope, e.through, e.ring, 0.0, last, count, true};
  double previous_width = high - low;
  int slow = 0;
  const int limit = rotor.resolution().max_iterations;
  while (count < limit) {
    double next = v + step;
    if (!(next > low && next < high) || slow > 3) {
      next = 0.5 * (low + high);
      slow = 0;
    }
    const double moved = next - v;
    last = 1 - last;
    const double before = e.residual;
    e = evaluate<kAzimuth>(rotor, a, c, az, next, f[last]);
    ++count;
    (e.residual < 0.0 ? low : high) = next;
    v = next;
    const double difference = e.residual - before;
    const bool usable = moved != 0.0 && difference != 0.0;
    const double beyond = usable ? -e.residual / difference : 0.0;  // of the root past `next`, in units of the move
    step = beyond * moved;
    if (usable) slope = difference / moved;
    const bool close =
        std::fabs(step) * (std::fabs(moved) + std::fabs(step)) <= kStepProduct * scale * scale && std::fabs(step) <= std::fabs(moved);
    if (e.residual == 0.0 || close) return {v + step, slope, e.through, e.ring, beyond, last, count, true};
    if (high - low <= kStepAlone * scale) return {v, slope, e.through, e.ring, 0.0, last, count, true};
    slow = high - low > 0.5 * previous_width && std::fabs(step) > 0.5 * std::fabs(moved) ? slow + 1 : 0;
    previous_width = high - low;
  }
  return {v, slope, e.through, e.ring, 0.0, last, count, false};
}

bool usable(const RotorCondition& c) {
  const auto fine = [](double x, double most) { return std::isfinite(x) && std::fabs(x) <= most; };
  for (int i = 0; i < 3; ++i)
    if (!fine(c.v_R_m_s[i], kMaxSpeed_m_s) || !fine(c.w_R_rad_s[i], kMaxSpeed_m_s)) return false;
  return fine(c.omega_rad_s, kMaxSpeed_m_s) && c.omega_rad_s >= 0.0 && std::isfinite(c.density_kg_m3) && c.density_kg_m3 >= 0.0;
}
template <int kAzimuth>
RotorLoads solve(const Rotor& rotor, const RotorCondition& condition, RotorWarmStart& warm) {
  RotorLoads loads;
  if (!usable(condition)) {
    warm.valid = false;
    loads.status = InflowStatus::not_converged;
    return loads;
  }
  // A clockwise rotor is solved as its mirror image in the xz plane: velocity is a vector, body rate an axial vector.
  const double mirror = condition.spin >= 0 ? 1.0 : -1.0;
  const double vx = condition.v_R_m_s.x(), vy = mirror * condition.v_R_m_s.y();
  const double wx = mirror * condition.w_R_rad_s.x(), wy = condition.w_R_rad_s.y(), wz = mirror * condition.w_R_rad_s.z();
  Condition c{};
  c.omega = condition.omega_rad_s + wz;
  c.climb = condition.v_R_m_s.z();
  c.edge2 = vx * vx + vy * vy;
  c.edge = std::sqrt(c.edge2);
  c.rate = std::sqrt(wx * wx + wy * wy);
  c.reynolds_per_W_chord = condition.density_kg_m3 / kViscosity_Pa_s;
  const double ex = c.edge > 0.0 ? vx / c.edge : 0.0, ey = c.edge > 0.0 ? vy / c.edge : 0.0;
  const int n = kAzimuth > 0 ? kAzimuth : rotor.resolution().azimuth;
  Azimuth<kAzimuth> az;
  const double *cosine = rotor.cos_psi(), *sine = rotor.sin_psi();
  for (int k = 0; k < n; ++k) {
    az.tangential[k] = vy * cosine[k] - vx * sine[k];
    az.radial[k] = vx * cosine[k] + vy * sine[k];
    az.flap[k] = wx * sine[k] - wy * cosine[k];
    az.skew[k] = -(ex * cosine[k] + ey * sine[k]);
  }

  const bool warm_usable = warm.valid && warm.omega_rad_s > 1.0 && c.omega < 1.5 * warm.omega_rad_s && c.omega > 0.5 * warm.omega_rad_s;
  const double ratio = warm_usable ? c.omega / warm.omega_rad_s : 1.0, climbed = c.climb - warm.climb_m_s;
  Forces<kAzimuth> f[2]{};  // zeros: a root met at the first trial leaves the second untouched
  Sums sums;
  bool converged = true;
  const auto& annuli = rotor.annuli();
  for (std::size_t i = 0; i < annuli.size(); ++i) {
    const Annulus& a = annuli[i];
    double guess = 0.1 * std::fabs(c.omega) * rotor.radius_m();  // a typical inflow ratio in hover
    double slope = 3.0 * guess + 0.5 * c.edge + std::fabs(c.climb) + kTiny;
    if (warm_usable) {
      slope = warm.slope_m_s[i] * ratio;
      // Half of a change of climb speed is made up by the induced velocity, the exact share follows from the two slopes.
      guess = warm.induced_m_s[i] * ratio - climbed * (1.0 - warm.through_m_s[i] / warm.slope_m_s[i]) + warm.missed_m_s[i];
    }
    const Root root = find_root<kAzimuth>(rotor, a, c, az, guess, slope, f);
    accumulate<kAzimuth>(rotor, a, f[root.last], f[1 - root.last], root.extrapolate, root.v, root.ring, sums);
    warm.missed_m_s[i] = warm_usable ? root.v - guess + warm.missed_m_s[i] : 0.0;
    warm.induced_m_s[i] = root.v;
    warm.slope_m_s[i] = root.slope > kTiny ? root.slope : slope;
    warm.through_m_s[i] = root.through;
    converged = converged && root.converged;
    loads.iterations = std::max(loads.iterations, root.evaluations);
  }
  warm.valid = converged;
  warm.omega_rad_s = c.omega;
  warm.climb_m_s = c.climb;

  const double scale = 0.5 * condition.density_kg_m3 * rotor.blades() / n;
  loads.shaft_torque_N_m = scale * sums.torque;
  loads.force_R_N = {scale * sums.x, mirror * scale * sums.y, scale * sums.thrust};
  loads.moment_R_N_m = {mirror * scale * sums.roll, scale * sums.pitch, -mirror * loads.shaft_torque_N_m};
  const double area = rotor.disk_area_m2() / (2.0 * std::numbers::pi);
  loads.induced_m_s = sums.induced_area / area;
  const double through = c.climb + loads.induced_m_s;
  if (!converged) {
    loads.status = InflowStatus::not_converged;
  } else if (condition.omega_rad_s * rotor.radius_m() < kStoppedTip_m_s) {
    loads.status = InflowStatus::stopped;
  } else if (sums.ring_area > 0.5 * area) {
    loads.status = InflowStatus::vortex_ring;
  } else if (loads.shaft_torque_N_m < 0.0 || loads.force_R_N.z() * through < 0.0) {
    loads.status = InflowStatus::windmill;
  }
  return loads;
}
}  // namespace

RotorLoads solve_rotor(const Rotor& rotor, const RotorCondition& condition, RotorWarmStart& warm_start) {
  // The usual resolution has its own copy, with loops of known length.
  if (rotor.resolution().azimuth == 16) return solve<16>(rotor, condition, warm_start);
  return solve<0>(rotor, condition, warm_start);
}

}  // namespace rotorloop::sim
