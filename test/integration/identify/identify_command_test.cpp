// `rotorloop identify` as a user runs it: logs written to a folder, a vehicle file and a report come out; bad logs end with a message.
#include <cctype>
#include <cmath>

#include "bench/identify/own_log.hpp"
#include "host/vehicle/vehicle_file.hpp"
#include "test/integration/hil/cli_run.hpp"
#include "test/support/model_true_flight.hpp"

namespace rotorloop::bench {
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
      write_text(scratch / (f.record.name + ".csv"), own_log_text(f.record));
      if (f.record.name == "vertical") {
        f.record.rotor_omega_rad_s = {};
        write_text(scratch / "no_speeds.csv", own_log_text(f.record));
      }
    }
    s.manoeuvre = model_true::Manoeuvre::rotation;
    s.seed = 77;
    s.duration_s = 12.0;
    write_text(scratch / "another.csv", own_log_text(model_true::fly({}, s).record));
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
  EXPECT_EQ(result.at("inputs").size(), 5u);
  EXPECT_NEAR(result.at("figures").at("static_c_t").at("value").get<double>(), model_true::static_thrust_coefficient(truth), 2e-8);
  const std::string page = read_text(scratch / "report" / "report.html");
  for (const char* part :
       {"id=\"parameters\"", "id=\"stages\"", "id=\"held-out\"", "id=\"residuals\"", "id=\"flights\"", "id=\"observability\""})
    EXPECT_NE(page.find(part), std::string::npos) << part;
  for (const std::string& text : {page, read_text(scratch / "out.toml"), read_text(scratch / "report" / "result.json")})
    EXPECT_FALSE(holds_no_number(text));
}

TEST_F(IdentifyCommand, RefusesToHoldOutAFlightThatIsFitted) {
  const CommandResult r = run("--rotation rotation.csv --held-out rotation.csv --noise fixed");
  EXPECT_EQ(r.exit_code, 2);
  EXPECT_NE(r.err.find("held out and also fitted"), std::string::npos) << r.err;
}

TEST_F(IdentifyCommand, ComparesWithFilesBesideInTextPageResultAndTrail) {
  const std::string beside = "--beside '" ROTORLOOP_SOURCE_DIR "/vehicles/reference_cad.toml' ";
  const std::string fit = "--flight rotation.csv --noise fixed --rate 50 --hold pose_delay --hold c_q --quiet ";
  ASSERT_EQ(run(fit + "--report first").exit_code, 0);
  const CommandResult r = run(fit + beside + "--trail first --report second");
  ASSERT_EQ(r.exit_code, 0) << r.err;
  for (const char* part : {"beside reference_cad.toml", "static thrust of these flights", "q_BS (w x y z)"})
    EXPECT_NE(r.out.find(part), std::string::npos) << part;
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

TEST_F(IdentifyCommand, EndsWith5ForALogWithoutRotorSpeedsNamingStageAndColumns) {
  const CommandResult r = run("--vertical no_speeds.csv --no-checks -o out.toml");
  EXPECT_EQ(r.exit_code, 5);
  EXPECT_NE(r.err.find("stage vertical needs rotor speeds"), std::string::npos) << r.err;
  EXPECT_FALSE(fs::exists(scratch / "out.toml"));
}

TEST_F(IdentifyCommand, EndsWith5AndWritesNothingWhenADirectionStaysOpen) {
  const CommandResult r = run("--flight rotation.csv --free imu_place --noise fixed -o out.toml --report report");
  EXPECT_EQ(r.exit_code, 5);
  EXPECT_NE(r.err.find("r_BI,x"), std::string::npos) << r.err;
  EXPECT_FALSE(fs::exists(scratch / "out.toml"));
  EXPECT_FALSE(fs::exists(scratch / "report"));
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
}  // namespace rotorloop::bench
