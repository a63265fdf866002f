// Labelled defects and unlike flights of measured Crazyflies, from motor commands and battery voltage alone: which rotor, which kind,
// what is confused with what. Skipped without ROTORLOOP_DATA.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "bench/studies/command_thrust.hpp"
#include "bench/studies/hover_shares.hpp"
#include "test/unit/bench/identify/measured_flights.hpp"

namespace rotorloop::studies {
namespace {

using identify::testing::flights_of;
using identify::testing::read_measured;

#define NEED_DATA() \
  if (identify::testing::measured_flights().empty()) GTEST_SKIP() << "ROTORLOOP_DATA is not set"

struct CrazyPad {
  std::vector<log::FlightRecord> normal_e8, normal_e9, defect;
  host::VehicleModel vehicle;
};
CrazyPad crazypad() {
  CrazyPad c;
  for (const auto& file : flights_of("crazypad_faults")) {
    auto m = read_measured(file);
    c.vehicle = m.vehicle;
    const std::string& n = m.record.name;
    (n.starts_with("normal_flight__E8") ? c.normal_e8 : n.starts_with("normal_flight__E9") ? c.normal_e9 : c.defect).push_back(m.record);
  }
  return c;
}
std::string label(const std::string& name) { return name.substr(0, name.find("__")); }

TEST(CrazyPadHover, six_normal_flights_judged_by_the_others_of_their_vehicle_are_clean) {
  NEED_DATA();
  const CrazyPad c = crazypad();
  for (const auto* vehicle : {&c.normal_e8, &c.normal_e9}) {
    ASSERT_EQ(vehicle->size(), 3u);
    for (std::size_t k = 0; k < 3; ++k) {
      auto others = *vehicle;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
      const HoverDiagnosis d = diagnose_hover((*vehicle)[k], others, c.vehicle);
      std::printf("%s", hover_text(d).c_str());
      EXPECT_EQ(d.verdict, diagnose::DiagnosisVerdict::clean) << d.share.flight;
    }
  }
}

// Motor 3 is rear left: our rotor 2. What is right for each label; an answer that names several must hold it. Right twice: a propeller
// that lost thrust, by cut or tape, is a weak rotor.
const std::map<std::string, std::string> kRight{{"weight_on_string_W3_near_M3", "slung_load"},
                                                {"tape_on_propeller_M3", "weak_rotor 2"},
                                                {"cut_propeller_M3_1mm", "weak_rotor 2"},
                                                {"cut_propeller_M3_3mm", "weak_rotor 2"},
                                                {"add_weight_W1_near_M3", "payload_mass at rotor 2"},
                                                {"add_weight_W3_near_M3", "payload_mass at rotor 2"}};

// The kind is a known miss (docs/acceptance/diagnose_measured.md: right in 3 of 10 flights, not told in 3, wrong in 4, of these 2 as the
// only answer). The test holds that it gets no worse; it says of no wrong name that it should be given.
TEST(CrazyPadHover, defect_at_motor_3_is_found_in_ten_flights_its_rotor_in_eight_its_kind_in_three_and_wrong_in_at_most_four) {
  NEED_DATA();
  const CrazyPad c = crazypad();
  ASSERT_EQ(c.defect.size(), 10u);
  int rotor_2 = 0, right = 0, untold = 0, wrong = 0, wrong_alone = 0;
  for (const auto& f : c.defect) {
    const HoverDiagnosis d = diagnose_hover(f, c.normal_e9, c.vehicle);
    std::printf("%s", hover_text(d).c_str());
    EXPECT_NE(d.verdict, diagnose::DiagnosisVerdict::clean) << f.name;
    rotor_2 += d.rotor == 2;
    const bool holds = std::find(d.named.begin(), d.named.end(), kRight.at(label(f.name))) != d.named.end();
    right += holds;
    untold += d.named.empty();
    wrong += !holds && !d.named.empty();
    wrong_alone += !holds && d.verdict == diagnose::DiagnosisVerdict::named;
    EXPECT_EQ(d.named.empty(), d.verdict == diagnose::DiagnosisVerdict::unexplained) << f.name;
  }
  std::printf("kind right %d, not told %d, wrong %d (given alone: %d) of 10\n", right, untold, wrong, wrong_alone);
  EXPECT_GE(rotor_2, 8);
  EXPECT_GE(right, 3);
  EXPECT_LE(wrong, 4);
  EXPECT_LE(wrong_alone, 2);
}

// Are the patterns themselves distinct, whatever physics makes of them? Nearest mean of the labels, each flight left out in turn.
TEST(CrazyPadHover, patterns_of_five_labels_are_told_apart_in_eleven_flights_left_out_in_turn) {
  NEED_DATA();
  const CrazyPad c = crazypad();
  std::vector<std::pair<std::string, Eigen::Vector4d>> flights;
  std::map<std::string, int> count;
  const auto add = [&](const log::FlightRecord& f) {
    const auto s = hover_share(f, CommandMeaning::thrust);
    ASSERT_TRUE(s);
    flights.emplace_back(label(f.name), Eigen::Vector4d(s->demand[0], s->demand[1], s->demand[2], s->demand[3]).array().log());
    ++count[label(f.name)];
  };
  for (const auto& f : c.normal_e9) add(f);
  for (const auto& f : c.defect) add(f);
  int right = 0, judged = 0;
  for (std::size_t k = 0; k < flights.size(); ++k) {
    if (count[flights[k].first] < 2) continue;
    std::map<std::string, std::pair<Eigen::Vector4d, double>> means;
    for (std::size_t i = 0; i < flights.size(); ++i) {
      if (i == k || count[flights[i].first] < 2) continue;
      auto& [sum, n] = means.try_emplace(flights[i].first, Eigen::Vector4d::Zero(), 0.0).first->second;
      sum += flights[i].second, n += 1.0;
    }
    std::string nearest;
    double least = 1e300;
    for (const auto& [name, mean] : means)
      if (const double d = (flights[k].second - mean.first / mean.second).norm(); d < least) least = d, nearest = name;
    std::printf("%s -> %s (%.1f %%)\n", flights[k].first.c_str(), nearest.c_str(), 100.0 * least);
    ++judged, right += nearest == flights[k].first;
  }
  EXPECT_EQ(judged, 11);
  EXPECT_EQ(right, 11);
}

TEST(NanoBenchThrust, a_factor_on_motor_voltage_that_differs_by_flight_is_named_and_halves_the_held_out_error) {
  NEED_DATA();
  std::vector<log::FlightRecord> flights;
  for (const auto& f : flights_of("nanobench_cf21")) flights.push_back(read_measured(f).record);
  const CommandThrustDiagnosis d = diagnose_command_thrust(flights);
  std::printf("%s", command_thrust_text(d).c_str());
  EXPECT_EQ(d.verdict, diagnose::DiagnosisVerdict::named);
  EXPECT_EQ(d.named, (std::vector<std::string>{"battery_gain"}));
  EXPECT_NEAR(d.none.r2, 0.55, 0.02) << "one map, as published";
  for (const auto& x : d.differences) {
    if (x.id != "battery_gain") continue;
    EXPECT_GT(x.r2, 0.85);
    EXPECT_LT(x.held_out_rms_m_s2, 0.6 * d.none.held_out_rms_m_s2);
    EXPECT_GT(x.fall.low, 0.3);
  }
}

}  // namespace
}  // namespace rotorloop::studies
