// The body's principal axes are not the body axes: products of inertia couple roll, pitch and yaw. The parameter is the element
// of the inertia matrix (with its minus sign inside: I_xz = -integral of x z dm).
#include "sim/effects/body/body_list.hpp"
#include "sim/effects/plant_setup.hpp"

namespace rotorloop::sim {
namespace {

class ProductsOfInertia final : public Effect {
 public:
  explicit ProductsOfInertia(const EffectValues& v) : xz_(v[0]), xy_(v[1]), yz_(v[2]) {}
  void prepare(PlantSetup& setup) override {
    Eigen::Matrix3d& I = setup.body.inertia_kg_m2;
    I(0, 2) += xz_;
    I(2, 0) += xz_;
    I(0, 1) += xy_;
    I(1, 0) += xy_;
    I(1, 2) += yz_;
    I(2, 1) += yz_;
  }

 private:
  double xz_, xy_, yz_;
};

constexpr EffectOption kOptions[]{{"I_xy_kg_m2", "kg m^2", -1e-3, 1e-3, 0.0}, {"I_yz_kg_m2", "kg m^2", -1e-3, 1e-3, 0.0}};

}  // namespace

const EffectInfo kProductsOfInertia{.id = "products_of_inertia",
                                    .parameter = {"I_xz_kg_m2", "kg m^2", -1e-3, 1e-3, 0.0},
                                    .options = kOptions,
                                    .make = make_effect<ProductsOfInertia>};

}  // namespace rotorloop::sim
