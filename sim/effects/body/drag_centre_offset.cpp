// Parasitic drag does not act at the centre of mass: a battery on top lifts the point where it acts, a camera moves it forward.
// Moment r x F_drag with the drag of the rigid body itself (sim/airframe/parasitic_drag.hpp), whose force stays.
// Source: statics. With 20 mm and the 0.40 N of 8.5 m/s: 8 mN m.
#include <Eigen/Geometry>

#include "sim/effects/body/body_list.hpp"
#include "sim/effects/plant_setup.hpp"

namespace rotorloop::sim {
namespace {

class DragCentreOffset final : public Effect {
 public:
  explicit DragCentreOffset(const EffectValues& v) : r_B_m_(v[1], v[2], v[0]) {}
  void prepare(PlantSetup& setup) override { drag_ = setup.body.drag(); }
  void body_loads(const BodyMotion& m, Wrench& w) const override {
    w.moment_B_N_m += r_B_m_.cross(drag_.force_B_N(m.v_air_B_m_s, m.density_kg_m3));
  }

 private:
  Eigen::Vector3d r_B_m_;  // from the centre of mass
  ParasiticDrag drag_;
};

constexpr EffectOption kDragCentreOffsetOptions[] = {{"x_m", "m", -0.05, 0.05, 0.0}, {"y_m", "m", -0.05, 0.05, 0.0}};

}  // namespace

const EffectInfo kDragCentreOffset{.id = "drag_centre_offset",
                                   .parameter = {"z_m", "m", -0.05, 0.05, 0.0},
                                   .options = kDragCentreOffsetOptions,
                                   .make = make_effect<DragCentreOffset>};

}  // namespace rotorloop::sim
