// A field over a rotor disk, seen from above, as inline SVG: one coloured cell for each ring and azimuth, a colour bar with its
// unit, where the wind comes from, and which way the rotor turns. Plain values; knows no rotor.
// On the page: x (forward) points up and y (left) to the left, as one looks down on a vehicle.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace rotorloop::render {

struct DiskMap {
  std::string title;                    // read out by screen readers
  std::string label;                    // of the colour bar, with unit: "thrust per area, N/m²"
  std::vector<double> ring_edges_m;     // rings + 1, ascending, first >= 0
  int sectors = 0;                      // per ring, equally wide; sector k is centred on (k + 1/2) 2 pi / sectors, from x towards y
  std::vector<double> values;           // rings x sectors, ring by ring from the hub; not-a-number: left empty
  std::optional<double> low, high;      // of the colour scale; else of the data. What lies beyond has the end's colour and an arrow there
  int spin = 1;                         // +1: counter-clockwise seen from above; 0: no arrow
  std::optional<double> wind_from_rad;  // direction that the air comes from, from x towards y; none: no arrow
  std::string wind_label;               // "8.5 m/s"
  int width_px = 500;
};
std::string disk_map_svg(const DiskMap& map);

// The colour scale: dark blue to yellow, `share` in [0, 1]. Equal steps look equally large and stay so in grey print and for
// colour-blind readers (viridis by N. Smith and S. van der Walt, 2015, at ten nodes; between them straight lines in sRGB).
struct Rgb {
  std::uint8_t r, g, b;
};
Rgb field_colour(double share);

}  // namespace rotorloop::render
