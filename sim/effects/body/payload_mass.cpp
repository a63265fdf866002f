// A load fixed to the body that the vehicle file does not know of: mass, centre of mass and inertia change together (Steiner's
// theorem about the new centre of mass; the load itself is small). In hover it is a thrust error in proportion to all rotors.
#include "sim/effects/body/body_list.hpp"
#include "sim/effects/plant_setup.hpp"

namespace rotorloop::sim {
namespace {

// Inertia of mass m at r about the origin.
Eigen::Matrix3d point_inertia(double mass_kg, const Eigen::Vector3d& r_m) {
  return mass_kg * (r_m.squaredNorm() * Eigen::Matrix3d::Identity() - r_m * r_m.transpose());
}

void payload_mass(const EffectValues& v, PlantSetup& setup) {
  const double mass_kg = v[0];
  const Eigen::Vector3d at_m(v[1], v[2], v[3]);  // from the geometric centre
  AirframeConfig& b = setup.body;
  const double total_kg = b.mass_kg + mass_kg;
  const Eigen::Vector3d com_m = (b.mass_kg * b.com_offset_m + mass_kg * at_m) / total_kg;
  b.inertia_kg_m2 += point_inertia(b.mass_kg, b.com_offset_m - com_m) + point_inertia(mass_kg, at_m - com_m);
  b.mass_kg = total_kg;
  // The pose sensor keeps its place on the body; its offset counts from the centre of mass.
  setup.pose.offset_B_m += b.com_offset_m - com_m;
  b.com_offset_m = com_m;
}

constexpr EffectOption kPayloadMassOptions[]{{"x_m", "m", -0.3, 0.3, 0.0}, {"y_m", "m", -0.3, 0.3, 0.0}, {"z_m", "m", -0.3, 0.3, -0.04}};

}  // namespace

const EffectInfo kPayloadMass{
    .id = "payload_mass", .parameter = {"mass_kg", "kg", 0.0, 0.5, 0.0}, .options = kPayloadMassOptions, .make = effect_of<payload_mass>};

}  // namespace rotorloop::sim
