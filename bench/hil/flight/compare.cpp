#include "bench/hil/flight/compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "host/base/error.hpp"
#include "host/base/sha256.hpp"
#include "host/base/statistics.hpp"

namespace rotorloop::hil {
namespace fs = std::filesystem;
namespace {

struct Metric {
  const char* name;
  const char* unit;
  double (*get)(const FlightResult&);
};
constexpr std::array kMetrics{
    Metric{"mean_error_3d", "cm", [](const FlightResult& f) { return f.tracking.truth.mean_3d_cm; }},
    Metric{"mean_error_z", "cm", [](const FlightResult& f) { return f.tracking.truth.mean_z_cm; }},
    Metric{"max_error_3d", "cm", [](const FlightResult& f) { return f.tracking.truth.max_3d_cm; }},
    Metric{"estimator_error_3d", "cm", [](const FlightResult& f) { return f.tracking.estimator_mean_3d_cm; }},
    Metric{"bus_load_esc_max", "%", [](const FlightResult& f) { return f.bus_load_max_percent[0]; }},
    Metric{"bus_load_state_max", "%", [](const FlightResult& f) { return f.bus_load_max_percent[1]; }},
    Metric{"limited_share", "1", [](const FlightResult& f) { return f.limited_share; }},
};

using Key = std::pair<std::string, Variant>;

std::vector<Key> keys_of(const RunResult& a, const RunResult& b) {
  std::vector<Key> keys;
  for (const auto* r : {&a, &b})
    for (const auto& f : r->flights)
      if (const Key k{f.flight, f.variant}; std::find(keys.begin(), keys.end(), k) == keys.end()) keys.push_back(k);
  return keys;
}

std::vector<const FlightResult*> flights_of(const RunResult& r, const Key& k) {
  std::vector<const FlightResult*> out;
  for (const auto& f : r.flights)
    if (f.flight == k.first && f.variant == k.second) out.push_back(&f);
  return out;
}

ComparedFigure compare_metric(const Metric& m, const Key& k, const std::vector<const FlightResult*>& fa,
                              const std::vector<const FlightResult*>& fb) {
  ComparedFigure c;
  c.flight = k.first;
  c.variant = k.second;
  c.name = m.name;
  c.unit = m.unit;
  std::vector<double> va, vb, differences;
  for (const auto* f : fa) va.push_back(m.get(*f));
  for (const auto* f : fb) vb.push_back(m.get(*f));
  c.a = spread_of(va);
  c.b = spread_of(vb);
  for (const auto* x : fa)
    for (const auto* y : fb)
      if (x->seed == y->seed && !std::isnan(m.get(*x)) && !std::isnan(m.get(*y))) differences.push_back(m.get(*y) - m.get(*x));
  if (!differences.empty()) {
    const auto d = spread_of(differences);
    c.pairs = d.n;
    c.difference = d.mean;
    c.uncertainty = d.n > 1 ? student_quantile(0.99, d.n - 1) * d.std / std::sqrt(d.n) : 0.0;
  } else if (c.a.n > 0 && c.b.n > 0) {
    c.difference = c.b.mean - c.a.mean;
    const double qa = c.a.std * c.a.std / c.a.n, qb = c.b.std * c.b.std / c.b.n;
    c.uncertainty = 0.0;
    if (c.a.n > 1 && c.b.n > 1 && qa + qb > 0)
      c.uncertainty = student_quantile(0.99, (qa + qb) * (qa + qb) / (qa * qa / (c.a.n - 1) + qb * qb / (c.b.n - 1))) * std::sqrt(qa + qb);
  }
  c.significant = std::fabs(c.difference) > c.uncertainty;
  return c;
}

void verify_logs(const fs::path& folder, const RunResult& r) {
  for (const auto& [path, sha] : r.log_hashes) {
    if (sha256_file(folder / path) != sha)
      throw Error({(folder / path).generic_string(), "does not fit its result.json: its SHA-256 differs",
                   "the log was edited or damaged after the run", "fly the run again"},
                  ExitCode::data_quality);
  }
  if (hash_of_logs(r.log_hashes) != r.log_sha256)
    throw Error(
        {(folder / "result.json").generic_string(), "log_sha256 does not fit the list of logs", "the file was edited", "fly the run again"},
        ExitCode::data_quality);
}

void compare_ends(Comparison& c, const Key& k, const std::vector<const FlightResult*>& fa, const std::vector<const FlightResult*>& fb) {
  const auto name = fmt::format("{} {}", k.first, variant_name(k.second));
  if (fa.empty() || fb.empty()) {
    c.reasons.push_back(fmt::format("{} was flown in {} alone", name, fa.empty() ? c.name_b : c.name_a));
    return;
  }
  for (const auto* x : fa)
    for (const auto* y : fb)
      if (x->seed == y->seed && x->end != y->end)
        c.reasons.push_back(fmt::format("{} seed {} {} in {}, but {} in {}", name, x->seed, flight_end_name(x->end), c.name_a,
                                        flight_end_name(y->end), c.name_b));
}

std::string num(double v) { return std::isnan(v) ? "-" : fmt::format("{:.4g}", v); }

void name_runs(const fs::path& folder_a, const fs::path& folder_b, Comparison& c) {
  const auto name = [](const fs::path& p) { return p.filename().empty() ? p.parent_path().filename().string() : p.filename().string(); };
  c.name_a = name(folder_a);
  c.name_b = name(folder_b);
  if (c.name_a == c.name_b) {
    c.name_a = "A (" + c.name_a + ")";
    c.name_b = "B (" + c.name_b + ")";
  }
}

}  // namespace

Comparison compare_runs(const fs::path& folder_a, const fs::path& folder_b, bool verify) {
  Comparison c;
  c.a = read_result(folder_a);
  c.b = read_result(folder_b);
  name_runs(folder_a, folder_b, c);
  c.logs_compared = !c.a.log_hashes.empty() && !c.b.log_hashes.empty();
  if (verify && !c.logs_compared)
    throw Error({"--verify", fmt::format("{} has no logs: nothing can be verified", c.a.log_hashes.empty() ? c.name_a : c.name_b),
                 "the run was flown with --no-logs, or stopped before its first flight",
                 "fly it with logs, or compare figures alone, without --verify"},
                ExitCode::data_quality);
  if (verify) {
    verify_logs(folder_a, c.a);
    verify_logs(folder_b, c.b);
  }

  for (const auto& [path, sha] : c.a.log_hashes) {
    const auto other = c.b.log_hashes.find(path);
    if (other == c.b.log_hashes.end())
      c.only_in_a.push_back(path);
    else if (other->second != sha)
      c.differing_logs.push_back(path);
  }
  for (const auto& [path, sha] : c.b.log_hashes)
    if (!c.a.log_hashes.contains(path)) c.only_in_b.push_back(path);
  c.logs_identical =
      !c.a.log_hashes.empty() && c.differing_logs.empty() && c.only_in_a.empty() && c.only_in_b.empty() && c.a.log_sha256 == c.b.log_sha256;

  std::map<std::string, std::array<std::string, 2>> inputs;
  for (const auto& i : c.a.inputs) inputs[i.path][0] = i.sha256;
  for (const auto& i : c.b.inputs) inputs[i.path][1] = i.sha256;
  for (const auto& [path, sha] : inputs)
    if (sha[0] != sha[1]) c.differing_inputs.push_back(path);

  for (const auto& k : keys_of(c.a, c.b)) {
    const auto fa = flights_of(c.a, k), fb = flights_of(c.b, k);
    compare_ends(c, k, fa, fb);
    if (fa.empty() || fb.empty()) continue;
    for (const auto& m : kMetrics) {
      auto figure = compare_metric(m, k, fa, fb);
      if (figure.a.n == 0 && figure.b.n == 0) continue;
      if (figure.significant)
        c.reasons.push_back(fmt::format("{} {} {}: {} {} in {}, {} {} in {}", k.first, variant_name(k.second), m.name, num(figure.a.mean),
                                        m.unit, c.name_a, num(figure.b.mean), m.unit, c.name_b));
      c.figures.push_back(std::move(figure));
    }
  }
  if (!c.logs_compared && c.figures.empty())
    throw Error({fmt::format("{} and {}", folder_a.generic_string(), folder_b.generic_string()),
                 "nothing can be compared: no flight was flown in both, and there are no logs",
                 "the runs are of different scenarios, or one was stopped before its first flight", "compare runs that share flights"},
                ExitCode::data_quality);
  c.differs = !c.reasons.empty();
  return c;
}

std::string comparison_text(const Comparison& c) {
  std::string out = fmt::format("A = {}: {}, {} flights, {} {}\n", c.name_a, c.a.scenario, c.a.flights.size(), c.a.version, c.a.git);
  out += fmt::format("B = {}: {}, {} flights, {} {}\n", c.name_b, c.b.scenario, c.b.flights.size(), c.b.version, c.b.git);
  out += fmt::format("verdict: A {}, B {}\n", verdict_name(c.a.verdict), verdict_name(c.b.verdict));
  if (c.logs_identical)
    out += fmt::format("logs: identical, all {} files to the bit (log_sha256 {})\n", c.a.log_hashes.size(), c.a.log_sha256.substr(0, 12));
  else if (!c.logs_compared)
    out += fmt::format("logs: not compared, {} has none; figures alone are compared\n", !c.a.log_hashes.empty()   ? c.name_b
                                                                                        : !c.b.log_hashes.empty() ? c.name_a
                                                                                                                  : "each run");
  else
    out += fmt::format("logs: {} differ, {} only in A, {} only in B\n", c.differing_logs.size(), c.only_in_a.size(), c.only_in_b.size());
  out += c.differing_inputs.empty() ? "inputs: identical\n" : fmt::format("inputs that differ: {}\n", fmt::join(c.differing_inputs, ", "));

  std::string previous;
  for (const auto& f : c.figures) {
    const auto at = fmt::format("{} / {}", f.flight, variant_label(f.variant));
    if (at != previous) out += fmt::format("\n{:<34}{:>23} {:>23} {:>22}\n", at, "A: mean (std)", "B: mean (std)", "B - A (99 %)");
    previous = at;
    const auto spread = [](const Spread& s) { return s.n > 1 ? fmt::format("{} ({})", num(s.mean), num(s.std)) : num(s.mean); };
    const auto difference =
        f.pairs > 1 || f.uncertainty > 0 ? fmt::format("{} +- {}", num(f.difference), num(f.uncertainty)) : num(f.difference);
    out += fmt::format("  {:<32}{:>23} {:>23} {:>22}{}\n", f.unit == "1" ? f.name : f.name + ", " + f.unit, spread(f.a), spread(f.b),
                       difference, f.significant ? "  *" : "");
  }
  if (!c.figures.empty())
    out += "\nDifferences are paired by seed where both runs flew it; * exceeds its 99 % interval (with one pair: any difference).\n";
  if (!c.differs) out += "No significant difference.\n";
  for (const auto& r : c.reasons) out += "differs: " + r + "\n";
  return out;
}

std::string comparison_json_text(const Comparison& c) {
  nlohmann::ordered_json j{{"format", 1},
                           {"command", "hil compare"},
                           {"a", c.name_a},
                           {"b", c.name_b},
                           {"verdict_a", verdict_name(c.a.verdict)},
                           {"verdict_b", verdict_name(c.b.verdict)}};
  j["logs_compared"] = c.logs_compared;
  j["logs_identical"] = c.logs_identical;
  j["differing_logs"] = c.differing_logs;
  j["only_in_a"] = c.only_in_a;
  j["only_in_b"] = c.only_in_b;
  j["differing_inputs"] = c.differing_inputs;
  j["figures"] = nlohmann::ordered_json::array();
  const auto spread = [](const Spread& s) {
    return nlohmann::ordered_json{{"mean", s.mean}, {"std", s.std}, {"min", s.min}, {"max", s.max}, {"n", s.n}};
  };
  for (const auto& f : c.figures)
    j["figures"].push_back({{"flight", f.flight},
                            {"variant", variant_name(f.variant)},
                            {"name", f.name},
                            {"unit", f.unit},
                            {"a", spread(f.a)},
                            {"b", spread(f.b)},
                            {"difference", f.difference},
                            {"uncertainty_99", f.uncertainty},
                            {"pairs", f.pairs},
                            {"significant", f.significant}});
  j["differs"] = c.differs;
  j["reasons"] = c.reasons;
  return j.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace rotorloop::hil
