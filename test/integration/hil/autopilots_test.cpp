// The bridges to ArduPilot's and PX4's simulator programs, flown by the built command with a stand-in from their documented packets, and in
// the ways in which such a program fails. Neither program itself is run.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <nlohmann/json.hpp>

#include "test/integration/hil/cli_run.hpp"

namespace rotorloop::test {
namespace {

using testing::HasSubstr;

const std::string kSource = ROTORLOOP_SOURCE_DIR;

struct Autopilot {
  const char *name, *variable;
};

class AutopilotBridges : public testing::TestWithParam<Autopilot> {
 protected:
  ~AutopilotBridges() override { unsetenv(GetParam().variable); }
  void stand_in(const std::string& mode) {
    const auto program = folder_ / "stand_in";
    write_text(program, "#!/bin/sh\nexec python3 -B '" + kSource + "/test/integration/hil/stand_in_autopilot.py' " + GetParam().name + " " +
                            mode + " \"$@\"\n");
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    setenv(GetParam().variable, program.c_str(), 1);
  }
  CommandResult fly(const std::string& name) {
    const auto scenario = write_short_scenario(folder_.path(), "");
    const std::string autopilot = GetParam().name;
    return rotorloop_command("hil '" + scenario.string() + "' -q --jobs 1 --controller " + autopilot +
                                 " --controller-timeout 60 --variants " + autopilot + " --out '" + (folder_ / "runs").string() +
                                 "' --name " + name,
                             folder_.path());
  }
  nlohmann::json flight(const std::string& name) {
    const auto result = result_of(folder_ / "runs" / name);
    return result.is_object() && !result["flights"].empty() ? result["flights"].back() : nlohmann::json::object();
  }
  std::string detail(const std::string& name) { return flight(name).value("end_detail", ""); }
  void expect_incomplete(const std::string& mode, const std::string& what) {
    stand_in(mode);
    EXPECT_EQ(fly(mode).exit_code, 7);
    EXPECT_EQ(flight(mode).value("end", ""), "incomplete");
    EXPECT_THAT(detail(mode), HasSubstr(what));
  }
  ScratchFolder folder_;
};

TEST_P(AutopilotBridges, AStandInFromTheDocumentedPacketsArmsTakesOffAndFliesTheSameBitsTwice) {
  stand_in("flies");
  ASSERT_EQ(fly("first").exit_code, 0) << detail("first");
  EXPECT_EQ(flight("first")["end"], "completed");
  EXPECT_LT(flight("first")["error_cm"]["mean_3d"], 10.0);  // of 100 cm climbed; with a wrong sign of one axis it falls
  const std::string notes = read_text(folder_ / "runs" / "first" / "climb" / GetParam().name / "1" / "controller.log");
  EXPECT_THAT(notes, HasSubstr("armed: motor outputs above zero"));
  EXPECT_THAT(notes, HasSubstr(" 0 of them without an answer"));
  ASSERT_EQ(fly("second").exit_code, 0);
  EXPECT_EQ(result_of(folder_ / "runs" / "first")["log_sha256"], result_of(folder_ / "runs" / "second")["log_sha256"]);
}

TEST_P(AutopilotBridges, WithoutItsProgramNothingFliesAndTheVariableIsNamed) {
  unsetenv(GetParam().variable);
  const auto unset = fly("unset");
  EXPECT_EQ(unset.exit_code, 3);
  EXPECT_THAT(unset.err, HasSubstr(std::string(GetParam().variable) + ": error: is not set"));
}

TEST_P(AutopilotBridges, AProgramThatEndsNeverSpeaksOrStopsIsNamedAndTheLogIsKept) {
  expect_incomplete("ends_at_start", "its program ended while it started");
  expect_incomplete("silent", std::string(GetParam().name) == "px4" ? "did not connect to TCP port 4560 within 8 s"
                                                                    : "sent no servo packet to UDP 9002 within 8 s");
  expect_incomplete("ends_in_flight", "its program has ended");
  EXPECT_THAT(read_text(folder_ / "runs" / "ends_in_flight" / "climb" / GetParam().name / "1" / (std::string(GetParam().name) + ".log")),
              HasSubstr("out of battery"));
  expect_incomplete("stops", "no motor packet for");
  if (std::string(GetParam().name) == "px4") expect_incomplete("mute", "no motor packet for");
}

INSTANTIATE_TEST_SUITE_P(Each, AutopilotBridges,
                         testing::Values(Autopilot{"ardupilot", "ROTORLOOP_ARDUPILOT"}, Autopilot{"px4", "ROTORLOOP_PX4"}),
                         [](const auto& i) { return std::string(i.param.name); });

}  // namespace
}  // namespace rotorloop::test
