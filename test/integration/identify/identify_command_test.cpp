// `rotorloop identify` as a user runs it: logs written to a folder, a vehicle file and a report come out; bad logs end with a message.
#include <gmock/gmock.h>

#include <cctype>
#include <cmath>

#include "bench/sysid/log/own_log.hpp"
#include "host/vehicle/vehicle_file.hpp"
#include "test/integration/hil/cli_run.hpp"
#include "test/support/model_true_flight.hpp"

namespace rotorloop::test {
namespace {

namespace fs = std::filesystem;

const std::string kVehicle = "--vehicle '" ROTORLOOP_SOURCE_DIR "/vehicles/paper.toml' ";

// "nan" as a word of its own: "provenance" is none.
bool holds_no_number(const std::string& text) {
  for (std::size_t at = text.find("nan"); at != std::string::npos; at = text.find("nan", at + 1)) {
    const bool before = at > 0 && std::isalpha(static_cast<unsigned char>(text[at - 1]));
    const bool after = at + 3 < text.size() && std::isalpha(static_cast<unsigned char>(text[at + 3]));
    if (!before && !after) return true;
  }
  return false;
}

// Three short flights as logs of this house, and one of them without rotor speeds.
class IdentifyCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    model_true::FlightSettings s;
    s.duration_s = 5.0;
    for (auto& f : model_true::fly_identification_set({}, s)) {
      write_text(scratch / (f.record.name + ".csv"), log::own_log_text(f.record));
      if (f.record.name == "vertical") {
        f.record.rotor_omega_rad_s = {};
        write_text(scratch / "no_speeds.csv", log::own_log_text(f.record));
      } else if (f.record.name == "horizontal") {
        for (auto& speeds : f.record.rotor_omega_rad_s.value)
          for (double& w : speeds) w *= 10.0;
        write_text(scratch / "wrong_unit.csv", log::own_log_text(f.record));
      }
    }
    s.manoeuvre = model_true::Manoeuvre::rotation;
    s.seed = 77;
    s.duration_s = 12.0;
    write_text(scratch / "another.csv", log::own_log_text(model_true::fly({}, s).record));
  }
  CommandResult run(const std::string& arguments) { return rotorloop_command("identify " + kVehicle + arguments, scratch.path()); }
  ScratchFolder scratch;
};

TEST_F(IdentifyCommand, WritesVehicleReportAndResultOfThreeFlights) {
  const CommandResult r =
      run("--vertical vertical.csv --horizontal horizontal.csv --rotation rotation.csv --held-out another.csv --noise fixed -o out.toml "
          "--report report");
  ASSERT_EQ(r.exit_code, 0) << r.out << r.err;
  const host::VehicleFile v = host::read_vehicle(scratch / "out.toml", host::builtin_effect_catalogue());
  const model_true::Truth truth;
  EXPECT_NEAR(v.inertia_kg_m2[0].value, truth.inertia_kg_m2.x(), 5.0 * v.inertia_kg_m2[0].u);
  EXPECT_NEAR(v.c_dh_s_m.value, truth.c_dh_s_m, 5.0 * v.c_dh_s_m.u);
  EXPECT_EQ(v.c_q_N_m_s2.origin, host::Origin::flight);
  const auto result = result_of(scratch / "report");
  EXPECT_EQ(result.at("command"), "identify");
  const auto& inputs = result.at("inputs");
  ASSERT_EQ(inputs.size(), 5u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_FALSE(inputs[i].contains("held_out")) << inputs[i];
    EXPECT_THAT(v.inputs, testing::Contains("sha256:" + inputs[i].at("sha256").get<std::string>()));
  }
  EXPECT_TRUE(inputs[4].at("held_out").get<bool>());
  EXPECT_EQ(v.inputs.size(), 4u) << "the flight held out had no part in the vehicle";
  const auto& held_out = result.at("held_out");
  EXPECT_EQ(held_out.at("flights").size(), 1u);
  EXPECT_EQ(held_out.at("rows").size(), 32u);
  for (const auto& row : held_out.at("rows")) {
    for (const char* key : {"before", "after", "floor", "ratio", "low", "high"}) EXPECT_GT(row.at(key).get<double>(), 0.0) << row;
  }
  EXPECT_NEAR(held_out.at("one_step").at("size").at("after").get<double>(), 1.0, 0.5);
  EXPECT_TRUE(held_out.at("one_step").at("log_likelihood").at("gain").is_number());
  EXPECT_NEAR(result.at("figures").at("static_c_t").at("value").get<double>(), model_true::static_thrust_coefficient(truth), 2e-8);
  const std::string page = read_text(scratch / "report" / "report.html");
  for (const char* part :
       {"id=\"parameters\"", "id=\"stages\"", "id=\"held-out\"", "id=\"residuals\"", "id=\"flights\"", "id=\"observability\""})
    EXPECT_NE(page.find(part), std::string::npos) << part;
  for (const std::string& text : {page, read_text(scratch / "out.toml"), read_text(scratch / "report" / "result.json")})
    EXPECT_FALSE(holds_no_number(text));
}

TEST_F(IdentifyCommand, UsesGyroAndAccelerometerWhereTheLogsHaveThemAndSaysSo) {
  model_true::FlightSettings s;
  s.manoeuvre = model_true::Manoeuvre::rotation;
  s.duration_s = 5.0;
  s.imu_every_ms = 2;
  write_text(scratch / "imu.csv", log::own_log_text(model_true::fly({}, s).record));
  for (const auto& [flights, used] :
       {std::pair{"imu.csv", nlohmann::json{"gyro", "accel"}}, std::pair{"imu.csv rotation.csv", nlohmann::json::array()}}) {
    const CommandResult r = run(std::string("--noise fixed --force --report report --flight ") + flights);
    ASSERT_EQ(r.exit_code, 0) << r.out << r.err;
    EXPECT_EQ(result_of(scratch / "report").at("conditions").at("use"), used);
    EXPECT_EQ(read_text(scratch / "report" / "report.html").find("poses, gyro") != std::string::npos, !used.empty());
  }
}

TEST_F(IdentifyCommand, RefusesToHoldOutAFlightThatIsFitted) {
  const CommandResult r = run("--rotation rotation.csv --held-out rotation.csv --noise fixed");
  EXPECT_EQ(r.exit_code, 2);
  EXPECT_NE(r.err.find("held out and also fitted"), std::string::npos) << r.err;
}

TEST_F(IdentifyCommand, ComparesWithOtherFilesInTextPageResultAndParameterHistory) {
  const std::string beside = "--compare '" ROTORLOOP_SOURCE_DIR "/vehicles/reference_cad.toml' ";
  const std::string fit = "--flight rotation.csv --noise fixed --rate 50 --hold pose_delay --hold c_q --quiet ";
  ASSERT_EQ(run(fit + "--report first").exit_code, 0);
  const CommandResult r = run(fit + beside + "--trail first --report second");
  ASSERT_EQ(r.exit_code, 0) << r.err;
  for (const char* part : {"Comparison with reference_cad.toml", "Static thrust of these flights compared with other measurements",
                           "The quaternion itself, sensor to body, w x y z: "})
    EXPECT_NE(r.out.find(part), std::string::npos) << part << "\n" << r.out;
  const auto result = result_of(scratch / "second");
  EXPECT_EQ(result.at("beside").at(0).at("file"), "reference_cad.toml");
  EXPECT_EQ(result.at("static_thrust").at(1).at("origin"), "stand") << "paper.toml has a flight's entry, then a stand's";
  EXPECT_EQ(result.at("inputs").size(), 3u) << "start file, log, file beside";
  EXPECT_EQ(result.at("held").at(0).at("symbol"), "c_q");
  const std::string page = read_text(scratch / "second" / "report.html");
  for (const char* part :
       {"id=\"beside\"", "id=\"noise\"", "id=\"trail\"", ">first</text>", ">second</text>", ">reference_cad.toml</text>"})
    EXPECT_NE(page.find(part), std::string::npos) << part;
  EXPECT_FALSE(holds_no_number(page));
}

TEST_F(IdentifyCommand, PrintsResultJsonAloneOnStdout) {
  const CommandResult r = run("--flight rotation.csv --noise fixed --json --quiet");
  ASSERT_EQ(r.exit_code, 0) << r.err;
  const auto j = nlohmann::json::parse(r.out);
  EXPECT_TRUE(j.at("fit").at("converged").get<bool>());
  EXPECT_EQ(j.at("stages").size(), 0u);
  EXPECT_EQ(r.err, "");
}

TEST_F(IdentifyCommand, TellsHowFarCeresLiesFromTheOwnSolverInTextResultAndPage) {
  const CommandResult r =
      run("--flight rotation.csv --hold pose_delay --rate 50 --noise fixed --solver ceres --term rotor_local_inflow -o out.toml --report "
          "report");
  ASSERT_EQ(r.exit_code, 0) << r.out << r.err;
  EXPECT_NE(r.out.find("the same fit by Ceres: cost "), std::string::npos) << r.out;
  EXPECT_NE(r.out.find("docs/acceptance/identify_speed.md"), std::string::npos) << r.out;
  const auto result = result_of(scratch / "report");
  EXPECT_EQ(result.at("verdict"), "pass");
  const auto& check = result.at("solver_check");
  EXPECT_TRUE(check.at("good").get<bool>());
  EXPECT_EQ(check.at("problem"), "");
  EXPECT_NEAR(check.at("ceres_cost").get<double>() / check.at("own_cost").get<double>(), 1.0, 1e-8);
  EXPECT_LT(std::fabs(check.at("to_the_end").at("estimate_u").get<double>()), 1e-3);
  EXPECT_LT(std::fabs(check.at("to_the_end").at("uncertainty").get<double>()), 1e-4);
  const std::string farthest = check.at("told").at("estimate").get<std::string>();
  bool is_an_estimate = false;
  for (const auto& e : result.at("estimates")) is_an_estimate = is_an_estimate || e.at("symbol") == farthest;
  EXPECT_TRUE(is_an_estimate) << farthest;
  EXPECT_NE(read_text(scratch / "report" / "report.html").find("the same fit by Ceres"), std::string::npos);
}

TEST_F(IdentifyCommand, TellsNothingOfCeresWhereNobodyAsked) {
  const CommandResult r = run("--flight rotation.csv --hold pose_delay --rate 50 --noise fixed --json --quiet");
  ASSERT_EQ(r.exit_code, 0) << r.err;
  EXPECT_FALSE(nlohmann::json::parse(r.out).contains("solver_check"));
}

TEST_F(IdentifyCommand, WritesALineForEachPartWhereStderrIsNoTerminal) {
  const CommandResult r = run("--rotation rotation.csv --hold pose_delay --rate 50 --noise fixed --no-checks");
  ASSERT_EQ(r.exit_code, 0) << r.err;
  EXPECT_TRUE(r.err.starts_with("[1/2] stage rotation: iteration 0 of at most 200, cost ")) << r.err;
  EXPECT_NE(r.err.find("\n[2/2] joint fit: iteration 0 of at most 200, cost "), std::string::npos) << r.err;
  EXPECT_EQ(r.err.find('\r'), std::string::npos);
}

TEST_F(IdentifyCommand, ListsNamesWithoutAVehicleFileAndAsksForOneOtherwise) {
  const CommandResult r = rotorloop_command("identify --names", scratch.path());
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_NE(r.out.find("drag.c_dh"), std::string::npos);
  EXPECT_NE(r.out.find("rotor_local_inflow"), std::string::npos);
  const CommandResult none = rotorloop_command("identify --flight rotation.csv", scratch.path());
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_NE(none.err.find("--vehicle is required"), std::string::npos) << none.err;
}

TEST_F(IdentifyCommand, LeavesOutAFlightThatTheChecksRefuseAndSaysSoInTextResultAndJunit) {
  const CommandResult r =
      run("--vertical vertical.csv --horizontal horizontal.csv --rotation rotation.csv --flight wrong_unit.csv --noise fixed -o out.toml "
          "--report report "
          "--junit j.xml");
  ASSERT_EQ(r.exit_code, 0) << r.out << r.err;
  EXPECT_THAT(r.err, testing::HasSubstr("warning: wrong_unit is left out, refused by the checks: ")) << r.err;
  EXPECT_THAT(r.out, testing::HasSubstr("left out: wrong_unit (refused by the checks: ")) << r.out;
  const auto result = result_of(scratch / "report");
  EXPECT_EQ(result.at("inputs").size(), 4u) << "vehicle file and the three flights that were fitted";
  ASSERT_EQ(result.at("checks").size(), 4u);
  EXPECT_FALSE(result.at("checks")[3].at("refusal").is_null());
  EXPECT_EQ(host::read_vehicle(scratch / "out.toml", host::builtin_effect_catalogue()).inputs.size(), 4u);
  EXPECT_THAT(read_text(scratch / "j.xml"), testing::HasSubstr("failures=\"1\""));
  EXPECT_THAT(read_text(scratch / "report" / "report.html"), testing::HasSubstr("refused by the checks: "));
}

TEST_F(IdentifyCommand, EndsWith5WhereTheChecksRefuseEveryFlight) {
  const CommandResult r = run("--flight wrong_unit.csv wrong_unit.csv --held-out vertical.csv -o out.toml");
  EXPECT_EQ(r.exit_code, 5) << r.out << r.err;
  EXPECT_FALSE(fs::exists(scratch / "out.toml"));
}

TEST_F(IdentifyCommand, DiagnosesTheFlightsThatAreLeftWhereTheChecksRefuseOneAndNamesTheFault) {
  const CommandResult r = rotorloop_command(
      "diagnose " + kVehicle + "--flight vertical.csv wrong_unit.csv --use none --rate 50 --max-effects 0 --placebos 0 --report report",
      scratch.path());
  ASSERT_EQ(r.exit_code, 0) << r.out << r.err;
  const auto result = result_of(scratch / "report");
  ASSERT_EQ(result.at("faults").size(), 1u) << result.at("faults");
  EXPECT_EQ(result.at("faults")[0].at("flight"), "wrong_unit");
  EXPECT_NE(result.at("verdict"), "faulty") << "of the flight that is left something can be said";
  EXPECT_THAT(r.out, testing::HasSubstr("wrong_unit is left out: the checks refuse it")) << r.out;
}

TEST_F(IdentifyCommand, EndsWith5ForALogWithoutRotorSpeedsNamingStageAndColumns) {
  const CommandResult r = run("--vertical no_speeds.csv --no-checks -o out.toml");
  EXPECT_EQ(r.exit_code, 5);
  EXPECT_NE(r.err.find("stage vertical needs rotor speeds"), std::string::npos) << r.err;
  EXPECT_FALSE(fs::exists(scratch / "out.toml"));
}

TEST_F(IdentifyCommand, EndsWith5WithoutAVehicleFileAndSaysRefusedInResultPageAndJunitWhenADirectionStaysOpen) {
  const CommandResult r = run("--flight rotation.csv --free imu_place --noise fixed -o out.toml --report report --junit j.xml");
  EXPECT_EQ(r.exit_code, 5);
  EXPECT_NE(r.err.find("r_BI,x"), std::string::npos) << r.err;
  EXPECT_FALSE(fs::exists(scratch / "out.toml"));
  const auto result = result_of(scratch / "report");
  EXPECT_EQ(result.at("verdict"), "refused");
  EXPECT_NE(result.at("errors").at(0).get<std::string>().find("r_BI,x"), std::string::npos) << result;
  EXPECT_FALSE(result.at("next").get<std::string>().empty());
  const std::string page = read_text(scratch / "report" / "report.html");
  EXPECT_NE(page.find("class=\"verdict fail\" role=\"status\"><b>refused</b>"), std::string::npos) << page;
  EXPECT_NE(read_text(scratch / "j.xml").find("r_BI,x"), std::string::npos);
}

// A torque coefficient 1.7 times too large makes a rotor that no one builds.
TEST_F(IdentifyCommand, TellsWhatItFoundBeforeItRefusesAVehicleFileThatIsNotCredible) {
  host::VehicleFile v = host::read_vehicle(std::string(ROTORLOOP_SOURCE_DIR) + "/vehicles/paper.toml", host::builtin_effect_catalogue());
  v.c_q_N_m_s2.value *= 1.7;
  v.k1_N_s2.value *= 1.09;  // hides it in the file: the flight tells the thrust, and then it shows
  v.k2_N_s2_m.value *= std::sqrt(1.09);
  v.static_thrust.clear();
  host::write_vehicle(scratch / "start.toml", v);
  const CommandResult r = rotorloop_command(
      "identify --vehicle start.toml --vertical vertical.csv --horizontal horizontal.csv --rotation rotation.csv --hold torque_model.c_q "
      "--noise fixed -o out.toml --report "
      "report",
      scratch.path());
  EXPECT_EQ(r.exit_code, 5) << r.out;
  EXPECT_NE(r.err.find("is not credible and was not written"), std::string::npos) << r.err;
  EXPECT_NE(r.out.find("k_1"), std::string::npos);
  EXPECT_FALSE(fs::exists(scratch / "out.toml"));
  const auto result = result_of(scratch / "report");
  EXPECT_EQ(result.at("verdict"), "refused") << "the figures stand, and the result says that they are no vehicle";
  EXPECT_NE(result.at("errors").at(0).get<std::string>().find("is not credible"), std::string::npos) << result.at("errors");
  EXPECT_FALSE(result.at("estimates").empty());
  EXPECT_NE(r.out.find("verdict: refused\nerror:   "), std::string::npos) << r.out;
  EXPECT_NE(read_text(scratch / "report" / "report.html").find("<b>refused</b>"), std::string::npos);
}

TEST_F(IdentifyCommand, ARobustLossTakesPosesFarOffForLess) {
  const auto fitted = [&](const std::string& options) {
    const CommandResult r = run("--flight rotation.csv --no-checks --noise fixed --json --quiet " + options);
    EXPECT_EQ(r.exit_code, 0) << r.err;
    return nlohmann::json::parse(r.out).at("figures").at("q_BS,x").at("value").get<double>();
  };
  const double clean = fitted("");
  model_true::FlightSettings s;
  s.duration_s = 5.0;
  for (auto& f : model_true::fly_identification_set({}, s)) {
    if (f.record.name != "rotation") continue;
    for (std::size_t i = 50; i < f.record.pose.size(); i += 37)  // 25 standard deviations
      f.record.pose.value[i].q_WS = f.record.pose.value[i].q_WS * Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitX());
    write_text(scratch / "rotation.csv", log::own_log_text(f.record));
  }
  const double squares = fitted(""), robust = fitted("--robust 3");
  EXPECT_LT(std::fabs(robust - clean), 0.3 * std::fabs(squares - clean)) << clean << " " << squares << " " << robust;
}

TEST_F(IdentifyCommand, SaysThatRobustUncertaintiesRestOnTooFewBlocks) {
  const std::string note = "fewer than two each";
  EXPECT_NE(run("--flight rotation.csv --noise fixed").out.find(note), std::string::npos);
  EXPECT_EQ(run("--flight rotation.csv --noise fixed --block 0.1").out.find(note), std::string::npos);
}

TEST_F(IdentifyCommand, EndsWith2ForUnknownTermsParametersAndNoFlight) {
  for (const std::string arguments :
       {"--flight rotation.csv --term rotor_locl_inflow", "--flight rotation.csv --hold drag.cdh", "", "--flight nowhere.csv"}) {
    const CommandResult r = run(arguments);
    EXPECT_EQ(r.exit_code, 2) << arguments << r.err;
    EXPECT_NE(r.err.find("do:"), std::string::npos) << arguments << r.err;
  }
}

}  // namespace
}  // namespace rotorloop::test
