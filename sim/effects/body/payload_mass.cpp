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

class PayloadMass final : public Effect {
 public:
  explicit PayloadMass(const EffectValues& v) : mass_kg_(v[0]), at_m_(v[1], v[2], v[3]) {}
  void prepare(PlantSetup& setup) override {
    AirframeConfig& b = setup.body;
    const double total_kg = b.mass_kg + mass_kg_;
    const Eigen::Vector3d com_m = (b.mass_kg * b.com_offset_m + mass_kg_ * at_m_) / total_kg;
    b.inertia_kg_m2 += point_inertia(b.mass_kg, b.com_offset_m - com_m) + point_inertia(mass_kg_, at_m_ - com_m);
    b.mass_kg = total_kg;
    // The pose sensor keeps its place on the body; its offset counts from the centre of mass.
    setup.pose.offset_B_m += b.com_offset_m - com_m;
    b.com_offset_m = com_m;
  }

 private:
  double mass_kg_;
  Eigen::Vector3d at_m_;  // from the geometric centre
};

constexpr EffectOption kOptions[]{{"x_m", "m", -0.3, 0.3, 0.0}, {"y_m", "m", -0.3, 0.3, 0.0}, {"z_m", "m", -0.3, 0.3, -0.04}};

}  // namespace

const EffectInfo kPayloadMass{
    .id = "payload_mass", .parameter = {"mass_kg", "kg", 0.0, 0.5, 0.0}, .options = kOptions, .make = make_effect<PayloadMass>};

}  // namespace rotorloop::sim
