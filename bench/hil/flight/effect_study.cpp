#include "bench/hil/flight/effect_study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/base/error.hpp"
#include "host/base/parallel.hpp"
#include "host/vehicle/effect_catalogue.hpp"

namespace rotorloop::hil {
namespace {

// What is compared at one instant.
struct Sample {
  std::int64_t time_us = 0;
  PlantTruth truth;
};

struct Flown {
  FlightResult result;
  std::vector<Sample> samples;
};

Flown fly_sampled(const Scenario& scenario, const Inputs& inputs, std::size_t flight, std::uint64_t seed, const StudyOptions& options,
                  Progress& progress) {
  Flown out;
  FlightRequest q{.flight = flight, .variant = scenario.variants.front(), .seed = seed, .folder = {}};
  q.observe = [&](const host::FlightRecord& r, const PlantTruth& truth) {
    if (r.phase == host::FlightPhase::flying) out.samples.push_back({r.time_us, truth});
  };
  out.result = fly(
                   scenario, inputs, q, nullptr, [&](double s) { progress.advance(s); }, options.stop)
                   .result;
  return out;
}

struct StudySums {
  double square = 0.0, peak = 0.0;
  std::size_t n = 0;
  void add(double size) {
    square += size * size;
    peak = std::max(peak, std::fabs(size));
    ++n;
  }
  Change change() const { return {n ? std::sqrt(square / static_cast<double>(n)) : 0.0, peak}; }
};

struct AllSums {
  StudySums thrust, in_plane, torque, speed, force, moment;

  void add(const std::vector<Sample>& a, const std::vector<Sample>& b) {
    const std::size_t n = std::min(a.size(), b.size());
    for (std::size_t k = 0; k < n && a[k].time_us == b[k].time_us; ++k) {
      const PlantTruth &p = a[k].truth, &q = b[k].truth;
      for (std::size_t i = 0; i < 4; ++i) {
        thrust.add(p.thrust_N[i] - q.thrust_N[i]);
        in_plane.add((p.in_plane_R_N[i] - q.in_plane_R_N[i]).norm());
        torque.add(p.shaft_torque_N_m[i] - q.shaft_torque_N_m[i]);
        speed.add(p.omega_rad_s[i] - q.omega_rad_s[i]);
      }
      force.add((p.further.force_B_N - q.further.force_B_N).norm());
      moment.add((p.further.moment_B_N_m - q.further.moment_B_N_m).norm());
    }
  }
};

std::string end_of(const FlightResult& r) {
  if (r.end == FlightEnd::completed) return {};
  return fmt::format("{} at {:.1f} s: {}", flight_end_name(r.end), r.duration_s, r.end_detail);
}

std::size_t find_entry(const sim::PlantFile& plant, std::string_view id) {
  const auto it = std::find_if(plant.effects.begin(), plant.effects.end(), [&](const auto& e) { return e.id == id; });
  return static_cast<std::size_t>(it - plant.effects.begin());
}

}  // namespace

bool is_intrinsic(const sim::EffectInfo& info, double typical_value) { return info.parameter.neutral != 0.0 && typical_value == 0.0; }

double typical_value(const sim::EffectInfo& info) { return host::effect(info.id).parameter.typical_value; }

bool has_effect(const sim::PlantFile& plant, const sim::EffectInfo& info, double typical_value) {
  return find_entry(plant, info.id) < plant.effects.size() || is_intrinsic(info, typical_value);
}

sim::PlantFile switched(const sim::PlantFile& plant, const sim::EffectInfo& info, double value) {
  sim::PlantFile out = plant;
  if (const std::size_t at = find_entry(plant, info.id); at < plant.effects.size())
    out.effects.erase(out.effects.begin() + static_cast<std::ptrdiff_t>(at));
  else
    out.effects.push_back({std::string(info.id), sim::effect_values(info, value)});
  return out;
}

std::vector<const sim::EffectInfo*> chosen_effects(const std::vector<std::string>& ids) {
  const auto all = sim::builtin_effects();
  if (ids.empty()) return {all.begin(), all.end()};
  std::vector<const sim::EffectInfo*> out;
  for (const std::string& id : ids) {
    const sim::EffectInfo* info = sim::find_effect(id);
    if (!info) throw Error({"--effect", fmt::format("\"{}\" is not an effect of the plant", id), "", sim::use_known_effect(id)});
    if (std::find(out.begin(), out.end(), info) != out.end())
      throw Error({"--effect", fmt::format("\"{}\" is given twice", id), "", "give each effect once"});
    out.push_back(info);
  }
  return out;
}

std::size_t flight_for(const Scenario& scenario, std::string_view effect) {
  std::size_t found = 0;
  for (std::size_t f = 0; f < scenario.flights.size(); ++f)
    for (const std::string& id : scenario.flights[f].effects) {
      if (!sim::find_effect(id))
        throw Error({scenario.path.generic_string(),
                     fmt::format("flight \"{}\" names \"{}\", which is not an effect of the plant", scenario.flights[f].name, id), "",
                     sim::use_known_effect(id)});
      if (id == effect) found = f;
    }
  return found;
}

namespace {

// A flight with the effect switched over from what the plant has, seed by seed against the flight without the change.
EffectComparison compare_effect(const Scenario& scenario, const Inputs& inputs, const sim::EffectInfo& info, std::size_t flight,
                                const std::vector<Flown>& reference, const StudyOptions& options, Progress& progress) {
  EffectComparison c;
  c.effect = info.id;
  c.parameter = info.parameter.key;
  c.unit = info.parameter.unit;
  c.flight = scenario.flights[flight].name;
  const double typical = typical_value(info);
  c.in_reference = has_effect(inputs.plant, info, typical);
  c.value = typical;
  if (is_intrinsic(info, typical)) c.value = info.parameter.neutral;
  if (const auto at = find_entry(inputs.plant, info.id);
      at < inputs.plant.effects.size() && info.parameter.origin == sim::ParameterOrigin::effect_entry)
    c.value = inputs.plant.effects[at].values[0];

  Inputs changed = inputs;
  changed.plant = switched(inputs.plant, info, typical);
  AllSums sums;
  std::vector<double> errors_reference, errors_changed;
  std::string end_reference, end_changed;
  for (std::size_t s = 0; s < reference.size() && !(options.stop && options.stop->load()); ++s) {
    const Flown& r = reference[s];
    const Flown flown = fly_sampled(scenario, changed, flight, scenario.seeds[s], options, progress);
    sums.add(flown.samples, r.samples);
    if (r.result.end == FlightEnd::completed && flown.result.end == FlightEnd::completed) {
      errors_reference.push_back(r.result.tracking.truth.mean_3d_cm);
      errors_changed.push_back(flown.result.tracking.truth.mean_3d_cm);
    }
    if (end_reference.empty()) end_reference = end_of(r.result);
    if (end_changed.empty()) end_changed = end_of(flown.result);
    FlightResult shown = flown.result;
    shown.flight += (c.in_reference ? " without " : " with ") + c.effect;
    progress.finished(shown);
  }
  c.error_with_cm = spread_of(c.in_reference ? errors_reference : errors_changed);
  c.error_without_cm = spread_of(c.in_reference ? errors_changed : errors_reference);
  c.end_with = c.in_reference ? end_reference : end_changed;
  c.end_without = c.in_reference ? end_changed : end_reference;
  c.thrust_N = sums.thrust.change();
  c.in_plane_N = sums.in_plane.change();
  c.shaft_torque_N_m = sums.torque.change();
  c.speed_rad_s = sums.speed.change();
  c.body_force_N = sums.force.change();
  c.body_moment_N_m = sums.moment.change();
  return c;
}

}  // namespace

std::vector<EffectComparison> compare_effects(const Scenario& scenario, const Inputs& inputs,
                                              const std::vector<const sim::EffectInfo*>& effects, const StudyOptions& options,
                                              Progress& progress) {
  const std::size_t seeds = scenario.seeds.size();
  std::vector<std::size_t> flight_of;
  std::vector<bool> used(scenario.flights.size(), false);
  for (const auto* info : effects) {
    flight_of.push_back(flight_for(scenario, info->id));
    used[flight_of.back()] = true;
  }
  std::vector<std::size_t> flights;
  for (std::size_t f = 0; f < used.size(); ++f)
    if (used[f]) flights.push_back(f);

  double total_s = 0.0;
  for (const std::size_t f : flights) total_s += flight_duration_s(scenario, inputs, {.flight = f, .folder = {}});
  for (const std::size_t f : flight_of) total_s += flight_duration_s(scenario, inputs, {.flight = f, .folder = {}});
  progress.begin((flights.size() + effects.size()) * seeds, total_s * static_cast<double>(seeds));

  std::vector<std::vector<Flown>> reference(scenario.flights.size(), std::vector<Flown>(seeds));
  parallel_for(flights.size() * seeds, options.jobs, [&](std::size_t i) {
    const std::size_t f = flights[i / seeds], s = i % seeds;
    reference[f][s] = fly_sampled(scenario, inputs, f, scenario.seeds[s], options, progress);
    progress.finished(reference[f][s].result);
  });

  std::vector<EffectComparison> out(effects.size());
  parallel_for(effects.size(), options.jobs, [&](std::size_t e) {
    out[e] = compare_effect(scenario, inputs, *effects[e], flight_of[e], reference[flight_of[e]], options, progress);
  });
  progress.end();
  if (options.stop && options.stop->load())  // what was not flown any more says nothing
    std::erase_if(out, [](const EffectComparison& c) { return c.error_with_cm.n == 0 && c.error_without_cm.n == 0; });
  return out;
}

}  // namespace rotorloop::hil
