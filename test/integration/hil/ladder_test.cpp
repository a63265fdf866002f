// The ladder that the seed paper reports, flown with one seed of the shipped scenario: every step of model knowledge pays.
#include <gtest/gtest.h>

#include "bench/hil/flight/flight.hpp"

namespace rotorloop::test {
namespace {

class Ladder : public testing::Test {
 protected:
  hil::FlightResult flown(const std::string& flight, host::Variant variant) {
    hil::FlightRequest request{.flight = 0, .variant = variant, .seed = 1, .folder = {}};
    while (scenario_.flights.at(request.flight).name != flight) ++request.flight;
    hil::FlightResult result = hil::fly(scenario_, inputs_, request, nullptr, {}, nullptr).result;
    EXPECT_EQ(result.end, hil::FlightEnd::completed) << flight << ": " << result.end_detail;
    RecordProperty(flight + "_" + std::string(hil::variant_name(variant)) + "_mm",
                   static_cast<int>(10.0 * result.tracking.truth.mean_3d_cm));
    return result;
  }
  hil::Scenario scenario_ = hil::read_scenario(std::string(ROTORLOOP_SOURCE_DIR) + "/scenarios/paper.toml");
  hil::Inputs inputs_ = hil::read_inputs(scenario_);
};

// Fig. 9: drag compensation, then thrust by flight state, each shrink the error; four centimetres are left, 60 % are gone.
TEST_F(Ladder, HorizontalErrorFallsWithEveryStepToFourCentimetres) {
  const double plain_cm = flown("horizontal", host::Variant::pd_ff).tracking.truth.mean_3d_cm;
  const double drag_cm = flown("horizontal", host::Variant::pd_ff_drag).tracking.truth.mean_3d_cm;
  const double full_cm = flown("horizontal", host::Variant::pd_ff_thrust_drag).tracking.truth.mean_3d_cm;
  EXPECT_GT(plain_cm, drag_cm);
  EXPECT_GT(drag_cm, full_cm);
  EXPECT_LE(full_cm, 4.0);
  EXPECT_GE(100.0 * (1.0 - full_cm / plain_cm), 60.0) << plain_cm << " cm, " << drag_cm << " cm, " << full_cm << " cm";
}

// Fig. 10: climb and descent are a matter of thrust; the vertical error shrinks to about a centimetre.
TEST_F(Ladder, VerticalErrorFallsToOneCentimetre) {
  const double plain_cm = flown("vertical", host::Variant::pd_ff).tracking.truth.mean_z_cm;
  const double full_cm = flown("vertical", host::Variant::pd_ff_thrust_drag).tracking.truth.mean_z_cm;
  EXPECT_GT(plain_cm, 2.0 * full_cm);
  EXPECT_LE(full_cm, 1.1);
}

}  // namespace
}  // namespace rotorloop::test
