// Accelerations of a quadrotor under given rotor loads, as RotorPy and Agilicious computed them: the oracle of sim/airframe. Their
// rotors are T = k w^2 and Q = c w^2; those loads are handed over, so that only the rigid body is judged. Both recordings use our
// frames (z up, quaternion w x y z body to world) and spin (+1 counter-clockwise, reaction along -z).
#include <fmt/format.h>

#include <Eigen/Geometry>

#include "bench/propeller/oracles/recording.hpp"
#include "sim/airframe/airframe.hpp"

namespace rotorloop::propeller {
namespace {
constexpr double kRigidBodyLimit = 1e-6;
using nlohmann::json;

Eigen::Vector3d vector3(const json& j) { return {j[0].get<double>(), j[1].get<double>(), j[2].get<double>()}; }
Eigen::Quaterniond quaternion(const json& j) { return {j[0].get<double>(), j[1].get<double>(), j[2].get<double>(), j[3].get<double>()}; }

struct Rates {
  Eigen::Vector3d a_W_m_s2, w_dot_B_rad_s2;
  Eigen::Vector4d q_dot;  // w x y z
};

// Mean rates over one step of the product itself.
Rates mean_rates(sim::AirframeConfig config, std::int64_t step_ns, const sim::AirframeState& start, const std::array<double, 4>& thrust_N,
                 const std::array<double, 4>& torque_N_m) {
  config.step_ns = step_ns;
  config.ground_z_m = -1e6;
  sim::Airframe body(config, start);
  const sim::AirframeState before = body.state();
  std::array<sim::RotorLoads, 4> loads{};
  for (std::size_t i = 0; i < 4; ++i) {
    loads[i].force_R_N.z() = thrust_N[i];
    loads[i].moment_R_N_m.z() = -config.rotors[i].spin * torque_N_m[i];
    loads[i].shaft_torque_N_m = torque_N_m[i];
  }
  const std::array<double, 4> still{};
  body.step(loads, still, still);
  const double h = static_cast<double>(step_ns) * 1e-9;
  const sim::AirframeState& after = body.state();
  const Eigen::Vector4d q_dot = (after.q_WB.coeffs() - before.q_WB.coeffs()) / h;  // x y z w
  return {(after.v_W_m_s - before.v_W_m_s) / h, (after.w_B_rad_s - before.w_B_rad_s) / h, {q_dot[3], q_dot[0], q_dot[1], q_dot[2]}};
}

// Rates at the start: two steps of 20 and 40 ns continued to none, which leaves rounding of about 1e-8 of the largest rate.
Rates rates_of(const sim::AirframeConfig& config, const sim::AirframeState& start, const std::array<double, 4>& thrust_N,
               const std::array<double, 4>& torque_N_m) {
  const Rates one = mean_rates(config, 20, start, thrust_N, torque_N_m), two = mean_rates(config, 40, start, thrust_N, torque_N_m);
  return {2.0 * one.a_W_m_s2 - two.a_W_m_s2, 2.0 * one.w_dot_B_rad_s2 - two.w_dot_B_rad_s2, 2.0 * one.q_dot - two.q_dot};
}

// A vector relative to its length, because a component may be zero.
template <class Vector>
OracleRow vector_row(const std::string& source, int number, const char* quantity, const Vector& recorded, const Vector& ours) {
  const double length = recorded.norm(), distance = (ours - recorded).norm();
  return {source,      fmt::format("case {}", number),    quantity,        length,
          ours.norm(), distance / std::max(length, 1e-3), kRigidBodyLimit, "length of the vector"};
}

Eigen::Vector3d moment_of(const Eigen::Matrix3d& inertia, const Eigen::Vector3d& w, const Eigen::Vector3d& w_dot) {
  return inertia * w_dot + w.cross(inertia * w);
}

std::vector<OracleRow> compare_rotorpy(const json& j) {
  const json& p = j.at("params");
  sim::AirframeConfig config;
  config.mass_kg = p.at("mass");
  config.gravity_m_s2 = p.at("grav");
  Eigen::Matrix3d inertia;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) inertia(i, k) = p.at("inertia")[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)];
  // Its 1.43, 1.43, 2.89 e-5 kg m^2 belong to no body (2.89 > 1.43 + 1.43) and are refused by our airframe. A body that is flat
  // replaces it, and the moments that turn the two are compared; Euler's equation itself is judged by the other recording.
  config.inertia_kg_m2 = inertia;
  config.inertia_kg_m2(2, 2) = inertia(0, 0) + inertia(1, 1);
  for (std::size_t i = 0; i < 4; ++i) {
    config.rotors[i].hub_m = vector3(p.at("rotor_pos")[i]);
    config.rotors[i].spin = p.at("spin")[i];
  }
  const std::string source = "RotorPy, rigid body";
  std::vector<OracleRow> rows;
  int number = 0;
  for (const json& c : j.at("cases")) {
    const json& s = c.at("state");
    sim::AirframeState start;
    start.p_W_m = vector3(s.at("x"));
    start.v_W_m_s = vector3(s.at("v"));
    start.q_WB = quaternion(s.at("q_wxyz"));
    start.w_B_rad_s = vector3(s.at("w"));
    std::array<double, 4> thrust{}, torque{};
    for (std::size_t i = 0; i < 4; ++i) {
      const double w = s.at("rotor_speeds")[i];
      thrust[i] = p.at("ct2")[i].get<double>() * w * w;
      torque[i] = p.at("cq2")[i].get<double>() * w * w;
    }
    const json& e = c.at("expected");
    const Rates ours = rates_of(config, start, thrust, torque);
    const Eigen::Quaterniond q_dot = quaternion(e.at("qdot_wxyz"));
    const Eigen::Vector4d recorded_q_dot(q_dot.w(), q_dot.x(), q_dot.y(), q_dot.z());
    rows.push_back(vector_row(source, number, "acceleration, m/s2", vector3(e.at("vdot")), ours.a_W_m_s2));
    rows.push_back(vector_row(source, number, "moment, N m", moment_of(inertia, start.w_B_rad_s, vector3(e.at("wdot"))),
                              moment_of(config.inertia_kg_m2, start.w_B_rad_s, ours.w_dot_B_rad_s2)));
    rows.push_back(vector_row(source, number, "quaternion rate, 1/s", recorded_q_dot, ours.q_dot));
    ++number;
  }
  return rows;
}

// Its rotor thrusts and its gyroscopic term are recorded apart; their sum is the body's angular acceleration.
std::vector<OracleRow> compare_agilicious(const json& j) {
  const json& quad = j.at("quad");
  sim::AirframeConfig config;
  config.mass_kg = quad.at("mass");
  config.gravity_m_s2 = quad.at("G");
  config.inertia_kg_m2 = vector3(quad.at("J_diag")).asDiagonal();
  for (std::size_t i = 0; i < 4; ++i) {
    config.rotors[i].hub_m = vector3(quad.at("t_BM")[i]);
    config.rotors[i].spin = j.at("spin")[i];
  }
  const std::string source = "Agilicious, rigid body";
  std::vector<OracleRow> rows;
  int number = 0;
  for (const json& c : j.at("cases")) {
    sim::AirframeState start;
    start.v_W_m_s = vector3(c.at("v_W"));
    start.q_WB = quaternion(c.at("q_wxyz"));
    start.w_B_rad_s = vector3(c.at("w_B"));
    std::array<double, 4> thrust{}, torque{};
    for (std::size_t i = 0; i < 4; ++i) {
      const double w = c.at("mot")[i];
      thrust[i] = quad.at("thrust_map")[0].get<double>() * w * w;
      torque[i] = quad.at("kappa").get<double>() * thrust[i];
    }
    const Rates ours = rates_of(config, start, thrust, torque);
    const Eigen::Quaterniond q_dot = quaternion(c.at("rb_datt"));
    const Eigen::Vector4d recorded_q_dot(q_dot.w(), q_dot.x(), q_dot.y(), q_dot.z());
    const Eigen::Vector3d w_dot = vector3(c.at("tts_dome")) + vector3(c.at("rb_dome"));
    rows.push_back(vector_row(source, number, "acceleration, m/s2", vector3(c.at("tts_dvel")), ours.a_W_m_s2));
    rows.push_back(vector_row(source, number, "angular acceleration, rad/s2", w_dot, ours.w_dot_B_rad_s2));
    rows.push_back(vector_row(source, number, "quaternion rate, 1/s", recorded_q_dot, ours.q_dot));
    ++number;
  }
  return rows;
}
}  // namespace

std::vector<OracleRow> rigid_body_oracle(const std::filesystem::path& data) {
  auto rows = with_recording(data, "rotorpy_base_no_aero.json", compare_rotorpy);
  const auto more = with_recording(data, "agilicious_simple_models.json", compare_agilicious);
  rows.insert(rows.end(), more.begin(), more.end());
  return rows;
}

}  // namespace rotorloop::propeller
