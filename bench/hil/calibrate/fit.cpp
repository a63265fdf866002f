#include "bench/hil/calibrate/fit.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "host/base/error.hpp"
#include "host/base/least_squares.hpp"
#include "host/vehicle/thrust.hpp"

namespace rotorloop::calibrate {
namespace {

using host::ThrustModel;

[[noreturn]] void lacking(const char* what, const char* remedy) {
  throw Error({"load table", std::string("has too few points for ") + what, "", remedy}, ExitCode::data_quality);
}

// Less in-plane velocity than this counts as axial flow: 1 % of the tip speed, where edgewise flow changes thrust by 0.1 %.
constexpr double kAxial_m_s = 0.5;

double signed_square(double v) { return v * std::fabs(v); }

// What the points leave is the model's error, not noise of a balance: one stream, one blade, so that neighbouring points miss alike. Their
// number says nothing then, and the standard error of independent points is widened to what one point per coefficient would give.
double widened(double u, std::size_t points, double coefficients) { return u * std::sqrt(static_cast<double>(points) / coefficients); }

// Least squares of y = c x through zero.
FittedValue slope(const std::vector<double>& x, const std::vector<double>& y) {
  double xx = 0.0, xy = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += x[i] * x[i];
    xy += x[i] * y[i];
  }
  const double c = xy / xx;
  double rss = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) rss += (y[i] - c * x[i]) * (y[i] - c * x[i]);
  const double dof = std::max<double>(1.0, static_cast<double>(x.size()) - 1.0);
  return {c, widened(std::sqrt(rss / dof / xx), x.size(), 1.0)};
}

double rms_about(double c, const std::vector<double>& x, const std::vector<double>& y) {
  double sum = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) sum += (y[i] - c * x[i]) * (y[i] - c * x[i]);
  return std::sqrt(sum / static_cast<double>(x.size()));
}

bool all_alike(const LoadPoint& p) {
  for (const double w : p.omega_rad_s)
    if (w <= 0.0 || std::fabs(w - p.omega_rad_s[0]) > 1e-6 * w) return false;
  return true;
}
bool bare(const LoadPoint& p) {
  for (const double w : p.omega_rad_s)
    if (w != 0.0) return false;
  return true;
}

double total_thrust(const ThrustModel& m, const LoadPoint& p) {
  double sum = 0.0;
  for (const double w : p.omega_rad_s) sum += host::solve_thrust(m, w, p.v_B_m_s.z(), p.v_B_m_s.head<2>().norm()).thrust_N;
  return sum;
}

// The points of the table by the coefficients that they determine.
struct LoadGroups {
  std::vector<double> vxy, fxy, vz, fz;             // without propellers: signed square of the velocity, force
  std::vector<double> reaction_square, yaw_torque;  // unequal pairs: Σ reaction ω², torque about z
  std::vector<const LoadPoint*> powered, axial;     // four equal speeds
};

LoadGroups group(const std::vector<LoadPoint>& points, const host::VehicleModel& geometry) {
  LoadGroups g;
  for (const auto& p : points) {
    if (bare(p)) {
      for (int axis = 0; axis < 2; ++axis)
        if (p.v_B_m_s[axis] != 0.0) {
          g.vxy.push_back(-signed_square(p.v_B_m_s[axis]));
          g.fxy.push_back(p.force_B_N[axis]);
        }
      if (p.v_B_m_s.z() != 0.0) {
        g.vz.push_back(-signed_square(p.v_B_m_s.z()));
        g.fz.push_back(p.force_B_N.z());
      }
    } else if (all_alike(p)) {
      g.powered.push_back(&p);
      if (p.v_B_m_s.head<2>().norm() < kAxial_m_s) g.axial.push_back(&p);
    } else {
      double s = 0.0;
      for (std::size_t i = 0; i < 4; ++i) s += geometry.rotors[i].reaction * p.omega_rad_s[i] * p.omega_rad_s[i];
      g.reaction_square.push_back(s);
      g.yaw_torque.push_back(p.torque_B_N_m.z());
    }
  }
  if (g.vxy.size() < 3 || g.vz.size() < 3)
    lacking("airframe drag, eq. (5)", "add points without propellers, at least 3 speeds along x, y and z");
  if (g.axial.size() < 20)
    lacking("the thrust model, eq. (1)-(2)", "add at least 20 points with four equal rotor speeds and velocity along z only");
  if (g.reaction_square.size() < 3) lacking("the torque coefficient, eq. (3)", "add at least 3 points with unequal rotor pairs");
  return g;
}

// With T measured, eq. (2) gives v_i, and eq. (1) is linear in k1 and k2. That minimises the equation error.
Eigen::Vector2d start_of_thrust(const std::vector<const LoadPoint*>& axial, double q, double c_dz) {
  const auto n = static_cast<Eigen::Index>(axial.size());
  Eigen::MatrixX2d a(n, 2);
  Eigen::VectorXd b(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& p = *axial[static_cast<std::size_t>(i)];
    const double v_z = p.v_B_m_s.z(), v_xy = p.v_B_m_s.head<2>().norm(), w = p.omega_rad_s[0];
    const double thrust = (p.force_B_N.z() + c_dz * signed_square(v_z)) / 4.0;
    double v_i = std::sqrt(std::max(thrust, 0.0) / q);
    for (int k = 0; k < 60; ++k) v_i = 0.5 * (v_i + std::max(thrust, 0.0) / (q * std::hypot(v_z + v_i, v_xy) + 1e-9));
    a.row(i) << w * w, w * (v_z + v_i);
    b[i] = thrust;
  }
  return a.colPivHouseholderQr().solve(b);
}

// Thrust, from axial flow alone (the paper's first stage): edgewise flow brings effects that eq. (1)-(2) has not, and k1 and
// k2 would bend to them. Least squares of the thrust itself minimises what a controller would notice.
void fit_thrust(const std::vector<const LoadPoint*>& axial, const ThrustModel& m, LoadFit& fit) {
  const double c_dz = fit.c_dz_N_s2_m2.value;
  const auto residuals = [&](const std::vector<double>& k) {
    ThrustModel t = m;
    t.k1_N_s2 = k[0];
    t.k2_N_s2_m = k[1];
    Eigen::VectorXd r(static_cast<Eigen::Index>(axial.size()));
    for (std::size_t i = 0; i < axial.size(); ++i)
      r[static_cast<Eigen::Index>(i)] = total_thrust(t, *axial[i]) - axial[i]->force_B_N.z() - c_dz * signed_square(axial[i]->v_B_m_s.z());
    return r;
  };
  const Eigen::Vector2d k = start_of_thrust(axial, m.momentum_kg_m(), c_dz);
  constexpr double kFree = std::numeric_limits<double>::infinity();
  const LeastSquaresFit found = fit_least_squares({{"k1", "N s^2", k[0], -kFree, kFree, 1e-5 * std::fabs(k[0])},
                                                   {"k2", "N s^2/m", k[1], -kFree, kFree, 1e-5 * std::fabs(k[1]) + 1e-10}},
                                                  residuals, {.tolerance = 1e-14});
  const double wide = widened(1.0, axial.size(), 2.0);
  fit.k1_N_s2 = {found.values[0], wide * found.standard_errors[0]};
  fit.k2_N_s2_m = {found.values[1], wide * found.standard_errors[1]};
  fit.k1_k2_covariance = wide * wide * found.covariance(0, 1);
  fit.thrust_rms_N = found.rms;
}

// Rotor drag, eq. (4): what the airframe's drag leaves of the in-plane force, over total thrust.
void fit_rotor_drag(const std::vector<const LoadPoint*>& powered, LoadFit& fit) {
  std::vector<double> x, y;
  for (const auto* p : powered) {
    const double thrust = p->force_B_N.z() + fit.c_dz_N_s2_m2.value * signed_square(p->v_B_m_s.z());
    for (int axis = 0; axis < 2; ++axis) {
      if (p->v_B_m_s[axis] == 0.0) continue;
      x.push_back(-thrust * p->v_B_m_s[axis]);
      y.push_back(p->force_B_N[axis] + fit.c_dxy_N_s2_m2.value * signed_square(p->v_B_m_s[axis]));
    }
  }
  if (x.size() < 10) lacking("rotor drag, eq. (4)", "add powered points with in-plane velocity");
  fit.c_dh_s_m = slope(x, y);
  fit.in_plane_rms_N = rms_about(fit.c_dh_s_m.value, x, y);
}

}  // namespace

LoadFit fit_loads(const std::vector<LoadPoint>& points, const host::VehicleModel& geometry) {
  const LoadGroups g = group(points, geometry);
  LoadFit fit;
  fit.c_dxy_N_s2_m2 = slope(g.vxy, g.fxy);
  fit.c_dz_N_s2_m2 = slope(g.vz, g.fz);
  fit.c_q_N_m_s2 = slope(g.reaction_square, g.yaw_torque);
  fit.yaw_torque_rms_N_m = rms_about(fit.c_q_N_m_s2.value, g.reaction_square, g.yaw_torque);
  fit.powered_points = g.powered.size();
  fit.axial_points = g.axial.size();
  fit_thrust(g.axial, geometry.thrust, fit);
  fit_rotor_drag(g.powered, fit);
  return fit;
}

}  // namespace rotorloop::calibrate
