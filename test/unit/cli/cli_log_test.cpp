// The log commands: what they print, what they write, and the messages on wrong arguments.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "host/base/error.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::cli {
namespace {
using test::TempFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

class LogCommand : public ::testing::Test {
 protected:
  LogCommand() {
    log_ = folder_.write("log.csv", "ms,u,a,b,c,d\n1000,16000,60,60,60,60\n1010,15900,60,60,60,\n1030,,60,60,60,60\n").string();
    mapping_ = folder_
                   .write("log.mapping.toml",
                          "format = 1\nname = \"test\"\nlog = \"csv\"\n[time]\ncolumn = \"ms\"\nunit = \"ms\"\n"
                          "[[stream]]\nquantity = \"battery\"\ncolumns = [\"u\"]\nunit = \"mV\"\n"
                          "[[stream]]\nquantity = \"rotor_speed\"\ncolumns = [\"a\", \"b\", \"c\", \"d\"]\nunit = \"rpm\"\n")
                   .string();
  }
  std::string run(std::vector<std::string> words, int expected_exit_code = 0) {
    CLI::App app;
    int exit_code = -1;
    add_log(app, exit_code);
    words.insert(words.begin(), "log");
    std::reverse(words.begin(), words.end());
    ::testing::internal::CaptureStdout();
    try {
      app.parse(words);
    } catch (...) {
      (void)::testing::internal::GetCapturedStdout();
      throw;
    }
    const std::string out = ::testing::internal::GetCapturedStdout();
    EXPECT_EQ(exit_code, expected_exit_code);
    return out;
  }
  TempFolder folder_;
  std::string log_, mapping_;
};

TEST_F(LogCommand, InfoListsStreamsWithRatesSpansFirstValuesAndNotes) {
  const std::string out = run({"info", log_, "--mapping", mapping_});
  EXPECT_THAT(out,
              AllOf(HasSubstr("flight log\n"), HasSubstr("rotor_omega"), HasSubstr("6.2832 6.2832 6.2832 6.2832"), HasSubstr("battery")));
  EXPECT_THAT(out, HasSubstr("note: battery: 1 of 3 rows are blank and left out\n"));
}

TEST_F(LogCommand, InfoAsJsonHasTheSameFigures) {
  const auto j = nlohmann::json::parse(run({"info", log_, "--mapping", mapping_, "--json"}));
  ASSERT_EQ(j["streams"].size(), 2u);
  const auto& rotors = j["streams"][0];
  EXPECT_EQ(rotors["name"], "rotor_omega");
  EXPECT_EQ(rotors["unit"], "rad/s");
  EXPECT_EQ(rotors["samples"], 3);
  EXPECT_NEAR(rotors["from_s"], 1.0, 1e-12);
  EXPECT_NEAR(rotors["to_s"], 1.03, 1e-12);
  EXPECT_NEAR(rotors["rate_Hz"], 50.0, 1e-9);  // median of 10 and 20 ms, the upper one
  EXPECT_NEAR(rotors["longest_gap_s"], 0.02, 1e-12);
  EXPECT_EQ(j["streams"][1]["first"][0], 16.0);
  EXPECT_EQ(j["notes"].size(), 1u);
}

TEST_F(LogCommand, ConvertsToAFlightLogAndToULogThatHoldTheSameFlight) {
  const std::string csv = (folder_.path() / "out.csv").string(), ulog = (folder_.path() / "out.ulg").string();
  run({"convert", log_, "-m", mapping_, "-o", csv});
  run({"convert", csv, "-o", ulog});
  const auto a = nlohmann::json::parse(run({"info", csv, "--json"})), b = nlohmann::json::parse(run({"info", ulog, "--json"}));
  ASSERT_EQ(b["streams"].size(), 2u);  // by the shipped mapping, as nobody gave one
  for (const std::size_t i : {0u, 1u}) {
    EXPECT_EQ(a["streams"][i]["name"], b["streams"][i]["name"]);
    EXPECT_EQ(a["streams"][i]["samples"], b["streams"][i]["samples"]);
    EXPECT_NEAR(a["streams"][i]["first"][0], b["streams"][i]["first"][0], 1e-5);
  }
}

TEST_F(LogCommand, CheckJudgesEveryLogWithoutAVehicleFileAndEndsWith5WhereOneIsRefused) {
  EXPECT_THAT(run({"check", log_, log_, "-m", mapping_}, 5),
              AllOf(HasSubstr(": no part of at least 1.0 s is left"), HasSubstr("not checked without a vehicle file")));
  const auto j = nlohmann::json::parse(run({"check", log_, log_, "-m", mapping_, "--json"}, 5));
  ASSERT_EQ(j["flights"].size(), 2u);
  EXPECT_FALSE(j["flights"][1]["refusal"].is_null());
  EXPECT_FALSE(j["with_vehicle"]);
}

TEST_F(LogCommand, WrongArgumentsNameTheRemedy) {
  EXPECT_THAT(test::error_of([&] {
                run({"info", log_});
              }),
              AllOf(HasSubstr("columns ms, u, a, b, c, d mean"), HasSubstr("give --mapping")));
  EXPECT_THAT(test::error_of([&] {
                run({"convert", log_, "-m", mapping_, "-o", "out.bag"});
              }),
              HasSubstr("columns in SI units), .ulg (ULog) or .mcap"));
  EXPECT_THAT(test::error_of([&] { run({"info", "no.csv"}); }), HasSubstr("no.csv: error: no such file"));
  EXPECT_THAT(test::error_of([&] { run({"info", log_, "-m", "no.toml"}); }), HasSubstr("no.toml"));
}

}  // namespace
}  // namespace rotorloop::cli
