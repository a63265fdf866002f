#include <fmt/format.h>
#include <fmt/ranges.h>

#include <fstream>

#include "host/base/error.hpp"
#include "host/base/toml_file.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::host {

namespace {

std::string toml_string(std::string_view s) {
  std::string out = "\"";
  for (const char c : s) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      out += fmt::format("\\u{:04x}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    } else {
      out += c;
    }
  }
  return out + "\"";
}

template <class Numbers>
std::string list(const Numbers& values) {
  std::string out = "[";
  for (const double v : values) out += (out.size() > 1 ? ", " : "") + number_text(v);
  return out + "]";
}

std::string list(const std::vector<std::string>& values) {
  std::string out = "[";
  for (const std::string& v : values) out += (out.size() > 1 ? ", " : "") + toml_string(v);
  return out + "]";
}

std::string text(const Quantity& q) {
  return fmt::format("{{ value = {}, u = {}, origin = \"{}\" }}", number_text(q.value), number_text(q.u), name(q.origin));
}

std::string effect_text(const VehicleEffect& e) {
  std::string s = fmt::format("[[effect]]\nid = {}\nparameter = {{", toml_string(e.id));
  for (std::size_t i = 0; i < e.parameters.size(); ++i)
    s += fmt::format("{} {} = {}", i ? "," : "", toml_string(e.parameters[i].name), text(e.parameters[i].quantity));
  s += " }\n";
  if (e.evidence)
    s += fmt::format("evidence = {{ held_out_before = {}, held_out_after = {}, unit = {}, run = {} }}\n",
                     number_text(e.evidence->held_out_before), number_text(e.evidence->held_out_after), toml_string(e.evidence->unit),
                     toml_string(e.evidence->run));
  return s;
}

}  // namespace

std::string vehicle_text(const VehicleFile& v) {
  std::string s = "# Nominal model of a vehicle: value, standard uncertainty u (same unit), origin (cad | stand | flight | guess).\n";
  s += fmt::format("format = {}\nname = {}\n\n[body]\nmass_kg = {}\n", v.advance ? 2 : 1, toml_string(v.name), text(v.mass_kg));
  s += fmt::format("inertia_kg_m2.xx = {}\ninertia_kg_m2.yy = {}\ninertia_kg_m2.zz = {}\n", text(v.inertia_kg_m2[0]),
                   text(v.inertia_kg_m2[1]), text(v.inertia_kg_m2[2]));
  s += fmt::format("com_offset_m.x = {}\ncom_offset_m.y = {}\n\n", text(v.com_offset_m[0]), text(v.com_offset_m[1]));
  for (const RotorPlace& r : v.rotors) s += fmt::format("[[rotor]]\nposition_m = {}\nreaction = {}\n", list(r.position_m), r.reaction);
  s += fmt::format("\n[thrust_model]\nk1_N_s2 = {}\nk2_N_s2_m = {}\nradius_m = {}\nair_density_kg_m3 = {}\nrpm_window = {}\n",
                   text(v.k1_N_s2), text(v.k2_N_s2_m), number_text(v.radius_m), number_text(v.air_density_kg_m3), list(v.rpm_window));
  s += fmt::format("\n[torque_model]\nc_q_N_m_s2 = {}\nrotor_inertia_kg_m2 = {}\n", text(v.c_q_N_m_s2), text(v.rotor_inertia_kg_m2));
  if (v.advance) s += fmt::format("c_q2_N_m_s2 = {}\nj_range = {}\n", text(v.advance->c_q2_N_m_s2), list(v.advance->j_range));
  s += fmt::format("\n[drag]\nc_dh_s_m = {}\nc_dxy_N_s2_m2 = {}\nc_dz_N_s2_m2 = {}\n", text(v.c_dh_s_m), text(v.c_dxy_N_s2_m2),
                   text(v.c_dz_N_s2_m2));
  const PoseSensorPrior& p = v.pose_sensor;
  s += fmt::format("\n[pose_sensor]\noffset_m = {{ value = {}, u = {}, origin = \"{}\" }}\n", list(p.offset_m), list(p.offset_u_m),
                   name(p.offset_origin));
  s += fmt::format("quaternion_wxyz = {{ value = {}, u_rad = {}, origin = \"{}\" }}\n", list(p.quaternion_wxyz), list(p.rotation_u_rad),
                   name(p.rotation_origin));
  if (v.ceiling_z_m) s += fmt::format("\n[room]\nceiling_z_m = {}\n", number_text(*v.ceiling_z_m));
  for (const CovarianceBlock& c : v.covariance) s += fmt::format("\n[[covariance]]\nof = {}\nmatrix = {}\n", list(c.of), list(c.matrix));
  for (const StaticThrust& t : v.static_thrust)
    s += fmt::format("\n[[static_thrust]]\norigin = \"{}\"\nc_t_N_s2 = {{ value = {}, u = {} }}\nrpm_window = {}\nair_density_kg_m3 = {}\n",
                     name(t.origin), number_text(t.c_t_N_s2), number_text(t.u_N_s2), list(t.rpm_window), number_text(t.air_density_kg_m3));
  for (const VehicleEffect& e : v.effects) s += "\n" + effect_text(e);
  if (!v.written_by.empty() || !v.inputs.empty()) {
    s += fmt::format("\n[provenance]\nwritten_by = {}\n", toml_string(v.written_by));
    if (!v.inputs.empty()) s += fmt::format("inputs = {}\n", list(v.inputs));
  }
  return s;
}

void write_vehicle(const std::filesystem::path& path, const VehicleFile& vehicle) {
  const std::filesystem::path part = path.string() + ".part";
  {
    std::ofstream out(part, std::ios::binary);
    out << vehicle_text(vehicle);
    out.flush();
    if (!out)
      throw Error({path.generic_string(), "cannot be written", "", "check that the folder exists and has space and permission"},
                  ExitCode::usage);
  }
  std::error_code ec;
  std::filesystem::rename(part, path, ec);
  if (ec)
    throw Error({path.generic_string(), "cannot be replaced: " + ec.message(), "", "check the permissions of the folder"}, ExitCode::usage);
}

}  // namespace rotorloop::host
