// How far the laws of thrust and torque over rotor speed differ between propellers: measured ones, and those that the thrust-stand
// statistics draw.
//   stats_stand_laws DATA BLADE.toml [--blades 200] [--from 1]
// DATA: folder of the measured propellers, what ROTORLOOP_DATA names. ln c = ln c* + e l + f l² + g l³, l = ln(ω/ω*), by least squares from
// a third of ω* to one and a half of it, ω* two thirds of the greatest speed: the window of a run on the virtual stand.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "bench/propeller/fit/propeller_files.hpp"
#include "host/base/constants.hpp"
#include "host/base/error.hpp"
#include "sim/rotor/bem.hpp"
#include "test/stats/stand_ensemble.hpp"

using namespace rotorloop;

namespace {

constexpr double kLeast = 1.0 / 3.0, kMost = 1.5;  // of ω*

struct Law {
  Eigen::Vector3d shape;  // e, f, g
  double kink = 0.0;      // rms of what they leave, relative
};

Law fitted(const std::vector<double>& omega, const std::vector<double>& c, double centre) {
  Eigen::MatrixXd X(static_cast<Eigen::Index>(omega.size()), 4);
  Eigen::VectorXd y(X.rows());
  Eigen::Index n = 0;
  for (std::size_t i = 0; i < omega.size(); ++i) {
    if (omega[i] < kLeast * centre || omega[i] > kMost * centre * 1.0001) continue;
    const double l = std::log(omega[i] / centre);
    X.row(n) << 1.0, l, l * l, l * l * l;
    y(n++) = std::log(c[i]);
  }
  const Eigen::VectorXd a = X.topRows(n).colPivHouseholderQr().solve(y.head(n));
  return {a.tail<3>(), std::sqrt((y.head(n) - X.topRows(n) * a).squaredNorm() / static_cast<double>(std::max<Eigen::Index>(1, n - 4)))};
}

struct Spread {
  Eigen::Array3d squares = Eigen::Array3d::Zero();
  double kink = 0.0, n = 0.0;
  void add(const Law& law) {
    squares += law.shape.array().square();
    kink += law.kink * law.kink;
    n += 1.0;
  }
  void print(const char* of, const char* name) const {
    const Eigen::Array3d rms = (squares / n).sqrt();
    fmt::print("{:<34} {:<4} {:>8.3f} {:>10.3f} {:>18.3f} {:>14.2f}\n", of, name, rms(0), rms(1), rms(2), 100.0 * std::sqrt(kink / n));
  }
};

struct Propeller {
  const char* folder;
  double diameter_m;  // nominal; 0: its files say it
};
constexpr Propeller kMeasured[] = {{"apc_4.2x4", 0.0},  {"da4002_5x3.75", 0.127}, {"da4002_9x6.75", 0.2286},
                                   {"apc_10x7sf", 0.0}, {"apc_16x8e", 0.0},       {"tmotor28", 0.0}};

void add_measured(const std::filesystem::path& data, Spread& thrust, Spread& torque) {
  for (const Propeller& p : kMeasured) {
    propeller::PropellerFileOptions options;
    if (p.diameter_m > 0.0) options.diameter_m = p.diameter_m;
    const auto files = propeller::read_propeller_files({data / "propellers" / p.folder}, options);
    std::vector<double> omega, ct, cp;
    for (const auto& row : files.sets.at(0).rows)
      if (row.j == 0.0) {
        omega.push_back(row.rpm * kRad_s_per_rpm);
        ct.push_back(row.ct);
        cp.push_back(row.cp);
      }
    const double centre = *std::max_element(omega.begin(), omega.end()) / kMost;
    const Law t = fitted(omega, ct, centre), q = fitted(omega, cp, centre);
    fmt::print("  {:<16} {:>3} rows to {:>6.0f} RPM  thrust {:+.3f} {:+.3f} {:+.3f}  torque {:+.3f} {:+.3f} {:+.3f}\n", p.folder,
               omega.size(), kMost * centre * kRpm_per_rad_s, t.shape(0), t.shape(1), t.shape(2), q.shape(0), q.shape(1), q.shape(2));
    thrust.add(t);
    torque.add(q);
  }
}

void add_blade(const sim::Blade& blade, Spread& thrust, Spread& torque) {
  constexpr int kSpeeds = 40;
  const double centre = 9000.0 * kRad_s_per_rpm;
  const sim::Rotor rotor(blade);
  std::vector<double> omega, ct, cq;
  for (int i = 0; i < kSpeeds; ++i) {
    sim::RotorCondition condition;
    condition.omega_rad_s = centre * (kLeast + (kMost - kLeast) * i / (kSpeeds - 1.0));
    condition.density_kg_m3 = test::kSimulatedDensity_kg_m3;
    sim::RotorWarmStart cold;
    const sim::RotorLoads loads = sim::solve_rotor(rotor, condition, cold);
    const double square = condition.omega_rad_s * condition.omega_rad_s;
    omega.push_back(condition.omega_rad_s);
    ct.push_back(loads.force_R_N.z() / square);
    cq.push_back(loads.shaft_torque_N_m / square);
  }
  thrust.add(fitted(omega, ct, centre));
  torque.add(fitted(omega, cq, centre));
}

}  // namespace

int main(int argc, char** argv) {
  std::filesystem::path data, blade;
  std::uint64_t first = 1, blades = 200;
  CLI::App app("Spread of the laws of thrust and torque over rotor speed: measured propellers against drawn blades.");
  app.add_option("data", data, "folder of measured data, what ROTORLOOP_DATA names")->required()->check(CLI::ExistingDirectory);
  app.add_option("blade", blade, "blade file that blades are drawn about")->required();
  app.add_option("--blades", blades)->check(CLI::Range(1, 100000));
  app.add_option("--from", first, "first seed of the drawn blades");
  CLI11_PARSE(app, argc, argv);
  try {
    Spread thrust, torque, drawn_thrust, drawn_torque, one_thrust, one_torque;
    add_measured(data, thrust, torque);
    const sim::Blade about = sim::read_blade(blade);
    add_blade(about, one_thrust, one_torque);
    for (std::uint64_t k = 0; k < blades; ++k) add_blade(stats::drawn_blade(about, first + k), drawn_thrust, drawn_torque);
    fmt::print("{:<34} {:<4} {:>8} {:>10} {:>18} {:>14}\n", "root mean squares", "", "exponent", "curvature", "change of curvature",
               "left over, %");
    thrust.print("six measured propellers", "c_t");
    torque.print("", "c_q");
    drawn_thrust.print(fmt::format("{} drawn blades", blades).c_str(), "c_t");
    drawn_torque.print("", "c_q");
    one_thrust.print("the blade itself", "c_t");
    one_torque.print("", "c_q");
  } catch (const Error& e) {
    fmt::print(stderr, "{}\n", e.what());
    return to_int(e.exit_code());
  }
  return 0;
}
