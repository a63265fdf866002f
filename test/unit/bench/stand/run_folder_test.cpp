// The format of a run's folder from both of its ends.
#include "bench/stand/run_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "bench/stand/evaluate/estimate/known_headers.hpp"
#include "bench/stand/evaluate/estimate/stand_uncertainty.hpp"
#include "host/base/error.hpp"

namespace rotorloop {
namespace {

using testing::HasSubstr;

stand::RunFacts read_back(const std::string& text) {
  const auto path = std::filesystem::temp_directory_path() / ("rotorloop_facts" + std::to_string(::getpid()) + ".toml");
  std::ofstream(path) << text;
  struct Remove {
    const std::filesystem::path& path;
    ~Remove() { std::filesystem::remove(path); }
  } remove{path};
  return stand::read_run_toml(path);
}

stand::RunFacts every_fact() {
  stand::RunFacts f;
  f.motor = "2306 \"no. 3\"";
  f.propeller = "5x4.3 no. 1";
  f.mount = "2";
  f.esc = "E\\1";
  f.stand = "bench 2";
  f.pole_pairs = 7;
  f.diameter_m = 0.127;
  f.simulated = true;
  f.sequence = "staircase,step";
  f.started_utc = "2026-11-20T08:00:00Z";
  f.version = "rotorloop 1";
  f.end = "tripped";
  f.trip = "thrust_N";
  f.air_temperature_degC = 21.5;
  f.air_pressure_Pa = 98100.0;
  f.air_humidity = 0.4;
  f.airspeed_m_s = -3.5;
  f.winding = stand::MeasuredWinding{0.064, 0.06, 15e-6, 18e-6, 0.017, 0.018, 24.5};
  for (const auto& k : stand::kUncertaintyKeys) f.uncertainty[k.key] = 0.001 * static_cast<double>(1 + f.uncertainty.size());
  f.instruments = {{"thrust", "cell", "force", "measured", "this project"}, {"torque", "cell", "torque", "manual", ""}};
  f.calibrated_on = "2026-11-20";
  f.calibration_expires = "2027-11-20";
  f.stand_sha256 = "ab01";
  f.esc_node = 21;
  f.esc_name = "org.rotorloop.esc";
  f.esc_unique_id = "00";
  f.esc_software = "1.0 00000001";
  f.esc_image_crc = "ff";
  f.esc_parameters = {{"pole_pairs", "7"}, {"resistance", "0.06"}};
  return f;
}

TEST(RunFolder, EveryFactThatIsWrittenIsReadBackTheSame) {
  const stand::RunFacts written = every_fact(), read = read_back(stand::run_toml(written));
  EXPECT_EQ(stand::run_toml(read), stand::run_toml(written));
  EXPECT_EQ(read.motor, "2306 \"no. 3\"");
  EXPECT_EQ(read.esc, "E\\1");
  EXPECT_EQ(read.uncertainty, written.uncertainty);
  EXPECT_EQ(read.esc_parameters, written.esc_parameters);
  ASSERT_TRUE(read.winding);
  EXPECT_EQ(read.winding->u_inductance, 0.018);
  EXPECT_EQ(read.airspeed_m_s, -3.5);
  EXPECT_EQ(read.air_humidity, 0.4);
}

TEST(RunFolder, ADensityThatAPersonGaveStandsInsteadOfTheInstrumentsAir) {
  stand::RunFacts f = every_fact();
  f.air_density_kg_m3 = 1.19;
  const stand::RunFacts read = read_back(stand::run_toml(f));
  EXPECT_EQ(read.air_density_kg_m3, 1.19);
  EXPECT_NE(read.air_temperature_degC, read.air_temperature_degC);
}

TEST(RunFolder, FactsOfAnotherProgramMayLeaveOutAllButTheFormatAndAreReadAsNotKnown) {
  const stand::RunFacts f = read_back("format = 1\nnote = \"a key of theirs\"\n");
  EXPECT_EQ(f.pole_pairs, 0);
  EXPECT_EQ(stand::run_toml(f), "format = 1\nsimulated = false\n");
}

TEST(RunFolder, AValueOutOfRangeIsRefusedWithItsLineKeyAndRange) {
  try {
    read_back("format = 1\ndiameter_m = 127\n");
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr(".toml:2"));
    EXPECT_THAT(e.what(), HasSubstr("diameter_m"));
    EXPECT_THAT(e.what(), HasSubstr("0.01 to 10 m"));
  }
}

TEST(RunFolder, AnEstimateFindsSpeedThrustTorqueSupplyAndDutyInTheColumnsThatASessionWrites) {
  std::vector<double> measured(stand::kColumns, stand::kNotMeasured);
  measured[stand::kOmegaColumn] = 899.5;
  measured[stand::kThrustColumn] = 1.5;
  measured[stand::kTorqueColumn] = 0.02;
  measured[stand::kDutyColumn] = 0.512345678;
  const std::string line = stand::sample_line(1.23456, 3, 'A', 900.0, measured);
  EXPECT_EQ(line, "1.2346,3,0,900.0000,899.5000,1.50000,0.0200000,,,,,,,,0.512346");
  const auto csv = stand::recognise_csv(stand::samples_header() + "\n" + line + "\n", "samples.csv");
  std::vector<std::string> found;
  for (const auto& channel : csv.mapping.channels) found.push_back(channel.columns[0]);
  EXPECT_THAT(found, testing::ElementsAre("omega_rad_s", "thrust_N", "torque_N_m", "voltage_V", "current_A", "duty_q"));
  EXPECT_EQ(csv.mapping.time_column, "t_s");
}

TEST(RunFolder, EveryUncertaintyThatAFileMayGiveReachesTheEstimate) {
  std::map<std::string, double> given;
  for (const auto& k : stand::kUncertaintyKeys) given[k.key] = 0.0123;
  const stand::StandUncertainty s = stand::stand_uncertainty(given, "run");
  for (const stand::KnownU* known :
       {&s.thrust_calibration, &s.torque_calibration, &s.arm_length, &s.alignment_rad, &s.rotor_speed, &s.air_density, &s.voltage,
        &s.current, &s.zero_thrust, &s.zero_torque, &s.hysteresis, &s.cross_talk_m}) {
    EXPECT_EQ(known->u, 0.0123);
    EXPECT_EQ(known->source, "run");
  }
}

}  // namespace
}  // namespace rotorloop
