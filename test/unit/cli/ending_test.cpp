// How a command ends: its table of codes, errors in one style, JUnit that a build server can read.
#include <gmock/gmock.h>

#include <CLI/CLI.hpp>
#include <set>

#include "bench/hil/flight/run_outcome.hpp"
#include "cli/ending/exit_codes.hpp"
#include "cli/ending/junit.hpp"
#include "cli/ending/outputs.hpp"
#include "cli/ending/refusal.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::cli {
namespace {
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(ExitCodes, EachCodeHasOneMeaning) {
  std::set<int> codes;
  std::set<std::string_view> names;
  for (const ExitCodeRow& r : exit_codes()) {
    EXPECT_TRUE(codes.insert(to_int(r.code)).second) << to_int(r.code);
    EXPECT_TRUE(names.insert(r.name).second) << r.name;
    EXPECT_THAT(exit_codes_text(), HasSubstr(std::string(r.meaning)));
  }
}

TEST(Junit, CountsAndEscapesWhatXmlCannotHold) {
  const std::string xml = junit_xml("a & b", {{"g", "one", JunitEnd::passed},
                                              {"g", "two", JunitEnd::failed, "1 < 2 \"cm\"\nnext\x01"},
                                              {"g", "three", JunitEnd::error, "not measured"}});
  EXPECT_THAT(xml,
              AllOf(HasSubstr("<testsuite name=\"a &amp; b\" tests=\"3\" failures=\"1\" errors=\"1\" skipped=\"0\">"),
                    HasSubstr("<testcase classname=\"g\" name=\"one\"/>"),
                    HasSubstr("<failure message=\"1 &lt; 2 &quot;cm&quot;&#10;next?\"/>"), HasSubstr("<error message=\"not measured\"/>")));
}

class Refusal : public ::testing::Test {
 protected:
  Refusal() {
    app_.name("rotorloop");
    hil_ = app_.add_subcommand("hil", "");
    hil_->add_option("SCENARIO", files_);
    hil_->add_option("--seeds", word_);
    hil_->add_subcommand("compare", "")->add_flag("--verify", flag_);
    app_.add_subcommand("identify", "");
  }
  std::string unknown(std::vector<const char*> words) {
    words.insert(words.begin(), "rotorloop");
    const auto found = unknown_word(app_, static_cast<int>(words.size()), words.data());
    return found ? refusal_text(*found, "rotorloop") : "";
  }
  CLI::App app_;
  CLI::App* hil_ = nullptr;
  std::vector<std::string> files_;
  std::string word_;
  bool flag_ = false;
};
TEST_F(Refusal, NamesCommandAndOptionWithTheNearest) {
  EXPECT_EQ(unknown({"identfy"}),
            "rotorloop: error: \"identfy\" is not a command\n  do:     did you mean \"identify\"? use one of: hil, identify; see rotorloop "
            "--help");
  EXPECT_THAT(unknown({"hil", "s.toml", "--sedes=3"}),
              HasSubstr("rotorloop hil --sedes: error: is not an option of this command\n  do:     did you mean \"--seeds\"?"));
}
TEST_F(Refusal, KnowsWordsOfArgumentsAndOfSubcommands) {
  EXPECT_THAT(unknown({"hil", "s.toml", "--seeds", "3"}), IsEmpty());
  EXPECT_THAT(unknown({"hil", "compare", "--verify"}), IsEmpty());
}
std::string refused(const char* option, const char* value) {
  CLI::App app("", "rotorloop");
  double lag_ms = 1.0;
  std::string file;
  CLI::App* c = app.add_subcommand("gains", "");
  c->add_option("--motor-lag", lag_ms, "time constant of the motor, ms")->check(CLI::Range(1.0, 300.0));
  c->add_option("--plant", file, "plant file")->check(CLI::ExistingFile);
  const char* words[] = {"rotorloop", "gains", option, value};
  try {
    app.parse(4, words);
  } catch (const CLI::ParseError& e) {
    return refusal_text(refusal_of(e, typed_command(app, 4, words)), "rotorloop");
  }
  return "";
}
TEST(RefusedValue, NamesValueAndRangeAndSaysInWhichUnit) {
  EXPECT_EQ(refused("--motor-lag", "0.018"),
            "rotorloop gains --motor-lag: error: 0.018 is out of range: 1 to 300\n  do:     time constant of the motor, ms; see rotorloop "
            "gains --help");
}
TEST(RefusedValue, SaysThatADecimalCommaIsOne) {
  EXPECT_EQ(refused("--motor-lag", "1,8"),
            "rotorloop gains --motor-lag: error: \"1,8\" is not a number\n  likely: a comma in place of the decimal point\n  do:     write "
            "1.8");
  EXPECT_THAT(refused("--motor-lag", "slow"), HasSubstr("\"slow\" is not a number\n  do:     time constant of the motor, ms"));
}
TEST(RefusedValue, NamesAFileThatDoesNotExist) {
  EXPECT_THAT(refused("--plant", "no.toml"), HasSubstr("rotorloop gains --plant: error: \"no.toml\": no such file"));
}
TEST(RefusalText, PutsTheCommandBeforeAnOptionAndLeavesFilesAlone) {
  EXPECT_THAT(refusal_text({"--seeds", "is odd", "", ""}, "rotorloop hil"), HasSubstr("rotorloop hil --seeds: error: is odd"));
  EXPECT_THAT(refusal_text({"", "is odd", "", ""}, "rotorloop hil"), HasSubstr("rotorloop hil: error: is odd"));
  EXPECT_THAT(refusal_text({"s.toml:3", "is odd", "", ""}, "rotorloop hil"), HasSubstr("s.toml:3: error: is odd"));
}

TEST(Outputs, AnEmptyFileAndAForcedOneMayBeReplaced) {
  test::TempFolder folder;
  const auto full = folder.write("full.toml", "x"), empty = folder.write("empty.toml", "");
  EXPECT_THAT(test::error_of([&] { check_outputs({{"-o", full}}, false); }), HasSubstr("exists already"));
  EXPECT_NO_THROW(check_outputs({{"-o", full}}, true));
  EXPECT_NO_THROW(check_outputs({{"-o", empty}, {"--junit", ""}, {"-o", "/dev/null"}}, false));
}

TEST(RunOutcome, SaysWhyARunDidNotPassAndWhatToDo) {
  hil::RunResult r;
  r.flights.resize(2);
  r.flights[0].flight = "h";
  r.flights[1].flight = "v";
  r.flights[1].seed = 5;
  r.flights[1].end = hil::FlightEnd::crashed;
  r.flights[1].end_detail = "below ground";
  r.limits.push_back({.name = "mean_tracking_error h pd_ff 3d", .value = 7.25, .unit = "cm", .limit = 5.0});
  r.verdict = hil::Verdict::fail;
  const auto errors = hil::errors_of(r, 3);
  ASSERT_THAT(errors, SizeIs(3));
  EXPECT_EQ(errors[0], "2 of 3 flights were flown");
  EXPECT_EQ(errors[1], "flight v/pd_ff/5 crashed: below ground");
  EXPECT_EQ(errors[2], "limit missed: mean_tracking_error h pd_ff 3d: 7.25 cm, allowed at most 5 cm");
  EXPECT_THAT(hil::outcome_of(r, "runs/x").next, HasSubstr("did not complete"));
  r = {};
  r.verdict = hil::Verdict::pass;
  EXPECT_THAT(hil::outcome_of(r, "runs/x").next, HasSubstr("rotorloop hil compare x"));
  EXPECT_THAT(hil::outcome_of(r, "runs/x").errors, IsEmpty());
}

}  // namespace
}  // namespace rotorloop::cli
