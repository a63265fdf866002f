// The rotor model of Agilicious, executed by others and recorded: uniform inflow, a plate-like section, in-plane force and frame
// blockage scaled by constants. Compared with the reference rotor in those conventions. Recorded frames are z down; recorded
// v_ver > 0 is descent. The program's arc tangent is approximate in single precision, so that agreement ends at about 2 %.
#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "bench/propeller/oracles/recording.hpp"
#include "sim/rotor/reference/reference_rotor.hpp"

namespace rotorloop::propeller {
namespace {
constexpr double kAgiliciousLimit = 0.025;
using nlohmann::json;

sim::ReferenceGeometry blade(const json& p, double lift_offset) {
  const double R = p.at("r_prop"), inner = p.at("chord_inner"), outer = p.at("chord_outer");
  const double root = p.at("theta0"), twist = p.at("theta1");
  const sim::Section section = sim::plate_section(p.at("cl0"), lift_offset, p.at("cd0"));
  sim::ReferenceGeometry g{p.at("num_blades"), R, 0.0, {}};
  constexpr int n = 60;
  for (int i = 0; i < n; ++i) {
    const double x = (i + 0.5) / n;
    g.elements.push_back({x * R, R / n, inner + (outer - inner) * x, root + twist * x, section});
  }
  return g;
}

sim::RotorConventions conventions(double in_plane_factor, const ConventionChange& change) {
  sim::RotorConventions c;
  c.inflow = sim::Inflow::uniform;
  c.descent = sim::Descent::quartic;
  c.edge_loss = sim::EdgeLoss::none;
  c.swirl = c.skew = c.spanwise_drag = false;
  c.in_plane_factor = in_plane_factor;
  if (change) change(c);
  return c;
}

constexpr const char* kSource = "Agilicious";

// Worst of the four rotors of one case, and the thrust of all.
struct CaseLoads {
  Worst thrust, torque, in_plane_force, induced, lateral, coning, thrust_given_inflow, torque_given_inflow;
  double total_thrust_N = 0.0;
};

CaseLoads loads_of(const json& j, const json& c, const sim::ReferenceRotor& rotor) {
  const double k_spring = j.at("bem_params").at("k_spring");
  const int blades = j.at("bem_params").at("num_blades");
  CaseLoads w;
  for (std::size_t i = 0; i < 4; ++i) {
    const double edgewise = c.at("v_hor")[i];
    sim::RotorCondition at;
    at.v_R_m_s = {edgewise, 0.0, -c.at("v_ver")[i].get<double>()};
    at.omega_rad_s = c.at("omega_mot")[i];
    at.density_kg_m3 = j.at("bem_params").at("rho");
    const auto solution = rotor.solve(at);
    const sim::RotorLoads& l = solution.loads;
    const double T = c.at("thrust")[i], Q = c.at("torque")[i], H = c.at("hforce")[i], v = c.at("vind")[i];
    w.thrust.add(l.force_R_N.z(), T, T);
    w.torque.add(l.shaft_torque_N_m, Q, Q);
    w.induced.add(l.induced_m_s, v, v);
    const sim::RotorLoads given = rotor.at_induced(at, v).loads;
    w.thrust_given_inflow.add(given.force_R_N.z(), T, T);
    w.torque_given_inflow.add(given.shaft_torque_N_m, Q, Q);
    if (edgewise > 0.1) w.in_plane_force.add(-l.force_R_N.x(), H, H);
    w.total_thrust_N += l.force_R_N.z();
    // A blade held by a spring at the axis: k a0 is its mean aerodynamic moment, k b1 the part that varies with sin(psi), psi = 90 deg
    // advancing.
    double moment_N_m = 0.0;
    for (const auto& s : solution.stations) moment_N_m += s.thrust_N * s.r_m;
    const double a0 = c.at("a0")[i], b1 = c.at("b1s")[i];
    w.coning.add(moment_N_m / blades / k_spring, a0, a0);
    if (edgewise > 0.1) w.lateral.add(-2.0 * l.moment_R_N_m.x() / blades / k_spring, b1, b1);
  }
  return w;
}

// The vehicle's acceleration along its own z, with the frame's blockage. Flapping turns it by less than 1e-4.
OracleRow specific_force_row(const json& j, const json& c, const std::string& condition, double total_thrust_N) {
  const double obstruction = j.at("identified").at("z_obstruction_factor");
  const double mass = j.at("quad").at("mass"), gravity = j.at("quad").at("G");
  const json &q = c.at("q_wxyz"), &a = c.at("dvel");
  const Eigen::Quaterniond attitude(q[0].get<double>(), q[1].get<double>(), q[2].get<double>(), q[3].get<double>());
  const Eigen::Vector3d up_W(0.0, 0.0, gravity);
  const Eigen::Vector3d specific_B =
      attitude.conjugate() * (Eigen::Vector3d(a[0].get<double>(), a[1].get<double>(), a[2].get<double>()) + up_W);
  const double ours = obstruction * total_thrust_N / mass;
  return {kSource,          condition, "specific force z x 0.9575, m/s2",
          specific_B.z(),   ours,      relative(ours, specific_B.z(), specific_B.z()),
          kAgiliciousLimit, ""};
}

std::vector<OracleRow> compare(const json& j, const ConventionChange& change) {
  const double camber = j.at("identified").at("camber_offset"), in_plane = j.at("identified").at("h_force_correction");
  const sim::ReferenceRotor rotor(blade(j.at("bem_params"), camber), conventions(in_plane, change), 24);
  const std::string not_judged = "not judged: theirs ignores climb speed, see the acceptance page";
  std::vector<OracleRow> rows;
  int number = 0;
  for (const json& c : j.at("cases")) {
    const CaseLoads w = loads_of(j, c, rotor);
    const std::string condition = fmt::format("case {}, v = ({:g} {:g} {:g}) m/s", number++, c.at("v_W")[0].get<double>(),
                                              c.at("v_W")[1].get<double>(), c.at("v_W")[2].get<double>());
    const auto judge = [&](const Worst& worst, const char* quantity) {
      rows.push_back(worst.row(kSource, condition, quantity, kAgiliciousLimit, "worst of 4 rotors"));
    };
    judge(w.thrust, "thrust, N");
    judge(w.torque, "torque, N m");
    judge(w.induced, "induced velocity, m/s");
    judge(w.thrust_given_inflow, "thrust at recorded inflow, N");
    judge(w.torque_given_inflow, "torque at recorded inflow, N m");
    if (w.in_plane_force.count > 0) {
      judge(w.in_plane_force, "in-plane force x 3, N");
      rows.push_back(w.lateral.row(kSource, condition, "flapping b1, rad", 0.0, not_judged));
    }
    rows.push_back(w.coning.row(kSource, condition, "coning a0, rad", 0.0, not_judged));
    rows.push_back(specific_force_row(j, c, condition, w.total_thrust_N));
  }
  return rows;
}
}  // namespace

std::vector<OracleRow> agilicious_oracle(const std::filesystem::path& data, const ConventionChange& change) {
  return with_recording(data, "agilicious_bem.json", [&](const json& j) { return compare(j, change); });
}

}  // namespace rotorloop::propeller
