// The command is the library: a program that calls it with the same files and the same options gets every figure that the command writes.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "bench/sysid/diagnose/diagnosis_run.hpp"
#include "bench/sysid/diagnose/report/diagnosis_text.hpp"
#include "bench/sysid/identify/report/identify_result.hpp"
#include "bench/sysid/log/own_log.hpp"
#include "host/vehicle/vehicle_file.hpp"
#include "rotorloop_version.hpp"
#include "test/integration/hil/cli_run.hpp"
#include "test/support/model_true_flight.hpp"

namespace rotorloop::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const fs::path kVehicles = fs::path(ROTORLOOP_SOURCE_DIR) / "vehicles";

// What differs, as a JSON patch; when a result was made and how long it took is none of its figures.
json differences(json command, json library) {
  for (json* result : {&command, &library}) {
    json& from = result->contains("provenance") ? result->at("provenance") : *result;
    from.erase("started_utc");
    from.erase("wall_s");
  }
  return json::diff(command, library);
}

json result_of_library(const identify::IdentificationRun& run) {
  return json::parse(identify::identify_result_json(run.result, run.analysis, run.comparison, run.flights.all_checked(),
                                                    {kVersion, kGit, "", 0.0, run.flights.inputs, run.request}));
}

class Library : public ::testing::Test {
 protected:
  fs::path flown(model_true::Manoeuvre manoeuvre, std::uint64_t seed) {
    model_true::FlightSettings s;
    s.manoeuvre = manoeuvre;
    s.duration_s = 5.0;
    s.imu_every_ms = 2;
    s.seed = seed;
    const fs::path path = scratch / (std::to_string(seed) + ".csv");
    write_text(path, log::own_log_text(model_true::fly({}, s).record));
    return path;
  }
  json command(const std::string& arguments) {
    const CommandResult r = rotorloop_command(arguments + " --json --quiet", scratch.path());
    EXPECT_EQ(r.exit_code, 0) << r.err;
    return json::parse(r.out);
  }
  ScratchFolder scratch;
};

TEST_F(Library, IdentifyWithNothingButFilesGivesEveryFigureOfTheCommandToTheLastBit) {
  const fs::path flight = flown(model_true::Manoeuvre::rotation, 1), other = flown(model_true::Manoeuvre::rotation, 2);
  const json written = command("identify --vehicle '" + (kVehicles / "paper.toml").string() + "' --flight '" + flight.string() +
                               "' --held-out '" + other.string() + "'");
  const auto run =
      identify::run_identification({.vehicle = kVehicles / "paper.toml", .flights = {.flights = {flight}, .held_out = {other}}});
  EXPECT_EQ(differences(written, result_of_library(run)), json::array());
  EXPECT_GT(written.at("figures").size(), 10u);
  EXPECT_TRUE(written.contains("held_out"));

  // The fit alone makes none of the command's choices.
  const auto bare = identify::identify(run.flights.to_fit(), run.base, {});
  ASSERT_NE(bare.fit.find(estimate::kIxx), nullptr);
  EXPECT_NE(bare.fit.find(estimate::kIxx)->value, run.result.fit.find(estimate::kIxx)->value);
}

TEST_F(Library, IdentifyWithOptionsGivesFiguresAndVehicleFileOfTheCommandWithTheSame) {
  const fs::path vertical = flown(model_true::Manoeuvre::vertical, 3), rotation = flown(model_true::Manoeuvre::rotation, 4);
  const fs::path out = scratch / "out.toml";
  const json written = command(
      "identify --vehicle '" + (kVehicles / "paper.toml").string() + "' --vertical '" + vertical.string() + "' --rotation '" +
      rotation.string() + "' --compare '" + (kVehicles / "reference_cad.toml").string() + "' -o '" + out.string() +
      "' --noise fixed --rate 50 --from 0.5 --to 4.5 --use gyro --hold pose_delay --free gravity_tilt=0.01 --term rotor_local_inflow "
      "--no-checks --no-priors --robust 4 --block 0.25 --iterations 100 --drag-speed 6");
  identify::IdentificationRequest request{.vehicle = kVehicles / "paper.toml",
                                          .flights = {.vertical = {vertical}, .rotation = {rotation}, .checks = false},
                                          .compare = {kVehicles / "reference_cad.toml"},
                                          .out = out,
                                          .noise = identify::NoiseSearch::fixed,
                                          .priors = false,
                                          .drag_speed_m_s = 6.0,
                                          .robust_scale = 4.0,
                                          .block_s = 0.25,
                                          .iterations = 100};
  request.fit = {.free = {"gravity_tilt=0.01"}, .hold = {"pose_delay"}, .use = {"gyro"}, .rate_Hz = 50.0, .from_s = 0.5, .to_s = 4.5};
  request.terms.add(*host::find_term("rotor_local_inflow"));
  const auto run = identify::run_identification(request);
  EXPECT_FALSE(run.problem) << run.problem->what();
  EXPECT_EQ(differences(written, result_of_library(run)), json::array());
  EXPECT_EQ(read_text(out), host::vehicle_text(run.vehicle));
}

TEST_F(Library, DiagnoseGivesEveryFigureOfTheCommandAndItsVehicleFileToTheLastBit) {
  const fs::path flight = flown(model_true::Manoeuvre::rotation, 5), other = flown(model_true::Manoeuvre::rotation, 6);
  const fs::path out = scratch / "out.toml";
  diagnose::DiagnosisRequest request{.vehicle = kVehicles / "paper.toml",
                                     .flights = {.flights = {flight}, .held_out = {other}},
                                     .out = out,
                                     .fit = {.hold = {"torque_model.c_q"}, .rate_Hz = 50.0},
                                     .wrench_band = {0.5, 5.0},
                                     .max_effects = 1,
                                     .placebos = 5,
                                     .seed = 7};
  std::string without;  // but three, so that this takes seconds
  for (const host::Term& term : host::all_terms()) {
    if (term.info.id == "linear_drag" || term.info.id == "com_offset" || term.info.id == "quadratic_rate_damping") continue;
    request.without.emplace_back(term.info.id);
    without += " " + request.without.back();
  }
  const json written =
      command("diagnose --vehicle '" + (kVehicles / "paper.toml").string() + "' --flight '" + flight.string() + "' --held-out '" +
              other.string() + "' -o '" + out.string() +
              "' --hold torque_model.c_q --rate 50 --wrench-band 0.5,5 --max-effects 1 --placebos 5 --seed 7 --without" + without);
  const diagnose::DiagnosedFlights found = diagnose::run_diagnosis(request);
  EXPECT_FALSE(found.problem) << found.problem->what();
  EXPECT_EQ(differences(written, json::parse(diagnose::diagnosis_json(found.run, {kVersion, kGit, "", 0.0, found.flights.inputs}))),
            json::array());
  EXPECT_FALSE(written.at("rounds").empty());
  EXPECT_TRUE(written.contains("held_out"));
  ASSERT_TRUE(found.vehicle);
  EXPECT_EQ(read_text(out), host::vehicle_text(*found.vehicle));
}

}  // namespace
}  // namespace rotorloop::test
