// The loop file: the nominal model, the injected effects, which flights the diagnosis gets, which are held out, which are judged before
// and after. Reading it is the only place where it is checked.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "bench/hil/flight/scenario.hpp"

namespace rotorloop::closed_loop {

struct PlannedFlight {
  std::string name;
  std::filesystem::path trajectory;
  std::string role;  // of a flight to learn from: "vertical", "horizontal", "rotation" or "any" (rotorloop identify)
};

// better: the tracking error must fall, by at least `percent`. no_worse: it must not rise by more than `percent`.
enum class Expectation : std::uint8_t { better, no_worse };

struct JudgedFlight {
  PlannedFlight flight;
  hil::ErrorAxis axis = hil::ErrorAxis::norm_3d;
  Expectation expect = Expectation::better;
  double percent = 0.0;
};

// An effect that the plant has and the vehicle file lacks: an [[effect]] of the plant file.
struct InjectedEffect {
  std::string id;
  std::vector<std::pair<std::string, double>> values;  // parameter and options
  std::vector<std::string> shows_as;  // other effects that a right answer may name for it (a payload shifts the centre of mass)
};

struct LoopPlan {
  std::filesystem::path path;
  std::string name;
  std::filesystem::path plant, vehicle, gains;
  host::Variant variant = host::Variant::pd_ff_thrust_drag;
  std::vector<InjectedEffect> injected;  // may be empty: then nothing is missing, and nothing should be found
  std::vector<std::string> also_true;  // effects that the plant has besides (its BEM rotor model): right when they are named, not asked for
  std::vector<PlannedFlight> learn, held_out;
  std::vector<JudgedFlight> judged;
  std::vector<std::uint64_t> learn_seeds, held_out_seeds, judged_seeds;  // no seed is in two of them
  std::vector<std::string> identify_arguments, diagnose_arguments;       // added to the commands of the diagnosis
};

// Throws Error with file, line, key, value, range and remedy.
LoopPlan read_loop_plan(const std::filesystem::path& path);

// The plant file's text with the injected effects at its end.
std::string plant_with(const std::string& plant_text, const std::vector<InjectedEffect>& injected);

// A scenario for `rotorloop hil`; the paths as they shall stand in it. Its name gives nothing away.
struct ScenarioPaths {
  std::string plant, vehicle, gains;
  std::vector<std::string> trajectories;  // one for each flight
};
std::string hil_scenario_text(const ScenarioPaths& paths, host::Variant variant, const std::vector<std::string>& flights,
                              const std::vector<std::uint64_t>& seeds);

}  // namespace rotorloop::closed_loop
