// The check of the parameters names what is wrong and what would be right.
#include "firmware/core/node/parameters.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>

#include "firmware/core/node/parameter_store.hpp"
#include "test/unit/firmware/node/esc_rig.hpp"

namespace rotorloop::firmware {
namespace {

std::string offender(const Parameters& p) {
  const auto e = check(p);
  return e ? kParameterRanges[e->index].name : "";
}

TEST(ParameterCheck, DefaultsAreValidWithoutNodeIdAndEscIndex) {
  EXPECT_EQ(offender(Parameters{}), "");
  EXPECT_EQ(offender(valid_parameters()), "");
}

TEST(ParameterCheck, ThereAreAtLeast44ParametersWithDistinctNamesOfAtMost16CharactersAndDefaultsInRange) {
  EXPECT_GE(kParameterRanges.size(), 44u);
  std::set<std::string> names;
  std::set<std::uint32_t> hashes;
  for (const ParameterRange& r : kParameterRanges) {
    EXPECT_LE(std::string(r.name).size(), 16u) << r.name;
    EXPECT_TRUE(names.insert(r.name).second) << r.name;
    EXPECT_TRUE(hashes.insert(parameter_hash(r.name)).second) << r.name;
    EXPECT_LT(r.min, r.max) << r.name;
    const float v = r.get(Parameters{});
    EXPECT_TRUE(v >= r.min && v <= r.max) << r.name;
    // Both ends can be set and read back.
    for (const float end : {r.min, r.max}) {
      Parameters p;
      r.set(p, end);
      EXPECT_EQ(r.get(p), end) << r.name;
    }
  }
}

TEST(ParameterCheck, ValuesOfAStoreOrTheBusAreClampedAndRoundedAndNanIsTheDefault) {
  const ParameterRange& poles = kParameterRanges[find_parameter("pole_pairs")];
  EXPECT_EQ(clamp_parameter(poles, 6.6f), 7.0f);
  EXPECT_EQ(clamp_parameter(poles, 1e30f), 32.0f);
  EXPECT_EQ(clamp_parameter(poles, -5.0f), 1.0f);
  EXPECT_EQ(clamp_parameter(poles, std::nanf("")), 7.0f);
  EXPECT_EQ(clamp_parameter(kParameterRanges[find_parameter("resistance")], 0.0f), 1e-3f);
}

TEST(ParameterCheck, EveryFloatFieldIsRefusedBelowAboveAndAsNaN) {
  struct Row {
    const char* name;
    float Parameters::*field;
  };
  for (const Row& row : {Row{"resistance", &Parameters::resistance_ohm}, Row{"inductance", &Parameters::inductance_H},
                         Row{"flux_linkage", &Parameters::flux_linkage_Wb}, Row{"inertia", &Parameters::inertia_kg_m2},
                         Row{"load", &Parameters::load_N_m_s2}, Row{"phase_limit", &Parameters::phase_current_limit_A},
                         Row{"bus_limit", &Parameters::bus_current_limit_A}, Row{"regen_limit", &Parameters::regen_current_limit_A},
                         Row{"speed_slew", &Parameters::speed_slew_rad_s2}, Row{"max_speed", &Parameters::max_speed_rad_s},
                         Row{"min_speed", &Parameters::min_speed_rad_s}, Row{"undervoltage", &Parameters::undervoltage_V},
                         Row{"overvoltage", &Parameters::overvoltage_V}, Row{"temp_limit", &Parameters::temperature_limit_K}}) {
    for (const float bad : {-1.0f, 1e9f, std::nanf(""), INFINITY}) {
      Parameters p = valid_parameters();
      p.*row.field = bad;
      EXPECT_EQ(offender(p), row.name) << bad;
    }
  }
}

TEST(ParameterCheck, EveryIntegerFieldIsRefusedOutsideItsRange) {
  const auto with = [](auto change) {
    Parameters p = valid_parameters();
    change(p);
    return offender(p);
  };
  EXPECT_EQ(with([](Parameters& p) { p.node_id = 126; }), "node_id");
  EXPECT_EQ(with([](Parameters& p) { p.esc_index = 16; }), "esc_index");
  EXPECT_EQ(with([](Parameters& p) { p.command_timeout_ms = 19; }), "cmd_timeout_ms");
  EXPECT_EQ(with([](Parameters& p) { p.command_timeout_ms = 1001; }), "cmd_timeout_ms");
  EXPECT_EQ(with([](Parameters& p) { p.fast_timeout_ms = 1; }), "fast_timeout_ms");
  EXPECT_EQ(with([](Parameters& p) { p.status_Hz = 1; }), "status_Hz");
  EXPECT_EQ(with([](Parameters& p) { p.pole_pairs = 0; }), "pole_pairs");
}

TEST(ParameterCheck, FeedbackRateMustDivideTheSequenceAndTheNeighboursAreNamed) {
  Parameters p = valid_parameters();
  for (const int rate_Hz : {0, 250, 500, 1000}) {
    p.fast_feedback_Hz = static_cast<std::uint16_t>(rate_Hz);
    EXPECT_FALSE(check(p)) << rate_Hz;
  }
  p.fast_feedback_Hz = 333;
  const auto e = check(p);
  ASSERT_TRUE(e);
  EXPECT_STREQ(kParameterRanges[e->index].name, "fast_feedback_Hz");
  EXPECT_EQ(e->value, 333.0f);
  EXPECT_EQ(e->min, 250.0f);
  EXPECT_EQ(e->max, 500.0f);
}

TEST(ParameterCheck, SpeedLimitsMustAgreeWithPolePairsAndEachOther) {
  Parameters p = valid_parameters();
  p.pole_pairs = 14;  // 1780 rad/s would be 238 000 electrical RPM
  auto e = check(p);
  ASSERT_TRUE(e);
  EXPECT_STREQ(kParameterRanges[e->index].name, "max_speed");
  EXPECT_NEAR(e->max, 1496.0f, 0.1f);
  p = valid_parameters();
  p.max_speed_rad_s = 100.0f;
  e = check(p);
  ASSERT_TRUE(e);
  EXPECT_STREQ(kParameterRanges[e->index].name, "min_speed");
  EXPECT_EQ(e->max, 100.0f);
}

TEST(ParameterCheck, UndervoltageMustLieBelowOvervoltage) {
  Parameters p = valid_parameters();
  p.undervoltage_V = 20.0f;
  p.overvoltage_V = 18.0f;
  const auto e = check(p);
  ASSERT_TRUE(e);
  EXPECT_STREQ(kParameterRanges[e->index].name, "undervoltage");
  EXPECT_EQ(e->max, 18.0f);
}

}  // namespace
}  // namespace rotorloop::firmware
