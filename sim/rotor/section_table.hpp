// Section data prepared for the solve: the force on a blade section by direction of the flow and Reynolds number, so that a lookup
// costs a division and six multiplications, with no trigonometry (libm differs between CPUs).
// Lift and drag are turned by the twist and the inflow angle when the table is made: it is looked up with the flow in disk axes (t
// against the blade's motion, u down through the disk) and holds the force coefficients up, along the thrust, and against rotation.
// Direction is the "diamond angle" p of the flow, p = u / (|t| + |u|), continued to +-2 where t < 0. It rises with the inflow angle,
// is 0, 1, +-2, -1 at 0, 90, +-180, -90 degrees, and is exact: table nodes are placed at the true angle of each p.
#pragma once
#include <vector>

#include "sim/rotor/polar.hpp"

namespace rotorloop::sim {

// Force coefficients, over rho/2 speed^2 chord, side by side: both are interpolated at once.
struct alignas(16) SectionForce {
  double up;    // along the thrust
  double drag;  // against rotation
};

struct SectionTable {
  static constexpr int kDirections = 1022;  // cells over p in [-2, 2]: 0.22 degrees at zero inflow angle
  static constexpr int kStride = 1024;      // nodes of a row: 1023 and a copy of the last, so that p = 2 needs no clamp
  static constexpr int kRows = 19;          // Reynolds rows; with 20e3 to 200e3 a row every 10e3
  double reynolds_min = 0.0;
  double reynolds_step = 1.0;
  std::vector<SectionForce> nodes;  // kRows x kStride

  const SectionForce* row(int index) const { return nodes.data() + static_cast<std::ptrdiff_t>(index) * kStride; }
};

// Two-dimensional polars fall short on a blade: rotation thins the boundary layer of the inner sections and delays their stall.
// Snel, Houwink & Bosschers (1993): the lift moves towards 2 pi sin(alpha - alpha_0) by the share tanh(3 (c/r)^2). The factor 3 is
// theirs, not fitted to propellers. Their data end at 30 degrees; here the correction is whole to 15 and fades out to 60, which is
// gentle enough for the annulus balance to stay single-valued (a steep fall of lift would give it a second solution).
constexpr double kSnelFactor = 3.0;
constexpr double kSnelFullTo_deg = 15.0, kSnelEnd_deg = 60.0;

// The formula is silent about drag. The air of a separated region pushes at right angles to the chord, so that lift regained by
// delta cl brings delta cd = delta cl tan(alpha); Chaviaropoulos & Hansen (J. Fluids Eng. 122, 2000) find lift and drag to rise
// together too. `stall_drag` is the share of it that counts: 0 (the published formula alone) to 1. Measured: decision 0025.
struct SectionCorrection {
  double stall_delay_share = 0.0;
  double stall_drag = 0.0;
  double drag_scale = 1.0;
  double lift_scale = 1.0;  // after the stall delay
};

// Between two polars of neighbouring stations (weight 0 is `a`, 1 is `b`), chord line `twist_deg` above the disk plane; the default
// correction gives the polars as they are.
SectionTable prepare_section(const Polar& a, const Polar& b, double weight, double twist_deg = 0.0, SectionCorrection correction = {});

// Angle in degrees of a diamond angle in [-2, 2].
double angle_of_direction_deg(double p);

// One lookup as the solve does it, for tests and the disk map.
SectionForce lookup(const SectionTable& table, double p, double reynolds);

}  // namespace rotorloop::sim
