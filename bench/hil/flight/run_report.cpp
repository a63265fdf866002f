#include "bench/hil/flight/run_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>

#include "bench/hil/flight/limiter_names.hpp"
#include "bench/hil/flight/run_outcome.hpp"
#include "bench/render/digits.hpp"
#include "bench/sysid/log/log_reader.hpp"
#include "host/base/constants.hpp"
#include "host/base/error.hpp"
#include "host/base/text_file.hpp"
#include "host/base/toml_file.hpp"
#include "host/bus/bus_log.hpp"
#include "host/bus/frame_bits.hpp"

namespace rotorloop::hil {
namespace fs = std::filesystem;
namespace {

constexpr double kBitRate_Hz = 1e6;      // both buses (wire specification)
constexpr double kLoadWindow_s = 0.010;  // as the virtual bus measures it
constexpr std::array kAxisNames{"x", "y", "z"};

// Ours keep their colours in every report; the others follow, by the order of the table.
int colour_of(const Variant& v, const std::vector<Variant>& flown) {
  if (!v.is_external()) return static_cast<int>(v.own());
  const auto at = std::find(flown.begin(), flown.end(), v) - flown.begin();
  const auto ours = std::count_if(flown.begin(), flown.end(), [](const Variant& o) { return !o.is_external(); });
  return static_cast<int>(kAllVariants.size()) + static_cast<int>(at - ours);
}

std::string joined(std::string_view a, std::string_view b) { return std::string(a) + std::string(b); }

struct FlightLogs {
  log::LogTable flight, truth;
  const log::LogTable* holder(std::string_view column) const { return truth.has(column) ? &truth : flight.has(column) ? &flight : nullptr; }
};

FlightLogs read_logs(const fs::path& folder) {
  std::set<std::string> wanted{"t[s]", "control_limiter[1]", "load_esc[%]", "load_state[%]"};
  for (const auto* axis : kAxisNames)
    for (const auto* name : {"true_p_", "est_p_", "sp_p_"}) wanted.insert(joined(name, axis) + "[m]");
  for (int i = 1; i <= 4; ++i) {
    for (const auto* name : {"omega_", "omega_cmd_", "true_omega_"}) wanted.insert(fmt::format("{}{}[rad/s]", name, i));
    wanted.insert(fmt::format("esc_limiter_{}[1]", i));
  }
  FlightLogs logs{log::read_log(folder / "flight.csv", wanted), log::read_log(folder / "truth.csv", wanted)};
  if (logs.flight.rows != logs.truth.rows || logs.flight.column("t[s]") != logs.truth.column("t[s]"))
    throw Error({(folder / "truth.csv").generic_string(),
                 fmt::format("does not fit flight.csv beside it: {} rows against {}, or other times", logs.truth.rows, logs.flight.rows),
                 "the run was stopped while it wrote", "fly the run again"},
                ExitCode::data_quality);
  return logs;
}

// Rows of time intervals in which `acts` held.
template <class Acts>
std::vector<render::Interval> intervals(const std::vector<double>& t, Acts acts) {
  std::vector<render::Interval> out;
  bool on = false;
  for (std::size_t i = 0; i < t.size(); ++i) {
    const bool now = acts(i);
    if (now && !on) out.push_back({t[i], t[i]});
    if (on) out.back().to = t[i];
    on = now;
  }
  return out;
}

std::string header_of(const FlightLogs& logs, const std::string& key) {
  for (const auto* log : {&logs.truth, &logs.flight})
    if (const auto it = log->header.find(key); it != log->header.end()) return it->second;
  return "";
}

std::vector<render::TimelineRow> limiter_rows(const FlightLogs& logs) {
  std::vector<render::TimelineRow> rows;
  const auto& t = logs.flight.column("t[s]");
  if (const auto* log = logs.holder("control_limiter[1]")) {
    const auto& bits = log->column("control_limiter[1]");
    auto names = numbered_names(header_of(logs, "control_limiter_bits"));
    for (int b = 0; b < 31; ++b) {
      auto on = intervals(t, [&](std::size_t i) { return !std::isnan(bits[i]) && (static_cast<std::uint32_t>(bits[i]) >> b & 1u) != 0; });
      if (on.empty()) continue;
      const auto& name = names[1 << b];
      rows.push_back({"controller: " + (name.empty() ? fmt::format("bit {}", b) : name), std::move(on), 3});
    }
  }
  const auto names = numbered_names(header_of(logs, "esc_limiter_codes"));
  for (int esc = 1; esc <= 4; ++esc) {
    const auto column = fmt::format("esc_limiter_{}[1]", esc);
    const auto* log = logs.holder(column);
    if (!log) continue;
    const auto& codes = log->column(column);
    std::vector<double> seen;
    for (const double c : codes)
      if (c > 0 && std::find(seen.begin(), seen.end(), c) == seen.end()) seen.push_back(c);
    std::sort(seen.begin(), seen.end());
    for (const double code : seen) {
      const auto name = names.find(static_cast<int>(code));
      rows.push_back({fmt::format("ESC {}: {}", esc, name == names.end() ? fmt::format("limiter {}", code) : name->second),
                      intervals(t, [&](std::size_t i) { return codes[i] == code; }), esc - 1});
    }
  }
  return rows;
}

ReportTrace trace_of(const FlightLogs& logs, const FlightResult& r, int colour) {
  ReportTrace out;
  out.variant = variant_label(r.variant);
  out.colour = colour;
  out.seed = std::to_string(r.seed);
  out.t_s = logs.flight.column("t[s]");
  std::array<const std::vector<double>*, 3> truth{}, est{}, sp{};
  for (std::size_t a = 0; a < 3; ++a) {
    truth[a] = &logs.truth.column(fmt::format("true_p_{}[m]", kAxisNames[a]));
    est[a] = &logs.flight.column(fmt::format("est_p_{}[m]", kAxisNames[a]));
    sp[a] = &logs.flight.column(fmt::format("sp_p_{}[m]", kAxisNames[a]));
    out.position_m[a] = *truth[a];
  }
  const auto distance_cm = [](const auto& u, const auto& v, std::size_t i) {
    return 100 * std::hypot((*u[0])[i] - (*v[0])[i], (*u[1])[i] - (*v[1])[i], (*u[2])[i] - (*v[2])[i]);
  };
  for (std::size_t i = 0; i < out.t_s.size(); ++i) {
    out.error_cm.push_back(distance_cm(truth, sp, i));
    out.error_z_cm.push_back(100 * ((*truth[2])[i] - (*sp[2])[i]));
    out.estimator_error_cm.push_back(distance_cm(truth, est, i));
  }
  for (std::size_t rotor = 0; rotor < 4; ++rotor) {
    const auto rpm = [&](const char* name) {
      const auto column = fmt::format("{}{}[rad/s]", name, rotor + 1);
      const auto* log = logs.holder(column);
      std::vector<double> v = log ? log->column(column) : std::vector<double>{};
      for (double& x : v) x *= kRpm_per_rad_s;
      return v;
    };
    out.rpm[rotor] = rpm("true_omega_");
    out.rpm_command[rotor] = rpm("omega_cmd_");
  }
  out.limiters = limiter_rows(logs);
  return out;
}

// Load over time and the worst case by formula, from the recorded frames of one bus.
struct BusTraffic {
  std::vector<double> t_s, load_percent;
  std::vector<std::string> formula;
};

BusTraffic traffic_of(const fs::path& file) {
  struct Stream {
    std::uint64_t frames = 0, worst_bits = 0;
    int longest = 0;
  };
  BusTraffic out;
  const auto log = read_bus_log(file.string());
  if (log.frames.empty()) return out;
  std::map<std::pair<bool, std::uint32_t>, Stream> streams;
  std::vector<double> busy_bits;
  for (const auto& f : log.frames) {
    const auto classic = f.frame.classic();
    if (!classic) continue;  // CAN FD has two bit rates; no run records any
    auto& s = streams[{f.frame.extended, f.frame.id}];
    ++s.frames;
    s.worst_bits += worst_frame_bits(f.frame.extended, f.frame.length);
    s.longest = std::max<int>(s.longest, f.frame.length);
    const auto window = static_cast<std::size_t>(static_cast<double>(f.time_ns) * 1e-9 / kLoadWindow_s);
    if (window >= busy_bits.size()) busy_bits.resize(window + 1, 0.0);
    busy_bits[window] += frame_bits(*classic) + kIntermissionBits;
  }
  if (!busy_bits.empty()) busy_bits.pop_back();  // the last window is not complete
  for (std::size_t w = 0; w < busy_bits.size(); ++w) {
    out.t_s.push_back((static_cast<double>(w) + 0.5) * kLoadWindow_s);
    out.load_percent.push_back(100 * busy_bits[w] / (kBitRate_Hz * kLoadWindow_s));
  }
  const double elapsed_s = static_cast<double>(log.frames.back().time_ns - log.frames.front().time_ns) * 1e-9;
  if (!(elapsed_s > 0)) return out;
  double total = 0, small = 0;
  std::vector<std::pair<double, std::string>> lines;
  for (const auto& [key, s] : streams) {
    const double rate = static_cast<double>(s.frames) / elapsed_s, load = 100 * static_cast<double>(s.worst_bits) / elapsed_s / kBitRate_Hz;
    total += load;
    if (load < 0.5)
      small += load;
    else
      lines.emplace_back(load, fmt::format("  id {:>8}  {:7.1f} frames/s  up to {} bytes  {:6.2f} %",
                                           fmt::format("{:0{}X}", key.second, key.first ? 8 : 3), rate, s.longest, load));
  }
  std::stable_sort(lines.begin(), lines.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  for (auto& [load, text] : lines) out.formula.push_back(std::move(text));
  if (small > 0) out.formula.push_back(fmt::format("  all others                                      {:6.2f} %", small));
  out.formula.push_back(fmt::format("  sum of rate x longest frame / {:.0f} kbit/s        {:6.2f} %", kBitRate_Hz / 1000, total));
  return out;
}

ReportBus bus_of(BusName name, const FlightLogs& logs, const fs::path& file, const Scenario& s) {
  ReportBus bus;
  bus.name = name == BusName::esc ? "ESC bus" : "state bus";
  bus.limit_percent = kNotMeasured;
  for (const auto& l : s.limits.bus_load)
    if (!l.bus || *l.bus == name) bus.limit_percent = l.max_percent;
  std::error_code ec;
  if (fs::is_regular_file(file, ec)) {
    auto traffic = traffic_of(file);
    bus.t_s = std::move(traffic.t_s);
    bus.load_percent = std::move(traffic.load_percent);
    if (!traffic.formula.empty()) bus.formula.push_back(bus.name);
    bus.formula.insert(bus.formula.end(), traffic.formula.begin(), traffic.formula.end());
  }
  // What the simulated bus measured itself counts error frames too, which no log of frames holds.
  const auto column = name == BusName::esc ? "load_esc[%]" : "load_state[%]";
  if (const auto* log = logs.holder(column)) {
    const auto& t = log->column("t[s]");
    const auto& load = log->column(column);
    std::vector<double> ts, ls;
    for (std::size_t i = 0; i < t.size(); ++i)
      if (!std::isnan(load[i])) {
        ts.push_back(t[i]);
        ls.push_back(load[i]);
      }
    if (!ts.empty()) {
      bus.t_s = std::move(ts);
      bus.load_percent = std::move(ls);
    }
  }
  return bus;
}

std::string text_of(const Spread& s, const char* unit, int decimals) {
  if (s.n == 0) return "–";
  // A spread far below the digits shown is that of rounding.
  return s.n > 1 && s.std >= 0.5 * std::pow(10.0, -decimals) ? fmt::format("{} {}", render::measured_text(s.mean, s.std), unit)
                                                             : fmt::format("{:.{}f} {}", s.mean, decimals, unit);
}

template <class Get>
Spread over(const std::vector<FlightResult>& flights, const std::string& flight, Get get) {
  std::vector<double> v;
  for (const auto& f : flights)
    if (f.flight == flight) v.push_back(get(f));
  return spread_of(v);
}

ReportFlight flight_of(const fs::path& folder, const Scenario& s, const RunResult& r, const std::string& name) {
  ReportFlight out;
  out.name = name;
  out.axis = table_axis(s, name) == ErrorAxis::z ? "|z|" : "3-D";
  out.first_motion_s = out.last_motion_s = kNotMeasured;
  const auto fact = [&](const char* label, const char* unit, int decimals, auto get) {
    out.facts.emplace_back(label, text_of(over(r.flights, name, get), unit, decimals));
  };
  fact("duration", "s", 1, [](const auto& f) { return f.duration_s; });
  fact("peak speed", "m/s", 2, [](const auto& f) { return f.max_speed_m_s; });
  fact("peak set-point acceleration", "m/s²", 2, [](const auto& f) { return f.max_accel_m_s2; });
  fact("RPM error in flight, rms", "RPM", 0, [](const auto& f) {
    double sum = 0;
    for (const double e : f.rpm_error_rms_rad_s) sum += e * e;
    return kRpm_per_rad_s * std::sqrt(sum / 4);
  });
  fact("time with a limiter acting", "%", 1, [](const auto& f) { return 100 * f.limited_share; });
  fact("attitude error, mean", "deg", 2, [](const auto& f) { return f.attitude_error_mean_deg; });
  fact("motor command, mean", "RPM", 0, [](const auto& f) { return kRpm_per_rad_s * f.command_mean_rad_s; });
  fact("mean load, ESC bus", "%", 1, [](const auto& f) { return f.bus_load_mean_percent[0]; });
  fact("peak load, ESC bus (10 ms window)", "%", 1, [](const auto& f) { return f.bus_load_max_percent[0]; });
  fact("mean load, state bus", "%", 1, [](const auto& f) { return f.bus_load_mean_percent[1]; });

  const auto flown = variants_of(r.flights);
  for (const Variant& v : flown) {
    const auto it = std::find_if(r.flights.begin(), r.flights.end(), [&](const auto& f) { return f.flight == name && f.variant == v; });
    if (it == r.flights.end()) continue;
    const fs::path at = folder / name / variant_name(v) / std::to_string(it->seed);
    std::error_code ec;
    if (!fs::is_regular_file(at / "flight.csv", ec) || !fs::is_regular_file(at / "truth.csv", ec)) continue;
    const auto logs = read_logs(at);
    out.traces.push_back(trace_of(logs, *it, colour_of(v, flown)));
    out.setpoint_t_s = out.traces.back().t_s;
    for (std::size_t a = 0; a < 3; ++a) out.setpoint_m[a] = logs.flight.column(fmt::format("sp_p_{}[m]", kAxisNames[a]));
    out.first_motion_s = it->tracking.first_motion_s;
    out.last_motion_s = it->tracking.last_motion_s;
    out.buses = {bus_of(BusName::esc, logs, at / "esc.log", s), bus_of(BusName::state, logs, at / "state.log", s)};
  }
  std::erase_if(out.buses, [](const auto& b) { return b.t_s.empty(); });
  return out;
}

std::vector<ReportTableRow> table_of(const Scenario& s, const Assessment& a, const std::vector<FlightResult>& flights) {
  std::vector<ReportTableRow> rows;
  std::string previous;
  Variant first = Variant::pd_ff;
  for (const auto& c : a.table) {
    const auto axis = table_axis(s, c.flight);
    const bool z = axis == ErrorAxis::z;
    const auto& e = z ? c.error_z_cm : c.error_3d_cm;
    ReportTableRow row;
    row.flight = c.flight;
    row.axis = z ? "|z|" : "3-D";
    row.variant = variant_label(c.variant);
    row.colour = colour_of(c.variant, variants_of(flights));
    row.mean = e.mean;
    row.std = e.std;
    row.min = e.min;
    row.max = e.max;
    row.flown = c.flown;
    row.completed = c.completed;
    row.reduction_percent = row.reduction_std_percent = kNotMeasured;
    if (c.flight != previous) {
      first = c.variant;
      previous = c.flight;
    } else {
      const auto less = reduction(flights, c.flight, first, c.variant, axis);
      row.reduction_percent = less.percent;
      row.reduction_std_percent = less.std_percent;
    }
    row.from_estimate = (z ? c.estimate_error_z_cm : c.estimate_error_3d_cm).mean;
    row.estimator_error = c.estimator_error_cm.mean;
    row.other_axis = z ? "3-D" : "|z|";
    row.other = (z ? c.error_3d_cm : c.error_z_cm).mean;
    row.published = row.limit = kNotMeasured;
    for (const auto& p : s.published)
      if (p.flight == c.flight && p.variant == c.variant && p.axis == axis) {
        row.published = p.error_cm;
        row.published_source = p.source;
      }
    for (const auto& l : s.limits.error)
      if (l.flight == c.flight && l.variant == c.variant && l.axis == axis) row.limit = l.max_cm;
    for (const auto& f : flights)
      if (f.flight == c.flight && f.variant == c.variant && f.end == FlightEnd::completed)
        row.seeds.push_back(z ? f.tracking.truth.mean_z_cm : f.tracking.truth.mean_3d_cm);
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace

std::map<int, std::string> numbered_names(std::string_view value) {
  std::map<int, std::string> out;
  while (!value.empty()) {
    const auto comma = value.find(',');
    auto part = value.substr(0, comma);
    value.remove_prefix(comma == std::string_view::npos ? value.size() : comma + 1);
    while (part.starts_with(' ')) part.remove_prefix(1);
    int number = 0;
    const auto [end, ec] = std::from_chars(part.data(), part.data() + part.size(), number);
    const auto used = static_cast<std::size_t>(end - part.data());
    if (ec == std::errc{} && used + 1 < part.size() && part[used] == ' ') out[number] = std::string(part.substr(used + 1));
  }
  return out;
}

HilReport read_hil_report(const fs::path& folder) {
  const RunResult r = read_result(folder);
  const auto run = TomlFile::read(folder / "run.toml");
  const Scenario s = read_scenario(folder / run.root().text("scenario_file"));
  const Assessment a = assess(s, r.flights, r.flights.size());

  HilReport out;
  out.title = r.scenario;
  out.outcome = outcome_of(r, folder);
  out.facts = {{"flights", std::to_string(r.flights.size())},
               {"seeds", std::to_string(r.seeds.size())},
               {"rotorloop", r.version + " (" + r.git + ")"}};
  if (!r.escs.empty()) out.facts.emplace_back("ESCs", r.escs);
  if (!r.started_utc.empty()) out.facts.emplace_back("started", r.started_utc);
  double virtual_s = 0;
  for (const auto& f : r.flights) virtual_s += f.duration_s;
  if (r.wall_s > 0)
    out.facts.emplace_back("flown", fmt::format("{:.0f} s in {:.1f} s ({:.1f} × real time)", virtual_s, r.wall_s, virtual_s / r.wall_s));
  if (!r.real_time.empty()) out.facts.emplace_back("granted", fmt::format("{}", fmt::join(r.real_time, ", ")));
  for (const auto& f : r.flights)
    if (f.pace) out.facts.emplace_back(fmt::format("real time, {}/{}/{}", f.flight, variant_name(f.variant), f.seed), pace_text(*f.pace));
  for (const auto& w : r.warnings) out.warnings.push_back(w.where.empty() ? w.what : w.where + ": " + w.what);
  out.table = table_of(s, a, r.flights);
  for (const auto& l : r.limits) out.limits.push_back({l.name, l.unit, l.value, l.limit, l.upper, l.pass});
  for (const auto& f : s.flights)
    if (std::any_of(r.flights.begin(), r.flights.end(), [&](const auto& x) { return x.flight == f.name; }))
      out.flights.push_back(flight_of(folder, s, r, f.name));
  for (const auto& i : r.inputs) out.inputs.emplace_back(i.path, i.sha256);
  out.provenance = {{"version", r.version},
                    {"commit", r.git},
                    {"log_sha256", r.log_sha256.substr(0, 16) + "…"},
                    {"logs", std::to_string(r.log_hashes.size())}};
  out.repeat_command = run.root().text("repeat", "");
  return out;
}

fs::path write_hil_report(const fs::path& folder) {
  const auto path = folder / "report.html";
  write_text_file(path, hil_report_html(read_hil_report(folder)));
  return path;
}

}  // namespace rotorloop::hil
