// What each physical effect of the plant does to a flight: the same scenario, controller and seeds with the effect and without
// it. One of the two flights is the plant as its file says (the reference); the other differs in this one effect.
#pragma once
#include <atomic>
#include <string>
#include <vector>

#include "bench/hil/flight/flight.hpp"
#include "bench/hil/flight/runner.hpp"
#include "sim/effects/effect_set.hpp"

namespace rotorloop::hil {

// Over all control steps in flight, all seeds, and all rotors where there are four.
struct Change {
  double rms = 0.0, peak = 0.0;
};

struct EffectComparison {
  std::string effect, parameter, unit;
  double value = 0.0;         // of the flight with the effect; of an intrinsic one 0 to its neutral value: what is taken out
  bool in_reference = false;  // the plant has it without or with an entry; the other flight is the one without it
  std::string flight;
  Spread error_without_cm, error_with_cm;  // mean 3-D tracking error over the seeds completed both times
  std::string end_without, end_with;       // why a flight was not completed; empty when all were
  // Flight with the effect less flight without it, at the same instants.
  Change thrust_N, in_plane_N, shaft_torque_N_m, speed_rad_s;
  Change body_force_N, body_moment_N_m;  // of what effects put on the body directly
};

// An effect that the solve of rotor or body contains: without an entry it acts in full, and its typical_value takes it out.
bool is_intrinsic(const sim::EffectInfo& info, double typical_value);

// The size of each effect for comparisons, from effects/catalogue.toml as built in.
double typical_value(const sim::EffectInfo& info);

// The plant with exactly one effect switched over: taken out where `plant` has it, else put in with `value` and the options'
// defaults.
sim::PlantFile switched(const sim::PlantFile& plant, const sim::EffectInfo& info, double value);
bool has_effect(const sim::PlantFile& plant, const sim::EffectInfo& info, double typical_value);

// All effects, or those named. Throws Error for an unknown id (the text lists the known ones) or one given twice.
std::vector<const sim::EffectInfo*> chosen_effects(const std::vector<std::string>& ids);

// The flight of the scenario that names the effect, else the first. Throws Error when flights name unknown effects.
std::size_t flight_for(const Scenario& scenario, std::string_view effect);

struct StudyOptions {
  int jobs = 1;
  const std::atomic<bool>* stop = nullptr;
};

// Flies with the scenario's first variant and all its seeds; in the order of `effects`.
std::vector<EffectComparison> compare_effects(const Scenario& scenario, const Inputs& inputs,
                                              const std::vector<const sim::EffectInfo*>& effects, const StudyOptions& options,
                                              Progress& progress);

}  // namespace rotorloop::hil
