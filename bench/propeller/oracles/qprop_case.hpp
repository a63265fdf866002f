// QPROP's own files: a propeller definition (.def) and the listing that the program prints. Formats as of QPROP 1.22.
#pragma once
#include <filesystem>
#include <vector>

#include "sim/rotor/reference/reference_rotor.hpp"

namespace rotorloop::propeller {

struct QpropStation {
  double r_m, chord_m, beta_deg, cl, cd, reynolds, mach, axial_m_s;
};
// One operating point.
struct QpropListing {
  double density_kg_m3, viscosity_Pa_s, sound_speed_m_s;
  double speed_m_s, rpm, thrust_N, torque_N_m;
  std::vector<QpropStation> stations;
};
// The radius behind the number of blades is not read: QPROP 1.22 ends the blade at the last station, as its listing shows (stations
// and advance ratio of CAM 6x3 belong to 3.00 in, its file says 3.05 in).
struct QpropDefinition {
  int blades;
  sim::QpropPolar polar;
  std::vector<double> r_m, chord_m, beta_deg;  // as given, scaled to SI
};

// Throw Error naming file and line.
QpropDefinition read_qprop_definition(const std::filesystem::path& path);
QpropListing read_qprop_listing(const std::filesystem::path& path);

// Interpolating cubic spline with zero third derivative at both ends.
class CubicSpline {
 public:
  CubicSpline(std::vector<double> x, std::vector<double> y);  // at least three points, x rising
  double operator()(double x) const;

 private:
  std::vector<double> x_, y_, slope_;
};

// `elements` strips of equal width from the first station to the last, as QPROP divides a blade.
sim::ReferenceGeometry qprop_geometry(const QpropDefinition& definition, int elements);

}  // namespace rotorloop::propeller
