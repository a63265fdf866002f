// result.json, both ways: contract result.schema.md, format 1. Numbers that were not measured are null.
#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "bench/hil/flight/run_folder.hpp"
#include "host/base/error.hpp"

namespace rotorloop::hil {
namespace {
using Json = nlohmann::ordered_json;

double number(const Json& j) { return j.is_number() ? j.get<double>() : kNotMeasured; }
double number(const Json& j, const char* key) { return j.contains(key) ? number(j.at(key)) : kNotMeasured; }
template <std::size_t N>
void numbers(const Json& j, const char* key, std::array<double, N>& out) {
  if (!j.contains(key)) return;
  for (std::size_t i = 0; i < N; ++i) out[i] = number(j.at(key).at(i));
}

Json to_json(const ErrorFigures& e) {
  return {{"mean_3d", e.mean_3d_cm}, {"max_3d", e.max_3d_cm}, {"rms_3d", e.rms_3d_cm},
          {"mean_z", e.mean_z_cm},   {"max_z", e.max_z_cm},   {"mean_horizontal", e.mean_horizontal_cm}};
}
ErrorFigures error_figures(const Json& j) {
  return {number(j, "mean_3d"), number(j, "max_3d"), number(j, "rms_3d"),
          number(j, "mean_z"),  number(j, "max_z"),  number(j, "mean_horizontal")};
}

Json to_json(const PaceResult& p) {
  const Lateness& l = p.lateness;
  return {{"pace", p.pace},
          {"deadlines", l.steps},
          {"missed", l.missed},
          {"late_up_to_us", Lateness::kUpTo_us},
          {"late_counts", l.counts},
          {"late_p99_9_us", l.quantile_us(0.999)},
          {"late_worst_us", 1e-3 * static_cast<double>(l.worst_ns)}};
}
PaceResult pace_result(const Json& j) {
  PaceResult p{.pace = j.at("pace"), .lateness = {}};
  p.lateness.steps = j.at("deadlines");
  p.lateness.missed = j.at("missed");
  p.lateness.counts = j.at("late_counts");
  p.lateness.worst_ns = std::llround(1e3 * j.at("late_worst_us").get<double>());
  return p;
}

Json to_json(const FlightResult& f) {
  Json j{{"flight", f.flight}, {"variant", variant_name(f.variant)}, {"seed", f.seed}, {"end", flight_end_name(f.end)}};
  if (!f.end_detail.empty()) j["end_detail"] = f.end_detail;
  j["duration_s"] = f.duration_s;
  j["max_speed_m_s"] = f.max_speed_m_s;
  j["max_accel_m_s2"] = f.max_accel_m_s2;
  j["error_cm"] = to_json(f.tracking.truth);
  j["estimate_error_cm"] = to_json(f.tracking.estimate);
  j["estimator_mean_3d_cm"] = f.tracking.estimator_mean_3d_cm;
  j["first_motion_s"] = f.tracking.first_motion_s;
  j["last_motion_s"] = f.tracking.last_motion_s;
  j["samples"] = f.tracking.samples;
  j["bus_load_mean_percent"] = f.bus_load_mean_percent;
  j["bus_load_max_percent"] = f.bus_load_max_percent;
  j["rpm_error_rms_rad_s"] = f.rpm_error_rms_rad_s;
  j["limited_share"] = f.limited_share;
  j["attitude_error_mean_deg"] = f.attitude_error_mean_deg;
  j["attitude_error_max_deg"] = f.attitude_error_max_deg;
  j["command_mean_rad_s"] = f.command_mean_rad_s;
  j["command_std_rad_s"] = f.command_std_rad_s;
  j["counters"] = f.counters;
  if (f.pace) j["pace"] = to_json(*f.pace);
  return j;
}

// A name that is none of ours is that of somebody's controller.
Variant variant_of(const Json& j) {
  const auto name = j.at("variant").get<std::string>();
  if (const auto v = variant_from_name(name)) return *v;
  if (!is_variant_name(name)) throw std::runtime_error("\"" + name + "\" is no name of a variant");
  return Variant::external(name);
}

FlightResult flight_result(const Json& j) {
  FlightResult f;
  f.flight = j.at("flight");
  f.variant = variant_of(j);
  f.seed = j.at("seed");
  for (const auto e :
       {FlightEnd::completed, FlightEnd::crashed, FlightEnd::safe_state, FlightEnd::interrupted, FlightEnd::incomplete, FlightEnd::late})
    if (flight_end_name(e) == j.at("end").get<std::string>()) f.end = e;
  f.end_detail = j.value("end_detail", "");
  f.duration_s = number(j, "duration_s");
  f.max_speed_m_s = number(j, "max_speed_m_s");
  f.max_accel_m_s2 = number(j, "max_accel_m_s2");
  f.tracking.truth = error_figures(j.at("error_cm"));
  f.tracking.estimate = error_figures(j.at("estimate_error_cm"));
  f.tracking.estimator_mean_3d_cm = number(j, "estimator_mean_3d_cm");
  f.tracking.first_motion_s = number(j, "first_motion_s");
  f.tracking.last_motion_s = number(j, "last_motion_s");
  f.tracking.samples = j.value("samples", std::uint64_t{0});
  numbers(j, "bus_load_mean_percent", f.bus_load_mean_percent);
  numbers(j, "bus_load_max_percent", f.bus_load_max_percent);
  numbers(j, "rpm_error_rms_rad_s", f.rpm_error_rms_rad_s);
  f.limited_share = number(j, "limited_share");
  f.attitude_error_mean_deg = number(j, "attitude_error_mean_deg");
  f.attitude_error_max_deg = number(j, "attitude_error_max_deg");
  f.command_mean_rad_s = number(j, "command_mean_rad_s");
  f.command_std_rad_s = number(j, "command_std_rad_s");
  if (j.contains("counters"))
    for (const auto& [name, value] : j.at("counters").items()) f.counters[name] = number(value);
  if (j.contains("pace")) f.pace = pace_result(j.at("pace"));
  return f;
}

}  // namespace

std::string result_json_text(const RunResult& r) {
  Json j{{"format", 1}, {"command", r.command}, {"version", r.version}, {"git", r.git}, {"scenario", r.scenario}};
  if (!r.escs.empty()) j["escs"] = r.escs;
  j["inputs"] = Json::array();
  for (const auto& i : r.inputs) j["inputs"].push_back({{"path", i.path}, {"sha256", i.sha256}});
  j["seed"] = r.seeds.empty() ? Json(nullptr) : Json(r.seeds.front());
  j["seeds"] = r.seeds;
  j["started_utc"] = r.started_utc;
  j["wall_s"] = r.wall_s;
  j["verdict"] = verdict_name(r.verdict);
  j["limits"] = Json::array();
  for (const auto& l : r.limits)
    j["limits"].push_back(
        {{"name", l.name}, {"value", l.value}, {"unit", l.unit}, {"limit", l.limit}, {"sense", l.upper ? "max" : "min"}, {"pass", l.pass}});
  j["figures"] = Json::object();
  for (const auto& [name, f] : r.figures) j["figures"][name] = {{"value", f.value}, {"u", f.u}, {"unit", f.unit}, {"n", f.n}};
  j["flights"] = Json::array();
  for (const auto& f : r.flights) j["flights"].push_back(to_json(f));
  j["published"] = Json::array();
  for (const auto& p : r.published)
    j["published"].push_back({{"flight", p.flight},
                              {"variant", variant_name(p.variant)},
                              {"error_cm", p.error_cm},
                              {"axis", axis_name(p.axis)},
                              {"source", p.source}});
  j["log_sha256"] = r.log_sha256;
  j["logs"] = r.log_hashes;
  j["warnings"] = Json::array();
  for (const auto& w : r.warnings) j["warnings"].push_back({{"where", w.where}, {"what", w.what}});
  if (!r.real_time.empty()) j["real_time"] = r.real_time;
  j["errors"] = r.errors;
  j["next"] = r.next;
  return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

RunResult read_result(const std::filesystem::path& run_folder) {
  const auto path = run_folder / "result.json";
  std::error_code ec;
  if (!std::filesystem::is_regular_file(path, ec)) {
    const bool started = std::filesystem::is_regular_file(run_folder / "run.toml", ec);
    const std::string what =
        std::filesystem::exists(run_folder, ec) ? "is not a run folder (no result.json)" : "is not a run folder (it does not exist)";
    throw Error(
        {run_folder.generic_string(), started ? "this run has no result.json" : what, started ? "the run was stopped before its end" : "",
         started ? "fly it again with --force" : "give a folder that `rotorloop hil` has written"},
        started ? ExitCode::data_quality : ExitCode::usage);
  }
  const auto broken = [&](const std::string& why) -> Error {
    return Error({path.generic_string(), "cannot be understood: " + why, "the file was edited, cut, or written by a newer rotorloop",
                  "fly the run again"},
                 ExitCode::data_quality);
  };
  try {
    std::ifstream in(path, std::ios::binary);
    const Json j = Json::parse(in);
    if (j.at("format") != 1) throw broken(fmt::format("format {} is not known here; known: 1", j.at("format").dump()));
    RunResult r;
    r.command = j.at("command");
    r.version = j.at("version");
    r.git = j.at("git");
    r.scenario = j.value("scenario", "");
    r.escs = j.value("escs", "");
    for (const auto& i : j.at("inputs")) r.inputs.push_back({i.at("path"), i.at("sha256")});
    if (j.contains("seeds")) r.seeds = j.at("seeds").get<std::vector<std::uint64_t>>();
    r.started_utc = j.value("started_utc", "");
    r.wall_s = number(j, "wall_s");
    for (const auto v : {Verdict::pass, Verdict::fail, Verdict::incomplete})
      if (verdict_name(v) == j.at("verdict").get<std::string>()) r.verdict = v;
    for (const auto& l : j.at("limits"))
      r.limits.push_back(
          {l.at("name"), number(l, "value"), l.at("unit"), number(l, "limit"), l.value("sense", "max") == "max", l.at("pass")});
    for (const auto& [name, f] : j.at("figures").items())
      r.figures[name] = {number(f, "value"), number(f, "u"), f.at("unit"), f.value("n", 0)};
    if (j.contains("flights"))
      for (const auto& f : j.at("flights")) r.flights.push_back(flight_result(f));
    if (j.contains("published"))
      for (const auto& p : j.at("published")) {
        r.published.push_back({p.at("flight"), variant_of(p), number(p, "error_cm"),
                               p.value("axis", "3d") == "z" ? ErrorAxis::z : ErrorAxis::norm_3d, p.at("source")});
      }
    r.log_sha256 = j.at("log_sha256");
    if (j.contains("logs")) r.log_hashes = j.at("logs").get<std::map<std::string, std::string>>();
    for (const auto& w : j.at("warnings")) r.warnings.push_back({w.at("where"), w.at("what")});
    r.real_time = j.value("real_time", std::vector<std::string>{});
    r.errors = j.at("errors").get<std::vector<std::string>>();
    r.next = j.value("next", "");
    return r;
  } catch (const Error&) {
    throw;
  } catch (const std::exception& e) {
    throw broken(e.what());
  }
}

std::map<std::string, Figure> figures_of(const Scenario& s, const Assessment& a, const std::vector<FlightResult>& flights) {
  std::map<std::string, Figure> out;
  for (const auto& c : a.table) {
    const std::string at = c.flight + "/" + std::string(variant_name(c.variant)) + "/";
    const auto put = [&](const char* name, const Spread& x) { out[at + name] = {x.mean, x.std, "cm", x.n}; };
    put("mean_error_3d", c.error_3d_cm);
    put("mean_error_z", c.error_z_cm);
    put("mean_error_3d_from_estimate", c.estimate_error_3d_cm);
    put("mean_error_z_from_estimate", c.estimate_error_z_cm);
    put("mean_estimator_error_3d", c.estimator_error_cm);
    const auto axis = table_axis(s, c.flight);
    for (const auto from : kAllVariants) {
      if (Variant(from) >= c.variant || !find_cell(a, c.flight, from)) continue;
      const auto less = reduction(flights, c.flight, from, c.variant, axis);
      out[at + "reduction_from_" + std::string(variant_name(from))] = {less.percent, less.std_percent, "%", less.n};
    }
  }
  return out;
}

}  // namespace rotorloop::hil
