#include "bench/stand/run_folder.hpp"

#include <fmt/format.h>

namespace rotorloop::stand {
namespace {

struct SampleColumn {
  std::string_view name;
  double SampleRow::*value;
  int decimals;  // below 0: six significant digits
};
constexpr SampleColumn kSampleColumns[] = {{column::kTime, &SampleRow::t_s, 4},
                                           {column::kStep, &SampleRow::step, 0},
                                           {"configuration", &SampleRow::configuration, 0},
                                           {column::kTarget, &SampleRow::target_rad_s, 4},
                                           {column::kOmega, &SampleRow::omega_rad_s, 4},
                                           {column::kThrust, &SampleRow::thrust_N, 5},
                                           {column::kTorque, &SampleRow::torque_N_m, 7},
                                           {column::kVoltage, &SampleRow::voltage_V, 5},
                                           {column::kCurrent, &SampleRow::current_A, 5},
                                           {"independent_rad_s", &SampleRow::independent_rad_s, 4},
                                           {"esc_voltage_V", &SampleRow::esc_voltage_V, -1},
                                           {"esc_current_A", &SampleRow::esc_current_A, -1},
                                           {"esc_degC", &SampleRow::esc_degC, -1},
                                           {"motor_degC", &SampleRow::motor_degC, -1},
                                           {column::kDutyQ, &SampleRow::duty_q, -1}};

std::string quoted(const std::string& s) {
  std::string out = "\"";
  for (const char c : s) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

// Both ends of run.toml have these calls; what is required is so for a reader.
class Writer {
 public:
  std::string out = "format = 1\n";
  void required(const char* key, const std::string& v) { out += fmt::format("{} = {}\n", key, quoted(v)); }
  void required(const char* key, double v, Range) { out += fmt::format("{} = {}\n", key, number_text(v)); }
  void optional(const char* key, const std::string& v) {
    if (!v.empty()) required(key, v);
  }
  void optional(const char* key, double v, Range range) {
    if (v == v) required(key, v, range);
  }
  void optional(const char* key, int v, int, int) {
    if (v != 0) out += fmt::format("{} = {}\n", key, v);
  }
  void optional(const char* key, bool v) { out += fmt::format("{} = {}\n", key, v); }
  template <class Keys>
  void table(const char* key, bool known, Keys keys) {
    if (known) out += fmt::format("[{}]\n", key), keys(*this);
  }
  template <class T, class Keys>
  void list(const char* key, std::vector<T>& entries, Keys keys) {
    for (T& entry : entries) out += fmt::format("[[{}]]\n", key), keys(*this, entry);
  }
  void entries(const std::map<std::string, double>& all) {
    for (const auto& [key, v] : all) out += fmt::format("{} = {}\n", key, number_text(v));
  }
  void entries(const std::vector<std::pair<std::string, std::string>>& all) {
    for (const auto& [key, v] : all) required(quoted(key).c_str(), v);
  }
};

class Reader {
 public:
  explicit Reader(TomlTable t) : t_(std::move(t)) {}
  void required(const char* key, std::string& v) { v = t_.text(key); }
  void required(const char* key, double& v, Range range) { v = t_.number(key, range); }
  void optional(const char* key, std::string& v) { v = t_.text(key, ""); }
  void optional(const char* key, double& v, Range range) {
    if (t_.has(key)) required(key, v, range);
  }
  void optional(const char* key, int& v, int least, int most) { v = static_cast<int>(t_.integer(key, least, most, 0)); }
  void optional(const char* key, bool& v) { v = t_.boolean(key, false); }
  template <class Keys>
  void table(const char* key, bool, Keys keys) {
    if (const auto t = t_.optional_table(key)) {
      Reader inner(*t);
      keys(inner);
    }
  }
  template <class T, class Keys>
  void list(const char* key, std::vector<T>& entries, Keys keys) {
    if (!t_.has(key)) return;
    for (const TomlTable& t : t_.tables(key, 1, 64)) {
      Reader inner(t);
      keys(inner, entries.emplace_back());
    }
  }
  void entries(std::map<std::string, double>& all) { all = read_uncertainties(t_); }
  void entries(std::vector<std::pair<std::string, std::string>>& all) {
    for (const std::string& key : t_.keys()) all.emplace_back(key, t_.text(key));
  }

 private:
  TomlTable t_;
};

// Every key of run.toml, in the order of the file.
template <class End>
void each_key(End& root, RunFacts& f) {
  constexpr Range kOhm{0.001, 10.0, "ohm"}, kHenry{5e-8, 1e-2, "H"};
  root.optional("motor", f.motor), root.optional("propeller", f.propeller), root.optional("mount", f.mount);
  root.optional("esc", f.esc), root.optional("stand", f.stand), root.optional("pole_pairs", f.pole_pairs, 1, 30);
  root.optional("diameter_m", f.diameter_m, {0.01, 10.0, "m"});
  root.optional("sequence", f.sequence), root.optional("started_utc", f.started_utc), root.optional("version", f.version);
  root.optional("simulated", f.simulated), root.optional("end", f.end), root.optional("trip", f.trip);
  root.table("air", f.air_density_kg_m3 == f.air_density_kg_m3 || f.air_temperature_degC == f.air_temperature_degC, [&](auto& t) {
    t.optional("density_kg_m3", f.air_density_kg_m3, {0.5, 1.6, "kg/m^3"});
    if (f.air_density_kg_m3 == f.air_density_kg_m3) return;
    t.required("temperature_degC", f.air_temperature_degC, {-40.0, 60.0, "degC"});
    t.required("pressure_Pa", f.air_pressure_Pa, {5e4, 1.1e5, "Pa"}), t.optional("humidity", f.air_humidity, {0.0, 1.0, "1"});
  });
  root.table("wind", f.airspeed_m_s == f.airspeed_m_s, [&](auto& t) {
    t.required("airspeed_m_s", f.airspeed_m_s, {-100.0, 100.0, "m/s"});
  });
  root.table("winding", f.winding.has_value(), [&](auto& t) {
    MeasuredWinding& w = f.winding ? *f.winding : f.winding.emplace();
    t.required("phase_ohm", w.phase_ohm, kOhm), t.required("winding_ohm", w.winding_ohm, {0.0005, 10.0, "ohm"});
    t.required("inductance_d_H", w.inductance_d_H, kHenry), t.required("inductance_q_H", w.inductance_q_H, kHenry);
    t.required("u_resistance", w.u_resistance, kShareOfValue), t.required("u_inductance", w.u_inductance, kShareOfValue);
    t.optional("temperature_degC", w.degC, {-60.0, 200.0, "degC"});
  });
  root.table("uncertainty", !f.uncertainty.empty(), [&](auto& t) { t.entries(f.uncertainty); });
  root.list("instrument", f.instruments, [](auto& t, Instrument& i) {
    t.required("axis", i.axis), t.required("model", i.model), t.required("channel", i.channel), t.required("evidence", i.evidence);
    t.optional("source", i.source);
  });
  root.table("calibration", !f.calibrated_on.empty(), [&](auto& t) {
    t.optional("date", f.calibrated_on), t.optional("expires", f.calibration_expires), t.optional("stand_sha256", f.stand_sha256);
  });
  root.table("esc_node", f.esc_node != 0, [&](auto& t) {
    t.optional("node", f.esc_node, 1, 127), t.optional("name", f.esc_name), t.optional("unique_id", f.esc_unique_id);
    t.optional("software", f.esc_software), t.optional("image_crc", f.esc_image_crc);
  });
  root.table("esc_parameters", !f.esc_parameters.empty(), [&](auto& t) { t.entries(f.esc_parameters); });
}

}  // namespace

std::string samples_header() {
  std::string out;
  for (const SampleColumn& c : kSampleColumns) out.append(out.empty() ? "" : ",").append(c.name);
  return out;
}

std::string sample_line(const SampleRow& row) {
  std::string out;
  for (const SampleColumn& c : kSampleColumns) {
    if (&c != kSampleColumns) out += ',';
    const double v = row.*c.value;
    if (v == v) out += c.decimals < 0 ? fmt::format("{:.6g}", v) : fmt::format("{:.{}f}", v, c.decimals);
  }
  return out;
}

std::string run_toml(const RunFacts& facts) {
  Writer writer;
  RunFacts f = facts;
  each_key(writer, f);
  return writer.out;
}

RunFacts read_run_toml(const std::filesystem::path& file) {
  const TomlFile toml = TomlFile::read(file);
  toml.format({1});
  Reader reader(toml.root());
  RunFacts f;
  each_key(reader, f);
  return f;
}

std::map<std::string, double> read_uncertainties(const TomlTable& table) {
  std::map<std::string, double> out;
  for (const auto& [key, range] : kUncertaintyKeys)
    if (table.has(key)) out[key] = table.number(key, range);
  return out;
}

}  // namespace rotorloop::stand
