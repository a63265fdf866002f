// Stand files made up from T = c_t ω² and Q = c_q ω², each with one thing wrong: what is wrong is named, nothing else is.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "bench/stand/evaluate/stand_comparison.hpp"
#include "bench/stand/evaluate/stand_text.hpp"
#include "host/base/error.hpp"
#include "host/base/random.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::stand {
namespace {

constexpr double kCt = 3.1e-6, kCq = 3.1e-8, kDiameter_m = 0.2032;

struct StandCase {
  double tare_N = 0.0, exponent = 0.0, advance = 0.0, speed_factor = 1.0, thrust_sign = 1.0;
  bool wind = false, speed_connected = true;
};

// Four sweeps of speed over 200 s, at two airspeeds when there is wind; noise 0.3 % of thrust and torque.
StandRecord made_up(const StandCase& c) {
  StandRecord r;
  r.name = "made_up.csv";
  r.diameter_m = kDiameter_m;
  r.means = true;
  const RandomStream noise(5, 77);
  for (int i = 0; i < 400; ++i) {
    StandPoint p;
    p.row = static_cast<std::size_t>(i + 1);
    p.t_s = 0.5 * i;
    const double omega = 500.0 + 5.0 * (i % 100);
    p.airspeed_m_s = c.wind ? (i < 200 ? 10.0 : 15.0) : kNotMeasured;
    const double J = c.wind ? p.airspeed_m_s / (omega / 6.283185307 * kDiameter_m) : 0.0;
    const auto n = static_cast<std::uint64_t>(2 * i);
    p.thrust_N = c.thrust_sign * (kCt * omega * omega * std::pow(omega / 750.0, c.exponent) * (1.0 + 0.003 * noise.gaussian(n)) + c.tare_N);
    p.torque_N_m = kCq * omega * omega * (1.0 + c.advance * J * J) * (1.0 + 0.003 * noise.gaussian(n + 1));
    p.omega_rad_s[0] = c.speed_connected ? omega * c.speed_factor : 0.0;
    r.points.push_back(p);
  }
  return r;
}

std::string said(const StandFileDiagnosis& d) {
  StandDiagnosis all;
  all.files.push_back(d);
  return stand_text(all);
}

TEST(Stand, ThrustAndTorqueInProportionToSpeedSquaredAreClean) {
  const auto d = diagnose_stand(made_up({}));
  EXPECT_EQ(d.verdict, diagnose::DiagnosisVerdict::clean) << said(d);
  EXPECT_NEAR(d.channels[0].coefficient.value, kCt, 3.0 * d.channels[0].coefficient.u);
  EXPECT_NEAR(d.channels[1].coefficient.value, kCq, 3.0 * d.channels[1].coefficient.u);
}

TEST(Stand, LoadCellWithAZeroOf300mNIsAFaultAndThrustGetsNoCoefficient) {
  const auto d = diagnose_stand(made_up({.tare_N = -0.3}));
  EXPECT_EQ(d.verdict, diagnose::DiagnosisVerdict::faulty) << said(d);
  ASSERT_EQ(d.faults.size(), 1u);
  EXPECT_EQ(d.faults[0].channel, "thrust");
  EXPECT_NE(d.faults[0].what.find("constant of -0.299"), std::string::npos) << d.faults[0].what;
  ASSERT_EQ(d.channels.size(), 1u);
  EXPECT_EQ(d.channels[0].channel, "torque");
}

TEST(Stand, SpeedExponentOf5HundredthsIsNamedAndIsNoWrongZero) {
  const auto d = diagnose_stand(made_up({.exponent = 0.05}));
  EXPECT_EQ(d.verdict, diagnose::DiagnosisVerdict::named) << said(d);
  const auto& c = d.channels[0].candidates[*d.channels[0].best];
  EXPECT_EQ(c.id, "thrust_speed_exponent");
  EXPECT_NEAR(c.parameters[0].value / kCt, 0.05, 0.005);
}

TEST(Stand, TorqueThatFallsWithAdvanceRatioIsNamedAndHoldsAtTheOtherAirspeed) {
  const auto d = diagnose_stand(made_up({.advance = -1.2, .wind = true}));
  const auto& q = d.channels[1];
  ASSERT_EQ(q.verdict, diagnose::DiagnosisVerdict::named) << said(d);
  EXPECT_EQ(q.candidates[*q.best].id, "torque_advance");
  EXPECT_NEAR(q.candidates[*q.best].parameters[0].value / kCq, -1.2, 0.05);
  EXPECT_LT(q.candidates[*q.best].held_out_rms, 0.1 * q.candidates[*q.best].held_out_rms_before);
}

TEST(Stand, FileWhoseSpeedReadsZeroThroughoutIsRefused) {
  const auto d = diagnose_stand(made_up({.speed_connected = false}));
  EXPECT_EQ(d.verdict, diagnose::DiagnosisVerdict::faulty);
  EXPECT_TRUE(d.channels.empty());
  EXPECT_NE(d.faults[0].what.find("reads 0 in"), std::string::npos) << d.faults[0].what;
}

TEST(Stand, OneSpeedAloneIsNotDiagnosedAndThatIsSaid) {
  StandRecord r = made_up({});
  r.points.resize(8);
  for (auto& p : r.points) p.omega_rad_s[0] = 500.0;
  const auto d = diagnose_stand(r);
  EXPECT_TRUE(d.channels.empty());
  EXPECT_NE(said(d).find("thrust: too few points to hold some of them out"), std::string::npos) << said(d);
}

TEST(Stand, ThrustCountedNegativeIsTurnedAndSaid) {
  const auto d = diagnose_stand(made_up({.thrust_sign = -1.0}));
  EXPECT_EQ(d.verdict, diagnose::DiagnosisVerdict::clean) << said(d);
  EXPECT_NEAR(d.channels[0].coefficient.value, kCt, 0.01 * kCt);
  EXPECT_NE(said(d).find("thrust is negative"), std::string::npos);
}

TEST(Stand, OneFileOfSixWithSpeedReadBySevenSixthsIsOddAmongItsPropeller) {
  StandDiagnosis all;
  for (int k = 0; k < 6; ++k) all.files.push_back(diagnose_stand(made_up({.speed_factor = k == 3 ? 7.0 / 6.0 : 1.0 + 0.005 * k})));
  compare_stands(all);
  for (std::size_t k = 0; k < 6; ++k) EXPECT_EQ(all.files[k].verdict == diagnose::DiagnosisVerdict::faulty, k == 3) << k;
  EXPECT_NE(all.files[3].faults[0].likely.find("speed read 1.1"), std::string::npos) << all.files[3].faults[0].likely;
}

constexpr const char* kMapping = R"(
format = 1
name = "made up"
separator = "blank"
header = ["rpm", "thrust_g"]
[[channel]]
quantity = "rotor_speed"
columns = ["rpm"]
unit = "rpm"
[[channel]]
quantity = "thrust"
columns = ["thrust_g"]
unit = "gf"
)";

TEST(StandMappingFile, FileWithoutHeaderIsReadByTheNamesOfTheMappingInSI) {
  test::TempFolder folder;
  std::ofstream(folder.path() / "a.txt") << "6000 100\n12000 400\n";
  const auto r = read_stand_file(folder.path() / "a.txt", parse_stand_mapping(kMapping, "m.toml"));
  ASSERT_EQ(r.points.size(), 2u);
  EXPECT_NEAR(r.points[0].omega_rad_s[0], 628.3185, 1e-3);
  EXPECT_NEAR(r.points[1].thrust_N, 3.922660, 1e-6);
}

std::string refusal(std::string text, const std::string& from, const std::string& to) {
  text.replace(text.find(from), from.size(), to);
  try {
    (void)parse_stand_mapping(text, "m.toml");
  } catch (const Error& e) {
    return e.what();
  }
  return "accepted";
}

TEST(StandMappingFile, SlipsAreRefusedWithLineAndRemedy) {
  EXPECT_NE(refusal(kMapping, "\"gf\"", "\"rpm\"").find("no unit of thrust"), std::string::npos);
  EXPECT_NE(refusal(kMapping, "\"gf\"", "\"rpm\"").find("N, gf"), std::string::npos);
  EXPECT_NE(refusal(kMapping, "[\"rpm\"]", "[\"a\", \"b\", \"c\", \"d\", \"e\"]").find("expected 1 to 4"), std::string::npos);
  EXPECT_NE(refusal(kMapping, "unit = \"gf\"", "unit = \"gf\"\nform = \"join\"").find("m.toml"), std::string::npos) << "misspelt key";
  EXPECT_NE(refusal(kMapping, "unit = \"gf\"", "unit = \"gf\"\nfrom = \"join\"").find("no [join]"), std::string::npos);
}

TEST(StandMappingFile, MappingOfAnotherStandSaysWhichColumnsTheFileHas) {
  test::TempFolder folder;
  std::ofstream(folder.path() / "a.csv") << "speed,force\n1,2\n";
  std::string text = kMapping;
  text.replace(text.find("separator = \"blank\"\nheader = [\"rpm\", \"thrust_g\"]"),
               std::string("separator = \"blank\"\nheader = [\"rpm\", \"thrust_g\"]").size(), "");
  try {
    (void)read_stand_file(folder.path() / "a.csv", parse_stand_mapping(text, "m.toml"));
    FAIL() << "accepted";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("speed, force"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace rotorloop::stand
