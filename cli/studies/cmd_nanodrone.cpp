// `rotorloop-studies nanodrone`: the IDSIA nano-drone benchmark, fitted and scored, with its limits.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "bench/render/digits.hpp"
#include "bench/studies/nanodrone_benchmark.hpp"
#include "cli/rotor/measured_data.hpp"
#include "cli/studies/studies.hpp"
#include "host/base/error.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::cli {
namespace {

constexpr std::array<const char*, score::kPredictedQuantities> kQuantity{"position", "velocity", "attitude", "rates"};

struct NanodroneArguments {
  std::filesystem::path flights, vehicle = "vehicles/measured/idsia_nanodrone_cf21bl.toml",
                                 mapping = "vehicles/measured/idsia_nanodrone_cf21bl.mapping.toml";
  bool likelihood = false, json = false;
};

void print_scores(const studies::NanodroneResult& r) {
  fmt::print("{} starts; error after 10, 100, 500 ms, and the sum over 10 to 500 ms\n{:<31}", r.scores.front().score.starts, "");
  for (std::size_t q = 0; q < kQuantity.size(); ++q)
    fmt::print(" | {:<31}", fmt::format("{} [{}]", kQuantity[q], score::kPredictedUnits[q]));
  fmt::print("\n");
  for (const auto& s : r.scores) {
    fmt::print("{:<31}", s.model);
    for (std::size_t q = 0; q < kQuantity.size(); ++q)
      fmt::print(" | {:.4f} {:.4f} {:.4f} {:>8.3f}  ", s.score.mean[q][0], s.score.mean[q][9], s.score.mean[q].back(),
                 s.score.sim_error[q]);
    fmt::print("\n");
  }
}

void print_limits(const studies::NanodroneResult& r) {
  fmt::print("\n{:<9} {:>8} {:>8} {:>10} {:>9}   {}\n", "sum", "measured", "limit", "published", "baseline", "measured / baseline (95 %)");
  for (const auto& l : r.limits) {
    fmt::print("{:<9} {:>8.3f} {:>8.3f} {:>10.2f} {:>9.3f}   {:.3f} ({:.3f} to {:.3f})  {}\n", kQuantity[l.quantity], l.measured, l.limit,
               l.published_best, l.baseline, l.to_baseline.value, l.to_baseline.low, l.to_baseline.high, l.met ? "met" : "MISSED");
  }
  fmt::print("k_F {:.4e} N s², published {:.2e}: {:+.2f} %\n", r.k_F_N_s2, studies::kNanodronePublishedK_F_N_s2,
             100.0 * (r.k_F_N_s2 / studies::kNanodronePublishedK_F_N_s2 - 1.0));
  fmt::print("\nrotation: error over that with rates held (95 %)\n");
  for (const auto& h : r.horizons) {
    fmt::print("  {:>4.0f} ms  attitude {:.3f} ({:.3f} to {:.3f})  rates {:.3f} ({:.3f} to {:.3f})\n", 1e3 * h.horizon_s, h.attitude.value,
               h.attitude.low, h.attitude.high, h.rates.value, h.rates.low, h.rates.high);
  }
  const auto range = [](const char* what, const score::HelpfulRange& h) {
    if (h.to_s > 0.0) {
      fmt::print("{} from {:.2f} to {:.2f} s ahead\n", what, h.from_s, h.to_s);
    } else {
      fmt::print("{} at no horizon\n", what);
    }
  };
  fmt::print("looked for up to 2 s, the rotation model beats constant rates:\n");
  range("  in attitude", r.attitude_helps);
  range("  in rates", r.rates_help);
  if (r.likelihood) range("  in rates, with the maximum-likelihood parameters,", r.likelihood_rates_help);
}

void print_parameters(const studies::NanodroneResult& r) {
  fmt::print("\nfitted to predict (not the vehicle's):\n");
  for (const int p : r.predicting_free) {
    const auto info = estimate::parameter_info(p, r.predicting.terms);
    fmt::print("  {:<48} {:>11.4e} {}\n", info.name, r.predicting[p], info.unit);
  }
  if (!r.likelihood) return;
  fmt::print("\nmaximum likelihood (classical and block-robust standard error):\n");
  for (std::size_t i = 0; i < r.likelihood->estimates.size(); ++i) {
    const auto& e = r.likelihood->estimates[i];
    const render::MeasuredText t = render::measured(e.value, e.u);
    fmt::print("  {:<48} {:>11} ± {} ({:.1e})\n", r.likelihood_names[i], t.value, t.u, e.u_robust);
  }
}

nlohmann::json as_json(const studies::NanodroneResult& r) {
  nlohmann::json j{{"format", 1}, {"command", "nanodrone"}, {"verdict", r.met() ? "pass" : "fail"}, {"errors", nlohmann::json::array()}};
  for (const auto& l : r.limits)
    if (!l.met)
      j["errors"].push_back(fmt::format("limit missed: {}: {:.3f}, allowed at most {:.3f}", kQuantity[l.quantity], l.measured, l.limit));
  for (const auto& s : r.scores) {
    for (std::size_t q = 0; q < kQuantity.size(); ++q)
      j["scores"][s.model][kQuantity[q]] = {{"mean", s.score.mean[q]}, {"sim_error", s.score.sim_error[q]}};
  }
  for (const auto& l : r.limits) {
    j["limits"][kQuantity[l.quantity]] = {{"measured", l.measured},
                                          {"limit", l.limit},
                                          {"published_best", l.published_best},
                                          {"baseline", l.baseline},
                                          {"ratio", {l.to_baseline.low, l.to_baseline.value, l.to_baseline.high}},
                                          {"met", l.met}};
  }
  j["k_F_N_s2"] = r.k_F_N_s2;
  j["rates_help_s"] = {r.rates_help.from_s, r.rates_help.to_s};
  j["attitude_helps_s"] = {r.attitude_helps.from_s, r.attitude_helps.to_s};
  for (const int p : r.predicting_free) j["predicting"][estimate::parameter_info(p, r.predicting.terms).name] = r.predicting[p];
  return j;
}

int run(const NanodroneArguments& o) {
  studies::NanodroneInputs in;
  in.flights = o.flights.empty() ? measured_data_folder() / "flights" / "idsia_nanodrone_cf21bl" : o.flights;
  in.mapping = o.mapping;
  in.vehicle = host::to_model(host::read_vehicle(o.vehicle, host::builtin_effect_catalogue()));
  in.maximum_likelihood = o.likelihood;
  const auto result = studies::run_nanodrone(in, [](const std::string& line) { fmt::print(stderr, "{}\n", line); });
  if (o.json) {
    fmt::print("{}\n", as_json(result).dump(1));
  } else {
    print_scores(result);
    print_limits(result);
    print_parameters(result);
    fmt::print("\nverdict: {}\n", result.met() ? "pass" : "fail");
  }
  return to_int(result.met() ? ExitCode::ok : ExitCode::verdict);
}

}  // namespace

void add_nanodrone(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<NanodroneArguments>();
  CLI::App* c = app.add_subcommand("nanodrone", "IDSIA nano-drone benchmark: fit on its training flights, score on its test flight");
  c->add_option("--flights", o->flights, "folder of the logs; default: flights/idsia_nanodrone_cf21bl below ROTORLOOP_DATA");
  c->add_option("--vehicle", o->vehicle, "vehicle file: mass, arms, inertia, start values")->capture_default_str();
  c->add_option("--mapping", o->mapping, "mapping file of the logs")->capture_default_str();
  c->add_flag("--likelihood", o->likelihood, "also fit the physical parameters by maximum likelihood (a minute)");
  c->add_flag("--json", o->json, "one JSON document instead of tables");
  c->footer(
      "Example:\n"
      "  ROTORLOOP_DATA=~/data rotorloop-studies nanodrone --likelihood\n"
      "Ends with exit code 6 when a limit of docs/acceptance/identify_idsia.md is missed.");
  c->callback([o, &exit_code] { exit_code = run(*o); });
}

}  // namespace rotorloop::cli
