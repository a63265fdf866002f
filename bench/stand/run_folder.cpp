#include "bench/stand/run_folder.hpp"

#include <fmt/format.h>

namespace rotorloop::stand {
namespace {

std::string in_quotes(const std::string& s) {
  std::string out = "\"";
  for (const char c : s) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

// A table of run.toml from either end: takes values from the file, or writes those that are known. `required`: for a reader.
class Keys {
 public:
  explicit Keys(const TomlTable& file) : file_(&file) {}
  explicit Keys(std::string& out) : out_(&out) {}

  void text(const char* key, std::string& v, bool required = false) {
    if (file_) v = required ? file_->text(key) : file_->text(key, "");
    if (out_ && (required || !v.empty())) put(key, in_quotes(v));
  }
  void number(const char* key, double& v, Range range, bool required = false) {
    if (file_ && (required || file_->has(key))) v = file_->number(key, range);
    if (out_ && v == v) put(key, number_text(v));
  }
  void integer(const char* key, int& v, int least, int most) {
    if (file_) v = static_cast<int>(file_->integer(key, least, most, 0));
    if (out_ && v != 0) put(key, std::to_string(v));
  }
  void flag(const char* key, bool& v) {
    if (file_) v = file_->boolean(key, false);
    if (out_) put(key, v ? "true" : "false");
  }
  // `known`: there is something to write.
  template <class Inner>
  void table(const char* key, bool known, Inner inner) {
    if (out_ && known) {
      *out_ += fmt::format("[{}]\n", key);
      inner(*this);
    }
    if (const auto t = file_ ? file_->optional_table(key) : std::nullopt) inner(Keys(*t));
  }
  template <class T, class Inner>
  void list(const char* key, std::vector<T>& entries, Inner inner) {
    if (out_)
      for (T& entry : entries) {
        *out_ += fmt::format("[[{}]]\n", key);
        inner(*this, entry);
      }
    if (file_ && file_->has(key))
      for (const TomlTable& t : file_->tables(key, 1, 64)) inner(Keys(t), entries.emplace_back());
  }
  void entries(std::map<std::string, double>& all) {
    if (file_) all = read_uncertainties(*file_);
    if (out_)
      for (const auto& [key, v] : all) put(key, number_text(v));
  }
  void entries(std::vector<std::pair<std::string, std::string>>& all) {
    if (file_)
      for (const std::string& key : file_->keys()) all.emplace_back(key, file_->text(key));
    if (out_)
      for (const auto& [key, v] : all) put(in_quotes(key), in_quotes(v));
  }

 private:
  void put(const std::string& key, const std::string& value) { *out_ += key + " = " + value + '\n'; }
  const TomlTable* file_ = nullptr;
  std::string* out_ = nullptr;
};

// Every key of run.toml, in the order of the file.
void each_key(Keys root, RunFacts& f) {
  constexpr Range kOhm{0.001, 10.0, "ohm"}, kHenry{5e-8, 1e-2, "H"};
  constexpr bool kRequired = true;
  for (const auto& [key, text] : {std::pair{"motor", &f.motor},
                                  {"propeller", &f.propeller},
                                  {"mount", &f.mount},
                                  {"esc", &f.esc},
                                  {"stand", &f.stand},
                                  {"sequence", &f.sequence},
                                  {"started_utc", &f.started_utc},
                                  {"version", &f.version},
                                  {"end", &f.end},
                                  {"trip", &f.trip}})
    root.text(key, *text);
  root.integer("pole_pairs", f.pole_pairs, 1, 30);
  root.number("diameter_m", f.diameter_m, {0.01, 10.0, "m"});
  root.flag("simulated", f.simulated);
  const bool density_known = f.air_density_kg_m3 == f.air_density_kg_m3;
  root.table("air", density_known || f.air_temperature_degC == f.air_temperature_degC, [&](Keys t) {
    t.number("density_kg_m3", f.air_density_kg_m3, {0.5, 1.6, "kg/m^3"});
    if (f.air_density_kg_m3 == f.air_density_kg_m3) return;
    t.number("temperature_degC", f.air_temperature_degC, {-40.0, 60.0, "degC"}, kRequired);
    t.number("pressure_Pa", f.air_pressure_Pa, {5e4, 1.1e5, "Pa"}, kRequired);
    t.number("humidity", f.air_humidity, {0.0, 1.0, "1"});
  });
  root.table("wind", f.airspeed_m_s == f.airspeed_m_s, [&](Keys t) {
    t.number("airspeed_m_s", f.airspeed_m_s, {-100.0, 100.0, "m/s"}, kRequired);
  });
  root.table("winding", f.winding.has_value(), [&](Keys t) {
    MeasuredWinding& w = f.winding ? *f.winding : f.winding.emplace();
    t.number("phase_ohm", w.phase_ohm, kOhm, kRequired);
    t.number("winding_ohm", w.winding_ohm, {0.0005, 10.0, "ohm"}, kRequired);
    t.number("inductance_d_H", w.inductance_d_H, kHenry, kRequired);
    t.number("inductance_q_H", w.inductance_q_H, kHenry, kRequired);
    t.number("u_resistance", w.u_resistance, kShareOfValue, kRequired);
    t.number("u_inductance", w.u_inductance, kShareOfValue, kRequired);
    t.number("temperature_degC", w.degC, {-60.0, 200.0, "degC"});
  });
  root.table("uncertainty", !f.uncertainty.empty(), [&](Keys t) { t.entries(f.uncertainty); });
  root.list("instrument", f.instruments, [](Keys t, Instrument& i) {
    t.text("axis", i.axis, kRequired);
    t.text("model", i.model, kRequired);
    t.text("channel", i.channel, kRequired);
    t.text("evidence", i.evidence, kRequired);
    t.text("source", i.source);
  });
  root.table("calibration", !f.calibrated_on.empty(), [&](Keys t) {
    t.text("date", f.calibrated_on);
    t.text("expires", f.calibration_expires);
    t.text("stand_sha256", f.stand_sha256);
  });
  root.table("esc_node", f.esc_node != 0, [&](Keys t) {
    t.integer("node", f.esc_node, 1, 127);
    t.text("name", f.esc_name);
    t.text("unique_id", f.esc_unique_id);
    t.text("software", f.esc_software);
    t.text("image_crc", f.esc_image_crc);
  });
  root.table("esc_parameters", !f.esc_parameters.empty(), [&](Keys t) { t.entries(f.esc_parameters); });
}

}  // namespace

std::string samples_header() {
  std::string out = fmt::format("{},{},configuration,{}", kTime, kStep, kTarget);
  for (const SampleColumn& c : kSampleColumns) out.append(",").append(c.name);
  return out;
}

std::string sample_line(double t_s, int step, char configuration, double target_rad_s, const std::vector<double>& measured) {
  std::string out =
      fmt::format("{:.4f},{},{},{:.4f}", t_s, step < 0 ? "" : std::to_string(step), configuration == 'B' ? 1 : 0, target_rad_s);
  for (std::size_t i = 0; i < kColumns; ++i) {
    const int decimals = kSampleColumns[i].decimals;
    const double v = measured[i];
    out += v != v ? "," : decimals < 0 ? fmt::format(",{:.6g}", v) : fmt::format(",{:.{}f}", v, decimals);
  }
  return out;
}

std::string run_toml(const RunFacts& facts) {
  std::string out = "format = 1\n";
  RunFacts f = facts;
  each_key(Keys(out), f);
  return out;
}

RunFacts read_run_toml(const std::filesystem::path& file) {
  const TomlFile toml = TomlFile::read(file);
  toml.format({1});
  const TomlTable root = toml.root();
  RunFacts f;
  each_key(Keys(root), f);
  return f;
}

std::map<std::string, double> read_uncertainties(const TomlTable& table) {
  std::map<std::string, double> out;
  for (const auto& [key, range] : kUncertaintyKeys)
    if (table.has(key)) out[key] = table.number(key, range);
  return out;
}

}  // namespace rotorloop::stand
