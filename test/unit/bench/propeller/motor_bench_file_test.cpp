// Steady points of a motor bench: what is read, in SI, and what is refused with which words.
#include "bench/propeller/motor_bench_file.hpp"

#include <numbers>

#include "host/base/error.hpp"
#include "test/unit/bench/propeller/fixtures.hpp"

namespace rotorloop::propeller {
namespace {
using namespace fixtures;
using ::testing::AllOf;
using ::testing::HasSubstr;

// Invented rows of the format.
const std::string kBench = R"({
  "meta": {"motor": "Some 2306", "prop": "none", "profile_def": {"pole_pairs": 7}},
  "metrics": {"steady_points": [
    {"throttle": 0.1, "voltage_v": 24.0, "current_a": 0.5, "elec_power_w": 12.0, "rpm": 3000.0, "thrust_gf": 10.0},
    {"throttle": 0.2, "voltage_v": 23.9, "current_a": 1.0, "elec_power_w": 23.9, "rpm": 6000.0, "thrust_gf": 40.0},
    {"throttle": 0.3, "voltage_v": 23.8, "current_a": 2.0, "elec_power_w": 47.6, "rpm": 9000.0, "thrust_gf": 90.0},
    {"throttle": 0.4, "voltage_v": 23.7, "current_a": 4.0, "elec_power_w": 94.8, "rpm": 12000.0, "thrust_gf": 160.0}]}})";

MotorBenchFile parse(const std::string& text) { return parse_motor_bench(text, "bench.json"); }
std::string refusal(const std::string& from, const std::string& to) {
  return message([&] { parse(replaced(kBench, from, to)); });
}

TEST(MotorBenchFile, RpmAndGramForceBecomeSi) {
  const MotorBenchFile f = parse(kBench);
  ASSERT_EQ(f.rows.size(), 4u);
  EXPECT_EQ(f.pole_pairs, 7);
  EXPECT_EQ(f.propeller, "none");
  EXPECT_NEAR(f.rows[1].omega_rad_s, 6000.0 * std::numbers::pi / 30.0, 1e-9);
  EXPECT_NEAR(f.rows[1].thrust_N, 0.040 * 9.80665, 1e-12);
  EXPECT_EQ(f.rows[1].bus_V, 23.9);
  EXPECT_EQ(f.rows[1].bus_A, 1.0);
}
TEST(MotorBenchFile, MissingFieldIsNamedWithItsRow) {
  EXPECT_THAT(refusal("\"rpm\": 6000.0", "\"speed\": 6000.0"),
              AllOf(HasSubstr("bench.json"), HasSubstr("metrics.steady_points[1].rpm is missing")));
}
TEST(MotorBenchFile, ThrottleInPercentIsRefusedWithItsRange) {
  EXPECT_THAT(refusal("\"throttle\": 0.2", "\"throttle\": 20"),
              AllOf(HasSubstr("[1].throttle = 20 is outside 0.01 to 1 of full throttle"), HasSubstr("do:")));
}
TEST(MotorBenchFile, ElectricalSpeedIsRefused) { EXPECT_THAT(refusal("12000.0", "121000.0"), HasSubstr("rpm = 121000 is outside")); }
TEST(MotorBenchFile, TextInPlaceOfANumberIsRefused) {
  EXPECT_THAT(refusal("\"current_a\": 2.0", "\"current_a\": \"2.0\""), HasSubstr("[2].current_a = \"2.0\" is not a number"));
}
TEST(MotorBenchFile, NullOfAFailedSensorIsRefused) {
  EXPECT_THAT(refusal("\"thrust_gf\": 40.0", "\"thrust_gf\": null"), HasSubstr("[1].thrust_gf = null is not a number"));
}
// Rows that contradict themselves end the command with exit code 5.
std::string data_fault(const std::string& from, const std::string& to) {
  try {
    parse(replaced(kBench, from, to));
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::data_quality);
    return e.what();
  }
  return "(no error)";
}
TEST(MotorBenchFile, PowerThatContradictsVoltageTimesCurrentIsADataFault) {
  EXPECT_THAT(data_fault("47.6", "57.6"), HasSubstr("elec_power_w = 57.6 W, but voltage_v times current_a is 47.60 W"));
}
TEST(MotorBenchFile, ThrottleThatDoesNotRiseIsADataFault) {
  EXPECT_THAT(data_fault("\"throttle\": 0.3", "\"throttle\": 0.2"), HasSubstr("does not exceed that of the row before"));
}
TEST(MotorBenchFile, AbortedStaircaseIsRefused) {
  EXPECT_THAT(message([] {
                parse(R"({"meta": {"motor": "m", "prop": "p", "profile_def": {"pole_pairs": 7}}, "metrics": {"steady_points": []}})");
              }),
              HasSubstr("has 0 rows, expected at least 4"));
}
TEST(MotorBenchFile, OtherFilesAreRefused) {
  EXPECT_THAT(message([] { parse("rpm,thrust\n1,2\n"); }), HasSubstr("is not JSON"));
  EXPECT_THAT(message([] { parse("[1, 2]"); }), HasSubstr("meta is missing"));
  EXPECT_THAT(message([] { read_motor_bench("no/such/bench.json"); }), AllOf(HasSubstr("no/such/bench.json"), HasSubstr("cannot be read")));
}

}  // namespace
}  // namespace rotorloop::propeller
