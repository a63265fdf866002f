// The centre of mass is not where the vehicle file has it: every rotor's arm changes by the same vector, so thrust makes a
// moment (1.4 mm under the reference vehicle's weight: 9.4 mN m). Mass and inertia about the centre of mass stay.
#include "sim/effects/body/body_list.hpp"
#include "sim/effects/plant_setup.hpp"

namespace rotorloop::sim {
namespace {

void com_offset(const EffectValues& v, PlantSetup& setup) {
  const Eigen::Vector3d shift_m(v[0], v[1], v[2]);
  setup.body.com_offset_m += shift_m;
  setup.pose.offset_B_m -= shift_m;  // the sensor keeps its place on the body
}

constexpr EffectOption kComOffsetOptions[]{{"dy_m", "m", -0.05, 0.05, 0.0}, {"dz_m", "m", -0.05, 0.05, 0.0}};

}  // namespace

const EffectInfo kComOffset{
    .id = "com_offset", .parameter = {"dx_m", "m", -0.05, 0.05, 0.0}, .options = kComOffsetOptions, .make = effect_of<com_offset>};

}  // namespace rotorloop::sim
