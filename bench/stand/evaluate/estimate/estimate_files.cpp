#include "bench/stand/evaluate/estimate/estimate_files.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/base/constants.hpp"
#include "host/base/error.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::stand {
namespace {

struct Line {
  double value = kNotMeasured;
  std::string note;
};

Line measured(const std::optional<MotorValue>& v, const char* unit, const std::string& more = "") {
  if (!v || !(v->value > 0.0)) return {};
  return {v->value, fmt::format("measured on the stand, u {:.2g} {}{}", v->u, unit, more)};
}

struct Base {
  Line resistance, inductance_d, inductance_q, flux, inertia, friction, cogging;
  std::optional<int> pole_pairs;
};
Base read_base(const std::filesystem::path& path) {
  Base b;
  if (path.empty()) return b;
  const TomlFile file = TomlFile::read(path);
  file.format({1});
  const TomlTable root = file.root();
  const std::string note = "not measured: of " + path.filename().generic_string();
  b.resistance = {root.number("resistance_ohm", {0.001, 10.0, "ohm"}), note};
  b.inductance_d = {root.table("inductance_H").number("d", {5e-7, 1e-2, "H"}), note};
  b.inductance_q = {root.table("inductance_H").number("q", {5e-7, 1e-2, "H"}), note};
  b.flux = {root.number("flux_linkage_Wb", {1e-5, 0.1, "Wb"}), note};
  b.pole_pairs = static_cast<int>(root.integer("pole_pairs", 1, 30));
  b.inertia = {root.number("inertia_kg_m2", {1e-9, 1e-2, "kg m^2"}), note};
  b.friction = {root.number("static_friction_N_m", {0.0, 0.5, "N m"}), note};
  b.cogging = {root.number("cogging_N_m", {0.0, 0.5, "N m"}), note};
  return b;
}

const Line& first(const Line& measured_line, const Line& base, const char* name, std::vector<std::string>& missing) {
  if (measured_line.value == measured_line.value) return measured_line;
  if (!(base.value == base.value)) missing.emplace_back(name);
  return base;
}

}  // namespace

std::string motor_file_text(const StandEstimate& e, const MotorFileOptions& o, const std::string& written_by) {
  const Base base = read_base(o.base);
  std::vector<std::string> missing;
  Line resistance, flux, friction, inertia, inductance_d, inductance_q;
  if (e.motor) {
    const double at = e.motor->winding_degC;
    const std::string warm = at == at ? fmt::format(", winding at {:.0f} degC", at) : ", at the run's temperature";
    resistance = measured(e.motor->resistance_ohm, "ohm", ", with the ESC's switches" + warm);
    if (const auto& w = e.motor->winding) {
      resistance = measured(MotorValue{w->winding_ohm, w->u_resistance * w->phase_ohm}, "ohm", ", by the ESC at rest" + warm);
      inductance_d = measured(MotorValue{w->inductance_d_H, w->u_inductance * w->inductance_d_H}, "H", " of each, by the ESC at rest");
      inductance_q = {w->inductance_q_H, ""};
    }
    flux = measured(e.motor->flux_linkage_Wb, "Wb", fmt::format("; K_v = {:.0f} rpm/V", e.motor->speed_constant_rpm_V.value));
    friction = measured(e.motor->friction_N_m, "N m");
  }
  std::string rotor_note;
  if (e.dynamics && e.dynamics->inertia_kg_m2) {
    const double J = *e.dynamics->inertia_kg_m2, u = e.dynamics->inertia_u_kg_m2.value_or(0.0);
    rotor_note = fmt::format("# Rotor and propeller together: {:.4g} kg m^2, u {:.2g}, from the reaction torque on the stand.\n", J, u);
    if (o.propeller_inertia_kg_m2)
      inertia = {J - *o.propeller_inertia_kg_m2,
                 fmt::format("measured, u {:.2g} kg m^2, less {:.3g} of the propeller", u, *o.propeller_inertia_kg_m2)};
  }
  const int pole_pairs = e.facts.pole_pairs > 0 ? e.facts.pole_pairs : base.pole_pairs.value_or(0);
  if (pole_pairs == 0) missing.emplace_back("pole_pairs");
  const Line& R = first(resistance, base.resistance, "resistance_ohm (needs duty, voltage and current of five steps)", missing);
  const Line& lambda = first(flux, base.flux, "flux_linkage_Wb (needs duty, voltage, current and pole_pairs)", missing);
  const Line& J = first(inertia, base.inertia, "inertia_kg_m2 (needs steps of speed with torque, and --propeller-inertia)", missing);
  const Line& F = first(friction, base.friction, "static_friction_N_m (needs torque beside the electrical channels)", missing);
  const Line& d = first(inductance_d, base.inductance_d, "inductance_H", missing);
  const Line& q = inductance_q.value == inductance_q.value ? inductance_q : base.inductance_q;
  const Line& cogging = first({}, base.cogging, "cogging_N_m", missing);
  if (!missing.empty())
    throw Error(
        {"-o", fmt::format("the run does not show {}", fmt::join(missing, ", ")), "a motor file holds more than one run on a stand can say",
         "give --base MOTOR.toml of a like motor for these (vehicles/motors/2306_2300kv.toml)"},
        ExitCode::data_quality);
  const auto line = [](const char* key, const Line& l) { return fmt::format("{} = {} # {}\n", key, number_text(l.value), l.note); };
  std::string s =
      fmt::format("# Motor {} by {}.\n{}format = 1\n", e.facts.motor.empty() ? "of run " + e.name : e.facts.motor, written_by, rotor_note);
  s += line("resistance_ohm", R);
  s += fmt::format("inductance_H = {{ d = {}, q = {} }} # {}\n", number_text(d.value), number_text(q.value), d.note);
  s += line("flux_linkage_Wb", lambda) + fmt::format("pole_pairs = {}\n", pole_pairs) + line("inertia_kg_m2", J);
  return s + line("static_friction_N_m", F) + line("cogging_N_m", cogging);
}

host::VehicleFile with_stand_values(host::VehicleFile v, const StandEstimate& e, const std::string& written_by,
                                    const AdvanceTorque* advance) {
  if (!e.thrust && !e.torque && advance == nullptr)
    throw Error({"--vehicle-out", "neither c_t nor c_q was estimated", "a faulty channel", "look at the faults that were found"},
                ExitCode::data_quality);
  const double rho = e.facts.air_density_kg_m3;
  if (!(rho > 0.0))
    throw Error({"--vehicle-out", "the run's air density is not known", "", "give --density, in kg/m³"}, ExitCode::data_quality);
  const double scale = v.air_density_kg_m3 / rho;
  const std::array<double, 2> window{e.window_rad_s[0] * kRpm_per_rad_s, e.window_rad_s[1] * kRpm_per_rad_s};
  if (e.thrust) {
    std::erase_if(v.static_thrust, [](const host::StaticThrust& s) { return s.origin == host::Origin::stand; });
    v.static_thrust.push_back({host::Origin::stand, e.thrust->value * scale, e.thrust->u * scale, window, v.air_density_kg_m3});
  }
  if (e.torque) {
    v.c_q_N_m_s2 = {e.torque->value * scale, e.torque->u * scale, host::Origin::stand};
    // A covariance of the old value says nothing of the new one.
    std::erase_if(v.covariance,
                  [](const host::CovarianceBlock& c) { return std::find(c.of.begin(), c.of.end(), "torque_model.c_q") != c.of.end(); });
  }
  if (advance != nullptr) {
    v.advance = host::TorqueAdvanceFit{{advance->c_q2_N_m_s2 * scale, advance->u2_N_m_s2 * scale, host::Origin::stand},
                                       {advance->j_low, advance->j_high}};
    // A file of runs in wind alone has no other c_q.
    if (!e.torque) v.c_q_N_m_s2 = {advance->c_q0_N_m_s2 * scale, advance->u0_N_m_s2 * scale, host::Origin::stand};
  }
  if (e.dynamics && e.dynamics->inertia_kg_m2)
    v.rotor_inertia_kg_m2 = {*e.dynamics->inertia_kg_m2, e.dynamics->inertia_u_kg_m2.value_or(0.0), host::Origin::stand};
  v.written_by = written_by;
  return v;
}

}  // namespace rotorloop::stand
