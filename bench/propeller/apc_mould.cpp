// Reader of APC's PE0 files: a table of stations in inches, then radius, blades, inertia and the names of the sections.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>

#include "bench/propeller/geometry.hpp"

namespace rotorloop::propeller {
namespace {
constexpr double kMouldUnit_m = 0.0254;
constexpr double kTipGapMost = 0.02;  // of the radius, between the last station and RADIUS: both are the tip
constexpr std::size_t kMinMouldStations = 5;
constexpr std::array<std::string_view, 13> kMouldColumns{"STATION", "CHORD",     "PITCH",         "PITCH", "PITCH", "SWEEP", "THICKNESS",
                                                         "TWIST",   "MAX-THICK", "CROSS-SECTION", "ZHIGH", "CGY",   "CGZ"};
constexpr std::array<std::string_view, 13> kUnits{"(IN)",  "(IN)", "(QUOTED)", "(LE-TE)", "(PRATHER)", "(IN)", "RATIO",
                                                  "(DEG)", "(IN)", "(IN**2)",  "(IN)",    "(IN)",      "(IN)"};
constexpr std::size_t kChord = 1, kThickness = 6, kTwist = 7;
constexpr Range kInches{0.0, 80.0, "in"};

template <class Names>
void expect(const TextFile& file, const TextLine& line, const Names& names, const char* what) {
  if (!std::equal(line.fields.begin(), line.fields.end(), names.begin(), names.end()))
    file.fail(line.number, fmt::format("{} are \"{}\", expected \"{}\"", what, fmt::join(line.fields, " "), fmt::join(names, " ")),
              "another kind or version of mould file", "give a PE0 file with lengths in inches and twist in degrees");
}

// The value of a line "NAME: 1.23 …"; an absent one is an error.
double keyed(const TextFile& file, std::string_view name, Range range) {
  for (const TextLine& l : file.lines)
    if (!l.fields.empty() && l.fields[0] == name) return file.number(l, 1, name, range);
  file.fail(static_cast<int>(file.lines.size()), fmt::format("no line \"{}\"", name), "the file was cut off", "get the whole file");
}

std::optional<double> inertia(const TextFile& file) {
  for (const TextLine& l : file.lines)
    if (l.text.find("MOMENT OF INERTIA (Kg-M**2)") != std::string::npos) {
      const double value = file.number(l, l.fields.size() - 1, "MOMENT OF INERTIA", {0.0, 10.0, "kg m^2"});
      return value > 0.0 ? std::optional(value) : std::nullopt;  // the file has six decimals: small propellers read 0
    }
  return std::nullopt;
}

// " AIRFOIL1:  1.40, E63   (Transition Start, Airfoil 1)"
std::optional<NamedSections> sections(const TextFile& file) {
  NamedSections s;
  int found = 0;
  for (const TextLine& l : file.lines) {
    if (l.fields.empty() || (l.fields[0] != "AIRFOIL1:" && l.fields[0] != "AIRFOIL2:")) continue;
    if (l.fields.size() < 3 || !l.fields[1].ends_with(','))
      file.fail(l.number, fmt::format("\"{}\" names no section", l.text), "the file was cut off",
                "write AIRFOIL1: STATION, NAME with the station in inches");
    TextLine plain = l;
    plain.fields[1].pop_back();
    const double r_m = kMouldUnit_m * file.number(plain, 1, l.fields[0], kInches);
    const bool first = l.fields[0] == "AIRFOIL1:";
    (first ? s.blend_from_m : s.blend_to_m) = r_m;
    (first ? s.inner : s.outer) = l.fields[2];
    found |= first ? 1 : 2;
  }
  return found == 3 ? std::optional(s) : std::nullopt;
}
}  // namespace

PropellerGeometry read_apc_mould(const TextFile& file) {
  auto line = file.lines.begin();
  while (line != file.lines.end() && (line->fields.empty() || line->fields[0] != "STATION")) ++line;
  if (line == file.lines.end() || line + 1 == file.lines.end())
    file.fail(static_cast<int>(file.lines.size()), "no table of stations: no line that begins with STATION", "not a PE0 file, or cut off",
              "give APC's NAME-PERF.PE0");
  expect(file, *line, kMouldColumns, "columns");
  expect(file, *++line, kUnits, "units");

  PropellerGeometry g;
  const TextLine* previous = nullptr;
  for (++line; line != file.lines.end(); ++line) {
    if (line->fields.empty()) {
      if (previous == nullptr) continue;  // a blank line follows the units
      break;
    }
    if (line->fields.size() != kMouldColumns.size())
      file.fail(line->number, fmt::format("{} fields where the header has {}", line->fields.size(), kMouldColumns.size()),
                "the file was cut off, or columns were added", "get the file again");
    const double r_m = kMouldUnit_m * file.number(*line, 0, "STATION", kInches);
    const GeometryStation s{r_m, kMouldUnit_m * file.number(*line, kChord, "CHORD", {1e-4, 40.0, "in"}),
                            file.number(*line, kTwist, "TWIST", {-30.0, 80.0, "deg"}),
                            file.number(*line, kThickness, "THICKNESS RATIO", {1e-3, 1.0, "1"})};
    // APC writes the row at the hub transition twice.
    if (previous != nullptr && previous->fields == line->fields) continue;
    if (!g.stations.empty() && !(r_m > g.stations.back().r_m))
      file.fail(line->number,
                fmt::format("STATION = {} in does not exceed that of the row before, {} in", number_text(r_m / kMouldUnit_m),
                            number_text(g.stations.back().r_m / kMouldUnit_m)),
                "", "order the stations from hub to tip; give each radius once");
    g.stations.push_back(s);
    previous = &*line;
  }
  const int end = line == file.lines.end() ? static_cast<int>(file.lines.size()) : line->number;
  if (g.stations.size() < kMinMouldStations)
    file.fail(end, fmt::format("{} stations, expected at least {}", g.stations.size(), kMinMouldStations), "the file was cut off",
              "get the whole file");
  const double stated_m = kMouldUnit_m * keyed(file, "RADIUS:", {0.2, 80.0, "in"});
  const double tip_m = g.stations.back().r_m;
  if (std::abs(tip_m - stated_m) > kTipGapMost * stated_m)
    file.fail(end,
              fmt::format("the last station is at {} in, RADIUS is {} in", number_text(tip_m / kMouldUnit_m),
                          number_text(stated_m / kMouldUnit_m)),
              "stations are missing, or two files were mixed", "get the whole file");
  g.radius_m = tip_m;  // RADIUS has two decimals only
  g.hub_radius_m = g.stations.front().r_m;
  g.blades = static_cast<int>(keyed(file, "BLADES:", {1.0, 8.0, "1"}));
  g.inertia_kg_m2 = inertia(file);
  g.sections = sections(file);
  for (const GeometryStation& s : g.stations)
    if (s.chord_m > 0.8 * g.radius_m)
      file.fail(end, fmt::format("CHORD = {} in is more than 0.8 of RADIUS", number_text(s.chord_m / kMouldUnit_m)), "another unit",
                "give lengths in inches");
  return g;
}

}  // namespace rotorloop::propeller
