// Blades of a propeller bend at the root: to first order each flaps about the hub on a spring of stiffness k = 1 / compliance.
//
// With beta = b_0 + b_c cos psi + b_s sin psi at steady speed, inertia and centrifugal force cancel in b_c and b_s: spring and
// aerodynamic damping C (per flapping rate) carry the applied moment, and centrifugal force helps the spring in the cone b_0:
//   k b_c + C omega b_s = M_c,   k b_s - C omega b_c = M_s,   b_0 = M_0 / (k + I omega^2)
// M_c, M_s: what the rigid blade-element model finds at the hub, plus the gyroscopic moment on blades carried along by the
// body, plus the upwash that a coned blade meets as it points into the wind. The hub passes on the spring's moment alone, and
// thrust stands on the tilted disk. Compliance 0 is the rigid rotor. Taken as settled at each step: the slow flapping mode of
// stiff blades, (nu - 1) omega with nu^2 = 1 + k / (I omega^2), lies above 15 Hz over the whole range.
// Source: Bauersfeld et al., NeuroBEM, 2021, eq. (16)-(17); Mahony, Kumar, Corke 2012. A spring of 5.89 N m/rad there.
#include "sim/effects/rotor/blade_motion.hpp"
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

class BladeFlapping final : public Effect {
 public:
  explicit BladeFlapping(const EffectValues& v) : compliance_rad_N_m_(v[0]) {}

  void rotor_loads(const RotorSite& s, RotorLoads& loads) override {
    const RotorCondition& c = s.condition;
    const double half = 0.5 * s.rotor->blades(), mirror = c.spin;  // solved as a counter-clockwise rotor
    const FlappingBlade b = flapping_blade(*s.rotor, c.omega_rad_s, c.density_kg_m3);

    // Per speed of the hub in the direction in which the blade points.
    const double upwash_N_s = b.upwash_N_m_s_m * cone_rad(b, compliance_rad_N_m_, loads.force_R_N.z(), *s.rotor, c.omega_rad_s);

    const Eigen::Vector2d gyroscopic_N_m = blade_gyroscopic_moment_R_N_m(s);
    // About x (lifting the left, half * M_s) and about y (lowering the front, -half * M_c).
    const double x_N_m = mirror * (loads.moment_R_N_m.x() + gyroscopic_N_m.x() + half * upwash_N_s * c.v_R_m_s.y());
    const double y_N_m = loads.moment_R_N_m.y() + gyroscopic_N_m.y() - half * upwash_N_s * c.v_R_m_s.x();

    const double d = compliance_rad_N_m_ * b.damping_N_m_s * c.omega_rad_s;
    const double passed_x_N_m = (x_N_m - d * y_N_m) / (1.0 + d * d), passed_y_N_m = (y_N_m + d * x_N_m) / (1.0 + d * d);
    loads.moment_R_N_m.x() = mirror * passed_x_N_m - gyroscopic_N_m.x();  // which the body has already
    loads.moment_R_N_m.y() = passed_y_N_m - gyroscopic_N_m.y();
    const double tilt_per_moment = compliance_rad_N_m_ / half;
    lean_thrust(loads, {tilt_per_moment * passed_y_N_m, -mirror * tilt_per_moment * passed_x_N_m});
  }

 private:
  double compliance_rad_N_m_;
};

}  // namespace

const EffectInfo kBladeFlapping{.id = "blade_flapping",
                                .parameter = {"compliance_rad_N_m", "rad/(N m)", 0.0, 2.0, 0.0},
                                .options = {},
                                .make = make_effect<BladeFlapping>};

}  // namespace rotorloop::sim
