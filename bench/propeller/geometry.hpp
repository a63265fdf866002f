// Shape of a propeller blade as two public sources give it: the UIUC database (photographed: r/R, c/R, beta) and the mould files
// of APC ("PE0": inches, twist of the mould's parting lines). Both say where the chord line stands; they differ by up to 2 degrees.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bench/propeller/text_file.hpp"

namespace rotorloop::propeller {

struct GeometryStation {
  double r_m;
  double chord_m;
  double twist_deg;                       // chord line against the rotor plane, leading edge up
  std::optional<double> thickness_ratio;  // over the chord; UIUC gives none
};

// Sections of a mould file: the first out to `blend_from_m`, the second from `blend_to_m` on, a mixture between.
struct NamedSections {
  std::string inner, outer;  // "E63", "CLARK-Y", "APC12" (NACA 4412)
  double blend_from_m = 0.0, blend_to_m = 0.0;
};

struct PropellerGeometry {
  int blades = 2;
  double radius_m = 0.0;
  double hub_radius_m = 0.0;              // the innermost station: nothing is known of the lift further in
  std::optional<double> inertia_kg_m2;    // of the whole propeller; UIUC gives none
  std::vector<GeometryStation> stations;  // from hub to tip
  std::optional<NamedSections> sections;  // UIUC names none
};

// The UIUC file knows neither diameter nor number of blades: the propeller's name does. Throw Error.
PropellerGeometry read_uiuc_geometry(const TextFile& file, double radius_m, int blades);
PropellerGeometry read_apc_mould(const TextFile& file);

}  // namespace rotorloop::propeller
