// The variance effects that are tested, each as directions in the whitened residuals.
#include <algorithm>
#include <cmath>

#include "bench/sysid/diagnose/residuals/variance_effects.hpp"
#include "host/vehicle/effect_catalogue.hpp"

namespace rotorloop::diagnose {
namespace {

using Wrench = Eigen::Matrix<double, 6, 1>;
using Rows = VarianceKind::Rows;

Wrench lift(const SampleState& s, std::size_t i) {
  Wrench w = Wrench::Zero();
  w[2] = 1.0;
  w[3] = s.arm_B_m[i].y();
  w[4] = -s.arm_B_m[i].x();
  return w;
}

// Bump of the vortex ring state: b = (1 - u²)² (1 - m)² (1 + 2m), effects/catalogue.toml (Johnson, NASA TP-2005-213477).
double ring_bump(const SampleState& s) {
  if (!(s.induced_hover_m_s > 0.0)) return 0.0;
  const double u = (-s.v_B_m_s.z() / s.induced_hover_m_s - 1.0) / 0.7;
  const double m = s.v_B_m_s.head<2>().squaredNorm() / (0.95 * 0.95 * s.induced_hover_m_s * s.induced_hover_m_s);
  if (std::fabs(u) > 1.0 || m > 1.0) return 0.0;
  return (1.0 - u * u) * (1.0 - u * u) * (1.0 - m) * (1.0 - m) * (1.0 + 2.0 * m);
}

struct Builder {
  const ResidualSeries& r;
  std::vector<VarianceKind> out;

  // `wrenches(state)`: body wrenches of one unit, independent of each other.
  template <class Wrenches>
  void steps(VarianceKind k, Wrenches&& wrenches) {
    k.rows = Rows::steps;
    double most = 0.0;
    for (const SampleState& s : r.state) {
      k.directions.emplace_back();
      for (const Wrench& w : wrenches(s)) {
        k.directions.back().push_back((s.whitened_by_wrench * w).template cast<float>());
        most = std::max(most, static_cast<double>(k.directions.back().back().squaredNorm()));
      }
    }
    if (!(most > 0.0)) {
      k.untested = "these flights never come where it acts";
      k.directions.clear();
    }
    out.push_back(std::move(k));
  }
};

VarianceKind kind(const host::CatalogueEffect& e, const char* what, double tau_s = 0.0) {
  return {
      .id = e.id, .what = what, .parameter = e.parameter.name, .unit = e.parameter.unit, .tau_s = tau_s, .directions = {}, .untested = {}};
}
VarianceKind rival(const char* what, const char* parameter, const char* unit, double tau_s = 0.0) {
  return {.id = {}, .what = what, .parameter = parameter, .unit = unit, .tau_s = tau_s, .directions = {}, .untested = {}};
}

VarianceKind pose_stamp_jitter(const ResidualSeries& r) {
  VarianceKind k = kind(host::effect("pose_stamp_jitter"), "pose stamps that scatter");
  k.rows = Rows::poses;
  for (const auto& by : r.whitened.pose_by_stamp) k.directions.push_back({by.cast<float>()});
  if (k.directions.empty()) k.untested = "the fit used no poses";
  return k;
}

VarianceKind pose_drift(const ResidualSeries& r) {
  VarianceKind k = kind(host::effect("pose_drift"), "poses that wander for seconds", 15.0);
  k.rows = Rows::poses;
  for (const double sigma : r.whitened.pose_position_m) {
    k.directions.emplace_back();
    for (Eigen::Index a = 0; a < 3; ++a)
      k.directions.back().push_back(Eigen::VectorXf(Eigen::VectorXd::Unit(6, a).cast<float>() / static_cast<float>(sigma)));
  }
  if (k.directions.empty()) k.untested = "the fit used no poses";
  return k;
}

void add_wrench_noise(Builder& b) {
  // Gusts blow along the world's axes, whatever way the body points, and last about a second: the model says what wrench they make.
  b.steps(kind(host::effect("wind_dryden"), "horizontal gusts, about a second long", 1.0), [](const SampleState& s) {
    return std::array<Wrench, 2>{Wrench(s.wrench_by_wind.col(0)), Wrench(s.wrench_by_wind.col(1))};
  });
  b.steps(kind(host::effect("vortex_ring_fluctuation"), "thrust of each rotor that wanders in vertical descent", 0.1),
          [](const SampleState& s) {
            const double bump = ring_bump(s);
            std::array<Wrench, 4> w;
            for (std::size_t i = 0; i < 4; ++i) w[i] = bump * s.thrust_N[i] * lift(s, i);
            return w;
          });
  b.steps(kind(host::effect("rotor_speed_noise"), "thrust and torque noise of each rotor in proportion to its speed"),
          [](const SampleState& s) {
            std::array<Wrench, 4> w;
            for (std::size_t i = 0; i < 4; ++i) {
              w[i] = (s.omega_rad_s[i] > 0.0 ? 2.0 * s.thrust_N[i] / s.omega_rad_s[i] : 0.0) * lift(s, i);
              w[i][5] = s.yaw_by_omega_N_m_s[i];
            }
            return w;
          });
}

VarianceKind rotor_imbalance(const ResidualSeries& r) {
  VarianceKind k = kind(host::effect("rotor_imbalance"), "vibration of the accelerometer with the square of rotor speed");
  k.rows = Rows::accels;
  for (std::size_t i = 0; i < r.whitened.accels.size(); ++i) {
    const SampleState& s = r.state[r.whitened.accel_sample[i]];
    k.directions.emplace_back();
    for (std::size_t rotor = 0; rotor < 4; ++rotor) {
      const double amplitude = s.omega_rad_s[rotor] * s.omega_rad_s[rotor] / s.mass_kg / std::sqrt(2.0);
      for (Eigen::Index a = 0; a < 2; ++a)
        k.directions.back().push_back(
            Eigen::VectorXf((amplitude / r.whitened.accel_m_s2[i][a] * Eigen::VectorXd::Unit(3, a)).cast<float>()));
    }
  }
  if (k.directions.empty()) k.untested = "the fit used no accelerometer";
  return k;
}

// Rivals: what a missing mean effect or a rough flight makes of the scatter must not be given a name of the catalogue.
void add_rivals(Builder& b) {
  b.steps(rival("force noise that grows with speed", "force_by_speed_N_s_m", "N s/m"), [](const SampleState& s) {
    std::array<Wrench, 3> w;
    for (Eigen::Index a = 0; a < 3; ++a) w[static_cast<std::size_t>(a)] = s.v_B_m_s.norm() * Wrench::Unit(a);
    return w;
  });
  b.steps(rival("torque noise that grows with speed", "torque_by_speed_N_s", "N s"), [](const SampleState& s) {
    std::array<Wrench, 3> w;
    for (Eigen::Index a = 0; a < 3; ++a) w[static_cast<std::size_t>(a)] = s.v_B_m_s.norm() * Wrench::Unit(3 + a);
    return w;
  });
  b.steps(rival("torque noise that grows with body rates", "torque_by_rate_N_m_s", "N m s"), [](const SampleState& s) {
    std::array<Wrench, 3> w;
    for (Eigen::Index a = 0; a < 3; ++a) w[static_cast<std::size_t>(a)] = s.x.w_B_rad_s.norm() * Wrench::Unit(3 + a);
    return w;
  });
  b.steps(rival("torque that wanders, a third of a second at a time", "torque_N_m", "N m", 0.3), [](const SampleState&) {
    return std::array<Wrench, 3>{Wrench::Unit(3), Wrench::Unit(4), Wrench::Unit(5)};
  });
}

}  // namespace

std::vector<VarianceKind> variance_kinds(const ResidualSeries& r) {
  Builder b{r, {pose_stamp_jitter(r), pose_drift(r)}};
  add_wrench_noise(b);
  b.out.push_back(rotor_imbalance(r));
  add_rivals(b);
  return b.out;
}

}  // namespace rotorloop::diagnose
