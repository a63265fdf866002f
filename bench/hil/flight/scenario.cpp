#include "bench/hil/flight/scenario.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <set>

#include "host/base/error.hpp"
#include "host/base/nearest.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::hil {
namespace {

constexpr double kLongestFlight_s = 3600.0;
constexpr std::size_t kMostFlights = 100, kMostFaults = 100, kMostLimits = 1000, kMostSeeds = 10'000;
constexpr std::int64_t kLargestSeed = 4'294'967'295;  // 32 bits: a seed is a name that people type, not a key

std::vector<std::string> variant_names(const std::vector<ExternalController>& external) {
  std::vector<std::string> names;
  for (const auto v : kAllVariants) names.emplace_back(variant_name(v));
  for (const auto& c : external) names.push_back(c.name);
  return names;
}

std::optional<Variant> named_variant(std::string_view name, const std::vector<ExternalController>& external) {
  for (const auto& c : external)
    if (c.name == name) return Variant::external(c.name);
  return variant_from_name(name);
}

std::vector<std::string> flight_names(const Scenario& s) {
  std::vector<std::string> names;
  for (const auto& f : s.flights) names.push_back(f.name);
  return names;
}

std::string given_flight(const TomlTable& t, std::string_view key, const Scenario& s) {
  const auto name = t.text(key);
  const auto names = flight_names(s);
  if (std::find(names.begin(), names.end(), name) == names.end())
    t.fail(key, fmt::format("{} = \"{}\" is not a flight of this scenario", key, name), "a renamed or misspelt flight",
           fmt::format("{}use one of: {}", did_you_mean(name, names), fmt::join(names, ", ")));
  return name;
}

Variant known_variant(const TomlTable& t, std::string_view key, const std::string& name, const Scenario& s) {
  if (const auto v = named_variant(name, s.external)) return *v;
  const auto names = variant_names(s.external);
  t.fail(key, fmt::format("{} has \"{}\", which is not a controller variant", key, name), "",
         fmt::format("{}use one of: {}", did_you_mean(name, names), fmt::join(names, ", ")));
}

// A variant that this scenario flies.
Variant flown_variant(const TomlTable& t, std::string_view key, const Scenario& s) {
  const auto v = known_variant(t, key, t.text(key), s);
  if (std::find(s.variants.begin(), s.variants.end(), v) == s.variants.end())
    t.fail(key, fmt::format("{} = \"{}\" is not flown by this scenario", key, variant_name(v)), "",
           "add it to variants, or remove the line that needs it");
  return v;
}

ErrorAxis axis(const TomlTable& t) { return t.choice("axis", {"3d", "z"}, "3d") == "z" ? ErrorAxis::z : ErrorAxis::norm_3d; }

void refuse_empty(const TomlTable& t, std::string_view key, bool empty, std::string_view example) {
  if (empty) t.fail(key, fmt::format("{} is an empty list", key), "", fmt::format("give at least one, such as {} = {}", key, example));
}

void read_seeds(const TomlTable& root, Scenario& s) {
  const auto seeds = root.integers("seeds", 0, kLargestSeed);
  refuse_empty(root, "seeds", seeds.empty(), "[1, 2, 3]");
  if (seeds.size() > kMostSeeds)
    root.fail("seeds", fmt::format("seeds has {} values, at most {}", seeds.size(), kMostSeeds), "", "give fewer seeds");
  std::set<std::int64_t> seen;
  for (const auto seed : seeds) {
    if (!seen.insert(seed).second)
      root.fail("seeds", fmt::format("seeds has {} twice", seed), "a copied list; the same seed flies the same flight",
                "give each seed once");
    s.seeds.push_back(static_cast<std::uint64_t>(seed));
  }
}

void read_variants(const TomlTable& root, Scenario& s) {
  const auto names = root.texts("variants");
  refuse_empty(root, "variants", names.empty(), "[\"pd_ff\"]");
  for (const auto& name : names) {
    const auto v = known_variant(root, "variants", name, s);
    if (std::find(s.variants.begin(), s.variants.end(), v) != s.variants.end())
      root.fail("variants", fmt::format("variants has \"{}\" twice", name), "", "give each variant once");
    s.variants.push_back(v);
  }
}

void read_flights(const TomlTable& root, Scenario& s) {
  for (const auto& t : root.tables("flight", 1, kMostFlights)) {
    FlightPlan f;
    f.name = t.text("name");
    if (!is_variant_name(f.name))  // the same rule: both name folders
      t.fail("name", fmt::format("flight.name = \"{}\" cannot name a folder", f.name), "", "use 1 to 64 letters, digits, '_' and '-'");
    for (const auto& other : s.flights)
      if (other.name == f.name)
        t.fail("name", fmt::format("flight.name = \"{}\" is used twice", f.name), "a copied [[flight]] block",
               "give each flight its own name");
    if (f.name == "inputs")
      t.fail("name", "flight.name = \"inputs\" is the name of the run folder's own folder", "", "choose another name");
    f.trajectory = t.file("trajectory");
    if (t.has("effects")) f.effects = t.texts("effects");
    s.flights.push_back(std::move(f));
  }
}

std::string backend(const TomlTable& t, std::string_view key) {
  const auto name = t.text(key, "virtual:");
  if (name == "virtual:") return name;
  const auto scheme = name.substr(0, name.find(':'));
  const bool known = name.find(':') != std::string::npos && (scheme == "socketcan" || scheme == "gsusb" || scheme == "mcast");
  t.fail(
      key,
      fmt::format("bus.{} = \"{}\": {}; built in: virtual:", key, name, known ? "this bus backend is not built in" : "not a bus backend"),
      known ? "" : "a backend is written as name:details", fmt::format("set {} = \"virtual:\"", key));
}

void read_bus(const TomlTable& root, Scenario& s) {
  const auto t = root.optional_table("bus");
  if (!t) return;
  s.bus.esc = backend(*t, "esc");
  s.bus.state = backend(*t, "state");
  const std::string pace = t->text("pace", "lockstep");
  const auto parsed = parse_pace(pace);
  if (!parsed) t->fail("pace", fmt::format("bus.pace = \"{}\" is no pace", pace), "", fmt::format("set {}", kPaceWords));
  s.bus.pace = *parsed;
}

EscKind esc_kind(const TomlTable& t, const std::string& name) {
  if (name == "native") return EscKind::native;
  if (name == "lag") return EscKind::lag;
  if (name == "emulated") return EscKind::emulated;
  if (name == "external")
    t.fail("kind", fmt::format("esc.kind has \"{}\": not built in; built in: native, lag, emulated", name), "",
           "use \"native\" (the firmware core on a simulated drive)");
  t.fail("kind", fmt::format("esc.kind has \"{}\", which is not known", name), "",
         did_you_mean(name, {"native", "lag", "emulated"}) + "use one of: native, lag, emulated");
}

void read_esc(const TomlTable& root, Scenario& s) {
  const auto t = root.optional_table("esc");
  if (!t) return;
  if (t->is_array("kind")) {
    const auto kinds = t->texts("kind");
    if (kinds.size() != 4)
      t->fail("kind", fmt::format("esc.kind has {} values, expected 4", kinds.size()), "",
              "give one text for all, or a list of four in rotor order");
    for (std::size_t i = 0; i < 4; ++i) s.esc.kind[i] = esc_kind(*t, kinds[i]);
  } else {
    s.esc.kind.fill(esc_kind(*t, t->text("kind", "native")));
  }
  if (t->has("elf")) s.esc.elf = t->file("elf");
  if (!s.esc.elf.empty() && !s.esc.emulated())
    t->fail("elf", "esc.elf names a program, but no ESC is of kind \"emulated\"", "", "set kind = \"emulated\", or remove elf");
  s.esc.fast_channel_Hz = static_cast<int>(t->integer("fast_channel_Hz", 0, 1000, 1000));
  if (const int f = s.esc.fast_channel_Hz; f != 0 && f != 250 && f != 500 && f != 1000)
    t->fail("fast_channel_Hz", fmt::format("esc.fast_channel_Hz = {} Hz is not a rate of the fast channel", f), "",
            "use 250, 500 or 1000, or 0 for DroneCAN commands only");
}

void read_faults(const TomlTable& root, Scenario& s) {
  for (const auto& t : root.tables("fault", 0, kMostFaults)) {
    Fault f;
    const auto kind = t.choice("kind", {"esc_silent", "node_silent", "bus_babble", "frame_drop", "frame_corrupt"});
    for (const auto k :
         {FaultKind::esc_silent, FaultKind::node_silent, FaultKind::bus_babble, FaultKind::frame_drop, FaultKind::frame_corrupt})
      if (fault_kind_name(k) == kind) f.kind = k;
    f.at_s = t.number("at_s", {0, kLongestFlight_s, "s"});
    if (t.has("duration_s")) f.duration_s = t.number("duration_s", {1e-3, kLongestFlight_s, "s"});
    if (f.kind == FaultKind::esc_silent || f.kind == FaultKind::node_silent) {
      f.rotor = static_cast<int>(t.integer("target", 1, 4));
    } else {
      f.bus = t.choice("target", {"esc", "state"}) == "esc" ? BusName::esc : BusName::state;
      if (f.kind != FaultKind::bus_babble) {
        f.probability = t.number("probability", {0, 1, "1"}, 1.0);
        if (f.probability == 0)
          t.fail("probability", "fault.probability = 0 never strikes", "", "give a value above 0, or remove the fault");
      }
    }
    if (t.has("flight")) f.flight = given_flight(t, "flight", s);
    s.faults.push_back(std::move(f));
  }
}

// Each limit may be one table or a list of tables.
std::vector<TomlTable> one_or_more(const TomlTable& t, std::string_view key) {
  if (!t.has(key)) return {};
  if (!t.is_array(key)) return {t.table(key)};
  return t.tables(key, 1, kMostLimits);
}

void read_limits(const TomlTable& root, Scenario& s) {
  const auto limits = root.optional_table("limits");
  if (!limits) return;
  for (const auto& t : one_or_more(*limits, "mean_tracking_error_cm")) {
    ErrorLimit l{given_flight(t, "flight", s), flown_variant(t, "variant", s), t.number("max", {1e-3, 1e4, "cm"}), axis(t)};
    for (const auto& other : s.limits.error)
      if (other.flight == l.flight && other.variant == l.variant && other.axis == l.axis)
        t.fail("flight",
               fmt::format("two limits for the tracking error of {} {} ({})", l.flight, variant_name(l.variant), axis_name(l.axis)), "",
               "keep one of them");
    s.limits.error.push_back(std::move(l));
  }
  for (const auto& t : one_or_more(*limits, "reduction_percent")) {
    ReductionLimit l{given_flight(t, "flight", s), flown_variant(t, "from", s), flown_variant(t, "to", s),
                     t.number("min", {-1000, 100, "%"}), axis(t)};
    if (l.from == l.to)
      t.fail("to", fmt::format("reduction from \"{0}\" to \"{0}\" is always 0 %", variant_name(l.from)), "", "name two different variants");
    for (const auto& other : s.limits.reduction)
      if (other.flight == l.flight && other.from == l.from && other.to == l.to && other.axis == l.axis)
        t.fail("flight",
               fmt::format("two limits for the reduction of {} from {} to {} ({})", l.flight, variant_name(l.from), variant_name(l.to),
                           axis_name(l.axis)),
               "", "keep one of them");
    s.limits.reduction.push_back(std::move(l));
  }
  for (const auto& t : one_or_more(*limits, "bus_load_percent")) {
    BusLoadLimit l;
    l.max_percent = t.number("max", {1, 100, "%"});
    if (t.has("bus")) l.bus = t.choice("bus", {"esc", "state"}) == "esc" ? BusName::esc : BusName::state;
    for (const auto& other : s.limits.bus_load)
      if (other.bus == l.bus) t.fail("max", "two limits for the load of the same bus", "", "keep one of them");
    s.limits.bus_load.push_back(l);
  }
}

void read_published(const TomlTable& root, Scenario& s) {
  for (const auto& t : root.tables("published", 0, kMostLimits)) {
    PublishedError p;
    p.flight = given_flight(t, "flight", s);
    p.variant = known_variant(t, "variant", t.text("variant"), s);
    p.error_cm = t.number("error_cm", {1e-3, 1e4, "cm"});
    p.axis = axis(t);
    p.source = t.text("source");
    s.published.push_back(std::move(p));
  }
}

void read_ablation(const TomlTable& root, Scenario& s) {
  if (const auto t = root.optional_table("ablation")) {
    s.ablation.latency_compensation = t->boolean("latency_compensation", true);
    s.ablation.drift = t->boolean("drift", true);
    s.ablation.bus = t->choice("bus", {"virtual", "direct"}, "virtual") == "direct" ? BusModel::direct : BusModel::virtual_bus;
    if (t->has("esc_lag_s")) s.ablation.esc_lag_s = t->number("esc_lag_s", {1e-3, 1.0, "s"});
    const bool lag = std::find(s.esc.kind.begin(), s.esc.kind.end(), EscKind::lag) != s.esc.kind.end();
    if (s.ablation.esc_lag_s > 0 && !lag)
      t->fail("esc_lag_s", "ablation.esc_lag_s is set, but no ESC is of kind \"lag\"", "", "set [esc] kind = \"lag\", or remove esc_lag_s");
    if (s.ablation.bus == BusModel::direct && !s.faults.empty())
      t->fail("bus", "ablation.bus = \"direct\" leaves no bus for the [[fault]] entries to strike", "",
              "remove the faults, or keep the bus");
  }
  if (s.esc.emulated() && s.ablation.bus == BusModel::direct)
    root.fail("ablation", "ablation.bus = \"direct\" leaves no bus for emulated ESCs, whose node hears nothing else", "",
              "keep the bus, or set [esc] kind = \"native\"");
  for (const auto k : s.esc.kind)
    if (k == EscKind::lag && s.ablation.esc_lag_s <= 0)
      root.fail("esc", "esc.kind \"lag\" needs its time constant", "", "add [ablation] esc_lag_s = a number, 0.001 to 1 s");
}

}  // namespace

std::string_view esc_kind_name(EscKind kind) { return kind == EscKind::native ? "native" : kind == EscKind::lag ? "lag" : "emulated"; }
std::string_view fault_kind_name(FaultKind kind) {
  switch (kind) {
    case FaultKind::esc_silent:
      return "esc_silent";
    case FaultKind::node_silent:
      return "node_silent";
    case FaultKind::bus_babble:
      return "bus_babble";
    case FaultKind::frame_drop:
      return "frame_drop";
    case FaultKind::frame_corrupt:
      return "frame_corrupt";
  }
  return "?";
}
std::string_view bus_name(BusName bus) { return bus == BusName::esc ? "esc" : "state"; }
std::string_view axis_name(ErrorAxis a) { return a == ErrorAxis::z ? "z" : "3d"; }

std::vector<std::string> ablation_texts(const Ablation& a) {
  std::vector<std::string> out;
  if (!a.latency_compensation) out.push_back("latency compensation is off: the estimator takes each pose as measured on arrival");
  if (!a.drift) out.push_back("the pose sensor's drift is off: the sensors are better than the reference sensors");
  if (a.bus == BusModel::direct) out.push_back("there is no ESC bus: set-points reach the ESCs directly");
  if (a.esc_lag_s > 0)
    out.push_back(fmt::format("ESCs of kind \"lag\" follow with a first-order lag of {} s instead of running the firmware", a.esc_lag_s));
  return out;
}

Scenario read_scenario(const std::filesystem::path& path) {
  const auto file = TomlFile::read(path);
  file.format({1});
  const auto root = file.root();
  Scenario s;
  s.path = path;
  s.name = root.text("name");
  if (s.name.empty() || s.name.size() > 200)
    root.fail("name", fmt::format("name has {} characters", s.name.size()), "", "give a name of 1 to 200 characters");
  s.plant = root.file("plant");
  s.vehicle = root.file("vehicle");
  s.gains = root.table("controller").file("gains");
  s.external = read_external_controllers(root);
  read_seeds(root, s);
  read_variants(root, s);
  read_flights(root, s);
  read_bus(root, s);
  read_esc(root, s);
  read_faults(root, s);
  read_limits(root, s);
  read_published(root, s);
  read_ablation(root, s);
  if (const auto step = root.optional_table("step")) {
    s.airframe_Hz = static_cast<int>(step->integer("airframe_Hz", 1000, 8000, 2000));
    if (s.airframe_Hz != 1000 && s.airframe_Hz != 2000 && s.airframe_Hz != 4000 && s.airframe_Hz != 8000)
      step->fail("airframe_Hz",
                 fmt::format("step.airframe_Hz = {} Hz does not divide the ESCs' 24 kHz and the controller's step evenly", s.airframe_Hz),
                 "", "use 1000, 2000, 4000 or 8000");
  }
  file.refuse_unknown_keys();
  s.files = {s.path, s.plant, s.vehicle, s.gains};
  for (const auto& f : s.flights) s.files.push_back(f.trajectory);
  if (!s.esc.elf.empty()) s.files.push_back(s.esc.elf);
  for (const auto& c : s.external)
    if (!c.library.empty()) s.files.push_back(c.library);
  return s;
}

std::optional<double> parse_pace(std::string_view text) {
  if (text == "lockstep") return 0.0;
  if (text == "realtime") return 1.0;
  double pace = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), pace);
  if (error != std::errc{} || end != text.data() + text.size() || !(pace >= 0.01 && pace <= 10.0)) return std::nullopt;
  return pace;
}

std::vector<std::uint64_t> parse_seeds(std::string_view text) {
  const auto refuse = [&](const std::string& what) {
    throw Error({"--seeds", fmt::format("\"{}\": {}", text, what), "", "give a count (10 flies seeds 1 to 10) or a list (1,4,7..9)"});
  };
  const auto number = [&](std::string_view part) {
    std::uint64_t v = 0;
    const auto [end, ec] = std::from_chars(part.data(), part.data() + part.size(), v);
    if (part.empty() || ec != std::errc{} || end != part.data() + part.size()) refuse(fmt::format("\"{}\" is not a seed", part));
    if (v > static_cast<std::uint64_t>(kLargestSeed)) refuse(fmt::format("{} is outside 0 to {}", part, kLargestSeed));
    return v;
  };
  std::vector<std::uint64_t> out;
  const auto add_range = [&](std::uint64_t from, std::uint64_t to) {
    if (to < from) refuse(fmt::format("{}..{} runs backwards", from, to));
    if (to - from >= kMostSeeds || out.size() + (to - from) >= kMostSeeds) refuse(fmt::format("more than {} seeds", kMostSeeds));
    for (auto v = from; v <= to; ++v) {
      if (std::find(out.begin(), out.end(), v) != out.end()) refuse(fmt::format("seed {} is given twice", v));
      out.push_back(v);
    }
  };
  if (text.find_first_of(",.") == std::string_view::npos) {
    const auto count = number(text);
    if (count == 0) refuse("no seed at all");
    add_range(1, count);
    return out;
  }
  while (true) {
    const auto comma = text.find(',');
    const auto part = text.substr(0, comma);
    if (const auto dots = part.find(".."); dots != std::string_view::npos)
      add_range(number(part.substr(0, dots)), number(part.substr(dots + 2)));
    else if (!(part.empty() && comma == std::string_view::npos && !out.empty()))  // "7," is the list of one
      add_range(number(part), number(part));
    if (comma == std::string_view::npos) return out;
    text.remove_prefix(comma + 1);
  }
}

std::vector<Variant> parse_variants(std::string_view text, const std::vector<ExternalController>& external) {
  std::vector<Variant> out;
  while (true) {
    const auto comma = text.find(',');
    const auto part = text.substr(0, comma);
    const auto v = named_variant(part, external);
    const auto names = variant_names(external);
    if (!v)
      throw Error({"--variants", fmt::format("\"{}\" is not a controller variant", part), "",
                   fmt::format("{}use one or more of: {}", did_you_mean(part, names), fmt::join(names, ", "))});
    if (std::find(out.begin(), out.end(), *v) != out.end())
      throw Error({"--variants", fmt::format("\"{}\" is given twice", part), "", "give each variant once"});
    out.push_back(*v);
    if (comma == std::string_view::npos) return out;
    text.remove_prefix(comma + 1);
  }
}

}  // namespace rotorloop::hil
