// The command as a user runs it, with a fake diagnosis: a strut takes thrust that the vehicle file lacks; the diagnosis's vehicle
// file corrects it; the diagnosis cannot open the plant; a second call makes nothing anew; the truth is compared afterwards.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using Json = nlohmann::json;

const fs::path kSource = ROTORLOOP_SOURCE_DIR;

struct CloseTest : ::testing::Test {
  TempFolder folder;
  std::string output, messages;

  // Hover, and 0.3 m up in 1 s (seventh-order, at rest at both ends).
  void SetUp() override {
    folder.write("up.toml",
                 "format = 1\nname = \"up\"\n[[segment]]\nduration_s = 2\nx_m = [0]\ny_m = [0]\nz_m = [1]\nyaw_rad = [0]\n"
                 "[[segment]]\nduration_s = 1\nx_m = [0]\ny_m = [0]\nz_m = [1, 0, 0, 0, 10.5, -25.2, 21, -6]\nyaw_rad = [0]\n"
                 "[[segment]]\nduration_s = 1\nx_m = [0]\ny_m = [0]\nz_m = [1.3]\nyaw_rad = [0]\n");
  }
  fs::path plan(double percent = 20) {
    const auto v = (kSource / "vehicles").string();
    return folder.write(
        "secret/plan.toml",
        "format = 1\nname = \"strut\"\nplant = \"" + v + "/reference_plant.toml\"\nvehicle = \"" + v +
            "/calibrated.toml\"\n[controller]\ngains = \"" + v +
            "/gains.toml\"\n[seeds]\nlearn = [201]\nheld_out = [301]\njudged = [1, 2, 3, 4]\n[[undeclared]]\nid = \"blockage_strut\"\nloss "
            "= "
            "0.08\n[[learn]]\nname = \"up\"\ntrajectory = \"../up.toml\"\n[[held_out]]\nname = \"up\"\ntrajectory = \"../up.toml\"\n"
            "[[judged]]\nname = \"up\"\ntrajectory = \"../up.toml\"\naxis = \"z\"\nexpect = \"better\"\npercent = " +
            std::to_string(percent) + "\n[analyst]\ndiagnose = [\"--factor\", \"0.92\", \"--pry\", \"" +
            (folder.path() / "secret/plan.toml").string() + "\", \"--pry\", \"" +
            (folder.path() / "runs/close-strut/inputs/flown_plant.toml").string() + "\", \"--pry\", \"" +
            (folder.path() / "runs/close-strut/1-fly/learn/up/pd_ff_thrust_drag/201/truth.csv").string() + "\"]\n");
  }

  // Root of a container with one user and no namespaces to be had: no sandbox can be made in it.
  std::string container;
  bool enter_container() {
    const std::string words = "bwrap --unshare-user --uid 0 --gid 0 --disable-userns --cap-drop ALL --dev-bind / / ";
    const bool can = std::system((words + "true 2>/dev/null").c_str()) == 0;
    if (can) container = words;
    return can;
  }

  int run(const std::string& arguments) {
    const auto o = (folder.path() / "stdout.txt").string(), e = (folder.path() / "stderr.txt").string();
    const int status = std::system((container + ROTORLOOP_COMMAND + " close " + arguments + " >" + o + " 2>" + e).c_str());
    output = read_text(o);
    messages = read_text(e);
    return WEXITSTATUS(status);
  }
  int close(const fs::path& p, const std::string& more = "") {
    return run(p.string() + " --analyst " + FAKE_DIAGNOSIS + " --out " + (folder.path() / "runs").string() + " -j 2 " + more);
  }
  fs::path run_folder() const { return folder.path() / "runs/close-strut"; }
};

TEST_F(CloseTest, GoesRoundOnceFromFlightToFlightAndSaysWhatItBrought) {
  ASSERT_EQ(close(plan()), 0) << messages << output;
  const Json result = Json::parse(read_text(run_folder() / "result.json"));
  EXPECT_EQ(result["verdict"], "pass");
  EXPECT_EQ(result["diagnosis"]["added"][0]["id"], "blockage_strut");
  const auto& t = result["tracking"][0];
  EXPECT_EQ(t["before_cm"].size(), 4u);
  EXPECT_GT(t["reduction"]["low"].get<double>(), 20.0) << "8 % of the thrust is 5 cm at this vertical stiffness";
  EXPECT_EQ(t["before_cm"], t["identified_cm"]) << "the fake diagnosis's identification changes nothing: the same flights to the bit";
  EXPECT_TRUE(fs::is_regular_file(run_folder() / "report.html"));

  // The diagnosis got copies of the logs, and could open nothing of what the test had it try.
  const Json diagnosis = Json::parse(read_text(run_folder() / "4-diagnose/out/report/result.json"));
  if (result["isolation"]["holds"].get<bool>()) {
    EXPECT_EQ(diagnosis["remarks"][0], "opened: ");
    EXPECT_THAT(messages, HasSubstr("4-diagnose: sandboxed by " + result["isolation"]["layers"].get<std::string>() + " (" +
                                    result["isolation"]["enforced_by"].get<std::string>() + ")"));
  } else {
    EXPECT_EQ(result["isolation"]["layers"], "not isolated");
  }
  EXPECT_THAT(messages, HasSubstr("4-diagnose: diagnose with 1 flights, 1 held out"));

  // An expectation that is missed ends with 6; what is expected is no input of a stage, so nothing is made anew.
  EXPECT_EQ(close(plan(99)), 6) << messages;
  EXPECT_THAT(output, HasSubstr("MISSED"));
  for (const char* stage : {"1-fly", "2-before", "3-identify", "4-diagnose", "5-identified", "6-after"})
    EXPECT_THAT(messages, HasSubstr(std::string(stage) + ": done before"));

  // Where no sandbox can be had the run says so of each layer and what to do, and goes on only where that was not forbidden.
  if (enter_container()) {
    fs::remove(run_folder() / "4-diagnose/done.toml");
    EXPECT_EQ(close(plan(), "--require-isolation"), 3) << messages;
    for (const char* text : {"no sandbox holds on this machine", "bubblewrap: cannot be run: bwrap: ", "own user id and Landlock: ",
                             "install the Debian package bubblewrap and allow user namespaces"})
      EXPECT_THAT(messages, HasSubstr(text));
    EXPECT_FALSE(fs::exists(run_folder() / "4-diagnose/out"));
    EXPECT_EQ(close(plan()), 0) << messages;
    EXPECT_THAT(messages, HasSubstr("4-diagnose: warning: not isolated"));
    EXPECT_EQ(Json::parse(read_text(run_folder() / "result.json"))["isolation"]["layers"], "not isolated");
    container.clear();
  }

  // Afterwards.
  EXPECT_EQ(run("truth " + run_folder().string()), 0) << messages << output;
  EXPECT_THAT(output, HasSubstr("blockage_strut             right"));
  EXPECT_THAT(output, HasSubstr("loss of blockage_strut"));
  EXPECT_THAT(read_text(run_folder() / "report.html"), HasSubstr("loss of blockage_strut"));
}

TEST_F(CloseTest, AnEffectThatThePlantDoesNotKnowIsFoundBeforeTheFirstFlight) {
  std::string text = read_text(plan());
  text.replace(text.find("blockage_strut"), 14, "blockage_stuck");
  EXPECT_EQ(close(folder.write("secret/plan.toml", text)), 2);
  EXPECT_THAT(messages, HasSubstr("blockage_stuck"));
  EXPECT_FALSE(fs::exists(run_folder() / "1-fly"));
}

TEST_F(CloseTest, AFolderThatIsNoLoopIsNamedSo) {
  EXPECT_EQ(run("truth " + folder.path().string()), 2);
  EXPECT_THAT(messages, HasSubstr("is not the folder of a finished study"));
}

}  // namespace
}  // namespace rotorloop::test
