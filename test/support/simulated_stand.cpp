#include "test/support/simulated_stand.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>

#include "host/base/random.hpp"
#include "sim/rotor/bem.hpp"

namespace rotorloop::test {
namespace {

constexpr double kNode_rad_s = 60.0;  // of the tables
constexpr std::size_t kNodes = 32;
constexpr double kSample_s = 0.01;
constexpr double kThrustRange_N = 20.0, kTorqueRange_N_m = 0.5;  // full scale of the cells
constexpr double kThrustDivision_N = 5e-3, kTorqueDivision_N_m = 1e-4;
constexpr double kThrustNoise_N = 0.02, kTorqueNoise_N_m = 8e-4;  // per sample, behind a filter of kFilter_s
constexpr double kFilter_s = 0.03;
// The reference drive.
constexpr double kFlux_Wb = 3.42e-4, kPolePairs = 7.0, kResistance_ohm = 0.06, kInductance_H = 15e-6, kInertia_kg_m2 = 9.4e-6;
constexpr double kFriction_N_m = 1.5e-3, kUp_s = 0.035, kDown_s = 0.05, kBus_V = 16.0, kBus_ohm = 0.02;

// What is wrong with the chain, drawn once for a run.
struct ChainErrors {
  double thrust_gain = 0.0, torque_gain = 0.0;            // 0.4 %
  double torque_to_thrust = 0.0, thrust_to_torque = 0.0;  // 1 % of full scale per full scale, before the calibration matrix
  double zero_N = 0.0, zero_N_m = 0.0, drift_N = 0.0;     // untared; drift 40 mN over the run
  double hysteresis_N = 0.0;                              // 20 mN, with the sense of the change of speed
  double running_N_m = 0.0;                               // 5 to 10 mN m as soon as the rotor turns
  double density = 0.0, alignment_rad = 0.0, speed = 0.0, voltage = 0.0, current = 0.0;
};

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed, 0x5354414E44ull) {}
  double normal(double sigma) { return sigma * random_.gaussian(next_++); }
  double uniform() { return random_.uniform(next_++); }

 private:
  RandomStream random_;
  std::uint64_t next_ = 0;
};

ChainErrors drawn_errors(Draw& d) {
  ChainErrors e;
  e.thrust_gain = d.normal(0.004);
  e.torque_gain = d.normal(0.004);
  e.torque_to_thrust = d.normal(0.01) * kThrustRange_N / kTorqueRange_N_m;

  e.thrust_to_torque = d.normal(0.01) * kTorqueRange_N_m / kThrustRange_N;
  e.zero_N = d.normal(0.05);
  e.zero_N_m = d.normal(1e-3);
  e.drift_N = d.normal(0.04);
  e.hysteresis_N = d.normal(0.02);
  e.running_N_m = (d.uniform() < 0.5 ? -1.0 : 1.0) * (5e-3 + 5e-3 * d.uniform());
  e.density = d.normal(0.003);
  e.alignment_rad = d.normal(std::numbers::pi / 180.0);
  e.speed = d.normal(5e-4);
  e.voltage = d.normal(3e-3);
  e.current = d.normal(5e-3);
  return e;
}

// What the operator does before the run: nine load cases, a matrix by least squares. Weights and arms err together, which is the gain.
struct Calibration {
  Eigen::Matrix2d to_load;
  double cross_talk_u = 0.0;  // N m per N
};
Calibration calibrate(const ChainErrors& e, Draw& d) {
  Eigen::Matrix<double, 9, 3> loads;
  Eigen::Matrix<double, 9, 2> readings;
  int k = 0;
  for (const double f : {-1.0, 0.0, 1.0})
    for (const double q : {-1.0, 0.0, 1.0}) {
      const double F = 10.0 * f, Q = 0.3 * q;
      loads.row(k) << F, Q, 1.0;
      readings.row(k++) << F + e.torque_to_thrust * Q + d.normal(4e-3), Q + e.thrust_to_torque * F + d.normal(1.5e-4);
    }
  const Eigen::Matrix3d inverse = (loads.transpose() * loads).inverse();
  const Eigen::Matrix<double, 3, 2> fit = inverse * loads.transpose() * readings;
  const double rss = (readings.col(1) - loads * fit.col(1)).squaredNorm() / 6.0;
  return {fit.topRows<2>().transpose().inverse(), std::sqrt(rss * inverse(0, 0))};
}

struct Hold {
  double omega_rad_s = 0.0, duration_s = 0.0;
  bool counts = true;  // gets a number once it has settled
  bool chirp = false;
};

std::vector<Hold> plan(const SimulatedStandOptions& o) {
  constexpr int kLevels = 12;
  constexpr double kIdle_rad_s = 150.0;
  const double low = 300.0, high = 1450.0;
  std::vector<Hold> out{{0.0, 6.0}};
  std::vector<double> levels;
  for (int i = 0; i < kLevels; ++i) levels.push_back(std::sqrt(low * low + (high * high - low * low) * i / (kLevels - 1)));
  // Idle shows the running offset: the rotor's own torque is 0.5 mN m there.
  out.push_back({kIdle_rad_s, 8.0});
  for (const double w : levels) out.push_back({w, 2.2});
  for (int i = kLevels - 2; i >= 0; --i) out.push_back({levels[static_cast<std::size_t>(i)], 2.2});
  out.push_back({kIdle_rad_s, 8.0});
  out.push_back({0.0, 6.0});
  if (o.steps)
    for (int i = 0; i < 12; ++i) {
      out.push_back({0.93 * o.centre_rad_s, 0.7, false});
      out.push_back({1.07 * o.centre_rad_s, 0.7, false});
    }
  if (o.chirp) out.push_back({o.centre_rad_s, 40.0, false, true});
  if (o.steps || o.chirp) out.push_back({0.0, 6.0});
  return out;
}

double rounded(double v, double division) { return division * std::round(v / division); }

}  // namespace

SimulatedStand::SimulatedStand(const sim::Blade& blade) : radius_m_(blade.radius_m) {
  const sim::Rotor rotor(blade);
  for (std::size_t i = 0; i < kNodes; ++i) {
    sim::RotorCondition c;
    c.omega_rad_s = kNode_rad_s * static_cast<double>(i + 1);
    c.density_kg_m3 = kSimulatedDensity_kg_m3;
    sim::RotorWarmStart cold;
    const sim::RotorLoads loads = sim::solve_rotor(rotor, c, cold);
    thrust_N_s2_.push_back(loads.force_R_N.z() / (c.omega_rad_s * c.omega_rad_s));
    torque_N_m_s2_.push_back(loads.shaft_torque_N_m / (c.omega_rad_s * c.omega_rad_s));
  }
}

double SimulatedStand::table(const std::vector<double>& v, double omega) const {
  const double x = std::clamp(omega / kNode_rad_s - 1.0, 0.0, static_cast<double>(kNodes - 1));
  const auto i = std::min(static_cast<std::size_t>(x), kNodes - 2);
  return v[i] + (x - static_cast<double>(i)) * (v[i + 1] - v[i]);
}

StandTruth SimulatedStand::truth(const SimulatedStandOptions& o) const {
  return {(1.0 - o.thrust_lost) * table(thrust_N_s2_, o.centre_rad_s),
          table(torque_N_m_s2_, o.centre_rad_s),
          60.0 / (std::sqrt(3.0) * 2.0 * std::numbers::pi * kFlux_Wb * kPolePairs),
          kResistance_ohm,
          kInertia_kg_m2,
          kUp_s,
          kDown_s};
}

void SimulatedStand::write_run(const std::filesystem::path& folder, const SimulatedStandOptions& o, std::uint64_t seed) const {
  Draw d(seed);
  const ChainErrors e = o.errors ? drawn_errors(d) : ChainErrors{};
  const Calibration calibration = calibrate(e, d);
  const double noise = o.errors ? 1.0 : 0.0, density = kSimulatedDensity_kg_m3 * (1.0 + 0.02 * (2.0 * d.uniform() - 1.0));
  std::string csv = "t_s,step,target_rad_s,omega_rad_s,thrust_N,torque_N_m,voltage_V,current_A,duty\n";
  double t = 0.0, omega = 0.0, filtered_N = 0.0, filtered_N_m = 0.0, before = 0.0, sense = 1.0;
  const auto holds = plan(o);
  double whole_s = 0.0;
  for (const Hold& h : holds) whole_s += h.duration_s;
  int number = 0;
  for (const Hold& h : holds) {
    if (h.omega_rad_s != before) sense = h.omega_rad_s > before ? 1.0 : -1.0;
    before = h.omega_rad_s;
    for (double since = 0.0; since < h.duration_s; since += kSample_s, t += kSample_s) {
      double target = h.omega_rad_s;
      if (h.chirp) target *= 1.0 + 0.02 * std::sin(2.0 * std::numbers::pi * (0.5 * since + 0.5 * (12.0 / h.duration_s) * since * since));
      const double tau = h.omega_rad_s == 0.0 ? 0.2 : target > omega ? kUp_s : kDown_s;
      const double next = target + (omega - target) * std::exp(-kSample_s / tau), slope = (next - omega) / kSample_s;
      const double middle = 0.5 * (next + omega);  // the cells average over the sample
      omega = next;
      const double share = density / kSimulatedDensity_kg_m3;
      const double thrust = share * (1.0 - o.thrust_lost) * table(thrust_N_s2_, middle) * middle * middle;
      const double shaft = share * table(torque_N_m_s2_, middle) * middle * middle;
      const bool turns = middle > 5.0;
      const double F = std::cos(e.alignment_rad) * thrust, Q = std::cos(e.alignment_rad) * (shaft + kInertia_kg_m2 * slope);
      Eigen::Vector2d reading(F + e.torque_to_thrust * Q, Q + e.thrust_to_torque * F);
      Eigen::Vector2d load = calibration.to_load * reading;
      const double forget = std::exp(-kSample_s / kFilter_s), spread = std::sqrt(1.0 - forget * forget);
      filtered_N = forget * filtered_N + spread * d.normal(noise * kThrustNoise_N);
      filtered_N_m = forget * filtered_N_m + spread * d.normal(noise * kTorqueNoise_N_m);
      load(0) = (1.0 + e.thrust_gain) * load(0) + e.zero_N + e.drift_N * t / whole_s + (turns ? sense * e.hysteresis_N : 0.0) + filtered_N;
      load(1) = (1.0 + e.torque_gain) * load(1) + e.zero_N_m + (turns ? e.running_N_m : 0.0) + filtered_N_m;
      // Sine drive: current for the shaft and friction, voltage for resistance, inductance and EMF.
      const double A = turns ? std::max(0.0, (shaft + kFriction_N_m + kInertia_kg_m2 * slope) / (1.5 * kPolePairs * kFlux_Wb)) : 0.0;
      const double along = kResistance_ohm * A + kPolePairs * kFlux_Wb * middle, across = kPolePairs * middle * kInductance_H * A;
      const double power_W = 1.5 * along * A, bus_V = kBus_V - kBus_ohm * power_W / kBus_V;
      const double duty = turns ? std::sqrt(3.0) * std::hypot(along, across) / bus_V : 0.0;
      const bool settled = since > (h.omega_rad_s == 0.0 ? 2.0 : 0.7);
      csv += fmt::format("{:.3f},{},{:.4f},{:.4f},{:.4f},{:.6f},{:.4f},{:.5f},{:.6f}\n", t,
                         h.counts && settled ? std::to_string(number) : std::string(), target, turns ? middle * (1.0 + e.speed) : 0.0,
                         rounded(load(0), kThrustDivision_N), rounded(load(1), kTorqueDivision_N_m), bus_V * (1.0 + e.voltage),
                         power_W / bus_V * (1.0 + e.current), duty);
    }
    ++number;
  }
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "samples.csv") << csv;
  std::ofstream(folder / "run.toml") << fmt::format(
      "format = 1\npropeller = \"simulated\"\nmotor = \"reference drive\"\npole_pairs = 7\ndiameter_m = {}\n[air]\ndensity_kg_m3 = {}\n"
      "[uncertainty]\nthrust_calibration = 0.004\ntorque_calibration = 0.004\narm_length = 0\nalignment_rad = 0.01745\nrotor_speed = "
      "0.0005\ndensity = 0.003\n"
      "voltage = 0.003\ncurrent = 0.005\nhysteresis = 0.005\ncross_talk_m = {}\n",
      2.0 * radius_m_, density * (1.0 + e.density), calibration.cross_talk_u);
}

}  // namespace rotorloop::test
