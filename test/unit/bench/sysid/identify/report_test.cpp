// The page and result.json of one short fit: what a reader must find there, and how it is written.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>

#include "bench/sysid/identify/identified_vehicle.hpp"
#include "bench/sysid/identify/report/identify_report.hpp"
#include "bench/sysid/identify/report/identify_sections.hpp"
#include "bench/sysid/identify/report/identify_text.hpp"
#include "test/support/model_true_flight.hpp"

namespace rotorloop::identify {
namespace {

constexpr double kDragSpeed_m_s = 8.5;

host::VehicleFile paper() {
  return host::read_vehicle(std::string(ROTORLOOP_SOURCE_DIR) + "/vehicles/paper.toml", host::builtin_effect_catalogue());
}

// One flight of turns, with the torque coefficient and drag held and the noise given.
const Identification& result() {
  static const Identification r = [] {
    model_true::FlightSettings s;
    s.manoeuvre = model_true::Manoeuvre::rotation;
    s.duration_s = 5.0;
    IdentifyOptions o;
    o.grid.rate_Hz = 50.0;
    o.wishes.hold = {"torque_model.c_q", "drag", "pose_delay"};
    o.fit.noise.rounds = 0;
    o.fit.innovations = true;
    return identify({{model_true::fly({}, s).record, FlightRole::any, {}, {}}}, paper(), o);
  }();
  return r;
}
const IdentifyAnalysis& analysis() {
  static const IdentifyAnalysis a = analyse(result(), host::to_model(paper()), kDragSpeed_m_s);
  return a;
}

IdentifyProvenance provenance() {
  IdentifyProvenance p{.version = "1.2.3", .git = "abc1234", .started_utc = "", .wall_s = 0.0, .inputs = {}, .conditions = {}};
  p.conditions.vehicle = "paper.toml";
  p.conditions.noise = NoiseSearch::fixed;
  p.conditions.fit.rate_Hz = 50.0;
  p.conditions.fit.from_s = 1.5;
  return p;
}

FileComparison compared_with(const std::vector<ComparedVehicle>& others, const host::VehicleFile& start = paper()) {
  return compared(result(), analysis().derived, kDragSpeed_m_s, {"paper.toml", start}, others);
}

std::string page_of(const FileComparison& c, const IdentifyAnalysis& a = analysis()) {
  const IdentifyProvenance p = provenance();
  return identify_report_html({result(), a, c, {}, p, "seed paper quadrotor"});
}

// The row of a table that begins with this cell, in the section with this id.
std::string row_of(const std::string& page, const std::string& section, const std::string& name) {
  const auto from = page.find("id=\"" + section + "\"");
  if (from == std::string::npos) return "";
  const std::string part = page.substr(from, page.find("<h2", from) - from);
  const auto at = part.find("<td class=\"l\">" + name + "</td>");
  return at == std::string::npos ? "" : part.substr(at, part.find("</tr>", at) - at);
}
bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

// A file that says `value` of I_xx, with this origin.
ComparedVehicle saying_inertia(double value, host::Origin origin) {
  ComparedVehicle b{"other.toml", paper()};
  b.file.inertia_kg_m2[0] = {value, 1e-6, origin};
  return b;
}

TEST(IdentifyPage, ListsWhatWasHeldOfThePapersParametersWithValueAndOrigin) {
  const std::string page = page_of(compared_with({}));
  for (const char* name : {"m", "I_xx", "I_yy", "I_zz", "c_q", "Δx", "Δy", "k_1", "k_2", "c_d,h", "c_d,xy", "c_d,z", "r_BS,x", "q_BS,z"})
    EXPECT_NE(row_of(page, "parameters", name), "") << name;
  const std::string c_q = row_of(page, "parameters", "c_q");
  EXPECT_TRUE(holds(c_q, ">3.1e−08<")) << c_q;
  EXPECT_TRUE(holds(c_q, ">flight<")) << c_q;
  EXPECT_TRUE(holds(c_q, ">held<")) << c_q;
  EXPECT_FALSE(holds(row_of(page, "parameters", "I_xx"), "held"));
  EXPECT_FALSE(holds(row_of(page, "parameters", "t_pose"), "guess")) << "no vehicle file says a delay";
}

TEST(IdentifyPage, SaysWhatItWasIdentifiedFromAndUnderWhatConditionsBeforeTheFirstTable) {
  IdentifyAnalysis a = analysis();
  ASSERT_FALSE(a.whiteness.empty());
  a.whiteness.front().channels.front().white = false;
  const std::string page = page_of(compared_with({}), a);
  const std::string top = page.substr(0, page.find("id=\"parameters\""));
  for (const char* part : {"<h1>Vehicle identified from 1 flight</h1>", "start: seed paper quadrotor (paper.toml)", "1.2.3", "abc1234",
                           "c_q, c_d,h, c_d,xy, c_d,z, t_pose", "fixed", "50 Hz", "1.5 s to end", "innovations are not white"})
    EXPECT_TRUE(holds(top, part)) << part;
}

TEST(IdentifyPage, HoldsTheNoiseFiguresOfEachFlight) {
  const std::string page = page_of(compared_with({}));
  EXPECT_TRUE(holds(row_of(page, "noise", "q_α"), "<td>0.5</td><td>0.5</td><td>0.5</td><td class=\"l\">rad/s²/√Hz</td>"));
  EXPECT_TRUE(holds(row_of(page, "noise", "position"), "<td>0.002</td>"));
  EXPECT_EQ(row_of(page, "noise", "gyro"), "") << "this fit read no gyro";
}

TEST(IdentifyPage, ShowsByHowManyPercentTheFlightsDifferFromAFileBeside) {
  const double found = result().fit.find(estimate::kIxx)->value;
  const std::string page = page_of(compared_with({saying_inertia(0.8 * found, host::Origin::cad)}));
  const std::string row = row_of(page, "beside", "I_xx");
  EXPECT_TRUE(holds(row, ">+25.0<")) << row;
  EXPECT_TRUE(holds(row, ">cad<")) << row;
  EXPECT_TRUE(holds(row_of(page, "beside", "c_q"), "(held)"));
  EXPECT_FALSE(holds(page_of(compared_with({})), "other.toml"));
}

TEST(IdentifyPage, ShowsADifferenceInRedOnlyWhereTheFileDoesNotGuess) {
  const double found = result().fit.find(estimate::kIxx)->value;
  const auto red = [&](host::Origin origin) {
    return holds(row_of(page_of(compared_with({saying_inertia(0.5 * found, origin)})), "beside", "I_xx"), "\"fail\"");
  };
  EXPECT_TRUE(red(host::Origin::cad));
  EXPECT_FALSE(red(host::Origin::guess));
}

TEST(IdentifyPage, ShowsStaticThrustAgainstEveryEntryOfStandAndFlight) {
  const DerivedQuantity& c_t = *derived_named("static_c_t", analysis().derived);
  host::VehicleFile start = paper();
  start.static_thrust = {{host::Origin::stand, c_t.value / 0.92, 1e-9, {5000, 15000}, start.air_density_kg_m3}};
  ComparedVehicle thin{"thin_air.toml", paper()};
  thin.file.static_thrust = {{host::Origin::flight, 0.5 * c_t.value, 1e-9, {5000, 15000}, 0.5 * start.air_density_kg_m3}};
  const FileComparison c = compared_with({thin}, start);
  ASSERT_EQ(c.static_thrust.size(), 2u);
  EXPECT_NEAR(c.static_thrust[0].said.percent, -8.0, 1e-9);
  EXPECT_NEAR(c.static_thrust[1].said.percent, 0.0, 1e-9) << "half the thrust in air half as dense is the same propeller";
  EXPECT_TRUE(holds(page_of(c), ">−8.00<"));
  const IdentifyProvenance p = provenance();
  EXPECT_TRUE(holds(identify_text({result(), analysis(), c, {}, p, "seed paper quadrotor"}), " -8.00 "));
}

TEST(IdentifyPage, GivesTheQuaternionThatTheRotationVectorStandsFor) {
  const host::VehicleFile v = identified_vehicle(result().fit, paper(), {0, 0}, "test", {});
  const auto& q = v.pose_sensor.quaternion_wxyz;
  const auto figure = [](double x) { return render::figure_text(x, "{:.6f}"); };
  const std::string shown = figure(q[0]) + ", " + figure(q[1]) + ", " + figure(q[2]) + ", " + figure(q[3]);
  const std::string page = page_of(compared_with({}));
  EXPECT_TRUE(holds(page, shown)) << shown;
  EXPECT_TRUE(holds(page, "rotation vector of the sensor about the start value"));
  // A file with the rotation that was found says nothing else about any axis.
  const FileComparison same = compared_with({{"found.toml", v}});
  for (std::size_t i = 0; i < same.rows.size(); ++i) {
    const int p = same.rows[i].parameter;
    if (p >= estimate::kTurnX && p <= estimate::kTurnZ) {
      EXPECT_NEAR(same.others[0].parameters[i]->value, same.rows[i].value, 1e-9) << same.rows[i].symbol;
    }
  }
}

TEST(IdentifyPage, WritesUnitsMinusAndHeadsAsPrintHasThem) {
  const std::string page = page_of(compared_with({{"paper_again.toml", paper()}}));
  for (const char* unit : {"kg m2", "N s2", "m2/N"}) EXPECT_FALSE(holds(page, unit)) << unit;
  EXPECT_TRUE(holds(page, "kg m²"));
  EXPECT_FALSE(std::regex_search(page, std::regex("<td[^>]*>[^<]*-[0-9]"))) << "an ASCII minus in a table";
  for (const char* name : {"unit", "meaning", "direction", "origin", "manoeuvre that determines it"}) {
    EXPECT_TRUE(holds(page, std::string("<th class=\"l\">") + name + "</th>")) << name;
    EXPECT_FALSE(holds(page, std::string("<th>") + name + "</th>")) << name;
  }
  EXPECT_EQ(p_text(0.0), "< 1e−300");
  EXPECT_EQ(p_text(0.04), "0.04");
}

TEST(IdentifyPage, ExplainsTheCorrelationMapAndPutsItsNumbersInTheColourOfThePaper) {
  const std::string page = page_of(compared_with({}));
  EXPECT_TRUE(holds(page, "correlation: blue below zero, orange above"));
  EXPECT_TRUE(std::regex_search(page, std::regex("fill:var\\(--paper\\)\">(−)?[01]\\.[0-9]{2}<"))) << "k_1 and k_2 are strongly correlated";
}

TEST(IdentifyPage, SaysWhyThereAreNoResidualsToJudgeWithoutPoses) {
  EXPECT_TRUE(holds(page_of(compared_with({})), "whitened in order"));
  IdentifyAnalysis without = analysis();
  without.whiteness.clear();
  EXPECT_TRUE(holds(page_of(compared_with({}), without), "none of these flights has poses"));
}

TEST(IdentifyResult, HoldsNoiseConditionsHeldParametersAndComparisons) {
  const double found = result().fit.find(estimate::kIxx)->value;
  const FileComparison c = compared_with({saying_inertia(0.8 * found, host::Origin::cad)});
  const auto j = nlohmann::json::parse(identify_result_json(result(), analysis(), c, {}, provenance()));
  EXPECT_EQ(j.at("conditions").at("noise"), "fixed");
  EXPECT_EQ(j.at("conditions").at("from_s"), 1.5);
  EXPECT_TRUE(j.at("conditions").at("to_s").is_null()) << "no bound was given";
  ASSERT_EQ(j.at("noise").size(), 1u);
  EXPECT_EQ(j.at("noise")[0].at("q_alpha_rad_s2_rtHz"), (std::vector<double>{0.5, 0.5, 0.5}));
  EXPECT_NEAR(j.at("noise")[0].at("rate_Hz").get<double>(), 50.0, 1e-9);
  EXPECT_TRUE(j.at("noise")[0].at("gyro_rad_s").is_null());
  ASSERT_EQ(j.at("held").size(), 5u) << j.at("held").dump();
  EXPECT_EQ(j.at("held")[0].at("symbol"), "c_q");
  EXPECT_EQ(j.at("held")[0].at("value").get<double>(), paper().c_q_N_m_s2.value);
  EXPECT_EQ(j.at("held")[0].at("origin"), "flight");
  ASSERT_EQ(j.at("beside").size(), 1u);
  for (const auto& row : j.at("beside")[0].at("parameters")) {
    if (row.at("symbol") == "I_xx") {
      EXPECT_NEAR(row.at("percent").get<double>(), 25.0, 1e-6);
    }
  }
  EXPECT_EQ(j.at("static_thrust").size(), 4u) << "two entries of the start file, two of the one beside";
}

}  // namespace
}  // namespace rotorloop::identify
