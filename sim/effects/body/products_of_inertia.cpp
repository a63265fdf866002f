// The body's principal axes are not the body axes: products of inertia couple roll, pitch and yaw. The parameter is the element
// of the inertia matrix (with its minus sign inside: I_xz = -integral of x z dm).
#include "sim/effects/body/body_list.hpp"
#include "sim/effects/plant_setup.hpp"

namespace rotorloop::sim {
namespace {

void products_of_inertia(const EffectValues& v, PlantSetup& setup) {
  const double xz = v[0], xy = v[1], yz = v[2];
  Eigen::Matrix3d& I = setup.body.inertia_kg_m2;
  I(0, 2) += xz;
  I(2, 0) += xz;
  I(0, 1) += xy;
  I(1, 0) += xy;
  I(1, 2) += yz;
  I(2, 1) += yz;
}

constexpr EffectOption kProductsOfInertiaOptions[]{{"I_xy_kg_m2", "kg m^2", -1e-3, 1e-3, 0.0}, {"I_yz_kg_m2", "kg m^2", -1e-3, 1e-3, 0.0}};

}  // namespace

const EffectInfo kProductsOfInertia{.id = "products_of_inertia",
                                    .parameter = {"I_xz_kg_m2", "kg m^2", -1e-3, 1e-3, 0.0},
                                    .options = kProductsOfInertiaOptions,
                                    .make = effect_of<products_of_inertia>};

}  // namespace rotorloop::sim
