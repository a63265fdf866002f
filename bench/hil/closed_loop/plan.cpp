#include "bench/hil/closed_loop/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "host/base/error.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::closed_loop {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kMostFlights = 50, kMostEffects = 20, kMostSeeds = 1000;
constexpr std::int64_t kLargestSeed = 4'294'967'295;

PlannedFlight read_flight(const TomlTable& t, std::vector<std::string>& names) {
  PlannedFlight f;
  f.name = t.text("name");
  const auto good = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; };
  if (f.name.empty() || f.name.size() > 40 || !std::all_of(f.name.begin(), f.name.end(), good))
    t.fail("name", fmt::format("name = \"{}\" cannot name a flight", f.name), "", "use 1 to 40 of a to z, 0 to 9 and '_'");
  if (std::find(names.begin(), names.end(), f.name) != names.end())
    t.fail("name", fmt::format("name = \"{}\" is used twice in this list", f.name), "a copied table", "give each flight its own name");
  names.push_back(f.name);
  f.trajectory = t.file("trajectory");
  return f;
}

std::vector<std::uint64_t> read_seeds(const TomlTable& t, std::string_view key, std::map<std::uint64_t, std::string>& taken) {
  const auto seeds = t.integers(key, 0, kLargestSeed);
  if (seeds.empty() || seeds.size() > kMostSeeds)
    t.fail(key, fmt::format("seeds.{} has {} values, expected 1 to {}", key, seeds.size(), kMostSeeds), "",
           "give a list such as [1, 2, 3]");
  std::vector<std::uint64_t> out;
  for (const auto s : seeds) {
    const auto seed = static_cast<std::uint64_t>(s);
    if (const auto [it, added] = taken.emplace(seed, std::string(key)); !added)
      t.fail(key, fmt::format("seed {} is in seeds.{} and in seeds.{}", seed, it->second, key),
             "flights with the same seed share their sensors' errors: what is judged or held out must not have been learnt from",
             "give every seed once, in one of the lists");
    out.push_back(seed);
  }
  return out;
}

InjectedEffect read_injected(const TomlTable& t) {
  InjectedEffect u;
  u.id = t.text("id");
  for (const std::string& key : t.keys()) {
    if (key == "id" || key == "shows_as") continue;
    u.values.emplace_back(key, t.number(key, {-1e9, 1e9, "as in the catalogue"}));  // its range is the plant reader's business
  }
  if (t.has("shows_as")) u.shows_as = t.texts("shows_as");
  return u;
}

JudgedFlight read_judged(const TomlTable& t, std::vector<std::string>& names) {
  JudgedFlight j;
  j.flight = read_flight(t, names);
  j.axis = t.choice("axis", {"3d", "z"}, "3d") == "z" ? hil::ErrorAxis::z : hil::ErrorAxis::norm_3d;
  j.expect = t.choice("expect", {"better", "no_worse"}) == "better" ? Expectation::better : Expectation::no_worse;
  j.percent = t.number("percent", {0, 100, "%"}, j.expect == Expectation::better ? 0.0 : 5.0);
  return j;
}

}  // namespace

LoopPlan read_loop_plan(const fs::path& path) {
  const auto file = TomlFile::read(path);
  file.format({1});
  const auto root = file.root();
  LoopPlan p;
  p.path = path;
  p.name = root.text("name");
  if (p.name.empty() || p.name.size() > 100) root.fail("name", "name must have 1 to 100 characters", "", "name the loop");
  p.plant = root.file("plant");
  p.vehicle = root.file("vehicle");
  const auto controller = root.table("controller");
  p.gains = controller.file("gains");
  const auto variant = controller.choice("variant", {"pd_ff", "pd_ff_drag", "pd_ff_thrust_drag"}, "pd_ff_thrust_drag");
  p.variant = hil::variant_from_name(variant)->own();
  for (const auto& t : root.tables("undeclared", 0, kMostEffects)) {
    p.injected.push_back(read_injected(t));
    for (std::size_t i = 0; i + 1 < p.injected.size(); ++i)
      if (p.injected[i].id == p.injected.back().id)
        t.fail("id", fmt::format("undeclared.id = \"{}\" is given twice", p.injected[i].id), "", "give each effect once");
  }
  if (root.has("also_true")) p.also_true = root.texts("also_true");
  std::vector<std::string> learn, held_out, judged;
  for (const auto& t : root.tables("learn", 1, kMostFlights)) {
    p.learn.push_back(read_flight(t, learn));
    p.learn.back().role = t.choice("role", {"vertical", "horizontal", "rotation", "any"}, "any");
  }
  for (const auto& t : root.tables("held_out", 1, kMostFlights)) p.held_out.push_back(read_flight(t, held_out));
  for (const auto& t : root.tables("judged", 1, kMostFlights)) p.judged.push_back(read_judged(t, judged));
  const auto seeds = root.table("seeds");
  std::map<std::uint64_t, std::string> taken;
  p.learn_seeds = read_seeds(seeds, "learn", taken);
  p.held_out_seeds = read_seeds(seeds, "held_out", taken);
  p.judged_seeds = read_seeds(seeds, "judged", taken);
  if (p.judged_seeds.size() < 2)
    seeds.fail("judged", "seeds.judged has one seed: without a second there is no scatter to judge by", "", "give three or more");
  if (const auto analyst = root.optional_table("analyst")) {
    if (analyst->has("identify")) p.identify_arguments = analyst->texts("identify");
    if (analyst->has("diagnose")) p.diagnose_arguments = analyst->texts("diagnose");
  }
  file.refuse_unknown_keys();
  return p;
}

std::string plant_with(const std::string& plant_text, const std::vector<InjectedEffect>& injected) {
  std::string out = plant_text;
  if (!out.empty() && out.back() != '\n') out += '\n';
  for (const InjectedEffect& u : injected) {
    out += fmt::format("\n[[effect]]\nid = \"{}\"\n", u.id);
    for (const auto& [key, value] : u.values) out += fmt::format("{} = {}\n", key, number_text(value));
  }
  return out;
}

std::string hil_scenario_text(const ScenarioPaths& paths, host::Variant variant, const std::vector<std::string>& flights,
                              const std::vector<std::uint64_t>& seeds) {
  std::string out = fmt::format(
      "format = 1\nname = \"flights\"\nplant = \"{}\"\nvehicle = \"{}\"\nseeds = [{}]\nvariants = [\"{}\"]\n\n[controller]\ngains = "
      "\"{}\"\n",
      paths.plant, paths.vehicle, fmt::join(seeds, ", "), hil::variant_name(variant), paths.gains);
  for (std::size_t i = 0; i < flights.size(); ++i)
    out += fmt::format("\n[[flight]]\nname = \"{}\"\ntrajectory = \"{}\"\n", flights[i], paths.trajectories.at(i));
  return out;
}

}  // namespace rotorloop::closed_loop
