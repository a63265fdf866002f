// Files of a propeller, known by what they hold: no name of a propeller is known here.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "bench/propeller/catalogue.hpp"

namespace rotorloop::propeller {

struct NamedGeometry {
  std::string source;  // "mould", "photo", "sections"
  PropellerGeometry geometry;
};

struct PropellerFiles {
  std::vector<NamedGeometry> geometries;
  std::vector<MeasuredSet> sets;  // the static one first, if there is any
  std::string static_file;        // what that one was read from
  double diameter_m = 0.0;        // that coefficients are made with
  double air_density_kg_m3 = 1.225;
  std::vector<std::string> remarks;
};

struct PropellerFileOptions {
  std::optional<double> diameter_m;  // nominal; needed where only a photographed geometry is given
  int blades = 2;                    // of a photographed geometry
  double air_density_kg_m3 = 1.225;  // of tables of thrust and torque in N and N m
};

// A folder stands for the files in it; what is none of a propeller is left out with a remark. Throws Error for a file that is damaged, a
// geometry without its diameter, and no geometry at all.
//   r/R c/R beta                 geometry of the UIUC database
//   ... STATION CHORD PITCH ...  APC mould file (PE0)
//   [rotor] radius chord pitch   sections of a blade-element program (ini)
//   property,file,description    geometry as tables of r/R, c/R and twist beside the file
//   RPM CT CP                    static rows;  J CT CP eta: a sweep, its speed at the end of the file's name
//   PROP RPM = ...               APC's own predictions (PER3): printed as such
//   RPM ... T(N);Q(Nm)           a stand's table
PropellerFiles read_propeller_files(const std::vector<std::filesystem::path>& paths, const PropellerFileOptions& options);

}  // namespace rotorloop::propeller
