// The bridge to Betaflight's simulator program, flown by the built command: with a stand-in that answers from the documented packets, in
// every way in which such a program fails, and with the program itself where ROTORLOOP_BETAFLIGHT names it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "test/integration/hil/cli_run.hpp"

namespace rotorloop::test {
namespace {

using testing::HasSubstr;

const std::string kSource = ROTORLOOP_SOURCE_DIR;
constexpr const char* kVariable = "ROTORLOOP_BETAFLIGHT";

class BetaflightBridge : public testing::Test {
 protected:
  BetaflightBridge() {
    if (const char* given = std::getenv(kVariable)) given_ = given;
  }
  ~BetaflightBridge() override {
    if (given_)
      setenv(kVariable, given_->c_str(), 1);
    else
      unsetenv(kVariable);
  }

  // A program of this mode in place of Betaflight's.
  void stand_in(const std::string& mode) {
    const auto program = folder_ / "stand_in";
    write_text(program, "#!/bin/sh\nexec python3 '" + kSource + "/test/integration/hil/stand_in_betaflight.py' " + mode + " \"$@\"\n");
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    setenv(kVariable, program.c_str(), 1);
  }
  CommandResult fly(const std::string& name, const std::string& options = "--variants betaflight", const std::string& more = "") {
    const auto scenario = write_short_scenario(folder_.path(), more);
    // A machine busy with other things may keep a flight waiting for as long as this.
    return rotorloop_command("hil '" + scenario.string() + "' -q --jobs 1 --controller betaflight --controller-timeout 60 --out '" +
                                 (folder_ / "runs").string() + "' --name " + name + " " + options,
                             folder_.path());
  }
  nlohmann::json flight(const std::string& name) {
    const auto result = result_of(folder_ / "runs" / name);
    return result.is_object() && !result["flights"].empty() ? result["flights"].back() : nlohmann::json::object();
  }
  std::string detail(const std::string& name) { return flight(name).value("end_detail", ""); }
  std::string notes(const std::string& name) {
    return read_text(folder_ / "runs" / name / "climb" / "betaflight" / "1" / "controller.log");
  }
  void expect_first_line_says(const std::string& mode, const std::string& what) {
    stand_in(mode);
    EXPECT_EQ(fly(mode).exit_code, 7);
    EXPECT_EQ(flight(mode).value("end", ""), "incomplete");
    EXPECT_THAT(detail(mode), HasSubstr(what));
  }

  ScratchFolder folder_;
  std::optional<std::string> given_;
};

TEST_F(BetaflightBridge, WithoutItsProgramNothingFliesAndTheVariableIsNamed) {
  unsetenv(kVariable);
  const auto unset = fly("unset", "");
  EXPECT_EQ(unset.exit_code, 3);
  EXPECT_THAT(unset.err, HasSubstr("ROTORLOOP_BETAFLIGHT: error: is not set"));
  setenv(kVariable, "/no/such/program", 1);
  const auto absent = fly("absent", "");
  EXPECT_EQ(absent.exit_code, 3);
  EXPECT_THAT(absent.err, HasSubstr("\"/no/such/program\": no such file"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "runs"));
}

TEST_F(BetaflightBridge, TheConfigurationFollowsTheVehicle) {
  const auto config = [&](const std::string& vehicle) {
    return rotorloop_command(
               "controller betaflight --print-config --gains '" + kSource + "/vehicles/gains.toml' --vehicle '" + vehicle + "'",
               folder_.path())
        .out;
  };
  const std::string shipped = config(kSource + "/vehicles/calibrated.toml");
  EXPECT_THAT(shipped, HasSubstr("set p_pitch = 28\n"));  // 28 rad/s of crossover over 519 rad/s² of the full output
  EXPECT_THAT(shipped, HasSubstr("aux 0 0 0 1700 2100 0 0\n"));
  EXPECT_TRUE(shipped.ends_with("save\n"));
  std::string text = read_text(kSource + "/vehicles/calibrated.toml");
  const auto at = text.find("inertia_kg_m2.yy = { value = ") + 29;
  ASSERT_GT(at, 29u);
  text.replace(at, text.find(',', at) - at, "0.00682");
  write_text(folder_ / "heavier.toml", text);
  EXPECT_THAT(config(folder_ / "heavier.toml"), HasSubstr("set p_pitch = 55\n"));  // twice the inertia, twice the gain
}

TEST_F(BetaflightBridge, AStandInFromTheDocumentedPacketsArmsTakesOffAndFliesTheSameBitsTwice) {
  stand_in("flies");
  ASSERT_EQ(fly("first").exit_code, 0) << detail("first");
  EXPECT_EQ(flight("first")["end"], "completed");
  EXPECT_LT(flight("first")["error_cm"]["mean_3d"], 10.0);  // of 100 cm climbed; with a wrong sign of one axis it falls
  EXPECT_THAT(notes("first"), HasSubstr("armed: motor outputs above zero"));
  EXPECT_THAT(notes("first"), HasSubstr(" 0 of them without an answer"));
  ASSERT_EQ(fly("second").exit_code, 0);
  EXPECT_EQ(result_of(folder_ / "runs" / "first")["log_sha256"], result_of(folder_ / "runs" / "second")["log_sha256"]);
}

TEST_F(BetaflightBridge, AnEscThatFallsSilentStandsInItsLogAndOurs) {
  stand_in("flies");
  EXPECT_EQ(fly("tripped", "--variants betaflight", "[[fault]]\nkind = \"esc_silent\"\ntarget = 2\nat_s = 9.0\n").exit_code, 6);
  EXPECT_EQ(flight("tripped")["end"], "safe_state");
  EXPECT_THAT(detail("tripped"), HasSubstr("ESC 2 silent"));
  EXPECT_THAT(notes("tripped"), HasSubstr("ESC 2: no new speed for 20 ms"));
  EXPECT_THAT(notes("tripped"), HasSubstr("disarmed: motor outputs at zero"));
}

TEST_F(BetaflightBridge, ALineOfTheConfigurationThatIsRefusedIsShown) {
  expect_first_line_says("refuses", "refuses lines of its configuration: ###ERROR IN set");
}
TEST_F(BetaflightBridge, AProgramThatWritesNoConfigurationIsNamed) { expect_first_line_says("writes_nothing", "wrote no eeprom.bin"); }
TEST_F(BetaflightBridge, AProgramThatEndsWhileItStartsIsNamed) {
  expect_first_line_says("ends_at_start", "its program ended while it started");
}

TEST_F(BetaflightBridge, AProgramThatEndsInFlightEndsTheFlightAndTheLogIsKept) {
  stand_in("ends_in_flight");
  EXPECT_EQ(fly("ended").exit_code, 7);
  EXPECT_THAT(detail("ended"), HasSubstr("(8.98"));
  EXPECT_THAT(detail("ended"), HasSubstr("its program has ended"));
  EXPECT_THAT(read_text(folder_ / "runs" / "ended" / "climb" / "betaflight" / "1" / "betaflight.log"), HasSubstr("out of battery"));
}

TEST_F(BetaflightBridge, AProgramThatNeverSendsAMotorPacketIsGivenUpWithinTheWaitOfTheRun) {
  stand_in("silent");
  EXPECT_EQ(fly("silent").exit_code, 7);
  EXPECT_THAT(detail("silent"), HasSubstr("its control loop does not follow the states"));
}

TEST_F(BetaflightBridge, AProgramThatStopsAnsweringInFlightIsGivenUpAfterFourSeconds) {
  stand_in("stops");
  EXPECT_EQ(fly("stops").exit_code, 7);
  EXPECT_THAT(detail("stops"), HasSubstr("no motor packet for 41 states"));
}

TEST_F(BetaflightBridge, TheProgramItselfArmsTakesOffAndHoversBesideOurs) {
  if (!given_) GTEST_SKIP() << "ROTORLOOP_BETAFLIGHT is not set: Betaflight not flown";
  const auto done = fly("real", "");
  ASSERT_EQ(done.exit_code, 0) << done.err << detail("real");
  EXPECT_EQ(flight("real")["variant"], "betaflight");
  EXPECT_EQ(flight("real")["end"], "completed");
  EXPECT_LT(flight("real")["error_cm"]["mean_3d"], 30.0);  // of 100 cm climbed by a pilot at 2.5 rad/s
  EXPECT_THAT(done.out, HasSubstr("attitude error"));
  EXPECT_THAT(read_text(folder_ / "runs" / "real" / "report.html"), HasSubstr("betaflight"));
}

TEST_F(BetaflightBridge, TheProgramItselfWithOneEscTripped) {
  if (!given_) GTEST_SKIP() << "ROTORLOOP_BETAFLIGHT is not set: Betaflight not flown";
  EXPECT_EQ(fly("real_trip", "--variants betaflight", "[[fault]]\nkind = \"esc_silent\"\ntarget = 2\nat_s = 9.0\n").exit_code, 6);
  EXPECT_THAT(detail("real_trip"), HasSubstr("ESC 2 silent"));
  EXPECT_THAT(notes("real_trip"), HasSubstr("ESC 2: no new speed for 20 ms"));
  EXPECT_THAT(notes("real_trip"), HasSubstr("disarmed: motor outputs at zero"));
}

}  // namespace
}  // namespace rotorloop::test
