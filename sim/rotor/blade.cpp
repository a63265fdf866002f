// Reader of blade files.
#include "sim/rotor/blade.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "host/base/elementary.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::sim {
namespace {
constexpr double kFirstStationMost = 0.3;  // of the radius: the inner part gives little, but its chord must not be invented
constexpr double kLastStationLeast = 0.95;
constexpr double kChordMost = 0.8;  // of the radius; the widest toys and ducted fans stay below

void check_span(const TomlTable& root, const Blade& b, const std::vector<TomlTable>& stations) {
  for (std::size_t i = 0; i < b.stations.size(); ++i) {
    const BladeStation& s = b.stations[i];
    if (i > 0 && !(s.r_m > b.stations[i - 1].r_m))
      stations[i].fail("r_m",
                       fmt::format("r_m = {} m does not exceed that of the station before, {} m", number_text(s.r_m),
                                   number_text(b.stations[i - 1].r_m)),
                       "", "order the stations from hub to tip; give each radius once");
    if (s.r_m > b.radius_m)
      stations[i].fail("r_m", fmt::format("r_m = {} m lies outside radius_m = {} m", number_text(s.r_m), number_text(b.radius_m)),
                       "diameter and radius mixed up, or inch and metre", "give radii in metres from the shaft");
    if (s.chord_m > kChordMost * b.radius_m)
      stations[i].fail("chord_m",
                       fmt::format("chord_m = {} m is more than {} of radius_m = {} m", number_text(s.chord_m), number_text(kChordMost),
                                   number_text(b.radius_m)),
                       "chord given per radius, or in other units", "give chords in metres");
  }
  if (b.stations.front().r_m > kFirstStationMost * b.radius_m)
    stations.front().fail("r_m",
                          fmt::format("the first station is at {} m, expected at most {} of radius_m = {} m",
                                      number_text(b.stations.front().r_m), number_text(kFirstStationMost), number_text(b.radius_m)),
                          "the root is not described", "add a station near the hub");
  if (b.stations.back().r_m < kLastStationLeast * b.radius_m)
    stations.back().fail("r_m",
                         fmt::format("the last station is at {} m, expected at least {} of radius_m = {} m",
                                     number_text(b.stations.back().r_m), number_text(kLastStationLeast), number_text(b.radius_m)),
                         "the tip is not described, or radius_m belongs to another propeller", "add a station at the tip");
  if (b.hub_radius_m >= 0.5 * b.radius_m)
    root.fail("hub_radius_m",
              fmt::format("hub_radius_m = {} m is not below half of radius_m = {} m", number_text(b.hub_radius_m), number_text(b.radius_m)),
              "", "give the radius at which the blades leave the hub");
}

void read_polars(Blade& b, const std::vector<TomlTable>& stations, const std::filesystem::path& path) {
  const std::filesystem::path folder = path.parent_path() / ".." / "polars";
  for (std::size_t i = 0; i < b.stations.size(); ++i) {
    const std::string& name = b.stations[i].polar;
    if (b.polars.contains(name)) continue;
    if (name.empty() || name.find_first_of("/\\.") != std::string::npos)
      stations[i].fail("polar", fmt::format("polar = \"{}\" is not a plain name", name), "a path or a file ending was given",
                       "write the file's name without folder and .toml");
    const auto file = (folder / (name + ".toml")).lexically_normal();
    std::error_code ec;
    if (!std::filesystem::is_regular_file(file, ec))
      stations[i].fail("polar", fmt::format("polar \"{}\" not found: no file {}", name, file.generic_string()), "a misspelt name",
                       "put the table there, or name one that is there");
    b.polars.emplace(name, read_polar(file));
    b.polar_files.push_back(file);
  }
}

// A blade by a few numbers, for a propeller of which no more is known: helix of constant pitch, held at the twist that moulded roots do
// not exceed; chord widest at `widest` of the radius, falling by a square to the root and by a cube to the tip.
std::vector<BladeStation> planform_stations(const TomlTable& t, const Blade& b) {
  constexpr int kStations = 17;
  const double pitch_m = t.number("pitch_m", {0.001, 4.0, "m"}), chord_m = t.number("chord_m", {kLeastChord_m, 1.0, "m"});
  const double widest = t.number("widest", {0.2, 0.9, "1"});
  const double root = t.number("root", {0.05, 1.0, "1"}), tip = t.number("tip", {0.05, 1.0, "1"});
  const double most_twist_deg = t.number("most_twist_deg", {5.0, 60.0, "deg"});
  const std::string polar = t.text("section");
  std::vector<BladeStation> stations;
  const double begin = std::max(b.hub_radius_m / b.radius_m, 0.1);
  for (int k = 0; k < kStations; ++k) {
    const double x = begin + (1.0 - begin) * k / (kStations - 1);
    const double inward = std::max(0.0, (widest - x) / widest), outward = std::max(0.0, (x - widest) / (1.0 - widest));
    const double share = 1.0 - (1.0 - root) * inward * inward - (1.0 - tip) * outward * outward * outward;
    const double helix_deg = atan2_exact(pitch_m, 2.0 * std::numbers::pi * x * b.radius_m) * 180.0 / std::numbers::pi;
    stations.push_back({x * b.radius_m, chord_m * share, std::min(helix_deg, most_twist_deg), polar});
  }
  return stations;
}

Blade blade_from(const TomlFile& file) {
  file.format({1});
  const TomlTable root = file.root();
  Blade b;
  b.blades = static_cast<int>(root.integer("blades", 1, 8));
  b.radius_m = root.number("radius_m", {0.01, 2.0, "m"});
  b.hub_radius_m = root.number("hub_radius_m", {0.001, 1.0, "m"});
  b.blade_inertia_kg_m2 = root.number("blade_inertia_kg_m2", {1e-9, 10.0, "kg m^2"});
  b.stall_delay = root.number("stall_delay", {0.0, 10.0, "1"}, kSnelFactor);
  b.stall_drag = root.number("stall_drag", {0.0, 1.0, "1"}, 0.0);
  b.drag_scale = root.number("drag_scale", {0.5, 3.0, "1"}, 1.0);
  b.lift_scale = root.number("lift_scale", {0.5, 1.5, "1"}, 1.0);
  b.pitch_offset_deg = root.number("pitch_offset_deg", {-10.0, 10.0, "deg"}, 0.0);
  std::vector<TomlTable> stations;  // where an error lies
  if (root.has("planform")) {
    b.stations = planform_stations(root.table("planform"), b);
    stations.assign(b.stations.size(), root.table("planform"));
  } else {
    stations = root.tables("station", kMinStations, 200);
    for (const TomlTable& t : stations)
      b.stations.push_back({t.number("r_m", {0.0, 2.0, "m"}), t.number("chord_m", {kLeastChord_m, 1.0, "m"}),
                            t.number("twist_deg", {-30.0, 80.0, "deg"}), t.text("polar")});
  }
  check_span(root, b, stations);
  file.refuse_unknown_keys();
  read_polars(b, stations, file.path());
  return b;
}
}  // namespace

Blade read_blade(const std::filesystem::path& path) { return blade_from(TomlFile::read(path)); }
Blade parse_blade(std::string_view text, const std::filesystem::path& path) { return blade_from(TomlFile::parse(text, path)); }

}  // namespace rotorloop::sim
