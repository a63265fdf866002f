// JSBSim's rotor (NASA TP-1285, Bailey's thrust, Glauert's inflow) and its propeller on a three-constant motor. Compared where we
// have a counterpart: blade elements at the recorded inflow, momentum theory, the settled rotor, motor torque and settled speed.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "bench/propeller/oracles/recording.hpp"
#include "sim/drive/motor.hpp"
#include "sim/rotor/inflow.hpp"
#include "sim/rotor/reference/momentum.hpp"
#include "sim/rotor/reference/reference_rotor.hpp"

namespace rotorloop::propeller {
namespace {
constexpr double kJsbsimLimit = 0.025;
using nlohmann::json;
using Series = std::vector<double>;

// --- rotor ------------------------------------------------------------------------------------------------------------
struct Helicopter {
  double radius_m, chord_m, lift_slope, twist_rad, omega_rad_s;
  int blades;
};

sim::ReferenceRotor rotor_of(const Helicopter& h, double root_pitch_rad, double cd, const ConventionChange& change) {
  sim::RotorConventions c;
  c.inflow = sim::Inflow::uniform;
  c.descent = sim::Descent::momentum;
  c.edge_loss = sim::EdgeLoss::none;
  c.swirl = c.skew = c.spanwise_drag = false;
  if (change) change(c);
  sim::ReferenceGeometry g{h.blades, h.radius_m, 0.0, {}};
  constexpr int n = 60;
  for (int i = 0; i < n; ++i) {
    const double x = (i + 0.5) / n;
    g.elements.push_back(
        {x * h.radius_m, h.radius_m / n, h.chord_m, root_pitch_rad + h.twist_rad * x, sim::linear_section(h.lift_slope, cd)});
  }
  return {std::move(g), c, 24};
}

// Mean profile drag of a blade at its mean lift (Bramwell, Helicopter Dynamics, eq. 3.43), the recording's closure.
double profile_drag(double ct, const Helicopter& h, double solidity) {
  const double mean = 6.0 * ct / (h.lift_slope * solidity);
  return 0.009 + 0.3 * mean * mean;
}

std::vector<OracleRow> compare_rotor(const json& j, const ConventionChange& change) {
  const json& p = j.at("params");
  const Helicopter h{p.at("R_m"), p.at("chord_m"), p.at("a_slope"), p.at("twist_rad"), p.at("Omega_rad_s"), p.at("blades")};
  const double solidity = p.at("solidity"), tip_m_s = h.omega_rad_s * h.radius_m;
  const std::string source = "JSBSim rotor";
  std::vector<OracleRow> rows;
  for (const json& c : j.at("cases")) {
    const json& s = c.at("sequence");
    const Series lambda = s.at("lambda"), mu = s.at("mu"), ct = s.at("CT"), nu = s.at("nu"), torque = s.at("torque_N_m");
    const double pitch = c.at("params").at("theta0_rad"), density = c.at("params").at("rho_kg_m3");
    const double thrust_unit_N = density * std::numbers::pi * h.radius_m * h.radius_m * tip_m_s * tip_m_s;
    const std::string condition = c.at("name");
    double most_torque = 0.0;
    for (const double q : torque) most_torque = std::max(most_torque, std::fabs(q));

    Worst blade_ct, blade_torque, blade_power, glauert;
    for (std::size_t k = 1; k < lambda.size(); ++k) {
      sim::RotorCondition at;
      at.v_R_m_s.x() = mu[k] * tip_m_s;
      at.omega_rad_s = h.omega_rad_s;
      at.density_kg_m3 = density;
      const auto l = rotor_of(h, pitch, profile_drag(ct[k], h, solidity), change).at_induced(at, -lambda[k] * tip_m_s).loads;
      blade_ct.add(l.force_R_N.z() / thrust_unit_N, ct[k], ct[k]);
      blade_torque.add(l.shaft_torque_N_m, torque[k], most_torque);
      // Their rotor flaps and tilts its thrust backwards, ours is rigid. What the air takes from either is Q + H mu R.
      const double lever_m = mu[k] * h.radius_m, H_N = s.at("H_N")[k];
      blade_power.add(l.shaft_torque_N_m - l.force_R_N.x() * lever_m, torque[k] + H_N * lever_m, most_torque);
      // Inflow that would carry this thrust at this through-flow: C_T / (2 sqrt(mu^2 + lambda^2)).
      const double nu_eq = s.at("nu_eq")[k];
      const double carried = ct[k - 1] / (2.0 * sim::reference_mass_flow(0.0, lambda[k - 1], mu[k - 1], sim::Descent::momentum).speed_m_s);
      glauert.add(carried, nu_eq, nu_eq);
    }
    const std::string note = fmt::format("worst of {} steps", blade_ct.count);
    rows.push_back(blade_ct.row(source, condition, "C_T at the recorded inflow", kJsbsimLimit, note));
    rows.push_back(blade_power.row(source, condition, "power over speed Q + H mu R, N m", kJsbsimLimit, note + ", of the largest torque"));
    rows.push_back(blade_torque.row(source, condition, "torque at the recorded inflow, N m", mu.back() > 0.01 ? 0.0 : kJsbsimLimit,
                                    note + (mu.back() > 0.01 ? "; theirs flaps, ours is rigid" : ", of the largest torque")));
    rows.push_back(glauert.row(source, condition, "Glauert inflow nu_eq", kJsbsimLimit, note));

    // Settled: our own balance. through = climb + induced, lambda = -(through) / tip.
    sim::RotorCondition at;
    at.v_R_m_s = {mu.back() * tip_m_s, 0.0, -(lambda.back() + nu.back()) * tip_m_s};
    at.omega_rad_s = h.omega_rad_s;
    at.density_kg_m3 = density;
    const auto l = rotor_of(h, pitch, profile_drag(ct.back(), h, solidity), change).solve(at).loads;
    const auto settled = [&](const char* quantity, double recorded, double ours) {
      rows.push_back({source, condition, quantity, recorded, ours, relative(ours, recorded, recorded), kJsbsimLimit, "after 1.3 s"});
    };
    settled("settled C_T", ct.back(), l.force_R_N.z() / thrust_unit_N);
    settled("settled induced inflow nu", nu.back(), l.induced_m_s / tip_m_s);
    settled("settled torque, N m", torque.back(), l.shaft_torque_N_m);
  }
  return rows;
}

// --- propeller and motor ------------------------------------------------------------------------------------------------
// Our motor as the direct-current machine of three constants: at i_d = 0 and constant speed a synchronous machine obeys
// v_q = R i_q + K_e w with K_e = p flux, and its torque is K_e (3/2 i_q); so V = v_q, I = 3/2 i_q, R_a = 2/3 R. One pole pair and
// a small inductance leave no other voltage.
class ThreeConstantMotor {
 public:
  ThreeConstantMotor(double K_e, double R_a, double inertia_kg_m2) : motor_(parameters(K_e, R_a), inertia_kg_m2) {}
  sim::Motor& motor() { return motor_; }
  void step(double volts, const sim::ShaftLoad& load) {
    const double half_turn = 0.5 * motor_.state().omega_rad_s * kStep_s;  // the voltage points along q at mid-step
    const double c = motor_.state().cos_e - half_turn * motor_.state().sin_e, s = motor_.state().sin_e + half_turn * motor_.state().cos_e;
    motor_.step_driven({-s * volts, c * volts}, 0.0, load, kStep_s);
  }
  static constexpr double kStep_s = 5e-6;

 private:
  static sim::MotorParameters parameters(double K_e, double R_a) {
    sim::MotorParameters m;
    m.resistance_ohm = 1.5 * R_a;
    m.inductance_H = {2e-6, 2e-6};
    m.flux_linkage_Wb = K_e;
    m.pole_pairs = 1;
    m.static_friction_N_m = m.cogging_N_m = 0.0;
    return m;
  }
  sim::Motor motor_;
};

std::vector<OracleRow> compare_drive(const json& j) {
  const json& p = j.at("params");
  const double K_e = p.at("K_e_V_s_rad"), K_q = p.at("K_q_Nm_A"), R_a = p.at("R_a_ohm"), V_max = p.at("V_max_V");
  const double area_m2 = p.at("disk_area_m2"), inertia = p.at("J_r_kg_m2");
  const std::string source = "JSBSim propeller, motor";
  std::vector<OracleRow> rows;
  for (const json& c : j.at("cases")) {
    const json &q = c.at("params"), &s = c.at("sequence_si");
    const double speed = q.at("V_axial_m_s"), throttle = q.at("throttle"), density = q.at("rho_kg_m3");
    const Series omega = s.at("Omega_rad_s"), vi = s.at("vi_m_s"), thrust = s.at("thrust_N"), current = s.at("current_A"),
                 power = s.at("P_req_W");
    const std::string condition = fmt::format("{:g} m/s, throttle {:g}", speed, throttle);
    const double volts = throttle * V_max;

    Worst momentum, torque;
    for (std::size_t k = 0; k + 1 < omega.size(); ++k) {
      if (thrust[k] > 0.01)
        momentum.add(2.0 * density * area_m2 * vi[k] * sim::mass_flow(vi[k], speed, 0.0).speed_m_s, thrust[k], thrust[k]);
      ThreeConstantMotor held(K_e, R_a, 1e6);  // an inertia that keeps the speed
      held.motor().state().omega_rad_s = omega[k];
      for (int i = 0; i < 60; ++i) held.step(volts, {});
      // The recorded current belongs to the speed before its step.
      torque.add(held.motor().torque_N_m(), K_q * current[k + 1], K_q * current[k + 1]);
    }
    const std::string note = fmt::format("worst of {} steps", momentum.count);
    rows.push_back(momentum.row(source, condition, "thrust from v_i by momentum, N", kJsbsimLimit, note));
    rows.push_back(
        torque.row(source, condition, "motor torque at speed, N m", kJsbsimLimit, fmt::format("worst of {} steps", torque.count)));

    // Settled speed under the load that the recorded table gives at its last advance ratio.
    const double w = omega.back();
    ThreeConstantMotor free(K_e, R_a, inertia);
    free.motor().state().omega_rad_s = 0.9 * w;
    for (double t = 0.0; t < 1.0; t += ThreeConstantMotor::kStep_s) free.step(volts, {power.back() / (w * w * w), 0.0});
    const double ours = free.motor().state().omega_rad_s;
    rows.push_back(
        {source, condition, "settled speed, rad/s", w, ours, relative(ours, w, w), kJsbsimLimit, "load from the recorded C_P(J)"});
  }
  return rows;
}
}  // namespace

std::vector<OracleRow> jsbsim_rotor_oracle(const std::filesystem::path& data, const ConventionChange& change) {
  return with_recording(data, "jsbsim_rotor_inflow.json", [&](const json& j) { return compare_rotor(j, change); });
}
std::vector<OracleRow> jsbsim_drive_oracle(const std::filesystem::path& data) {
  return with_recording(data, "jsbsim_prop_bldc.json", compare_drive);
}

}  // namespace rotorloop::propeller
