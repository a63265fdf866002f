// The three balances between blades and air, chosen by the conventions.
#include "sim/rotor/reference/reference_rotor.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/error.hpp"
#include "sim/rotor/prandtl.hpp"  // kSheetSpread, a constant of the model
#include "sim/rotor/reference/blade_side.hpp"
#include "sim/rotor/reference/momentum.hpp"

namespace rotorloop::sim {
namespace {
using reference::BladeSide;
using reference::find_root;
using reference::Root;
using reference::StripLoads;
using reference::sum;
using reference::Wind;

constexpr double kPi = std::numbers::pi;

// Induced velocity beyond which all flow comes from one side of the disk, so that the residual's sign is known.
double far_m_s(const ReferenceGeometry& g, const Wind& w) {
  return 2.0 * (std::fabs(w.climb_m_s) + w.edgewise_m_s + g.radius_m * (std::fabs(w.omega_rad_s) + w.rate_rad_s.norm())) + 1e-3;
}

struct AnnulusFlow {
  double swirl_m_s, loss;
};
AnnulusFlow annulus_flow(const BladeSide& side, const ReferenceElement& e, const Wind& wind, double v) {
  const RotorConventions& c = side.conventions;
  const ReferenceGeometry& g = side.geometry;
  const double through = wind.climb_m_s + v, tip = wind.omega_rad_s * e.r_m;
  const double through2 = through * through, tip2 = tip * tip;
  AnnulusFlow f{0.0, 1.0};
  if (c.swirl && through2 + tip2 > 0.0) f.swirl_m_s = v * through * tip / (through2 + tip2);
  if (c.edge_loss == EdgeLoss::none) return f;
  // Sine of the angle at which the vortex sheets leave.
  const double sheets2 = through2 + (c.sheet_spread ? kSheetSpread * v * v : 0.0) + 1e-12;
  const double sine = std::sqrt(sheets2 / (tip2 + 0.5 * wind.edgewise_m_s * wind.edgewise_m_s + sheets2));
  f.loss = prandtl_share(0.5 * g.blades * (g.radius_m - e.r_m) / (e.r_m * sine));
  if (c.edge_loss == EdgeLoss::tip_and_root) f.loss *= prandtl_share(0.5 * g.blades * (e.r_m - g.hub_radius_m) / (g.hub_radius_m * sine));
  return f;
}

void set_status(const ReferenceGeometry& g, const Wind& wind, double ring_share, int evaluations, bool found, RotorLoads& loads) {
  loads.iterations = evaluations;
  const double through = wind.climb_m_s + loads.induced_m_s;
  if (!found)
    loads.status = InflowStatus::not_converged;
  else if (wind.omega_rad_s * g.radius_m < 1.0)
    loads.status = InflowStatus::stopped;
  else if (ring_share > 0.5)
    loads.status = InflowStatus::vortex_ring;
  else if (loads.shaft_torque_N_m < 0.0 || loads.force_R_N.z() * through < 0.0)
    loads.status = InflowStatus::windmill;
}

ReferenceSolution solve_annular(const BladeSide& side, const Wind& wind) {
  std::vector<StripLoads> strips;
  double ring_area = 0.0, area = 0.0;
  int most = 0;
  bool found = true;
  const double far = far_m_s(side.geometry, wind);
  for (const ReferenceElement& e : side.geometry.elements) {
    int evaluations = 0;
    const double air = 4.0 * kPi * wind.density_kg_m3 * e.r_m * e.width_m;  // dT = air * F v U
    const auto residual = [&](double v) {
      const AnnulusFlow flow = annulus_flow(side, e, wind, v);
      const double U = reference_mass_flow(v, wind.climb_m_s, wind.edgewise_m_s, side.conventions.descent).speed_m_s;
      return air * flow.loss * v * U - side.strip(e, wind, v, flow.swirl_m_s).thrust_N;
    };
    const auto [v, balanced] = find_root(-far, far, residual, evaluations);
    found = found && balanced;
    strips.push_back(side.strip(e, wind, v, annulus_flow(side, e, wind, v).swirl_m_s));
    const double ring = reference_mass_flow(v, wind.climb_m_s, wind.edgewise_m_s, side.conventions.descent).ring;
    ring_area += e.r_m * e.width_m * ring;
    area += e.r_m * e.width_m;
    most = std::max(most, evaluations);
  }
  ReferenceSolution s = sum(side.geometry, side.conventions, wind, strips);
  set_status(side.geometry, wind, ring_area / area, most, found, s.loads);
  return s;
}

ReferenceSolution uniform_at(const BladeSide& side, const Wind& wind, double v) {
  std::vector<StripLoads> strips;
  for (const ReferenceElement& e : side.geometry.elements)
    strips.push_back(side.strip(e, wind, v, annulus_flow(side, e, wind, v).swirl_m_s));
  return sum(side.geometry, side.conventions, wind, strips);
}

Root uniform_root(const BladeSide& side, const Wind& wind, Descent descent, int& evaluations) {
  const double far = far_m_s(side.geometry, wind), area = kPi * side.geometry.radius_m * side.geometry.radius_m;
  const auto residual = [&](double v) {
    double thrust_N = 0.0;
    for (const ReferenceElement& e : side.geometry.elements)
      thrust_N += side.strip(e, wind, v, annulus_flow(side, e, wind, v).swirl_m_s).thrust_N;
    return 2.0 * wind.density_kg_m3 * area * v * reference_mass_flow(v, wind.climb_m_s, wind.edgewise_m_s, descent).speed_m_s - thrust_N;
  };
  return find_root(-far, far, residual, evaluations);
}

ReferenceSolution solve_uniform(const BladeSide& side, const Wind& wind) {
  int evaluations = 0;
  const Descent descent = side.conventions.descent;
  auto [v, found] = uniform_root(side, wind, descent, evaluations);
  double ring = 0.0;
  if (descent == Descent::ring) ring = reference_mass_flow(v, wind.climb_m_s, wind.edgewise_m_s, descent).ring;
  if (descent == Descent::quartic && wind.climb_m_s < 0.0 && v > 0.0 && -wind.climb_m_s < 2.0 * v) {
    Wind hover = wind;
    hover.climb_m_s = 0.0;
    const double vh = uniform_root(side, hover, Descent::momentum, evaluations).x;
    v = std::min(std::max(v, vh * descent_quartic(wind.climb_m_s / vh)), 2.0 * vh);
    ring = 1.0;
  }
  ReferenceSolution s = uniform_at(side, wind, v);
  set_status(side.geometry, wind, ring, evaluations, found, s.loads);
  return s;
}

ReferenceSolution solve_circulation(const BladeSide& side, const Wind& wind) {
  if (wind.edgewise_m_s > 1e-9 || wind.rate_rad_s.norm() > 1e-9 || wind.climb_m_s < 0.0)
    throw Error({"reference rotor", "the circulation form was given edgewise flow, a body rate or a descent",
                 "its helical wake is that of a rotor in axial flow from above",
                 "use Inflow::annular, or set in-plane velocity and rates to zero and the climb to at least zero"});
  std::vector<StripLoads> strips;
  int most = 0;
  bool found = true;
  for (const ReferenceElement& e : side.geometry.elements) {
    int evaluations = 0;
    const auto v = reference::wake_velocity(side, e, wind, evaluations);
    strips.push_back(side.strip(e, wind, v.axial_m_s, v.swirl_m_s));
    found = found && v.found;
    most = std::max(most, evaluations);
  }
  ReferenceSolution s = sum(side.geometry, side.conventions, wind, strips);
  set_status(side.geometry, wind, 0.0, most, found, s.loads);
  return s;
}
}  // namespace

ReferenceRotor::ReferenceRotor(ReferenceGeometry geometry, const RotorConventions& conventions, int azimuths)
    : geometry_(std::move(geometry)), conventions_(conventions), azimuths_(azimuths) {
  const auto refuse = [](const char* what, const char* remedy) { throw Error({"reference rotor", what, "", remedy}); };
  if (geometry_.elements.empty()) refuse("there are no blade elements", "give at least one");
  if (azimuths < 4) refuse("fewer than four azimuths", "use 64; 4 are enough in axial flow");
  if (conventions.descent == Descent::quartic && conventions.inflow != Inflow::uniform)
    refuse("the descent quartic corrects one velocity of the whole disk", "use it with Inflow::uniform, or Descent::ring");
}

double ReferenceRotor::disk_area_m2() const { return kPi * geometry_.radius_m * geometry_.radius_m; }

ReferenceSolution ReferenceRotor::solve(const RotorCondition& condition) const {
  const BladeSide side{geometry_, conventions_, azimuths_};
  const Wind wind = reference::wind_of(condition);
  switch (conventions_.inflow) {
    case Inflow::uniform:
      return solve_uniform(side, wind);
    case Inflow::circulation:
      return solve_circulation(side, wind);
    case Inflow::annular:
      break;
  }
  return solve_annular(side, wind);
}

ReferenceSolution ReferenceRotor::at_induced(const RotorCondition& condition, double induced_m_s) const {
  const BladeSide side{geometry_, conventions_, azimuths_};
  return uniform_at(side, reference::wind_of(condition), induced_m_s);
}

}  // namespace rotorloop::sim
