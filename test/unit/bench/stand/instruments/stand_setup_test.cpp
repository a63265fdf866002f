// Stand files: calibration matrices from known loads, and every mistake named with line and column.
#include "bench/stand/instruments/stand_setup.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "host/base/error.hpp"
#include "host/base/random.hpp"

namespace rotorloop::modbus {
namespace {

using testing::AllOf;
using testing::HasSubstr;

// Two cells: 40 and 900 counts a unit, each feels the other's load by 1 % of full scale per full scale; noise of 0.05 % of full scale.
constexpr double kFullN = 50.0, kFullNm = 1.0;
LoadCase weighed(double force_N, double torque_N_m, std::uint64_t n, double noise = 0.0005) {
  const RandomStream random(11, 22);
  LoadCase c;
  c.load = {force_N, torque_N_m};
  c.reading[0] = 40.0 * (force_N + 0.01 * kFullN / kFullNm * torque_N_m + noise * kFullN * random.gaussian(2 * n)) + 17.0;
  c.reading[1] = 900.0 * (torque_N_m + 0.01 * kFullNm / kFullN * force_N + noise * kFullNm * random.gaussian(2 * n + 1)) - 5.0;
  return c;
}
std::vector<LoadCase> eight_cases(double noise = 0.0005) {
  std::vector<LoadCase> out;
  std::uint64_t n = 0;
  for (const auto& [f, q] :
       std::vector<std::pair<double, double>>{{0, 0}, {50, 0}, {-50, 0}, {0, 1}, {0, -1}, {25, 0.5}, {40, -0.8}, {-25, 0.5}})
    out.push_back(weighed(f, q, n++, noise));
  return out;
}

TEST(LoadCalibration, CrossTalkOf1percentIsFoundAndTakenOut) {
  std::string problem;
  const LoadCalibration c = fit_calibration(eight_cases(), {kFullN, kFullNm}, problem);
  ASSERT_EQ(problem, "");
  EXPECT_NEAR(c.cross_talk_percent[0], 1.0, 0.1);
  EXPECT_NEAR(c.cross_talk_percent[1], 1.0, 0.1);
  EXPECT_NEAR(c.condition, 1.02, 0.01);
  EXPECT_LT(c.residual_max[0], 0.002 * kFullN);
  EXPECT_GT(c.residual_sd[0], 0.0002 * kFullN);
  const auto load = c.load_of(weighed(33.0, 0.4, 0, 0.0).reading);
  EXPECT_NEAR(load[0], 33.0, 0.001 * kFullN);
  EXPECT_NEAR(load[1], 0.4, 0.001 * kFullNm);
  // without the matrix the torque would be 0.66 % of full scale off
  EXPECT_NEAR((weighed(33.0, 0.4, 0, 0.0).reading[1] + 5.0) / 900.0 - 0.4, 0.0066, 1e-9);
}

TEST(LoadCalibration, WithoutNoiseTheMatrixIsExact) {
  std::string problem;
  const LoadCalibration c = fit_calibration(eight_cases(0.0), {kFullN, kFullNm}, problem);
  const auto load = c.load_of(weighed(-12.0, 0.9, 0, 0.0).reading);
  EXPECT_NEAR(load[0], -12.0, 1e-9);
  EXPECT_NEAR(load[1], 0.9, 1e-9);
  EXPECT_NEAR(c.zero[0], 17.0, 1e-9);
}

TEST(LoadCalibration, CasesThatCannotGiveAMatrixSayWhy) {
  std::string problem;
  auto cases = eight_cases();
  cases.resize(5);
  (void)fit_calibration(cases, {kFullN, kFullNm}, problem);
  EXPECT_THAT(problem, HasSubstr("5 load cases, at least 6"));
  cases.clear();
  for (int i = -4; i <= 4; ++i) cases.push_back(weighed(10.0 * i, 0.2 * i, static_cast<std::uint64_t>(i + 4)));  // a weight at one arm only
  (void)fit_calibration(cases, {kFullN, kFullNm}, problem);
  EXPECT_THAT(problem, HasSubstr("do not separate thrust, torque and zero"));
  cases = eight_cases();
  for (LoadCase& c : cases) c.reading[1] = 2.0 * c.reading[0] + 3.0;  // both channels from one cell
  (void)fit_calibration(cases, {kFullN, kFullNm}, problem);
  EXPECT_THAT(problem, HasSubstr("show nearly the same"));
}

std::filesystem::path shipped_profile(const std::string& name) {
  return std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "devices" / (name + ".toml");
}

std::string good_file() {
  std::ifstream in(std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "devices/examples/stand.toml");
  return {std::istreambuf_iterator<char>(in), {}};
}
std::string refusal_of(const std::string& text) {
  try {
    (void)parse_stand_setup(text, "stand.toml", [](const std::string& n) {
      return std::filesystem::is_regular_file(shipped_profile(n))
                 ? shipped_profile(n)
                 : throw Error({"PROFILE", "\"" + n + "\" is no shipped profile", "", "see the list"});
    });
    return "accepted";
  } catch (const Error& e) {
    return e.what();
  }
}
std::string changed(std::string_view from, std::string_view to) {
  std::string text = good_file();
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(StandFile, TheShippedExampleIsAcceptedAndItsTextNamesCalibrationAxesAndEvidence) {
  ASSERT_EQ(refusal_of(good_file()), "accepted");
  const StandSetup s = parse_stand_setup(good_file(), "stand.toml", [](const std::string& n) { return shipped_profile(n); });
  const std::string text = stand_setup_text(s, "2099-01-01");
  EXPECT_THAT(text, AllOf(HasSubstr("EXPIRED"), HasSubstr("cross-talk"), HasSubstr("axis thrust"), HasSubstr("evidence manual"),
                          HasSubstr("settle word order")));
  EXPECT_THAT(stand_setup_text(s, s.calibrated_on), testing::Not(HasSubstr("EXPIRED")));
  EXPECT_EQ(s.limits.size(), 10u);
}

TEST(StandFile, EveryMistakeIsNamedWithLineAndColumn) {
  EXPECT_THAT(refusal_of(changed("serial = \"M-", "serial_ = \"M-")),
              AllOf(HasSubstr("stand.toml:"), HasSubstr("serial"), HasSubstr("(column ")));
  EXPECT_THAT(refusal_of(changed("profile = \"laumas_tlb\"", "profile = \"laumas\"")),
              AllOf(HasSubstr("is no shipped profile (column "), HasSubstr("stand.toml:")));
  EXPECT_THAT(refusal_of(changed("channels = [\"gross\"]", "channels = [\"gros\"]")), HasSubstr("has no channel \"gros\" (column 12)"));
  EXPECT_THAT(refusal_of(changed("channel = \"cell.gross\"", "channel = \"cell.gros\"")),
              AllOf(HasSubstr("is none of this stand (column 11)"), HasSubstr("cell.gross")));
  EXPECT_THAT(refusal_of(changed("channel = \"cell.gross\"", "channel = \"cell.net\"")), HasSubstr("not among the channels that are read"));
  EXPECT_THAT(refusal_of(changed("channel = \"cell.gross\"", "channel = \"supply.voltage\"")),
              HasSubstr("supply.voltage is in V, axis thrust needs N"));
  EXPECT_THAT(refusal_of(changed("axis = \"torque\"", "axis = \"air_pressure\"")), HasSubstr("needs Pa"));
  EXPECT_THAT(refusal_of(changed("full_scale = 1.0", "")), HasSubstr("has no full_scale"));
  EXPECT_THAT(refusal_of(changed("port = \"rtu:/dev/ttyUSB0\"", "port = \"tcp:10.0.0.1:0\"")), HasSubstr("TCP port \"0\" (column 8)"));
  EXPECT_THAT(refusal_of(changed("port = \"rtu:/dev/ttyUSB0\"", "port = \"tcp:10.0.0.1\"")), HasSubstr("has no TCP"));
  EXPECT_THAT(refusal_of(changed("baud = 115200", "baud = 57600")), HasSubstr("does not speak 57600 8N1"));
  EXPECT_THAT(refusal_of(changed("stale_ms = 100", "stale_ms = 5")),
              AllOf(HasSubstr("stale_ms = 5 ms of cell is below"), HasSubstr("two cycles of this bus")));
  EXPECT_THAT(refusal_of(changed("expires = \"2027", "expires = \"2020")), HasSubstr("is not after date"));
  EXPECT_THAT(refusal_of(changed("date = \"2026-11-20\"", "date = \"20.11.2026\"")), HasSubstr("is no date (column 8)"));
  EXPECT_THAT(refusal_of(changed("force_N = 50.0,", "force_N = 5000.0,")), HasSubstr("beyond 120 % of full scale"));
  EXPECT_THAT(refusal_of(changed("force_N = 50.0,", "force_N = -50.0,")), HasSubstr("of full scale off in one case"));
  EXPECT_THAT(refusal_of(changed("omega_max_rad_s = 1100.0", "omega_max_rad_s = 10500.0")),
              AllOf(HasSubstr("gives tip Mach"), HasSubstr("RPM instead of rad/s")));
  EXPECT_THAT(refusal_of(changed("side_m = 1.5", "side_m = 0.05")), HasSubstr("is inside the propeller"));
}

TEST(StandFile, ALimitThatIsMissingOrBeyondWhatWasCalibratedIsRefused) {
  for (const char* key : {"current_A", "voltage_V", "omega_rad_s", "thrust_N", "torque_N_m", "vibration_m_s2", "temperature_degC",
                          "tracking_error_rad_s", "stale_ms", "run_time_s"}) {
    std::string text = good_file();
    const auto at = text.find(std::string("\n") + key + " = {", text.find("[limits]"));
    ASSERT_NE(at, std::string::npos) << key;
    text.erase(at, text.find('\n', at + 1) - at);
    EXPECT_THAT(refusal_of(text), HasSubstr(std::string("key \"limits.") + key + "\" is missing (column")) << key;
  }
  EXPECT_THAT(refusal_of(changed("thrust_N = { max = 45.0", "thrust_N = { max = 80.0")), HasSubstr("above 120 % of the calibrated 50"));
  EXPECT_THAT(refusal_of(changed("omega_rad_s = { max = 1000.0", "omega_rad_s = { max = 1200.0")),
              HasSubstr("the most that the propeller may turn"));
}

}  // namespace
}  // namespace rotorloop::modbus
