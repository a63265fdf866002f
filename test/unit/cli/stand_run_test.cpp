// `stand run --virtual` against the library call that it stands for.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "bench/stand/run_folder.hpp"
#include "bench/stand/virtual/virtual_run.hpp"
#include "cli/stand/bus_commands.hpp"
#include "host/base/error.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::cli {
namespace {

const std::filesystem::path kSource = ROTORLOOP_SOURCE_DIR;
const std::filesystem::path kStand = kSource / "devices/virtual/stand.toml", kPlant = kSource / "vehicles/reference_plant.toml";

std::string text_of(const std::filesystem::path& path) {
  std::stringstream s;
  s << std::ifstream(path).rdbuf();
  return s.str();
}

struct Printed {
  int exit_code = -1;
  std::string out;
};
Printed command(std::vector<std::string> words) {
  CLI::App app;
  Printed p;
  add_stand_run(app, p.exit_code);
  std::reverse(words.begin(), words.end());
  ::testing::internal::CaptureStdout();
  app.parse(words);
  p.out = ::testing::internal::GetCapturedStdout();
  return p;
}

modbus::StandSetup setup() {
  return modbus::read_stand_setup(kStand, [](const std::string& name) -> std::filesystem::path { return name; });
}

std::vector<std::string> files_below(const std::filesystem::path& folder) {
  std::vector<std::string> out;
  for (const auto& e : std::filesystem::recursive_directory_iterator(folder))
    if (e.is_regular_file()) out.push_back(std::filesystem::relative(e.path(), folder).generic_string());
  std::sort(out.begin(), out.end());
  return out;
}

TEST(StandRunCommand, WritesByteForByteTheFolderOfTheLibraryCallAndPrintsItsSummary) {
  const test::TempFolder folder;
  const auto by_command = folder.path() / "command", by_library = folder.path() / "library";
  const Printed printed = command({"run",
                                   kStand.string(),
                                   "--virtual",
                                   "--plant",
                                   kPlant.string(),
                                   "--seed",
                                   "3",
                                   "--sequence",
                                   "abab",
                                   "--rpm",
                                   "6000,9000",
                                   "--repeats",
                                   "2",
                                   "--hold",
                                   "0.5",
                                   "--zero",
                                   "1",
                                   "--strut",
                                   "0.1",
                                   "-q",
                                   "--json",
                                   "-o",
                                   by_command.string()});
  stand_run::RunOptions o;
  o.out = by_library;
  o.sequences = {"abab"};
  o.rpm = {6000.0, 9000.0};
  o.sequence.repeats = 2;
  o.sequence.hold_s = 0.5;
  o.sequence.zero_s = 1.0;
  virtual_stand::VirtualRunOptions v;
  v.plant = kPlant;
  v.seed = 3;
  v.strut = 0.1;
  const modbus::StandSetup stand = setup();
  const stand_run::RunSummary summary = virtual_stand::run_virtually(stand, stand_run::plan_of(o, stand), o, v);

  ASSERT_EQ(files_below(by_command), files_below(by_library));
  for (const std::string& file : files_below(by_library)) {
    if (file != stand::kFactsFile) {
      EXPECT_EQ(text_of(by_command / file), text_of(by_library / file)) << file;
    }
  }
  stand::RunFacts written = stand::read_run_toml(by_command / stand::kFactsFile),
                  called = stand::read_run_toml(by_library / stand::kFactsFile);
  EXPECT_EQ(called.version, "") << "who calls the library says by what it was made";
  EXPECT_THAT(written.version, testing::HasSubstr("rotorloop"));
  written.version = called.version;
  written.started_utc = called.started_utc;
  EXPECT_EQ(stand::run_toml(written), stand::run_toml(called));

  EXPECT_EQ(nlohmann::ordered_json::parse(printed.out), stand_run::summary_json(by_command, summary));
  EXPECT_EQ(printed.exit_code, 0);
  EXPECT_EQ(summary.end, stand_run::RunEnd::done);
  ASSERT_TRUE(summary.thrust);
  EXPECT_NEAR(summary.thrust->share, 0.1, 0.03);
}

TEST(StandRunCommand, ARunStoppedByALimitEndsWith4AndTheLibrarySaysWhichLimit) {
  const test::TempFolder folder;
  const std::vector<std::string> words{"run",    kStand.string(), "--virtual", "--plant", kPlant.string(),
                                       "--dies", "cell",          "--dies-at", "12",      "-q",
                                       "--json", "--rpm",         "6000,9000", "-o",      (folder.path() / "command").string()};
  const Printed printed = command(words);
  EXPECT_EQ(printed.exit_code, to_int(ExitCode::safety));
  stand_run::RunOptions o;
  o.out = folder.path() / "library";
  o.rpm = {6000.0, 9000.0};
  virtual_stand::VirtualRunOptions v;
  v.plant = kPlant;
  v.dies = "cell";
  v.dies_at_s = 12.0;
  const modbus::StandSetup stand = setup();
  const auto summary = virtual_stand::run_virtually(stand, stand_run::plan_of(o, stand), o, v);
  ASSERT_TRUE(summary.trip);
  EXPECT_EQ(summary.trip->limit, "stale_ms");
  EXPECT_EQ(nlohmann::ordered_json::parse(printed.out), stand_run::summary_json(folder.path() / "command", summary));
}

TEST(StandRun, TheLibraryArmsNothingBeyondTheLimitsOfTheStandFile) {
  const test::TempFolder folder;
  modbus::StandSetup stand = setup();
  stand.limits.at("thrust_N").max = 0.5;
  stand_run::RunOptions o;
  o.out = folder.path() / "run";
  o.rpm = {6000.0, 9000.0};
  virtual_stand::VirtualRunOptions v;
  v.plant = kPlant;
  try {
    virtual_stand::run_virtually(stand, stand_run::plan_of(o, stand), o, v);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::safety);
    EXPECT_THAT(e.what(), testing::HasSubstr("exceeds what the stand file allows: thrust_N"));
  }
  EXPECT_FALSE(std::filesystem::exists(o.out));
}

}  // namespace
}  // namespace rotorloop::cli
