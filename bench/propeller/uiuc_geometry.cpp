// Reader of geometry files of the UIUC propeller database.
#include <fmt/format.h>

#include "bench/propeller/geometry.hpp"

namespace rotorloop::propeller {
namespace {
constexpr double kFirstStationMost = 0.3, kLastStationLeast = 0.95;  // of the radius; sim/rotor's blade files ask the same
constexpr std::size_t kMinUiucStations = 5;
}  // namespace

PropellerGeometry read_uiuc_geometry(const TextFile& file, double radius_m, int blades) {
  PropellerGeometry g;
  g.blades = blades;
  g.radius_m = radius_m;
  double last = -1.0;
  for (const TableRow& row :
       read_table(file, {{"r/R", {0.0, 1.0, "radii"}}, {"c/R", {1e-3, 0.8, "radii"}}, {"beta", {-30.0, 80.0, "deg"}}}, kMinUiucStations)) {
    const double r = row.values[0];
    if (!(r > last))
      file.fail(row.line, fmt::format("r/R = {} does not exceed that of the station before, {}", number_text(r), number_text(last)), "",
                "order the stations from hub to tip; give each radius once");
    last = r;
    g.stations.push_back({r * radius_m, row.values[1] * radius_m, row.values[2], std::nullopt});
  }
  const int end = static_cast<int>(file.lines.size());
  if (g.stations.front().r_m > kFirstStationMost * radius_m)
    file.fail(end,
              fmt::format("the first station is at r/R = {}, expected at most {}", number_text(g.stations.front().r_m / radius_m),
                          number_text(kFirstStationMost)),
              "the root's stations are missing", "get the whole file");
  if (last < kLastStationLeast)
    file.fail(end, fmt::format("the last station is at r/R = {}, expected at least {}", number_text(last), number_text(kLastStationLeast)),
              "the file was cut off", "get the whole file");
  g.hub_radius_m = g.stations.front().r_m;
  return g;
}

}  // namespace rotorloop::propeller
