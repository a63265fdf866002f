// The wake condition of Drela's QPROP Formulation (MIT, June 2006), one element at a time. The blade's circulation
//   Gamma = W c cl / 2
// leaves it in a helix. With the swirl v_t at the blade, averaged over the circle, half of what the wake will have,
//   B Gamma = 4 pi r v_t F sqrt(1 + (4 lambda_w R / (pi B r))^2)
// where the root keeps the circulation of the axis finite and F is Prandtl's tip loss with f = (B/2)(1 - r/R) / lambda_w,
// lambda_w = (r/R) W_a / W_t. Induced velocity stands across W: with undisturbed (U_a, U_t) of length U that puts the tip of W on
// a circle, W_a = (U_a + U sin psi) / 2, W_t = (U_t + U cos psi) / 2, and leaves psi as the one unknown.
#include <cmath>
#include <numbers>

#include "host/base/elementary.hpp"
#include "sim/rotor/reference/blade_side.hpp"
#include "sim/rotor/reference/momentum.hpp"

namespace rotorloop::sim::reference {

WakeVelocity wake_velocity(const BladeSide& side, const ReferenceElement& e, const Wind& wind, int& evaluations) {
  const ReferenceGeometry& g = side.geometry;
  const double ua = wind.climb_m_s, ut = wind.omega_rad_s * e.r_m;
  const double u = std::sqrt(ua * ua + ut * ut);
  struct Velocity {
    double axial, tangential;
  };
  const auto on_circle = [&](double psi) {
    const SinCos s = sincos_exact(psi);
    return Velocity{0.5 * (ua + u * s.sin), 0.5 * (ut + u * s.cos)};
  };
  const auto residual = [&](double psi) {  // rises with psi: more inflow, less circulation, more swirl
    const Velocity w = on_circle(psi);
    const double speed = std::sqrt(w.axial * w.axial + w.tangential * w.tangential);
    const double alpha = e.twist_rad - atan2_exact(w.axial, w.tangential);
    const double reynolds = wind.density_kg_m3 * speed * e.chord_m / side.conventions.viscosity_Pa_s;
    const double mach = side.conventions.compressibility ? speed / side.conventions.sound_speed_m_s : 0.0;
    const double gamma = 0.5 * speed * e.chord_m * e.section({alpha, reynolds, mach}).cl;
    const double lambda = std::fabs(e.r_m / g.radius_m * w.axial / w.tangential) + 1e-12;
    const double f = 0.5 * g.blades * (1.0 - e.r_m / g.radius_m) / lambda;
    const double loss = side.conventions.edge_loss == EdgeLoss::none ? 1.0 : prandtl_share(f);
    const double near_axis = 4.0 * lambda * g.radius_m / (std::numbers::pi * g.blades * e.r_m);
    const double swirl = ut - w.tangential;
    return 4.0 * std::numbers::pi * e.r_m / g.blades * swirl * loss * std::sqrt(1.0 + near_axis * near_axis) - gamma;
  };
  // At psi = atan(Ua/Ut) nothing is induced: a lifting element finds its balance above. A braking one (windmill) finds it between
  // there and the mirrored angle, where the air through the disk has come to rest.
  const double undisturbed = atan2_exact(ua, ut), quarter = 0.5 * std::numbers::pi;
  ++evaluations;
  const Root psi = residual(undisturbed) < 0.0 ? find_root(undisturbed, quarter, residual, evaluations)
                                               : find_root(-undisturbed, undisturbed, residual, evaluations);
  const Velocity w = on_circle(psi.x);
  return {w.axial - ua, ut - w.tangential, psi.found};
}

}  // namespace rotorloop::sim::reference
