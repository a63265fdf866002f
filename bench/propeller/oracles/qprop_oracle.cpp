// QPROP 1.22 on the Graupner CAM 6x3: the reference rotor with Drela's circulation form and section, station by station; beside it,
// for information, what the annular balance and the fast solve make of the same blade.
#include <cmath>
#include <numbers>

#include "bench/propeller/oracles/oracles.hpp"
#include "bench/propeller/oracles/qprop_case.hpp"
#include "bench/propeller/oracles/recording.hpp"
#include "host/base/constants.hpp"
#include "sim/rotor/bem.hpp"

namespace rotorloop::propeller {
namespace {
constexpr double kLoadLimit = 0.005, kStationLimit = 0.01;

// The section as a polar that the fast solve can read: every half degree, a table every 5000 of Reynolds number.
sim::Polar tabulated(const sim::QpropPolar& p) {
  sim::Polar polar{"QPROP section", {}, {}};
  for (int i = -360; i <= 360; ++i) polar.alpha_deg.push_back(0.5 * i);
  const sim::Section section = sim::qprop_section(p);
  for (double re = 20e3; re <= 110e3; re += 5e3) {
    sim::PolarTable t{re, {}, {}};
    for (const double alpha : polar.alpha_deg) {
      const auto c = section({alpha * kRad_per_deg, re, 0.0});
      t.cl.push_back(c.cl);
      t.cd.push_back(c.cd);
    }
    polar.tables.push_back(std::move(t));
  }
  return polar;
}

sim::Blade as_blade(const QpropDefinition& d) {
  sim::Blade b;
  b.blades = d.blades;
  b.radius_m = d.r_m.back();
  b.hub_radius_m = d.r_m.front();
  b.stall_delay = 0.0;
  const CubicSpline chord(d.r_m, d.chord_m), beta(d.r_m, d.beta_deg);
  for (int i = 0; i <= 40; ++i) {
    const double r = d.r_m.front() + i * (d.r_m.back() - d.r_m.front()) / 40;
    b.stations.push_back({r, chord(r), beta(r), "qprop"});
  }
  b.polars.emplace("qprop", tabulated(d.polar));
  return b;
}

void compare(const std::filesystem::path& folder, const std::string& condition, const ConventionChange& change,
             std::vector<OracleRow>& rows) {
  QpropDefinition d = read_qprop_definition(folder / "cam6x3.def");
  // The listing's stations with cl < CLCD0 obey CD2u, not the CD2l of the definition: version 1.22 has one parabola.
  d.polar.cd2_below = d.polar.cd2_above;
  const QpropListing q = read_qprop_listing(folder / "cam6x3_qprop1.22_output.txt");
  sim::RotorConventions c;
  c.inflow = sim::Inflow::circulation;
  c.compressibility = true;
  c.viscosity_Pa_s = q.viscosity_Pa_s;
  c.sound_speed_m_s = q.sound_speed_m_s;
  if (change) change(c);
  sim::RotorCondition at;
  at.v_R_m_s.z() = q.speed_m_s;
  at.omega_rad_s = q.rpm * std::numbers::pi / 30.0;
  at.density_kg_m3 = q.density_kg_m3;
  const auto geometry = qprop_geometry(d, static_cast<int>(q.stations.size()));
  const auto ours = sim::ReferenceRotor(geometry, c, 4).solve(at);

  const auto row = [&](const std::string& quantity, double recorded, double value, double limit, const std::string& note = "") {
    rows.push_back({"QPROP 1.22, CAM 6x3", condition, quantity, recorded, value, relative(value, recorded, recorded), limit, note});
  };
  row("thrust, N", q.thrust_N, ours.loads.force_R_N.z(), kLoadLimit);
  row("torque, N m", q.torque_N_m, ours.loads.shaft_torque_N_m, kLoadLimit);
  Worst chord, beta, cl, cd, reynolds, axial;
  for (std::size_t i = 0; i < q.stations.size(); ++i) {
    const QpropStation& s = q.stations[i];
    const auto& o = ours.stations[i];
    chord.add(geometry.elements[i].chord_m, s.chord_m, s.chord_m);
    beta.add(geometry.elements[i].twist_rad / kRad_per_deg, s.beta_deg, s.beta_deg);
    cl.add(o.cl, s.cl, s.cl);
    cd.add(o.cd, s.cd, s.cd);
    reynolds.add(o.reynolds, s.reynolds, s.reynolds);
    axial.add(o.axial_m_s, s.axial_m_s, s.axial_m_s);
  }
  const std::string source = "QPROP 1.22, CAM 6x3", note = "worst of 25 stations";
  rows.push_back(chord.row(source, condition, "chord, m", kStationLimit, note + ", printed to 1e-4 m"));
  rows.push_back(beta.row(source, condition, "beta, deg", kStationLimit, note));
  rows.push_back(cl.row(source, condition, "cl", kStationLimit, note));
  rows.push_back(cd.row(source, condition, "cd", kStationLimit, note));
  rows.push_back(reynolds.row(source, condition, "Reynolds number", kStationLimit, note));
  rows.push_back(axial.row(source, condition, "axial velocity W_a, m/s", kStationLimit, note));

  // The same blade under our own balance, nothing of QPROP's but blade and section.
  sim::RotorConventions own;
  own.compressibility = true;
  const auto annular = sim::ReferenceRotor(geometry, own, 4).solve(at).loads;
  row("thrust, N, annular balance", q.thrust_N, annular.force_R_N.z(), 0.0, "another theory of tip loss and wake");
  row("torque, N m, annular balance", q.torque_N_m, annular.shaft_torque_N_m, 0.0);
  sim::RotorWarmStart cold;
  const auto fast = sim::solve_rotor(sim::Rotor(as_blade(d)), at, cold);
  row("thrust, N, fast solve", q.thrust_N, fast.force_R_N.z(), 0.0, "and no compressibility");
  row("torque, N m, fast solve", q.torque_N_m, fast.shaft_torque_N_m, 0.0);
}
}  // namespace

std::vector<OracleRow> qprop_oracle(const std::filesystem::path& data, const ConventionChange& change) {
  std::vector<OracleRow> rows;
  const auto folder = data / "propellers" / "cam6x3_qprop_ref";
  compare(folder / "hover", "hover, 14020 rpm", change, rows);
  compare(folder / "U5", "5 m/s, 14020 rpm", change, rows);
  return rows;
}

}  // namespace rotorloop::propeller
