#include "bench/hil/closed_loop/truth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "bench/hil/closed_loop/findings.hpp"
#include "bench/hil/closed_loop/plan.hpp"
#include "bench/hil/closed_loop/run_layout.hpp"
#include "host/base/error.hpp"
#include "host/base/text_file.hpp"
#include "host/base/toml_file.hpp"
#include "host/vehicle/vehicle_file.hpp"
#include "sim/plant/assemble.hpp"

namespace rotorloop::closed_loop {
namespace fs = std::filesystem;
namespace {
using Json = nlohmann::ordered_json;

bool holds(const std::vector<std::string>& list, const std::string& id) { return std::find(list.begin(), list.end(), id) != list.end(); }

const char* word(NameResult t) { return t == NameResult::right ? "right" : t == NameResult::in_class ? "class" : "missed"; }
const char* word(Size s) { return s == Size::right ? "right" : s == Size::wrong ? "wrong" : "not compared"; }

constexpr double kStandardErrors = 3.0, kRelativeTolerance = 0.01, kPlaceTolerance_m = 1e-4;
constexpr const char* kPlace = "centre of mass";

// Mass properties as flown beside those that the controller flies with.
void compare_vehicle(TruthComparison& c, const fs::path& plant_file, const fs::path& vehicle_file) {
  const sim::PlantFile plant = sim::read_plant(plant_file);
  const sim::SharedRotors rotors = sim::read_rotors(plant);
  sim::PlantSetup setup = sim::plant_setup(plant, sim::pointers(rotors), 500'000, 1);
  sim::EffectSet effects = sim::effect_set(plant);
  effects.prepare(setup);
  const FlyingBody flown = flying_body(host::read_vehicle(vehicle_file, host::builtin_effect_catalogue()));
  const auto add = [&](const std::string& what, const char* unit, double truth, const host::Quantity& found) {
    c.values.push_back({what, unit, truth, found.value, found.u});
  };
  const auto& b = setup.body;
  add("mass", "kg", b.mass_kg, flown.mass_kg);
  add("I_xx", "kg m^2", b.inertia_kg_m2(0, 0), flown.inertia_kg_m2[0]);
  add("I_yy", "kg m^2", b.inertia_kg_m2(1, 1), flown.inertia_kg_m2[1]);
  add("I_zz", "kg m^2", b.inertia_kg_m2(2, 2), flown.inertia_kg_m2[2]);
  add(fmt::format("{} x", kPlace), "m", b.com_offset_m.x(), flown.com_m[0]);
  add(fmt::format("{} y", kPlace), "m", b.com_offset_m.y(), flown.com_m[1]);
}

}  // namespace

FlyingBody flying_body(const host::VehicleFile& v) {
  FlyingBody b{.mass_kg = v.mass_kg,
               .com_m = {v.com_offset_m[0], v.com_offset_m[1]},
               .inertia_kg_m2 = {v.inertia_kg_m2[0], v.inertia_kg_m2[1], v.inertia_kg_m2[2]}};
  const auto more = [](host::Quantity& to, double value, double u) {
    to.value += value;
    to.u = std::hypot(to.u, u);
  };
  for (const host::VehicleEffect& e : v.effects) {
    const auto of = [&](std::string_view name) {
      const auto found = std::find_if(e.parameters.begin(), e.parameters.end(), [&](const auto& p) { return p.name == name; });
      return found == e.parameters.end() ? host::Quantity{} : found->quantity;
    };
    if (e.id == host::effect("com_offset").id) {
      more(b.com_m[0], of("dx_m").value, of("dx_m").u);
      more(b.com_m[1], of("dy_m").value, of("dy_m").u);
    }
    if (e.id != host::effect("payload_mass").id) continue;
    // The term's moments are about the centre of mass without the payload; both bodies turn about the one that they have together.
    const host::Quantity payload = of("mass_kg");
    const std::array<host::Quantity, 3> moment{of("moment_x_kg_m"), of("moment_y_kg_m"), of("moment_z_kg_m")};
    const double body_kg = b.mass_kg.value, total_kg = body_kg + payload.value;
    for (std::size_t i = 0; i < b.com_m.size(); ++i) more(b.com_m[i], moment[i].value / total_kg, moment[i].u / total_kg);
    if (payload.value > 0.0) {
      for (std::size_t i = 0; i < b.inertia_kg_m2.size(); ++i) {
        const double p = moment[(i + 1) % 3].value, q = moment[(i + 2) % 3].value;
        b.inertia_kg_m2[i].value += body_kg / total_kg / payload.value * (p * p + q * q);
      }
    }
    more(b.mass_kg, payload.value, payload.u);
  }
  return b;
}

double TruthValue::tolerance() const { return what.starts_with(kPlace) ? kPlaceTolerance_m : kRelativeTolerance * std::abs(truth); }
bool TruthValue::right() const { return std::abs(found - truth) <= std::max(kStandardErrors * u, tolerance()); }

bool TruthComparison::names_right() const {
  return wrong.empty() && std::none_of(hidden.begin(), hidden.end(), [](const HiddenEffect& h) { return h.name == NameResult::missed; });
}
bool TruthComparison::sizes_right() const {
  return std::all_of(values.begin(), values.end(), [](const TruthValue& v) { return v.right(); });
}

std::vector<std::string> names_of(const InjectedEffect& hidden) {
  std::vector<std::string> names{hidden.id};
  if (const auto* row = host::builtin_effect_catalogue().find(hidden.id)) names.insert(names.end(), row->twins.begin(), row->twins.end());
  names.insert(names.end(), hidden.shows_as.begin(), hidden.shows_as.end());
  return names;
}

namespace {

bool names_any(const FoundEffect& f, const std::vector<std::string>& names) {
  return holds(names, f.id) || std::any_of(f.aliases.begin(), f.aliases.end(), [&](const FoundAlias& t) { return holds(names, t.id); });
}

// The size of a hidden effect, where the answer gives one: as named, or as the member of a class.
void compare_size(TruthComparison& c, HiddenEffect& h, const InjectedEffect& u, const FoundEffect& f) {
  const auto compare = [&](const std::vector<FoundValue>& parameters) {
    for (const FoundValue& v : parameters)
      for (const auto& [name, value] : u.values)
        if (name == v.name) {
          c.values.push_back({fmt::format("{} of {}", name, u.id), v.unit, value, v.value, v.u});
          if (h.size != Size::wrong) h.size = c.values.back().right() ? Size::right : Size::wrong;
        }
  };
  if (f.id == u.id) compare(f.parameters);
  for (const FoundAlias& t : f.aliases)
    if (t.id == u.id) compare(t.parameters);
}

}  // namespace

TruthComparison compare_effects(const LoopPlan& plan, const Findings& findings) {
  TruthComparison c;
  std::vector<std::string> all = plan.also_true;
  for (const InjectedEffect& u : plan.injected) {
    HiddenEffect h{u.id, NameResult::missed, "", Size::not_compared};
    const auto names = names_of(u);
    all.insert(all.end(), names.begin(), names.end());
    for (const FoundEffect& f : findings.added) {
      if (!names_any(f, names)) continue;
      const NameResult name = f.id == u.id && f.aliases.empty() ? NameResult::right : NameResult::in_class;
      if (h.name == NameResult::missed || name == NameResult::right) {
        h.name = name;
        h.answer = f.id;
      }
      compare_size(c, h, u, f);
    }
    c.hidden.push_back(h);
  }
  for (const FoundEffect& f : findings.added)
    if (!names_any(f, all)) c.wrong.push_back(f.id);
  return c;
}

TruthComparison compare_with_truth(const fs::path& run) {
  const LoopLayout at{run};
  if (!fs::is_regular_file(at.run_toml()) || !fs::is_regular_file(at.diagnosis()))
    throw Error({run.generic_string(), "is not the folder of a finished study",
                 "another folder, or a run that was stopped before its diagnosis",
                 "name a folder that `rotorloop close` wrote, or let the run end"});
  const auto file = TomlFile::read(at.run_toml());
  const auto root = file.root();
  const LoopPlan plan = read_loop_plan(run / root.text("plan"));
  TruthComparison c = compare_effects(plan, read_findings(at.diagnosis()));
  const fs::path vehicle = fs::is_regular_file(at.diagnosed_vehicle()) ? at.diagnosed_vehicle() : run / root.text("vehicle");
  compare_vehicle(c, run / root.text("flown_plant"), vehicle);
  write_text_file(at.truth(), truth_json(c));
  return c;
}

std::string truth_json(const TruthComparison& c) {
  Json j{{"format", 1},
         {"right", c.right()},
         {"names_right", c.names_right()},
         {"sizes_right", c.sizes_right()},
         {"hidden", Json::array()},
         {"wrong", c.wrong},
         {"values", Json::array()}};
  for (const auto& h : c.hidden)
    j["hidden"].push_back({{"id", h.id}, {"told", word(h.name)}, {"answer", h.answer}, {"size", word(h.size)}});
  for (const auto& v : c.values)
    j["values"].push_back({{"what", v.what},
                           {"unit", v.unit},
                           {"truth", v.truth},
                           {"found", v.found},
                           {"u", v.u},
                           {"errors_in_u", v.errors_in_u()},
                           {"tolerance", v.tolerance()},
                           {"size_right", v.right()}});
  return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

TruthComparison read_truth(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  const Json j = Json::parse(in, nullptr, false);
  TruthComparison c;
  if (j.is_discarded())
    throw Error({path.generic_string(), "is no JSON", "the file was edited or cut", "run `rotorloop close truth` again"});
  for (const Json& h : j.at("hidden")) {
    const auto told = h.at("told").get<std::string>();
    c.hidden.push_back({h.at("id"),
                        told == "right"   ? NameResult::right
                        : told == "class" ? NameResult::in_class
                                          : NameResult::missed,
                        h.at("answer")});
    const auto size = h.value("size", "");  // not in files of older programs
    c.hidden.back().size = size == "right" ? Size::right : size == "wrong" ? Size::wrong : Size::not_compared;
  }
  c.wrong = j.at("wrong").get<std::vector<std::string>>();
  for (const Json& v : j.at("values")) c.values.push_back({v.at("what"), v.at("unit"), v.at("truth"), v.at("found"), v.at("u")});
  return c;
}

std::string truth_text(const TruthComparison& c) {
  std::string out;
  if (c.hidden.empty()) out += "nothing was hidden\n";
  for (const auto& h : c.hidden)
    out += fmt::format("hidden    {:<26} {}{}; size {}\n", h.id, word(h.name), h.answer.empty() ? "" : ", as " + h.answer, word(h.size));
  for (const auto& w : c.wrong) out += fmt::format("wrong     {:<26} the plant does not have it\n", w);
  out += fmt::format("\n{:<36}{:>14}{:>14}{:>12}{:>12}   {}\n", "", "truth", "found", "u", "error / u", "size");
  for (const auto& v : c.values)
    out += fmt::format("{:<36}{:>14.5g}{:>14.5g}{:>12.2g}{:>12}   {}\n", v.what + ", " + v.unit, v.truth, v.found, v.u,
                       v.u > 0 ? fmt::format("{:.1f}", v.errors_in_u()) : "-", v.right() ? "right" : "WRONG");
  out += fmt::format("\nnames: {}\nsizes: {} (right: within {:.0f} u, {:.0f} % of the truth, or {:.1f} mm of a place)\n",
                     c.names_right() ? "right" : "wrong", c.sizes_right() ? "right" : "wrong", kStandardErrors, 100.0 * kRelativeTolerance,
                     1e3 * kPlaceTolerance_m);
  return out;
}

}  // namespace rotorloop::closed_loop
