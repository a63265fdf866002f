// Options and vehicle files that identify and diagnose share.
#include "cli/fit_options.hpp"

#include <gtest/gtest.h>

#include "cli/renamed_option.hpp"
#include "host/base/error.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::cli {
namespace {

namespace fs = std::filesystem;

host::VehicleFile calibrated(const host::EffectCatalogue& catalogue) {
  return host::read_vehicle(std::string(ROTORLOOP_SOURCE_DIR) + "/vehicles/calibrated.toml", catalogue);
}

TEST(WriteChecked, AVehicleWithNegativeVerticalDragIsRefusedAsDataQualityAndNotWritten) {
  const rotorloop::test::TempFolder folder;
  const host::EffectCatalogue catalogue = host::builtin_effect_catalogue();
  host::VehicleFile v = calibrated(catalogue);
  write_checked(folder.path() / "good.toml", v, catalogue);
  EXPECT_TRUE(fs::exists(folder.path() / "good.toml"));
  v.c_dz_N_s2_m2.value = -0.002;
  try {
    write_checked(folder.path() / "bad.toml", v, catalogue);
    FAIL() << "written";
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::data_quality);
    EXPECT_NE(e.text().what.find("not credible and was not written"), std::string::npos) << e.what();
    EXPECT_NE(e.text().what.find("c_dz"), std::string::npos) << e.what();
  }
  EXPECT_FALSE(fs::exists(folder.path() / "bad.toml"));
}

TEST(FitOptions, WordsOfTheCommandLineReachTheFit) {
  CLI::App app;
  identify::FitRequest o;
  add_fit_options(app, o, "states per second", 20.0);
  app.parse("--use gyro,velocity --rate 50 --from 1.5 --to 9 --free gravity_tilt=0.01 --hold c_q --per-flight com_offset", false);
  identify::IdentifyOptions i;
  o.apply(i);
  EXPECT_TRUE(i.grid.use_gyro);
  EXPECT_FALSE(i.grid.use_accel);
  EXPECT_TRUE(i.grid.use_velocity);
  EXPECT_EQ(i.grid.rate_Hz, 50.0);
  EXPECT_EQ(i.grid.from_s, 1.5);
  EXPECT_EQ(i.grid.to_s, 9.0);
  EXPECT_EQ(i.wishes.free, std::vector<std::string>{"gravity_tilt=0.01"});
  EXPECT_EQ(i.wishes.hold, std::vector<std::string>{"c_q"});
  EXPECT_EQ(i.wishes.per_flight, std::vector<std::string>{"com_offset"});
}

TEST(FitOptions, GyroAndAccelerometerAreUsedWhereAllFlightsHaveThemAndTheUserNamedNothing) {
  identify::FlightToFit whole, without_accelerometer;
  whole.record.gyro_B_rad_s.add(0.0, Eigen::Vector3d::Zero());
  whole.record.accel_B_m_s2.add(0.0, Eigen::Vector3d::Zero());
  without_accelerometer.record.gyro_B_rad_s.add(0.0, Eigen::Vector3d::Zero());
  identify::FitRequest both, gyro_alone, none{.use = {"none"}};
  both.use_what_all_have({whole, whole});
  EXPECT_EQ(both.use, (std::vector<std::string>{"gyro", "accel"}));
  gyro_alone.use_what_all_have({whole, without_accelerometer});
  EXPECT_EQ(gyro_alone.use, std::vector<std::string>{"gyro"});
  none.use_what_all_have({whole});
  identify::IdentifyOptions i;
  none.apply(i);
  EXPECT_FALSE(i.grid.use_gyro || i.grid.use_accel);
}

TEST(FitOptions, ThePlaceOfAnAccelerometerInUseIsLookedForUnlessTheUserSaidOtherwise) {
  const host::VehicleFile v = calibrated(host::builtin_effect_catalogue());
  identify::FitRequest used{.use = {"accel"}}, unused{.use = {"gyro"}}, held{.hold = {"imu_place"}, .use = {"accel"}};
  for (identify::FitRequest* o : {&used, &unused, &held}) o->free_place_of_accelerometer(v);
  ASSERT_EQ(used.free.size(), 1u);
  EXPECT_TRUE(used.free[0].starts_with("imu_place=0.0")) << used.free[0];  // m: a part of an arm of some centimetres to decimetres
  EXPECT_TRUE(unused.free.empty());
  EXPECT_TRUE(held.free.empty());
}

TEST(FitOptions, ARateBelowTheLeastOfTheCommandIsAnErrorOfUse) {
  CLI::App app;
  identify::FitRequest o;
  add_fit_options(app, o, "states per second", 20.0);
  EXPECT_THROW(app.parse("--rate 10", false), CLI::ParseError);
}

TEST(RenamedOption, WorksByItsOldNameSaysTheNewOneAndIsNotInTheHelp) {
  CLI::App app;
  bool no_priors = false;
  std::vector<fs::path> compared;
  app.add_flag("--no-priors", no_priors, "no priors");
  add_old_flag(app, "--forget", "--no-priors", &no_priors);
  app.add_option("--compare", compared, "files");
  add_old_option(app, "--beside", "--compare", &compared);
  testing::internal::CaptureStderr();
  app.parse("--forget --beside a.toml --beside b.toml", false);
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "warning: --forget is called --no-priors now\nwarning: --beside is called --compare now\n");
  EXPECT_TRUE(no_priors);
  EXPECT_EQ(compared, (std::vector<fs::path>{"a.toml", "b.toml"}));
  EXPECT_EQ(app.help().find("--forget"), std::string::npos);
  EXPECT_EQ(app.help().find("--beside"), std::string::npos);
}

}  // namespace
}  // namespace rotorloop::cli
