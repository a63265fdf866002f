// Labelled defects and unlike flights of measured Crazyflies, from motor commands and battery voltage alone: which rotor, which kind,
// what is confused with what. Skipped without ROTORLOOP_DATA.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <map>

#include "bench/studies/command_thrust.hpp"
#include "bench/studies/hover_diagnosis.hpp"
#include "host/base/error.hpp"
#include "test/unit/bench/sysid/identify/measured_flights.hpp"

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

std::vector<log::FlightRecord> without(std::vector<log::FlightRecord> flights, std::size_t k) {
  flights.erase(flights.begin() + static_cast<std::ptrdiff_t>(k));
  return flights;
}
std::string percents(const std::array<double, 4>& v) {
  std::string s;
  for (const double x : v) s += (s.empty() ? "" : " / ") + fmt::format("{:+.1f}", 100.0 * x);
  return s;
}
std::string answer(const HoverDiagnosis& d) {
  if (!d.refused.empty()) return "refused";
  return fmt::format("{}{}", name(d.verdict), d.named.empty() ? "" : fmt::format(": {}", fmt::join(d.named, " | ")));
}

TEST(CrazyPadHover, SixNormalFlightsJudgedByTheTwoOthersOfTheirVehicleAreClean) {
  NEED_DATA();
  const CrazyPad c = crazypad();
  for (const auto* vehicle : {&c.normal_e8, &c.normal_e9}) {
    ASSERT_EQ(vehicle->size(), 3u);
    for (std::size_t k = 0; k < 3; ++k) {
      const HoverDiagnosis d = diagnose_hover((*vehicle)[k], without(*vehicle, k), c.vehicle);
      std::printf("| %s | %s | seen from %s | %s |\n", d.share.flight.c_str(), percents(d.change).c_str(), percents(d.seen_from).c_str(),
                  answer(d).c_str());
      EXPECT_EQ(d.verdict, diagnose::DiagnosisVerdict::clean) << d.share.flight;
    }
  }
}

// Motor 3 is rear left: our rotor 2. What is right for each label; an answer that names several must hold it, and at most three. Right
// twice: a propeller that lost thrust, by cut or tape, is a weak rotor.
const std::map<std::string, std::string> kRight{{"weight_on_string_W3_near_M3", "slung_load"},
                                                {"tape_on_propeller_M3", "weak_rotor 2"},
                                                {"cut_propeller_M3_1mm", "weak_rotor 2"},
                                                {"cut_propeller_M3_3mm", "weak_rotor 2"},
                                                {"add_weight_W1_near_M3", "payload_mass at rotor 2"},
                                                {"add_weight_W3_near_M3", "payload_mass at rotor 2"}};

struct Score {
  int seen = 0, rotor = 0, kind = 0, wrong = 0, wrong_alone = 0;
};
// Prints a row of the page's table for each flight.
Score score(const std::vector<log::FlightRecord>& flights, const std::vector<log::FlightRecord>& reference,
            const host::VehicleModel& vehicle) {
  Score s;
  for (const auto& f : flights) {
    const HoverDiagnosis d = diagnose_hover(f, reference, vehicle);
    const bool kind = d.named.size() <= 3 && std::find(d.named.begin(), d.named.end(), kRight.at(label(f.name))) != d.named.end();
    s.seen += d.verdict != diagnose::DiagnosisVerdict::clean && d.refused.empty();
    s.rotor += d.rotor == 2;
    s.kind += kind;
    s.wrong += !kind && !d.named.empty();
    s.wrong_alone += !kind && d.verdict == diagnose::DiagnosisVerdict::named;
    std::printf("| %s | %s | %s | %s | %s |\n", f.name.c_str(), percents(d.change).c_str(),
                fmt::format("{}", fmt::join(d.rotors, ", ")).c_str(), answer(d).c_str(),
                kind              ? "yes"
                : d.named.empty() ? "not told"
                                  : "no");
  }
  std::printf("seen %d, rotor %d, kind in a class of at most three %d, wrong %d (given alone: %d) of %zu\n", s.seen, s.rotor, s.kind,
              s.wrong, s.wrong_alone, flights.size());
  return s;
}

// These ten flights were seen while the rules were written: what is held here is no claim for flights that were not. The two with a blade
// cut by 1 mm are the known miss: rotors 1 and 2 rise alike there.
TEST(CrazyPadHover, DefectAtMotor3IsSeenInTenFlightsItsRotorAndKindInEightWhicheverNormalFlightIsLeftOut) {
  NEED_DATA();
  const CrazyPad c = crazypad();
  ASSERT_EQ(c.defect.size(), 10u);
  for (std::size_t fold = 0; fold <= 3; ++fold) {
    const auto reference = fold < 3 ? without(c.normal_e9, fold) : c.normal_e9;
    std::printf("%s\n", fold < 3 ? ("without " + c.normal_e9[fold].name).c_str() : "all three normal flights of E9");
    const Score s = score(c.defect, reference, c.vehicle);
    EXPECT_EQ(s.seen, 10);
    EXPECT_GE(s.rotor, 8);
    EXPECT_GE(s.kind, 8);
    EXPECT_EQ(s.wrong_alone, 0);
  }
  for (const auto& f : c.defect) std::printf("%s", hover_text(diagnose_hover(f, c.normal_e9, c.vehicle)).c_str());
}

// The other way round nothing is refused, and references with two flights of E8 seldom: those scatter nearly as much as the two vehicles
// differ.
TEST(CrazyPadHover, NormalFlightsOfE8AreRefusedByTheReferenceOfE9AndOneOfThemAmongThoseOfE9Too) {
  NEED_DATA();
  const CrazyPad c = crazypad();
  for (std::size_t fold = 0; fold <= 3; ++fold)
    for (const auto& f : c.normal_e8) {
      const HoverDiagnosis d = diagnose_hover(f, fold < 3 ? without(c.normal_e9, fold) : c.normal_e9, c.vehicle);
      EXPECT_NE(d.refused, "") << hover_text(d);
      if (fold == 3) std::printf("%s: %s\n", f.name.c_str(), d.refused.c_str());
    }
  int refused = 0;
  for (const auto& f : c.normal_e9) {
    const HoverDiagnosis d = diagnose_hover(f, c.normal_e8, c.vehicle);
    std::printf("%s by E8: %s, a rise seen from %s %%\n", f.name.c_str(), answer(d).c_str(), percents(d.seen_from).c_str());
    refused += !d.refused.empty();
  }
  std::printf("E9 by E8: %d of 3 refused\n", refused);

  std::vector<HoverShare> all;
  for (const auto* flights : {&c.normal_e8, &c.normal_e9})
    for (const auto& f : *flights) all.push_back(*hover_share(f, CommandMeaning::thrust));
  int mixed[4] = {}, found[4] = {};  // by the number of flights of E8
  for (unsigned choice = 0; choice < 64; ++choice) {
    std::vector<HoverShare> some;
    for (unsigned i = 0; i < 6; ++i)
      if (choice >> i & 1U) some.push_back(all[i]);
    const int of_e8 = std::popcount(choice & 7U);
    if (some.size() < 3 || of_e8 == 0 || (choice & 56U) == 0) continue;  // three at least, of both
    ++mixed[of_e8];
    try {
      hover_reference(some);
    } catch (const Error& e) {
      ++found[of_e8];
      if (choice == 63) std::printf("%s\n", e.what());
    }
  }
  for (int n = 1; n <= 3; ++n) std::printf("references of both vehicles, %d of E8: %d of %d refused\n", n, found[n], mixed[n]);
  EXPECT_EQ(found[1], mixed[1]) << "one of E8 beside two or three of E9";
}

// Are the patterns themselves distinct, whatever physics makes of them? Nearest mean of the labels, each flight left out in turn.
TEST(CrazyPadHover, PatternsOfFiveLabelsAreToldApartInElevenFlightsLeftOutInTurn) {
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
      sum += flights[i].second;
      n += 1.0;
    }
    std::string nearest;
    double least = 1e300;
    for (const auto& [name, mean] : means)
      if (const double d = (flights[k].second - mean.first / mean.second).norm(); d < least) {
        least = d;
        nearest = name;
      }
    std::printf("%s -> %s (%.1f %%)\n", flights[k].first.c_str(), nearest.c_str(), 100.0 * least);
    ++judged;
    right += nearest == flights[k].first;
  }
  EXPECT_EQ(judged, 11);
  EXPECT_EQ(right, 11);
}

TEST(NanoBenchThrust, AFactorOnMotorVoltageThatDiffersByFlightIsNamedAndHalvesTheHeldOutError) {
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
