// Controllers that are not ours, flown by the built command: as a library, as a process, and as everything that goes wrong with them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "test/integration/hil/busy_neighbours.hpp"
#include "test/integration/hil/cli_run.hpp"

namespace rotorloop::test {
namespace {

using testing::HasSubstr;

const std::string kSource = ROTORLOOP_SOURCE_DIR;
const std::string kPython = "python=python3 " + kSource + "/docs/examples/own_controller/controller.py";

// Long enough for an interpreter to start on a machine that is busy with other things.
constexpr const char* kTimeout = "--controller-timeout 5";

class Controllers : public testing::Test {
 protected:
  CommandResult fly(const std::string& name, const std::string& options) {
    return rotorloop_command(
        "hil '" + scenario_.string() + "' -q --jobs 1 --out '" + (folder_ / "runs").string() + "' --name " + name + " " + options,
        folder_.path());
  }
  // Only the controller under test, which fails as `mode` says.
  CommandResult fly_failing(const std::string& mode, const std::string& more = "") {
    return fly(mode, "--variants failing --controller 'failing=exec python3 " + kSource + "/test/integration/hil/failing_controller.py " +
                         mode + "' " + more);
  }
  nlohmann::json flight(const std::string& name) {
    const auto result = result_of(folder_ / "runs" / name);
    return result.is_object() && !result["flights"].empty() ? result["flights"].back() : nlohmann::json::object();
  }
  std::filesystem::path log(const std::string& name, const std::string& variant, const std::string& file) {
    return folder_ / "runs" / name / "climb" / variant / "1" / file;
  }
  static std::size_t rows(const std::filesystem::path& csv) {
    const std::string text = read_text(csv);
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  }

  ScratchFolder folder_;
  std::filesystem::path scenario_ = write_short_scenario(folder_.path());
};

// Its lines but those of the header, which name the variant.
std::string rows_of(const std::filesystem::path& csv) {
  const std::string text = read_text(csv);
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const auto end = std::min(text.find('\n', at), text.size() - 1) + 1;
    if (text[at] != '#') out += text.substr(at, end - at);
    at = end;
  }
  return out;
}

TEST_F(Controllers, OurOwnControllerBuiltAsALibraryFliesTheSameBits) {
  const auto done = fly("both", "--controller 'library=" OUR_CONTROLLER_LIBRARY "'");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  for (const char* file : {"flight.csv", "truth.csv", "esc.log", "state.log"}) {
    const std::string ours = rows_of(log("both", "pd_ff_thrust_drag", file)), library = rows_of(log("both", "library", file));
    ASSERT_GT(ours.size(), 100'000u) << file;
    EXPECT_TRUE(ours == library) << file;
  }
  EXPECT_THAT(done.out, HasSubstr("library"));
  EXPECT_THAT(done.out, HasSubstr("attitude error"));
}

TEST_F(Controllers, APythonControllerFliesTheSameBitsEveryTimeAndBesideBusyProcesses) {
  const std::string options = "--variants python --controller '" + kPython + "'";
  ASSERT_EQ(fly("first", options).exit_code, 0);
  const std::string first = result_of(folder_ / "runs" / "first")["log_sha256"];
  ASSERT_EQ(first.size(), 64u);
  for (const char* name : {"second", "third", "fourth"}) {
    ASSERT_EQ(fly(name, options).exit_code, 0);
    EXPECT_EQ(result_of(folder_ / "runs" / name)["log_sha256"], first) << name;
  }
  const BusyNeighbours neighbours(3);
  ASSERT_EQ(neighbours.count(), 3u);
  ASSERT_EQ(fly("busy", options).exit_code, 0);
  EXPECT_EQ(result_of(folder_ / "runs" / "busy")["log_sha256"], first);
}

TEST_F(Controllers, PythonAtAttitudeLevelFliesThePapersHorizontalFlightWithinTwiceOurError) {
  const auto done = rotorloop_command(
      "hil '" + kSource + "/scenarios/paper.toml' -q --flights horizontal --seeds 1, --variants pd_ff_thrust_drag --controller '" +
          kPython + "' --no-logs --jobs 2 --out '" + (folder_ / "runs").string() + "' --name paper",
      folder_.path());
  const auto flights = result_of(folder_ / "runs" / "paper")["flights"];
  ASSERT_EQ(flights.size(), 2u) << done.err;
  ASSERT_EQ(flights[1]["variant"], "python");
  EXPECT_EQ(flights[1]["end"], "completed");
  const double ours_cm = flights[0]["error_cm"]["mean_3d"], python_cm = flights[1]["error_cm"]["mean_3d"];
  EXPECT_LE(python_cm, 2.0 * ours_cm);
  EXPECT_GT(python_cm, 0.0);
}

TEST_F(Controllers, TheExampleLibraryFliesAndWhatItPrintsIsKept) {
  ASSERT_EQ(fly("example", "--variants example --controller 'example=" EXAMPLE_LIBRARY "'").exit_code, 0);
  EXPECT_EQ(flight("example")["end"], "completed");
  EXPECT_THAT(read_text(log("example", "example", "controller.log")), HasSubstr("my_controller: climb, 0.682 kg"));
}

TEST_F(Controllers, OneThatHangsEndsTheFlightAsIncompleteAndTheLogIsKept) {
  EXPECT_EQ(fly_failing("hang", kTimeout).exit_code, 7);
  EXPECT_EQ(flight("hang")["end"], "incomplete");
  EXPECT_EQ(flight("hang")["end_detail"], "controller failing: no answer for 5 s at step 2500 (2.500 s)");
  EXPECT_GT(rows(log("hang", "failing", "flight.csv")), 2400u);
}

TEST_F(Controllers, OneThatNeverAnswersIsNamed) {
  EXPECT_EQ(fly("mute", "--variants mute --controller 'mute=cat >/dev/null' " + std::string(kTimeout)).exit_code, 7);
  EXPECT_EQ(flight("mute")["end_detail"], "controller mute: no answer for 5 s to the first line");
}

TEST_F(Controllers, OneThatCrashesEndsTheFlightWithItsSignalAndTheLogIsKept) {
  EXPECT_EQ(fly_failing("crash").exit_code, 7);
  EXPECT_EQ(flight("crash")["end"], "incomplete");
  EXPECT_THAT(flight("crash")["end_detail"].get<std::string>(), HasSubstr("ended by signal 11"));
  EXPECT_GT(rows(log("crash", "failing", "flight.csv")), 2400u);
}

TEST_F(Controllers, OneThatExitsEndsTheFlightWithItsCodeAndItsLastWords) {
  EXPECT_EQ(fly_failing("exit").exit_code, 7);
  EXPECT_EQ(flight("exit")["end_detail"],
            "controller failing: ended with exit code 1 at step 2500 (2.500 s) (its last line on standard error: out of ideas)");
}

TEST_F(Controllers, OneThatSaysSomethingElseOrSpeaksAnotherVersionIsNamed) {
  EXPECT_EQ(fly_failing("text").exit_code, 7);
  EXPECT_EQ(flight("text")["end_detail"], "controller failing: no JSON object: \"not an answer\" at step 2500 (2.500 s)");
  EXPECT_EQ(fly_failing("version").exit_code, 7);
  EXPECT_EQ(flight("version")["end_detail"], "controller failing: handshake version 2, here version 1");
}

TEST_F(Controllers, OneStepOfNotANumberOrOutOfRangeHoldsTheLastCommandAndCounts) {
  for (const char* mode : {"nan_once", "far_once"}) {
    EXPECT_EQ(fly_failing(mode).exit_code, 0) << mode;
    EXPECT_EQ(flight(mode)["end"], "completed") << mode;
    EXPECT_EQ(flight(mode)["counters"]["control.bad_input"], 1.0) << mode;
  }
}

TEST_F(Controllers, ThreeStepsOfNotANumberInARowLeadToTheSafeState) {
  EXPECT_EQ(fly_failing("nan_thrice").exit_code, 6);
  EXPECT_EQ(flight("nan_thrice")["end"], "safe_state");
  EXPECT_THAT(flight("nan_thrice")["end_detail"].get<std::string>(),
              HasSubstr("controller: no usable command three times in a row at 2.50"));
}

TEST_F(Controllers, ALibraryThatCrashesEndsOneFlightAndNotTheRun) {
  EXPECT_EQ(fly("library_crash", "--controller 'crashing=" CRASHING_LIBRARY "'").exit_code, 7);
  const auto flights = result_of(folder_ / "runs" / "library_crash")["flights"];
  ASSERT_EQ(flights.size(), 2u);
  EXPECT_EQ(flights[0]["end"], "completed");
  EXPECT_EQ(flights[1]["end"], "incomplete");
  EXPECT_THAT(flights[1]["end_detail"].get<std::string>(), HasSubstr("signal 11"));
}

TEST_F(Controllers, ALibraryOfAnotherAbiIsRefusedWithBothNumbers) {
  EXPECT_EQ(fly("abi", "--variants foreign --controller 'foreign=" FOREIGN_ABI_LIBRARY "'").exit_code, 7);
  EXPECT_THAT(flight("abi")["end_detail"].get<std::string>(), HasSubstr("ABI 99, here ABI 1"));
}

TEST_F(Controllers, AScenarioNamesAControllerAndALimitForIt) {
  scenario_ =
      write_short_scenario(folder_.path(), "[[external_controller]]\nname = \"failing\"\ncommand = \"python3 " + kSource +
                                               "/test/integration/hil/failing_controller.py never\"\n"
                                               "[[limits.mean_tracking_error_cm]]\nflight = \"climb\"\nvariant = \"failing\"\nmax = 5\n");
  std::string text = read_text(scenario_);
  const std::string ours = "[\"pd_ff_thrust_drag\"]";
  text.replace(text.find(ours), ours.size(), "[\"failing\"]");
  write_text(scenario_, text);
  EXPECT_EQ(fly("limit", "").exit_code, 0);
  EXPECT_TRUE(result_of(folder_ / "runs" / "limit")["limits"][0]["pass"]);
}

}  // namespace
}  // namespace rotorloop::test
