#include "bench/hil/flight/effect_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace rotorloop::hil {
namespace {

// Three significant digits, no exponent for what a person reads.
std::string digits(double v) {
  if (v == 0.0) return "0";
  const double a = std::fabs(v);
  return fmt::format("{:.{}f}", v, a >= 100 ? 0 : a >= 10 ? 1 : a >= 1 ? 2 : a >= 0.1 ? 3 : 4);
}
// A size below `least` is nothing that a reader should look at.
std::string change(const Change& c, double scale, double least) {
  return c.peak * scale < least ? "-" : digits(c.rms * scale) + " / " + digits(c.peak * scale);
}
std::string value(double v, const std::string& unit) { return fmt::format("{:g}{}", v, unit == "1" ? "" : " " + unit); }

std::string error(const Spread& s, const std::string& end) {
  if (!end.empty()) return s.n > 0 ? fmt::format("{:.2f}; {}", s.mean, end) : end;
  return s.n > 0 ? fmt::format("{:.2f}", s.mean) : "-";
}

std::string reference(const ProbeResult& p) {
  return p.low == p.high ? fmt::format("{:g}", p.low) : fmt::format("{:g} … {:g}", p.low, p.high);
}

std::string probe_table(const std::vector<ProbeResult>& probes) {
  std::string out =
      "| effect | size | source | what is compared | unit | reference | measured | ratio | |\n|---|---|---|---|---|---:|---:|---:|---|\n";
  for (const ProbeResult& p : probes)
    out += fmt::format("| `{}` | {:g} | {} | {} | {} | {} | {} | {:.2f} | {} |\n", p.effect, p.value, p.source, p.where, p.unit,
                       reference(p), digits(p.measured), p.ratio,
                       p.within              ? ""
                       : p.deviation.empty() ? "**outside**"
                                             : "outside: " + p.deviation);
  return out;
}

std::string flight_table(const std::vector<EffectComparison>& flights) {
  std::string out =
      "| effect | size | flight | error without, cm | error with, cm | thrust, N | in-plane force, N | shaft torque, mN m | speed, rad/s | "
      "force on "
      "body, N | moment on body, mN m |\n|---|---|---|---:|---:|---:|---:|---:|---:|---:|---:|\n";
  for (const EffectComparison& c : flights)
    out += fmt::format("| `{}`{} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |\n", c.effect, c.in_reference ? " *" : "",
                       value(c.value, c.unit), c.flight, error(c.error_without_cm, c.end_without), error(c.error_with_cm, c.end_with),
                       change(c.thrust_N, 1.0, 5e-4), change(c.in_plane_N, 1.0, 5e-4), change(c.shaft_torque_N_m, 1e3, 5e-3),
                       change(c.speed_rad_s, 1.0, 0.05), change(c.body_force_N, 1.0, 5e-4), change(c.body_moment_N_m, 1e3, 5e-3));
  return out;
}

nlohmann::ordered_json to_json(const Change& c) { return {{"rms", c.rms}, {"peak", c.peak}}; }
nlohmann::ordered_json to_json(const Spread& s) { return {{"mean", s.mean}, {"std", s.std}, {"n", s.n}}; }

}  // namespace

std::string effect_page(const EffectStudy& s) {
  std::string seeds;
  for (const auto seed : s.scenario.seeds) seeds += (seeds.empty() ? "" : ", ") + std::to_string(seed);
  std::string out = fmt::format(
      "# What each effect does\n\n"
      "Made by `{}`; do not edit. Law, signature in flight and confounders of each effect: "
      "[effects/catalogue.toml](../effects/catalogue.toml).\n\n",
      s.command_line);
  if (!s.interrupted.empty())
    out += fmt::format("**Incomplete: interrupted by {}.** What stands here was flown before; fly all of it again.\n\n", s.interrupted);
  if (!s.probes.empty())
    out += fmt::format(
        "## Sizes at defined points\n\n"
        "The plant `{}` in a virtual wind tunnel, level, with the effect and without it: the difference of the loads, against the size "
        "that a measurement or theory gives for this vehicle. `size` is the effect's parameter; for an effect that the solve of the rotor "
        "or the body "
        "contains, the difference is between its full action and none. Forces and moments in the frame of the body (x forward, y left, z "
        "up). "
        "Without another speed in the text, the rotors turn at the speed that carries the weight there. `ratio`: measured over the nearest "
        "end of the "
        "reference. A ratio below 1/{:g} or above {:g} is outside and ends the command with 6, unless its reason is known and given. "
        "Sources: E numbers are those of `survey`, L "
        "numbers "
        "those of `library` in the catalogue.\n\n{}\n",
        s.scenario.plant.filename().generic_string(), kProbeFactor, kProbeFactor, probe_table(s.probes));
  if (!s.flights.empty())
    out += fmt::format(
        "## In flight\n\n"
        "The flights of `{}`, controller `{}`, seed {}; each effect in the flight that shows it best. `error`: mean distance between the "
        "true position "
        "and the set-point, over the seeds whose two flights were both completed. Controller and vehicle file are the same in both columns "
        "and know nothing of the effect, but were fitted to "
        "the plant as its file says; taking away what the fit contains may therefore cost as much as adding what it lacks. `*`: the plant "
        "of the file has the effect, and the other flight is the one without it.\n\n"
        "The other columns: difference of the two flights at the same instants with the same noise, rms / peak, over all four rotors; "
        "\"on body\" is what effects add there directly. They contain the answer of the controller, which holds the sum of thrusts near "
        "the weight whatever the effect: a loss of thrust shows as speed. The plant reacts to rotor acceleration, and the noise of the "
        "motors falls "
        "out differently after the smallest change: a moment on the body of about 3 / 30 mN m, a thrust of 0.001 / 0.01 N and a speed of "
        "0.3 / 3 rad/s are this floor and no effect. `-`: nothing, or no flight to compare. A flight that does not end says why; the "
        "figures beside "
        "it are those until then.\n\n{}",
        s.scenario.path.filename().generic_string(), variant_name(s.scenario.variants.front()), seeds, flight_table(s.flights));
  return out;
}

std::string effect_json_text(const EffectStudy& s) {
  nlohmann::ordered_json j{{"format", 1}, {"command", s.command_line}, {"seeds", s.scenario.seeds}};
  const auto outside = std::count_if(s.probes.begin(), s.probes.end(), [](const ProbeResult& p) { return p.missed(); });
  j["verdict"] = !s.interrupted.empty() ? "incomplete" : outside > 0 ? "fail" : "pass";
  j["errors"] = nlohmann::ordered_json::array();
  if (!s.interrupted.empty()) j["errors"].push_back("interrupted by " + s.interrupted);
  if (outside > 0)
    j["errors"].push_back(
        fmt::format("{} of {} sizes are outside a factor {:g} of their reference", outside, s.probes.size(), kProbeFactor));
  j["probes"] = nlohmann::ordered_json::array();
  for (const ProbeResult& p : s.probes)
    j["probes"].push_back({{"effect", p.effect},
                           {"value", p.value},
                           {"source", p.source},
                           {"where", p.where},
                           {"unit", p.unit},
                           {"reference", {p.low, p.high}},
                           {"measured", p.measured},
                           {"ratio", p.ratio},
                           {"within", p.within},
                           {"deviation", p.deviation}});
  j["flights"] = nlohmann::ordered_json::array();
  for (const EffectComparison& c : s.flights)
    j["flights"].push_back({{"effect", c.effect},
                            {"parameter", c.parameter},
                            {"unit", c.unit},
                            {"value", c.value},
                            {"in_reference", c.in_reference},
                            {"flight", c.flight},
                            {"error_without_cm", to_json(c.error_without_cm)},
                            {"error_with_cm", to_json(c.error_with_cm)},
                            {"end_without", c.end_without},
                            {"end_with", c.end_with},
                            {"thrust_N", to_json(c.thrust_N)},
                            {"in_plane_N", to_json(c.in_plane_N)},
                            {"shaft_torque_N_m", to_json(c.shaft_torque_N_m)},
                            {"speed_rad_s", to_json(c.speed_rad_s)},
                            {"body_force_N", to_json(c.body_force_N)},
                            {"body_moment_N_m", to_json(c.body_moment_N_m)}});
  return j.dump(2) + "\n";
}

}  // namespace rotorloop::hil
