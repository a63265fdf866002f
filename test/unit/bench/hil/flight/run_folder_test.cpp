// Run folders: nothing is lost, nothing foreign is deleted, no hash depends on place or time, inputs stay usable.
#include "bench/hil/flight/run_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "bench/hil/flight/compare.hpp"
#include "host/base/sha256.hpp"
#include "host/base/text_file.hpp"
#include "host/base/toml_file.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::hil {
namespace {
namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(FolderName, IsMadeFromTheScenariosName) {
  EXPECT_EQ(folder_name("paper: horizontal"), "paper-horizontal");
  EXPECT_EQ(folder_name("  ../../etc  "), "etc");
  EXPECT_EQ(folder_name("Größe 5"), "gr-e-5");
  EXPECT_EQ(folder_name("..."), "run");
}

TEST(RunFolder, RefusesAnExistingRunAndForceReplacesIt) {
  test::TempFolder f;
  {
    auto run = RunFolder::create(f.path(), "a", false);
    write_text_file(run.path() / "run.toml", "format = 1\n");
    write_text_file(run.path() / "old.txt", "x");
  }
  EXPECT_THAT(test::error_of([&] { RunFolder::create(f.path(), "a", false); }),
              AllOf(HasSubstr("this run exists already"), HasSubstr("--force")));
  EXPECT_TRUE(fs::exists(f.path() / "a/old.txt"));
  RunFolder::create(f.path(), "a", true);
  EXPECT_FALSE(fs::exists(f.path() / "a/old.txt"));
}
TEST(RunFolder, ForceNeverDeletesAFolderThatIsNotARun) {
  test::TempFolder f;
  f.write("thesis/chapter1.tex", "years of work");
  EXPECT_THAT(test::error_of([&] { RunFolder::create(f.path(), "thesis", true); }), HasSubstr("is not a run folder"));
  EXPECT_EQ(test::read_text(f.path() / "thesis/chapter1.tex"), "years of work");
}
TEST(RunFolder, NameCannotLeaveTheRunsFolder) {
  test::TempFolder f;
  for (const auto* name : {"..", "a/b", "", "."})
    EXPECT_THAT(test::error_of([&] { RunFolder::create(f.path(), name, true); }), HasSubstr("cannot name a folder")) << name;
}

struct Inputs : ::testing::Test {
  Inputs() {
    for (const auto* name : {"vehicles/plant.toml", "vehicles/vehicle.toml", "vehicles/gains.toml", "scenarios/trajectories/h.toml"})
      folder.write(std::string("kit/") + name, std::string("format = 1 # ") + name);
    scenario_file =
        folder.write("kit/scenarios/s.toml",
                     "format = 1\nname = \"n\"\nplant = \"../vehicles/plant.toml\"\nvehicle = \"../vehicles/vehicle.toml\"\nseeds = "
                     "[3]\nvariants = [\"pd_ff\"]\n"
                     "[controller]\ngains = \"../vehicles/gains.toml\"\n[[flight]]\nname = \"h\"\ntrajectory = \"trajectories/h.toml\"\n");
  }
  test::TempFolder folder;
  fs::path scenario_file;
};

TEST_F(Inputs, TheCopiedScenarioFindsItsCopiedInputs) {
  const auto s = read_scenario(scenario_file);
  auto run = RunFolder::create(folder.path() / "runs", "n", false);
  const auto inputs = run.copy_inputs({s.path, s.plant, s.vehicle, s.gains, s.flights[0].trajectory});
  ASSERT_EQ(inputs.size(), 5u);
  EXPECT_EQ(inputs[0].path, "scenarios/s.toml");
  EXPECT_EQ(inputs[0].sha256, sha256_file(scenario_file));
  fs::remove_all(folder.path() / "kit");
  const auto again = read_scenario(run.path() / "inputs" / run.input_path_of(s.path));
  EXPECT_EQ(again.plant, (run.path() / "inputs/vehicles/plant.toml").lexically_normal());
}

TEST_F(Inputs, RunTomlSaysHowToRepeatAndHoldsNoAbsolutePath) {
  const auto s = read_scenario(scenario_file);
  auto run = RunFolder::create(folder.path() / "runs", "n", false);
  RunResult r;
  r.scenario = s.name;
  r.version = "0.1.0";
  r.git = "abc";
  r.inputs = run.copy_inputs({s.path, s.plant, s.vehicle, s.gains, s.flights[0].trajectory});
  run.write_run_toml(r, "rotorloop hil \"s.toml\"", s);
  const auto file = TomlFile::read(run.path() / "run.toml");
  EXPECT_EQ(file.root().text("repeat"), "rotorloop hil inputs/scenarios/s.toml --seeds 3, --variants pd_ff --name repeat");
  EXPECT_EQ(file.root().text("command_line"), "rotorloop hil \"s.toml\"");
  EXPECT_EQ(file.root().tables("input", 5, 5)[0].text("path"), "inputs/scenarios/s.toml");
  EXPECT_EQ(test::read_text(run.path() / "run.toml").find(folder.path().string()), std::string::npos);
}

TEST_F(Inputs, RunTomlRepeatsWithTheVehicleThatWasGivenInPlaceOfTheScenarios) {
  auto s = read_scenario(scenario_file);
  s.vehicle = s.vehicle_given = folder.write("kit/identified.toml", "format = 1");
  auto run = RunFolder::create(folder.path() / "runs", "n", false);
  RunResult r;
  std::vector<fs::path> files = s.files;  // as the scenario's own vehicle, which its copy still names
  files.push_back(s.vehicle);
  r.inputs = run.copy_inputs(files);
  run.write_run_toml(r, "rotorloop hil s.toml --vehicle identified.toml", s);
  EXPECT_EQ(TomlFile::read(run.path() / "run.toml").root().text("repeat"),
            "rotorloop hil inputs/scenarios/s.toml --seeds 3, --variants pd_ff --vehicle inputs/identified.toml --name repeat");
}

TEST(LogHash, DependsOnNamesAndBytesButNotOnPlaceOrOrderOfWriting) {
  test::TempFolder f;
  const auto fly = [&](const std::string& place, bool backwards) {
    auto run = RunFolder::create(f.path() / place, "r", false);
    std::vector<std::uint64_t> seeds{1, 2};
    if (backwards) std::swap(seeds[0], seeds[1]);
    for (const auto seed : seeds) {
      const auto at = run.flight_folder("h", Variant::pd_ff, seed);
      write_text_file(at / "flight.csv", "log of " + std::to_string(seed));
      run.note_log(at / "flight.csv");
    }
    return run.log_hashes();
  };
  const auto a = fly("here", false), b = fly("there", true);
  EXPECT_EQ(a.begin()->first, "h/pd_ff/1/flight.csv");
  EXPECT_EQ(hash_of_logs(a), hash_of_logs(b));
  EXPECT_EQ(hash_of_logs({{"b", "2"}, {"a", "1"}}), sha256_text("a 1\nb 2\n"));
  auto renamed = a;
  renamed["h/pd_ff/9/flight.csv"] = renamed.extract("h/pd_ff/1/flight.csv").mapped();
  EXPECT_NE(hash_of_logs(a), hash_of_logs(renamed));
}

FlightResult flight(std::uint64_t seed, double error_cm) {
  FlightResult r;
  r.flight = "h";
  r.variant = Variant::pd_ff_drag;
  r.seed = seed;
  r.tracking.truth.mean_3d_cm = error_cm;
  r.tracking.truth.mean_z_cm = 0.5;
  r.tracking.samples = 9000;
  r.bus_load_max_percent = {61.5, 33.25};
  r.counters["frames_lost"] = 3;
  return r;
}

TEST(ResultFile, ReadsBackWhatWasWrittenAndNotMeasuredBecomesNull) {
  test::TempFolder f;
  auto run = RunFolder::create(f.path(), "r", false);
  RunResult r;
  r.version = "0.1.0";
  r.seeds = {3, 4};
  r.verdict = Verdict::fail;
  r.inputs = {{"s.toml", "00"}};
  r.limits = {{"bus_load esc", kNotMeasured, "%", 70, true, false}, {"reduction x", 61.25, "%", 60, false, true}};
  r.figures["h/pd_ff_drag/mean_error_3d"] = {4.25, 0.1, "cm", 2};
  r.flights = {flight(3, 4.2), flight(4, 4.3)};
  r.flights[1].end = FlightEnd::crashed;
  r.flights[1].end_detail = "ground contact at 3.2 s";
  r.published = {{"h", Variant::pd_ff, 10.5, ErrorAxis::z, "paper"}};
  r.log_hashes = {{"h/pd_ff/3/flight.csv", "aa"}};
  r.log_sha256 = hash_of_logs(r.log_hashes);
  r.warnings = {{"ablation", "drift is off"}};
  run.write_result(r);
  EXPECT_THAT(test::read_text(run.path() / "result.json"),
              AllOf(HasSubstr("\"value\": null"), HasSubstr("\"format\": 1"), HasSubstr("\"seed\": 3")));
  const auto back = read_result(run.path());
  EXPECT_EQ(result_json_text(back), result_json_text(r));
  EXPECT_EQ(back.verdict, Verdict::fail);
  EXPECT_TRUE(std::isnan(back.limits[0].value));
  EXPECT_FALSE(back.limits[1].upper);
  EXPECT_EQ(back.flights[1].end, FlightEnd::crashed);
  EXPECT_EQ(back.flights[0].counters.at("frames_lost"), 3);
}

TEST(ResultFile, RefusalsSayWhatTheFolderIs) {
  test::TempFolder f;
  EXPECT_THAT(test::error_of([&] { read_result(f.path()); }), HasSubstr("is not a run folder"));
  f.write("run.toml", "format = 1\n");
  EXPECT_THAT(test::error_of([&] { read_result(f.path()); }, ExitCode::data_quality), HasSubstr("this run has no result.json"));
  f.write("result.json", "{ \"format\": 9 }");
  EXPECT_THAT(test::error_of([&] { read_result(f.path()); }, ExitCode::data_quality), HasSubstr("format 9 is not known here"));
  f.write("result.json", "{ \"format\": ");
  EXPECT_THAT(test::error_of([&] { read_result(f.path()); }, ExitCode::data_quality), HasSubstr("cannot be understood"));
}

struct TwoRuns : ::testing::Test {
  // A run whose flights had these errors, with one log each.
  fs::path run(const std::string& name, const std::vector<double>& errors_cm, std::uint64_t first_seed = 1,
               const std::string& log = "log") {
    auto r = RunFolder::create(f.path(), name, true);
    write_text_file(r.path() / "run.toml", "format = 1\n");
    RunResult result;
    result.scenario = "s";
    for (std::size_t i = 0; i < errors_cm.size(); ++i) {
      result.flights.push_back(flight(first_seed + i, errors_cm[i]));
      const auto at = r.flight_folder("h", Variant::pd_ff_drag, first_seed + i);
      write_text_file(at / "flight.csv", log + std::to_string(i));
      r.note_log(at / "flight.csv");
    }
    result.log_hashes = r.log_hashes();
    result.log_sha256 = hash_of_logs(result.log_hashes);
    r.write_result(result);
    return r.path();
  }
  test::TempFolder f;
};

TEST_F(TwoRuns, SameLogsAreIdenticalToTheBit) {
  const auto c = compare_runs(run("a", {4, 5}), run("b", {4, 5}), true);
  EXPECT_TRUE(c.logs_identical);
  EXPECT_FALSE(c.differs);
  EXPECT_THAT(comparison_text(c), AllOf(HasSubstr("logs: identical, all 2 files"), HasSubstr("No significant difference")));
}
TEST_F(TwoRuns, PairingBySeedFindsASmallShiftThatTheSpreadHides) {
  const auto paired = compare_runs(run("a", {4, 5, 6, 7, 8}), run("b", {4.2, 5.21, 6.19, 7.2, 8.2}, 1, "other"), false);
  EXPECT_FALSE(paired.logs_identical);
  EXPECT_EQ(paired.differing_logs.size(), 5u);
  ASSERT_FALSE(paired.figures.empty());
  const auto& e = paired.figures[0];
  EXPECT_EQ(e.name, "mean_error_3d");
  EXPECT_EQ(e.pairs, 5);
  EXPECT_NEAR(e.difference, 0.2, 1e-9);
  EXPECT_TRUE(e.significant);
  EXPECT_TRUE(paired.differs);
  // The same figures with other seeds cannot be paired, and the shift drowns in the spread.
  const auto unpaired = compare_runs(run("a", {4, 5, 6, 7, 8}), run("b", {4.2, 5.21, 6.19, 7.2, 8.2}, 100), false);
  EXPECT_EQ(unpaired.figures[0].pairs, 0);
  EXPECT_FALSE(unpaired.figures[0].significant);
}
TEST_F(TwoRuns, NoiseAboutZeroIsNoDifference) {
  const auto c = compare_runs(run("a", {4, 5, 6, 7}), run("b", {4.3, 4.8, 6.2, 6.7}, 1, "other"), false);
  EXPECT_FALSE(c.figures[0].significant);
  EXPECT_FALSE(c.differs);
}
TEST_F(TwoRuns, WithOnePairAnyDifferenceCounts) { EXPECT_TRUE(compare_runs(run("a", {4}), run("b", {4.001}), false).differs); }
TEST_F(TwoRuns, ADamagedLogIsFoundByVerify) {
  const auto a = run("a", {4}), b = run("b", {4});
  write_text_file(b / "h/pd_ff_drag/1/flight.csv", "edited");
  EXPECT_FALSE(compare_runs(a, b, false).differs) << "without the check the edit goes unseen";
  EXPECT_THAT(test::error_of([&] { compare_runs(a, b, true); }, ExitCode::data_quality), HasSubstr("does not fit its result.json"));
}
TEST_F(TwoRuns, AFlightThatCrashedInOneRunIsADifference) {
  const auto a = run("a", {4, 5}), b = run("b", {4, 5});
  auto r = read_result(b);
  r.flights[1].end = FlightEnd::crashed;
  write_text_file(b / "result.json", result_json_text(r));
  const auto c = compare_runs(a, b, false);
  EXPECT_TRUE(c.differs);
  EXPECT_THAT(comparison_text(c), HasSubstr("seed 2 completed in a, but crashed in b"));
}

}  // namespace
}  // namespace rotorloop::hil
