// What follows from a model's values: of a vehicle whose numbers can be checked on paper, with and without added terms.
#include "bench/sysid/identify/derived.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "host/vehicle/thrust.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::identify {
namespace {

host::VehicleModel paper() {
  return host::to_model(host::read_vehicle(std::string(ROTORLOOP_SOURCE_DIR) + "/vehicles/paper.toml", host::builtin_effect_catalogue()));
}

// The quantity of the paper's vehicle with one term at a value, of a fit that estimated nothing.
double derived(std::string_view id, std::string_view term = {}, double value = 0.0, double speed_m_s = 8.5) {
  host::TermList terms;
  if (!term.empty()) terms.add(*host::find_term(term));
  estimate::Fit fit;
  fit.values = {estimate::model_values(paper(), terms)};
  fit.covariance = fit.robust_covariance = Eigen::MatrixXd(0, 0);
  if (!term.empty()) fit.values.front()[estimate::kCoreParameters] = value;
  for (const DerivedQuantity& d : derived_quantities(fit, paper(), speed_m_s)) {
    if (d.id == id) return d.value;
  }
  ADD_FAILURE() << id;
  return 0.0;
}

double hover_rad_s() { return derived("hover_speed") * std::numbers::pi / 30.0; }

TEST(Derived, HoverOfThePapersEquationsIsThatOfTheStaticThrust) { EXPECT_NEAR(hover_rad_s(), host::hover_omega_rad_s(paper()), 1e-6); }

TEST(Derived, DragOfThePapersEquationsIsRotorDragAtTheWeightAndAirframeDrag) {
  const host::VehicleModel m = paper();
  EXPECT_NEAR(derived("total_drag"), m.weight_N() * m.drag.c_dh_s_m * 8.5 + m.drag.c_dxy_N_s2_m2 * 8.5 * 8.5, 1e-9);
}

TEST(Derived, DragHoldsWhatATermAddsToIt) {
  const double k_d = 2e-5, v = 0.5;  // slow enough for the rotor speed to be that of hover
  const double more = derived("total_drag", "rotor_drag_with_speed", k_d, v) - derived("total_drag", {}, 0.0, v);
  EXPECT_NEAR(more, host::kRotors * k_d * hover_rad_s() * v, 0.005 * more);
}

TEST(Derived, ALossOfThrustAmongNeighboursTurnsTheRotorsFasterInHover) {
  EXPECT_NEAR(derived("hover_speed", "hover_interference", 0.05) / derived("hover_speed"), 1.0 / std::sqrt(0.95), 2e-3);
}

TEST(Derived, AShareOfTheClimbSpeedThatIsNotFeltDampsTheClimbLess) {
  EXPECT_LT(derived("thrust_by_climb"), 0.0);
  EXPECT_NEAR(derived("thrust_by_climb", "axial_inflow", 0.5) / derived("thrust_by_climb"), 0.5, 1e-3);
}

TEST(Derived, ParametersOfTermsAreNamedAfterTheirTerm) {
  host::TermList terms;
  terms.add(*host::find_term("rotor_local_inflow"));
  terms.add(*host::find_term("translational_lift"));
  EXPECT_EQ(estimate::parameter_info(estimate::kCoreParameters, terms).symbol, "rotor_local_inflow.share");
  EXPECT_EQ(estimate::parameter_info(estimate::kCoreParameters + 1, terms).symbol, "translational_lift.share");
  EXPECT_EQ(estimate::find_parameter("translational_lift.share", terms), estimate::kCoreParameters + 1);
  EXPECT_EQ(estimate::find_parameter("share", terms), -1) << "two terms have one";
}

}  // namespace
}  // namespace rotorloop::identify
