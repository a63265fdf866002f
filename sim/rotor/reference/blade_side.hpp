// The blades' side of the balance: what one element feels and gives, averaged over azimuth, at a given induced velocity.
// Internal to sim/rotor/reference.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "sim/rotor/reference/conventions.hpp"
#include "sim/rotor/reference/geometry.hpp"

namespace rotorloop::sim::reference {

// A condition for a rotor that turns counter-clockwise seen from above; the other sense is solved as its mirror image.
struct Wind {
  double omega_rad_s, climb_m_s, edgewise_m_s, density_kg_m3;
  Eigen::Vector2d hub_m_s;         // in-plane hub velocity through the air
  Eigen::Vector2d rate_rad_s;      // body rate about x, y
  Eigen::Vector2d edge_direction;  // unit, or zero without edgewise flow
  double mirror;                   // -1: y forces and x moments change sign
};
Wind wind_of(const RotorCondition& condition);

// Loads of one element on the hub, all blades, averaged over azimuth.
struct StripLoads {
  double thrust_N = 0.0, torque_N_m = 0.0;
  Eigen::Vector2d in_plane_N = Eigen::Vector2d::Zero();
  Eigen::Vector2d moment_N_m = Eigen::Vector2d::Zero();
  ReferenceStation mean{};
};

struct BladeSide {
  const ReferenceGeometry& geometry;
  const RotorConventions& conventions;
  int azimuths;

  // induced: along -z; swirl: of the air in the sense of rotation.
  StripLoads strip(const ReferenceElement& e, const Wind& wind, double induced_m_s, double swirl_m_s) const;
};

struct Root {
  double x;
  bool found;  // false: the residual has one sign at both ends; x is the end where it is smaller
};

// Zero of a function that is negative at `low` and positive at `high`: false position in the Illinois form, with a bisection every
// third step. Adds to `evaluations`.
template <class Residual>
Root find_root(double low, double high, Residual residual, int& evaluations) {
  double at_low = residual(low), at_high = residual(high);
  evaluations += 2;
  if (!(at_low <= 0.0 && at_high >= 0.0)) return {at_low > 0.0 ? low : high, false};
  int side = 0;
  for (int i = 0; i < 200 && high - low > 1e-13 * (1.0 + (low < 0 ? -low : low) + (high < 0 ? -high : high)); ++i) {
    // Every third step halves the bracket, so that a kink cannot stall the search.
    const double trial = i % 3 == 2 ? 0.5 * (low + high) : (low * at_high - high * at_low) / (at_high - at_low);
    const double x = trial > low && trial < high ? trial : 0.5 * (low + high);
    const double y = residual(x);
    ++evaluations;
    if (y == 0.0) return {x, true};
    if (y < 0.0) {
      low = x;
      at_low = y;
      if (side == -1) at_high *= 0.5;
      side = -1;
    } else {
      high = x;
      at_high = y;
      if (side == 1) at_low *= 0.5;
      side = 1;
    }
  }
  return {0.5 * (low + high), true};
}

ReferenceSolution sum(const ReferenceGeometry& geometry, const RotorConventions& conventions, const Wind& wind,
                      const std::vector<StripLoads>& strips);

// One element of the wake condition (circulation.cpp): induced axial velocity and swirl.
struct WakeVelocity {
  double axial_m_s, swirl_m_s;
  bool found;
};
WakeVelocity wake_velocity(const BladeSide& side, const ReferenceElement& e, const Wind& wind, int& evaluations);

}  // namespace rotorloop::sim::reference
