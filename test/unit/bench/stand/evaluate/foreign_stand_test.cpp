// Stand files of other programs as people have them: units, encodings, two speeds, misread speeds, figures that no rotor has. The cases of
// the data folder are skipped without ROTORLOOP_DATA.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "bench/stand/evaluate/estimate/known_headers.hpp"
#include "bench/stand/evaluate/estimate/stand_estimate.hpp"
#include "host/base/constants.hpp"
#include "host/base/random.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::stand {
namespace {

using std::filesystem::path;
using testing::HasSubstr;

constexpr double kCt = 1.2e-5, kCq = 1.5e-7;

EstimateOptions few_draws() {
  EstimateOptions o;
  o.draws = 100;
  return o;
}

std::string all_of(const std::vector<std::string>& lines) {
  std::string s;
  for (const auto& l : lines) s += l + "\n";
  return s;
}

// A staircase up and down with zeros, of c_t and c_q above; each value as `text` writes it.
struct Staircase {
  std::string header = "Time (s),Torque (N·m),Thrust (N),Voltage (V),Current (A),Motor Optical Speed (RPM)";
  double torque_unit = 1.0, thrust_unit = 1.0, speed_unit = kRad_s_per_rpm, current = 1.0, exponent = 2.0;
  std::string end = "\n";
  char separator = ',';
  bool comma = false;
};
std::string text_of(const Staircase& o) {
  std::string out = o.header + "\n";
  const auto number = [&](double v) {
    std::string s = fmt::format("{:.7g}", v);
    if (o.comma) std::replace(s.begin(), s.end(), '.', ',');
    return s;
  };
  const RandomStream random(7, 1);
  std::uint64_t k = 0;
  for (int i = 0; i < 24; ++i) {
    const double share = i < 2 || i > 21 ? 0.0 : i < 12 ? (i - 1) / 10.0 : (22 - i) / 10.0, w = 1400.0 * share;
    const double thrust = kCt * 700.0 * 700.0 * std::pow(w / 700.0, o.exponent) + 0.005 * random.gaussian(k++),
                 torque = kCq * w * w + 1e-4 * random.gaussian(k++);
    const double power = share > 0.0 ? 1.4 * kCq * w * w * w : 0.0;
    for (const double v : {3.0 * i, torque / o.torque_unit, thrust / o.thrust_unit, 16.0, o.current * power / 16.0, w / o.speed_unit})
      out += number(v) + o.separator;
    out.pop_back();
    out += o.end;
  }
  return out;
}

StandEstimate estimate_of(const std::string& bytes) {
  const test::TempFolder folder;
  return estimate_stand(read_stand_run(folder.write("log.csv", bytes), {}), few_draws());
}

void expect_truth(const StandEstimate& e) {
  ASSERT_TRUE(e.thrust && e.torque) << all_of(e.faults) << all_of(e.remarks);
  EXPECT_NEAR(e.thrust->value / kCt, 1.0, 0.02);
  EXPECT_NEAR(e.torque->value / kCq, 1.0, 0.04);
}

struct UnitCase {
  const char *thrust, *torque, *speed;
  double thrust_N, torque_N_m, speed_rad_s;
};
class ForeignUnits : public testing::TestWithParam<UnitCase> {};
TEST_P(ForeignUnits, OfThrustTorqueAndSpeedAreReadFromTheHeader) {
  const UnitCase& u = GetParam();
  expect_truth(
      estimate_of(text_of({.header = fmt::format("Time (s),Torque ({}),Thrust ({}),Voltage (V),Current (A),Motor Optical Speed ({})",
                                                 u.torque, u.thrust, u.speed),
                           .torque_unit = u.torque_N_m,
                           .thrust_unit = u.thrust_N,
                           .speed_unit = u.speed_rad_s})));
}
// Factors from NIST SP 811 (2008), appendix B.8.
INSTANTIATE_TEST_SUITE_P(Units, ForeignUnits,
                         testing::Values(UnitCase{"N", "N·cm", "rad/s", 1.0, 1e-2, 1.0},
                                         UnitCase{"kgf", "N⋅mm", "Hz", 9.80665, 1e-3, 6.283185307},
                                         UnitCase{"gf", "mN.m", "RPM", 9.80665e-3, 1e-3, kRad_s_per_rpm},
                                         UnitCase{"lbf", "lbf·ft", "rpm", 4.448222, 1.355818, kRad_s_per_rpm},
                                         UnitCase{"ozf", "ozf-in", "rpm", 0.2780139, 7.061552e-3, kRad_s_per_rpm},
                                         UnitCase{"kg", "kgf*cm", "rev/s", 9.80665, 9.80665e-2, 6.283185307},
                                         UnitCase{"g", "lbf.in", "1/min", 9.80665e-3, 0.1129848, kRad_s_per_rpm}));

TEST(ForeignStand, AUnitOfTorqueThatNobodyKnowsIsRefusedAndNotTakenForNewtonMetres) {
  const test::TempFolder folder;
  const auto file =
      folder.write("log.csv", text_of({.header = "Time (s),Torque (N·dm),Thrust (N),Voltage (V),Current (A),Motor Optical Speed (RPM)"}));
  EXPECT_THAT(test::error_of([&] { (void)read_stand_run(file, {}); }), HasSubstr("\"N·dm\", which is no known unit of torque"));
}

TEST(ForeignStand, SemicolonsTabsDecimalCommasQuotesAndUTF16GiveTheSameCoefficients) {
  const std::string semicolon_header = "Time (s);Torque (N·m);Thrust (N);Voltage (V);Current (A);Motor Optical Speed (RPM)";
  expect_truth(estimate_of(text_of({.header = semicolon_header, .separator = ';', .comma = true})));
  std::string tab_header = semicolon_header;
  std::replace(tab_header.begin(), tab_header.end(), ';', '\t');
  expect_truth(estimate_of(text_of({.header = tab_header, .separator = '\t', .comma = true})));
  std::string quoted;
  for (const char c : text_of({})) quoted += c == ',' ? std::string("\",\"") : c == '\n' ? std::string("\"\n\"") : std::string(1, c);
  quoted = "\"" + quoted.substr(0, quoted.size() - 1);
  expect_truth(estimate_of(quoted));
  std::string utf16 = "\xFF\xFE";
  for (const char c : text_of({.header = "Time (s),Torque (Nm),Thrust (N),Voltage (V),Current (A),Motor Optical Speed (RPM)"})) {
    utf16 += c;
    utf16 += '\0';
  }
  expect_truth(estimate_of(utf16));
}

TEST(ForeignStand, RowsAboveTheNamesAndCellsBeyondThemArePassedOverAndNoted) {
  const StandEstimate e = estimate_of("Test of,Monday\nOperator,x\n" + text_of({.end = ",1.0\n"}));
  expect_truth(e);
  EXPECT_THAT(all_of(e.remarks), HasSubstr("the names of its columns are in line 3"));
  EXPECT_THAT(all_of(e.remarks), HasSubstr("24 of 24 rows have more cells than the 6 names"));
}

TEST(ForeignStand, OfTwoSpeedsTheOpticalIsTakenAndTheRatioIsNamedAsPolePairs) {
  std::string two;
  std::size_t line = 0;
  const std::string one = text_of({});
  for (std::size_t from = 0, to = one.find('\n'); to != std::string::npos; from = to + 1, to = one.find('\n', from), ++line) {
    const std::string row = one.substr(from, to - from);
    const std::string last = row.substr(row.rfind(',') + 1);
    two += line == 0 ? "Motor Electrical Speed (RPM)," + row + "\n" : fmt::format("{:.6g},{}\n", std::stod(last) * 6.0 / 7.0, row);
  }
  const StandEstimate e = estimate_of(two);
  expect_truth(e);
  EXPECT_THAT(all_of(e.remarks), HasSubstr("likely: 7 pole pairs set for a motor that has 6"));
}

TEST(Credibility, ShaftPowerAboveTheElectricalPowerRefusesEveryCoefficientUnlessTheUserAnswersForIt) {
  const test::TempFolder folder;
  const auto run = read_stand_run(folder.write("log.csv", text_of({.current = 0.05})), {});
  const StandEstimate refused = estimate_stand(run, few_draws());
  EXPECT_FALSE(refused.thrust || refused.torque);
  EXPECT_THAT(all_of(refused.faults), HasSubstr("shaft power (torque times rotor speed) exceeds the electrical power"));
  EstimateOptions accepting = few_draws();
  accepting.accepted = {"power_balance"};
  expect_truth(estimate_stand(run, accepting));
}

TEST(Credibility, ThrustThatGoesWithThePower1Point3OfTheSpeedIsNoPropellersAndThat1Point8And2Point3Are) {
  for (const auto& [exponent, refused] : {std::pair{1.3, true}, {1.8, false}, {2.3, false}}) {
    const test::TempFolder folder;
    const auto run = read_stand_run(folder.write("log.csv", text_of({.exponent = exponent})), {});
    const StandEstimate e = estimate_stand(run, few_draws());
    EXPECT_EQ(!e.thrust, refused) << exponent << all_of(e.faults);
    if (!refused) continue;
    EXPECT_THAT(all_of(e.faults), HasSubstr("goes with the speed to the power of 1.3"));
    EstimateOptions accepting = few_draws();
    accepting.accepted = {"speed_law"};
    EXPECT_TRUE(estimate_stand(run, accepting).thrust);
  }
}

RunOptions with_density() {
  RunOptions o;
  o.air_density_kg_m3 = 1.2;
  return o;
}

// Speeds of `rows` of the staircase multiplied, as a sensor that counts marks twice or misses some has it.
TEST(MisreadSpeed, FactorsOfTwoHalfAnd2p3InUpTo5Of20PointsLeaveTheTruthInTheIntervalAndNameTheRows) {
  const RandomStream random(3, 9);
  std::uint64_t draw = 0;
  int held = 0, all = 0;
  for (const double factor : {2.0, 0.5, 2.3})
    for (const int wrong : {1, 3, 5})
      for (int repeat = 0; repeat < 2; ++repeat) {
        StandRecord r;
        r.name = "drawn";
        for (int i = 0; i < 24; ++i) {
          StandPoint p;
          const double share = i < 2 || i > 21 ? 0.0 : i < 12 ? (i - 1) / 10.0 : (22 - i) / 10.0, w = 1400.0 * share;
          p.row = static_cast<std::size_t>(i) + 1;
          p.t_s = 3.0 * i;
          p.omega_rad_s[0] = w;
          p.thrust_N = kCt * w * w + 0.005 * random.gaussian(draw++);
          p.torque_N_m = kCq * w * w + 1e-4 * random.gaussian(draw++);
          r.points.push_back(p);
        }
        for (int k = 0; k < wrong; ++k)
          r.points[2 + static_cast<std::size_t>(random.uniform(draw++) * 4.0) + 4 * static_cast<std::size_t>(k)].omega_rad_s[0] *= factor;
        const StandEstimate e = estimate_stand(stand_run(std::move(r), with_density()), few_draws());
        ++all;
        if (!e.thrust || !e.torque) {
          ++held;  // refused
          continue;
        }
        held += e.thrust->low < kCt && kCt < e.thrust->high && e.torque->low < kCq && kCq < e.torque->high;
        EXPECT_NEAR(e.thrust->value / kCt, 1.0, 0.03) << factor << " in " << wrong;
        // A point of 2 % of the largest thrust says nothing of its speed, and has no weight.
        if (wrong > 1) {
          EXPECT_THAT(all_of(e.remarks), HasSubstr("their speed does not fit")) << factor << " in " << wrong;
        }
      }
  EXPECT_GE(held, all - 1) << all;
}

// Holds at idle, whose thrust is no larger than the zero of its cell may be off, tell c_q from a torque that wires and bearings add.
TEST(MisreadSpeed, HoldsAtIdleWithARunningTorqueOffsetOf7mNmStayInTheFit) {
  const RandomStream random(4, 2);
  std::uint64_t draw = 0;
  for (const double running_N_m : {-0.0073, 0.0076}) {
    StandRecord r;
    r.name = "idle";
    std::vector<double> speeds{0.0, 150.0}, down;
    for (int i = 0; i <= 11; ++i) speeds.push_back(314.0 + 100.0 * i);
    down.assign(speeds.rbegin() + 1, speeds.rend());
    speeds.insert(speeds.end(), down.begin(), down.end());
    for (const double w : speeds) {
      StandPoint p;
      p.row = r.points.size() + 1;
      p.t_s = 3.0 * static_cast<double>(p.row);
      p.omega_rad_s[0] = w;
      p.thrust_N = 1.75e-6 * w * w + 0.01 * random.gaussian(draw++);
      p.torque_N_m = 2.2e-8 * w * w + (w > 0.0 ? running_N_m : 0.0) + 1e-4 * random.gaussian(draw++);
      r.points.push_back(p);
    }
    const std::size_t turning = speeds.size() - 2;
    const StandEstimate e = estimate_stand(stand_run(std::move(r), with_density()), few_draws());
    ASSERT_TRUE(e.torque) << all_of(e.faults) << all_of(e.remarks);
    EXPECT_EQ(e.steps, turning) << all_of(e.remarks);
    EXPECT_NEAR(e.torque->value / 2.2e-8, 1.0, 0.02);
  }
}

// A stand with friction of 0.5 % of the largest thrust in its mount, which the budget takes as typical: u alone is told to the estimator.
TEST(UpOnlyWithZeros, FrictionInTheMountIsInTheFitAnd90percentOrMoreOfTheIntervalsHoldTheTruth) {
  const RandomStream random(5, 2);
  std::uint64_t draw = 0;
  int held = 0;
  constexpr int kRuns = 60;
  for (int run = 0; run < kRuns; ++run) {
    const double friction_N = 0.005 * 24.0 * random.gaussian(draw++), gain = 1.0 + 0.004 * random.gaussian(draw++),
                 speed = 1.0 + 5e-4 * random.gaussian(draw++), density = 1.0 + 0.003 * random.gaussian(draw++);
    StandRecord r;
    r.name = "up";
    for (int i = 0; i < 26; ++i) {
      StandPoint p;
      const double w = i < 4 ? 0.0 : 300.0 + 50.0 * (i - 4);
      p.row = static_cast<std::size_t>(i) + 1;
      p.t_s = 3.0 * i;
      p.omega_rad_s[0] = w * speed;
      p.thrust_N = gain * density * 1.2e-5 * w * w + (w > 0.0 ? friction_N : 0.0) + 0.02 * random.gaussian(draw++);
      r.points.push_back(p);
    }
    const StandEstimate e = estimate_stand(stand_run(std::move(r), with_density()), few_draws());
    ASSERT_TRUE(e.thrust);
    held += e.thrust->low < 1.2e-5 && 1.2e-5 < e.thrust->high;
    EXPECT_TRUE(e.thrust->fit.law.running) << "what friction adds between the zeros and the rows that turn";
  }
  EXPECT_GE(held, static_cast<int>(0.90 * kRuns));
}

TEST(AirDensity, ThatNobodyGaveIsAGuessWithAnUncertaintyOf5percentAndIsSaid) {
  StandRecord r;
  for (int i = 0; i < 26; ++i) {
    StandPoint p;
    const double w = i < 4 ? 0.0 : 300.0 + 50.0 * (i - 4);
    p.row = static_cast<std::size_t>(i) + 1;
    p.t_s = 3.0 * i;
    p.omega_rad_s[0] = w;
    p.thrust_N = 1.2e-5 * w * w;
    r.points.push_back(p);
  }
  const auto density_u = [&](const StandEstimate& e) {
    for (const BudgetTerm& t : e.thrust->budget)
      if (t.name == "air density") return t.u;
    return 0.0;
  };
  const StandEstimate guessed = estimate_stand(stand_run(r, {}), few_draws());
  EXPECT_EQ(density_u(guessed), 0.05);
  EXPECT_THAT(all_of(guessed.remarks), HasSubstr("the air's density is a guess, 1.2 kg/m³ with u of 5 %: nobody gave it"));
  const StandEstimate given = estimate_stand(stand_run(r, with_density()), few_draws());
  EXPECT_EQ(density_u(given), 0.003);
  EXPECT_THAT(all_of(given.remarks), Not(HasSubstr("density")));
  r.density_given = true;  // by a mapping
  EXPECT_EQ(density_u(estimate_stand(stand_run(r, {}), few_draws())), 0.003);
}

// The staircase of a stand whose cell repeats its reading of row `from` until row `to`; thrust in steps of 0.01 N.
StandRecord with_frozen_thrust(std::size_t from, std::size_t to) {
  StandRecord r;
  r.density_given = true;
  double last_N = 0.0;
  for (std::size_t i = 0; i < 24; ++i) {
    StandPoint p;
    const double w = i < 3 ? 0.0 : 300.0 + 45.0 * static_cast<double>(i);
    p.row = i + 1;
    p.t_s = 3.0 * static_cast<double>(i);
    p.omega_rad_s[0] = w;
    p.torque_N_m = kCq * w * w;
    p.thrust_N = p.row > from && p.row <= to ? last_N : 0.01 * std::round(100.0 * kCt * w * w);
    last_N = p.thrust_N;
    r.points.push_back(p);
  }
  return r;
}

TEST(FrozenInstrument, ThatRepeatsOneReadingWhileTheSpeedRisesIsNamedByRowsAndGivesNoCoefficient) {
  const StandEstimate frozen = estimate_stand(stand_run(with_frozen_thrust(10, 16), {}), few_draws());
  EXPECT_FALSE(frozen.thrust);
  EXPECT_TRUE(frozen.torque) << "the other channel is sound";
  EXPECT_THAT(all_of(frozen.faults), HasSubstr("to the last digit in 7 points one behind the other (rows 10 to 16) while the speed goes"));
  const StandEstimate sound = estimate_stand(stand_run(with_frozen_thrust(0, 0), {}), few_draws());
  EXPECT_TRUE(sound.thrust);
  EXPECT_THAT(all_of(sound.faults), Not(HasSubstr("to the last digit")));
}

path field(const char* name) {
  const char* root = std::getenv("ROTORLOOP_DATA");
  return root ? path(root) / "field" / name : path();
}
#define NEED_DATA() \
  if (field("").empty()) GTEST_SKIP() << "ROTORLOOP_DATA is not set"

StandEstimate estimate_field(const char* file, const char* mapping = nullptr) {
  RunOptions o;
  if (mapping) o.mapping = read_stand_mapping(field(mapping));
  return estimate_stand(read_stand_run(field(file), o), few_draws());
}

struct FieldCase {
  const char *file, *mapping;
  double c_t, c_q;
};
class FieldStand : public testing::TestWithParam<FieldCase> {};
TEST_P(FieldStand, TruthIsInTheIntervalsAndWithin1And3percent) {
  NEED_DATA();
  const FieldCase& c = GetParam();
  const StandEstimate e = estimate_field(c.file, c.mapping);
  ASSERT_TRUE(e.thrust && e.torque) << all_of(e.faults) << all_of(e.remarks);
  EXPECT_NEAR(e.thrust->value / c.c_t, 1.0, 0.01);
  EXPECT_NEAR(e.torque->value / c.c_q, 1.0, 0.03);
  EXPECT_TRUE(e.thrust->low < c.c_t && c.c_t < e.thrust->high) << e.thrust->low << " " << e.thrust->high;
  EXPECT_TRUE(e.torque->low < c.c_q && c.c_q < e.torque->high) << e.torque->low << " " << e.torque->high;
}
INSTANTIATE_TEST_SUITE_P(Files, FieldStand,
                         testing::Values(FieldCase{"S1_optical_only.csv", nullptr, kCt, kCq},
                                         FieldCase{"S2_speed_rad_s.csv", nullptr, kCt, kCq},
                                         FieldCase{"S3_torque_N_cm.csv", nullptr, kCt, kCq}, FieldCase{"S6_ragged.csv", nullptr, kCt, kCq},
                                         FieldCase{"flight_stand_header.csv", nullptr, 1.9e-6, 2.9e-8},
                                         FieldCase{"semi.csv", "semi.toml", 1.9e-6, 2.9e-8},
                                         FieldCase{"rpm_doubled_3_of_24.csv", nullptr, 1.9e-6, 2.9e-8}));

TEST(FieldStand, ThrottleThatIsNoDutyGivesNoResistanceAndNoKv) {
  NEED_DATA();
  const StandEstimate e = estimate_field("throttle_as_duty.csv", "throttle_as_duty.toml");
  ASSERT_TRUE(e.thrust && e.torque);
  EXPECT_FALSE(e.motor);
  EXPECT_THAT(all_of(e.remarks), HasSubstr("likely the command is a throttle and not the duty of the bridge"));
}

TEST(FieldStand, SpeedDoubledInThreeOf24RowsIsNamedByRow) {
  NEED_DATA();
  EXPECT_THAT(all_of(estimate_field("rpm_doubled_3_of_24.csv").remarks),
              HasSubstr("3 of 24 points left out, their speed does not fit: row"));
}

TEST(FieldStand, RowsThatGoUpWithZerosHaveTheFrictionOfTheMountInTheFit) {
  NEED_DATA();
  const StandEstimate e = estimate_field("uponly_hysteresis_zero.csv");
  ASSERT_TRUE(e.thrust);
  EXPECT_TRUE(e.thrust->fit.law.running);
  EXPECT_TRUE(e.thrust->low < 1.9e-6 && 1.9e-6 < e.thrust->high) << e.thrust->low << " " << e.thrust->high;
}

TEST(FieldStand, HeadOfASeries1780ExportAtRestIsReadAndSaysThatNothingTurns) {
  NEED_DATA();
  const StandRun run = read_stand_run(field("tyto1780_header.csv"), {});
  EXPECT_THAT(all_of(run.remarks), HasSubstr("recognised as an RCbenchmark (Tyto) export"));
  EXPECT_EQ(run.checked.speed, StandChannelState::faulty);
}

}  // namespace
}  // namespace rotorloop::stand
