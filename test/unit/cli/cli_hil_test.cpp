// The hil command with a runner that only notes what it was asked: arguments, texts, exit codes, progress.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>

#include "cli/hil_commands.hpp"
#include "cli/progress/progress_line.hpp"
#include "host/base/error.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::cli {
namespace {
using test::TempFolder;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class HilCommand : public ::testing::Test {
 protected:
  HilCommand() {
    for (const auto* f : {"plant.toml", "vehicle.toml", "gains.toml", "h.toml", "v.toml"}) folder_.write(f, "format = 1\n");
    scenario_ = write_scenario("s.toml", "first one");
  }
  std::string write_scenario(const std::string& file, const std::string& name) {
    return folder_
        .write(file, "format = 1\nname = \"" + name +
                         "\"\nplant = \"plant.toml\"\nvehicle = \"vehicle.toml\"\nseeds = [4, 5]\nvariants = [\"pd_ff\", "
                         "\"pd_ff_drag\"]\n[controller]\ngains = \"gains.toml\"\n"
                         "[[flight]]\nname = \"h\"\ntrajectory = \"h.toml\"\n[[flight]]\nname = \"v\"\ntrajectory = \"v.toml\"\n")
        .string();
  }
  // Runs `rotorloop hil WORDS…`; the runner returns `verdict`.
  int run(std::vector<std::string> words, hil::Verdict verdict = hil::Verdict::pass) {
    CLI::App app;
    int exit_code = -1;
    add_hil(app, exit_code, [&](const hil::Scenario& s, const hil::RunOptions& o, hil::Progress&) {
      flown_.push_back(s);
      options_.push_back(o);
      hil::HilResult r;
      r.result.verdict = verdict;
      r.result.scenario = s.name;
      r.folder = o.runs_dir / "x";
      return r;
    });
    words.insert(words.begin(), "hil");
    std::reverse(words.begin(), words.end());
    ::testing::internal::CaptureStdout();
    try {
      app.parse(words);
    } catch (...) {
      out_ = ::testing::internal::GetCapturedStdout();
      throw;
    }
    out_ = ::testing::internal::GetCapturedStdout();
    return exit_code;
  }
  std::string error(const std::vector<std::string>& words) {
    return test::error_of([&] { run(words); });
  }
  TempFolder folder_;
  std::string scenario_, out_;
  std::vector<hil::Scenario> flown_;
  std::vector<hil::RunOptions> options_;
};

TEST_F(HilCommand, FliesTheScenarioAsWrittenAndPrintsVerdictAndPlace) {
  EXPECT_EQ(run({scenario_, "--out", "there"}), 0);
  ASSERT_EQ(flown_.size(), 1u);
  EXPECT_THAT(flown_[0].seeds, ElementsAre(4, 5));
  EXPECT_EQ(options_[0].runs_dir, "there");
  EXPECT_THAT(out_, AllOf(HasSubstr("verdict: pass"), HasSubstr("there/x/report.html")));
}
TEST_F(HilCommand, SeedsVariantsFlightsNarrowIt) {
  run({scenario_, "--seeds", "1,3", "--variants", "pd_ff_drag", "--flights", "v", "-j", "3", "--force", "--name", "n"});
  EXPECT_THAT(flown_[0].seeds, ElementsAre(1, 3));
  EXPECT_THAT(flown_[0].variants, ElementsAre(host::Variant::pd_ff_drag));
  ASSERT_EQ(flown_[0].flights.size(), 1u);
  EXPECT_EQ(flown_[0].flights[0].name, "v");
  EXPECT_EQ(flown_[0].files.size(), 6u) << "the files of flights left out still belong to the scenario";
  EXPECT_EQ(options_[0].jobs, 3);
  EXPECT_TRUE(options_[0].force);
  EXPECT_EQ(options_[0].name, "n");
  EXPECT_THAT(options_[0].command_line, HasSubstr("--seeds 1,3 --variants pd_ff_drag --flights v --name n"));
}
TEST_F(HilCommand, AnotherVehicleFileTakesThePlaceOfTheScenarios) {
  const std::string other = folder_.write("identified.toml", "format = 1\n").string();
  run({scenario_, "--vehicle", other});
  EXPECT_EQ(flown_[0].vehicle, other);
  EXPECT_EQ(flown_[0].vehicle_given, other);
  EXPECT_THAT(options_[0].command_line, HasSubstr("--vehicle " + other));
  EXPECT_THAT(error({scenario_, "--vehicle", "no/such.toml"}),
              AllOf(HasSubstr("--vehicle: error: \"no/such.toml\": no such file"), HasSubstr("identify")));
}
TEST_F(HilCommand, ExitCodeIsSixForAMissedLimitAndSevenForWhatWasNotJudged) {
  EXPECT_EQ(run({scenario_}, hil::Verdict::fail), 6);
  EXPECT_EQ(run({scenario_}, hil::Verdict::incomplete), 7);
}
TEST_F(HilCommand, JsonIsOneDocumentForOneScenarioAndAListForMore) {
  run({scenario_, "--json"});
  EXPECT_TRUE(out_.starts_with("{\n  \"format\": 1"));
  run({scenario_, write_scenario("t.toml", "second one"), "--json"});
  EXPECT_TRUE(out_.starts_with("[\n{"));
  EXPECT_TRUE(out_.ends_with("}\n]\n"));
}
TEST_F(HilCommand, DryRunFliesNothingAndSaysWhatWouldBe) {
  EXPECT_EQ(run({scenario_, "--dry-run"}), 0);
  EXPECT_TRUE(flown_.empty());
  EXPECT_THAT(out_, AllOf(HasSubstr("2 flights x 2 variants x 2 seeds = 8 runs"), HasSubstr("runs/first-one")));
}
TEST_F(HilCommand, ASlipInTheLastScenarioIsFoundBeforeTheFirstFlight) {
  EXPECT_THAT(error({scenario_, "no/such.toml"}), HasSubstr("no/such.toml: error: no such file"));
  EXPECT_TRUE(flown_.empty());
}
TEST_F(HilCommand, RefusalsSayWhatToDo) {
  EXPECT_THAT(error({}), AllOf(HasSubstr("no scenario given"), HasSubstr("--help")));
  EXPECT_THAT(error({scenario_, "--seeds", "x"}), HasSubstr("--seeds: error: \"x\""));
  EXPECT_THAT(error({scenario_, "--variants", "lqr"}),
              HasSubstr("use one or more of: pd_ff, pd_ff_drag, pd_ff_no_effects, pd_ff_thrust_drag"));
  EXPECT_THAT(error({scenario_, "--flights", "z"}), AllOf(HasSubstr("--flights: error: \"z\" is not a flight of"), HasSubstr("h,v")));
  EXPECT_THAT(error({scenario_, "--flights", "h,h"}), HasSubstr("given twice"));
  EXPECT_THAT(error({scenario_, write_scenario("t.toml", "two"), "--name", "n"}), HasSubstr("names one run, but 2 scenarios"));
  EXPECT_THAT(error({scenario_, write_scenario("t.toml", "first: one")}), HasSubstr("would write the same run folder \"first-one\""));
  EXPECT_THAT(error({"compare", "no/a", "no/b"}), HasSubstr("no/a: error: is not a run folder"));
  EXPECT_THAT(error({"report", "no/a"}), HasSubstr("is not a run folder"));
  EXPECT_TRUE(flown_.empty());
}
TEST_F(HilCommand, UnknownOptionsAndImpossibleJobsAreUsageErrors) {
  EXPECT_THROW(run({scenario_, "--sedes", "3"}), CLI::ParseError);
  EXPECT_THROW(run({scenario_, "-j", "0"}), CLI::ParseError);
  EXPECT_THROW(run({"compare", "a"}), CLI::ParseError);
}

// What a ProgressLine writes, read back from a temporary file.
struct Progress : ::testing::Test {
  std::string written(ProgressStyle style) {
    std::FILE* f = std::tmpfile();
    {
      ProgressLine p(style, f);
      p.begin(2, 20.0);
      p.advance(10.0);
      hil::FlightResult r;
      r.flight = "h";
      r.seed = 4;
      r.tracking.truth.mean_3d_cm = 3.456;
      r.tracking.truth.mean_z_cm = 1;
      p.finished(r);
      r.end = hil::FlightEnd::crashed;
      r.end_detail = "below ground";
      p.finished(r);
      p.warn("h/pd_ff/4", "rotor.not_converged = 3");
      p.end();
    }
    std::string text(4096, '\0');
    std::rewind(f);
    text.resize(std::fread(text.data(), 1, text.size(), f));
    std::fclose(f);
    return text;
  }
};
TEST_F(Progress, WithoutATerminalIsOnePlainLineForEachFlight) {
  const auto text = written(ProgressStyle::lines);
  EXPECT_THAT(text, AllOf(HasSubstr("[1/2] h pd_ff seed 4: error 3.46 cm (|z| 1.00 cm)\n"),
                          HasSubstr("[2/2] h pd_ff seed 4: crashed, below ground\n"),
                          HasSubstr("h/pd_ff/4: warning: rotor.not_converged = 3\n"), Not(HasSubstr("\x1b")), Not(HasSubstr("\r"))));
}
TEST_F(Progress, OnATerminalRedrawsOneLineAndErasesItAtTheEnd) {
  const auto text = written(ProgressStyle::redrawn);
  EXPECT_THAT(text, AllOf(HasSubstr("50 %"), HasSubstr("flight 2/2"), HasSubstr("crashed, below ground\n")));
  EXPECT_EQ(text.find('#', text.rfind("\x1b[K")), std::string::npos) << "no bar is left on the screen";
}
TEST_F(Progress, QuietWritesNothing) { EXPECT_EQ(written(ProgressStyle::silent), ""); }
TEST(DurationText, RoundsUpAndShowsHoursWhenThereAreAny) {
  EXPECT_EQ(duration_text(0.2), "0:01");
  EXPECT_EQ(duration_text(75), "1:15");
  EXPECT_EQ(duration_text(3700), "1:01:40");
}

}  // namespace
}  // namespace rotorloop::cli
