// Stand against flight: the three verdicts, and what the seed paper's table can show.
#include <gtest/gtest.h>

#include <cmath>

#include "bench/stand/evaluate/report/comparison_document.hpp"

namespace rotorloop::stand {
namespace {

host::VehicleFile paper() {
  return host::read_vehicle(std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "vehicles/paper.toml", host::builtin_effect_catalogue());
}

// The stand of the seed paper is 8 % above flight; its u is assumed to be 1 %.
PairComparison table_1(double correlation) {
  const FlightCoefficient f = flight_coefficient(paper(), correlation);
  return compare_pair({"stand", 1.08 * f.c_t_N_s2, 0.0108 * f.c_t_N_s2}, {"flight", f.c_t_N_s2, f.u_N_s2}, 0.03);
}

TEST(StandComparison, UOfCTFromThePapersK1AndK2Is8p9percentUncorrelated2p9AtMinus0p9And1p0AtMinus0p99) {
  for (const auto& [r, u] : {std::pair{0.0, 0.089}, {-0.9, 0.029}, {-0.99, 0.010}}) {
    const FlightCoefficient f = flight_coefficient(paper(), r);
    EXPECT_NEAR(f.u_N_s2 / f.c_t_N_s2, u, 0.0015) << r;
    EXPECT_NEAR(f.c_t_N_s2, 1.897e-6, 0.002e-6);
  }
}

TEST(StandComparison, EightPercentOfTheSeedPaperIsUndecidedWithoutCorrelationAndDifferentFromMinus0p9On) {
  const PairComparison none = table_1(0.0), some = table_1(-0.9), strong = table_1(-0.99);
  EXPECT_EQ(none.verdict, ComparisonVerdict::cannot_tell);
  EXPECT_NEAR(none.z, 0.9, 0.1);
  EXPECT_NE(verdict_text(none).find("need u < 3.9 %"), std::string::npos) << verdict_text(none);
  EXPECT_EQ(some.verdict, ComparisonVerdict::different);
  EXPECT_NEAR(some.z, 2.6, 0.15);
  EXPECT_EQ(strong.verdict, ComparisonVerdict::different);
  EXPECT_NEAR(strong.z, 5.4, 0.4);
}

TEST(StandComparison, HalfAPercentApartWithUOf0p6percentIsEquivalentWithin3percent) {
  const PairComparison p = compare_pair({"a", 1.005, 0.006}, {"b", 1.0, 0.006}, 0.03);
  EXPECT_EQ(p.verdict, ComparisonVerdict::equivalent);
  EXPECT_LT(p.e_n, 1.0);
}

TEST(StandComparison, DifferenceThatIsSignificantAndBelowTheMarginIsEquivalentAndSaidToBeSignificant) {
  const PairComparison p = compare_pair({"a", 1.01, 0.002}, {"b", 1.0, 0.002}, 0.03);
  EXPECT_EQ(p.verdict, ComparisonVerdict::equivalent);
  EXPECT_TRUE(p.significant);
}

TEST(StandComparison, ScaleThatBothShareCancels) {
  const PairComparison apart = compare_pair({"a", 1.02, 0.01}, {"b", 1.0, 0.01}, 0.03),
                       shared = compare_pair({"a", 1.02, 0.01}, {"b", 1.0, 0.01}, 0.03, 0.008);
  EXPECT_GT(shared.z, 1.5 * apart.z);
}

TEST(StandComparison, NamedUIsWhatItTakesToDecide) {
  const PairComparison p = compare_pair({"a", 1.04, 0.02}, {"b", 1.0, 0.02}, 0.03);
  ASSERT_EQ(p.verdict, ComparisonVerdict::cannot_tell);
  const double each = 0.99 * p.needed_u / std::sqrt(2.0);
  EXPECT_NE(compare_pair({"a", 1.04, 1.04 * each}, {"b", 1.0, each}, 0.03).verdict, ComparisonVerdict::cannot_tell);
}

// Four rotors that hover at 900 rad/s with c_t = 2e-6: 50 Hz poses with a slow bob of 5 mm.
log::FlightRecord hovering(double c_t, double mass_kg) {
  log::FlightRecord f;
  const double squares = mass_kg * 9.80665 / c_t / 4.0;
  for (int i = 0; i < 2000; ++i) {
    const double t = 0.02 * i, bob = 0.005 * std::sin(2.0 * t), acceleration = -4.0 * bob;
    log::PoseReading p;
    p.p_W_m = {0.0, 0.0, 1.0 + bob};
    f.pose.add(t, p);
    const double w = i < 200 ? 100.0 : std::sqrt(squares * (1.0 + acceleration / 9.80665));
    f.rotor_omega_rad_s.add(t, {w, w, w, w});
  }
  return f;
}

TEST(StandComparison, HoverGivesCTOfMassAndRotorSpeedTo0p3percentAndLeavesTheGroundOut) {
  const auto h = hover_coefficient({hovering(2e-6, 0.68)}, {.mass_kg = 0.68, .mass_u_kg = 0.001, .air_density_kg_m3 = 1.2});
  ASSERT_TRUE(h);
  EXPECT_NEAR(h->c_t_N_s2, 2e-6, 0.006e-6);
  EXPECT_GE(h->u_N_s2 / h->c_t_N_s2, 0.001 / 0.68);
  EXPECT_FALSE(hover_coefficient({}, {.mass_kg = 0.68}));
}

}  // namespace
}  // namespace rotorloop::stand
