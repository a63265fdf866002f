// The centre of mass is not where the vehicle file believes it: every rotor's arm changes by the same vector, so thrust makes a
// moment (1.4 mm under the reference vehicle's weight: 9.4 mN m). Mass and inertia about the centre of mass stay.
#include "sim/effects/body/body_list.hpp"
#include "sim/effects/plant_setup.hpp"

namespace rotorloop::sim {
namespace {

class ComOffset final : public Effect {
 public:
  explicit ComOffset(const EffectValues& v) : shift_m_(v[0], v[1], v[2]) {}
  void prepare(PlantSetup& setup) override {
    setup.body.com_offset_m += shift_m_;
    setup.pose.offset_B_m -= shift_m_;  // the sensor keeps its place on the body
  }

 private:
  Eigen::Vector3d shift_m_;
};

constexpr EffectOption kOptions[]{{"dy_m", "m", -0.05, 0.05, 0.0}, {"dz_m", "m", -0.05, 0.05, 0.0}};

}  // namespace

const EffectInfo kComOffset{
    .id = "com_offset", .parameter = {"dx_m", "m", -0.05, 0.05, 0.0}, .options = kOptions, .make = make_effect<ComOffset>};

}  // namespace rotorloop::sim
