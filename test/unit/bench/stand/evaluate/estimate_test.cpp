// Runs of a simulated stand whose errors are known (test/support/simulated_stand): coefficients, their uncertainty, motor and rotor.
#include <gtest/gtest.h>

#include <cmath>

#include "bench/stand/evaluate/estimate/estimate_files.hpp"
#include "bench/stand/evaluate/estimate/known_headers.hpp"
#include "bench/stand/evaluate/estimate/variance_components.hpp"
#include "bench/stand/evaluate/report/estimate_document.hpp"
#include "host/base/constants.hpp"
#include "host/base/random.hpp"
#include "test/stats/stand_ensemble.hpp"
#include "test/support/simulated_stand.hpp"
#include "test/unit/bench/markup.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::stand {
namespace {

const sim::Blade& reference_blade() {
  static const sim::Blade blade = sim::read_blade(std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "vehicles/blades/triblade_5in.toml");
  return blade;
}
const test::SimulatedStand& simulated() {
  static const test::SimulatedStand stand(reference_blade());
  return stand;
}

EstimateOptions at_hover() {
  EstimateOptions o;
  o.window_rad_s = {{7000.0 * kRad_s_per_rpm, 11000.0 * kRad_s_per_rpm}};
  o.reference_density_kg_m3 = test::kSimulatedDensity_kg_m3;
  o.draws = 300;
  o.inductance_H = 15e-6;
  return o;
}

StandRun run_of(const test::TempFolder& folder, const test::SimulatedStandOptions& options, std::uint64_t seed) {
  simulated().write_run(folder.path() / "run", options, seed);
  return read_stand_run(folder.path() / "run", {});
}

TEST(StandEstimate, RunWithoutErrorsGivesCTAt9000RPMTo0p2percentCQAndTheMotorTo1percent) {
  const test::TempFolder folder;
  const test::SimulatedStandOptions o{.errors = false};
  const auto truth = simulated().truth(o);
  const StandEstimate e = estimate_stand(run_of(folder, o, 1), at_hover());
  ASSERT_TRUE(e.thrust && e.torque && e.motor && e.dynamics);
  EXPECT_NEAR(e.reduced_c_t / truth.c_t_N_s2, 1.0, 0.002);
  // c_q of the simulated blade has a kink near 500 rad/s, where its polars end; a smooth law beside a free offset follows it so far.
  EXPECT_NEAR(e.reduced_c_q / truth.c_q_N_m_s2, 1.0, 0.01);
  EXPECT_NEAR(e.motor->speed_constant_rpm_V.value / truth.speed_constant_rpm_V, 1.0, 0.002);
  EXPECT_NEAR(e.motor->resistance_ohm.value / truth.resistance_ohm, 1.0, 0.01);
  EXPECT_NEAR(*e.dynamics->inertia_kg_m2 / truth.inertia_kg_m2, 1.0, 0.01);
  EXPECT_NEAR(e.dynamics->up->value_s, truth.up_s, 0.001);
  EXPECT_NEAR(e.dynamics->down->value_s, truth.down_s, 0.001);
}

TEST(OperatingPoints, ThrustAndTorqueAreTheRotorsOwnWithoutZeroRunningOffsetDriftAndHysteresisOfTheStand) {
  const test::TempFolder folder;
  const test::SimulatedStandOptions o;
  const auto truth = simulated().truth(o);
  const StandRun run = run_of(folder, o, 3);
  const StandEstimate e = estimate_stand(run, at_hover());
  const auto near_centre = [](double omega_rad_s) { return std::abs(omega_rad_s * kRpm_per_rad_s - 9000.0) < 400.0; };
  int points = 0;
  double raw_error = 0.0;
  for (const OperatingPoint& p : e.points) {
    if (!near_centre(p.omega_rad_s)) continue;
    ++points;
    EXPECT_NEAR(p.thrust_N / (truth.c_t_N_s2 * p.omega_rad_s * p.omega_rad_s), 1.0, 0.03);
    EXPECT_NEAR(p.torque_N_m / (truth.c_q_N_m_s2 * p.omega_rad_s * p.omega_rad_s), 1.0, 0.04);
    EXPECT_GT(p.motor_V, 0.0);
    EXPECT_LT(p.motor_V, p.supply_V);
    EXPECT_GT(p.drive_efficiency(), 0.5);
    EXPECT_LT(p.drive_efficiency(), 1.0);
  }
  EXPECT_GE(points, 2);
  for (const StandStep& s : run.steps)
    if (near_centre(s.omega_rad_s))
      raw_error = std::max(raw_error, std::abs(s.torque_N_m / (truth.c_q_N_m_s2 * s.omega_rad_s * s.omega_rad_s) - 1.0));
  EXPECT_GT(raw_error, 0.1) << "the stand's running offset is in what it reads";
}

TEST(StandEstimate, AnEmptyFileIsCalledEmptyAndARunOfOneStepIsRefusedWithTheReason) {
  EXPECT_NE(test::error_of([] { (void)recognise_csv("\r\n \n", "x.csv"); }).find("x.csv: error: is empty"), std::string::npos);
  const test::TempFolder folder;
  const auto file = folder.write("one.csv", "t_s,omega_rad_s,thrust_N,torque_N_m\n0,500,1.0,0.01\n");
  EstimateDocument d;
  d.files.push_back({estimate_stand(read_stand_run(file, {}), {}), std::nullopt});
  const render::Outcome o = estimate_outcome(d);
  EXPECT_EQ(o.verdict, "refused");
  ASSERT_EQ(o.errors.size(), 1u);
  EXPECT_NE(o.errors[0].find("no coefficient from 1 step in still air: five different speeds"), std::string::npos) << o.errors[0];
}

TEST(OperatingPoints, AKilogramOfThrustFor50WIs20GramsPerWatt) {
  OperatingPoint p;
  p.omega_rad_s = 100.0;
  p.thrust_N = 9.80665;
  p.torque_N_m = 0.2;
  p.supply_V = 10.0;
  p.current_A = 5.0;
  EXPECT_DOUBLE_EQ(p.thrust_g(), 1000.0);
  EXPECT_DOUBLE_EQ(p.grams_per_watt(), 20.0);
  EXPECT_DOUBLE_EQ(p.newtons_per_ampere(), 9.80665 / 5.0);
  EXPECT_DOUBLE_EQ(p.shaft_W(), 20.0);
  EXPECT_DOUBLE_EQ(p.drive_efficiency(), 0.4);
}

TEST(OperatingPoints, LevelsAreTheMeansOfUpAndDownAndOfASlowRamp24AtMost) {
  const auto at = [](double omega_rad_s, double thrust_N) {
    OperatingPoint p;
    p.omega_rad_s = omega_rad_s;
    p.thrust_N = thrust_N;
    return p;
  };
  const auto levels = levels_of({at(500.0, 1.0), at(800.0, 2.6), at(501.0, 1.2)});
  ASSERT_EQ(levels.size(), 2u);
  EXPECT_DOUBLE_EQ(levels[0].omega_rad_s, 500.5);
  EXPECT_DOUBLE_EQ(levels[0].thrust_N, 1.1);
  EXPECT_TRUE(std::isnan(levels[0].torque_N_m)) << "not measured";
  std::vector<OperatingPoint> ramp;
  for (int i = 0; i <= 500; ++i) ramp.push_back(at(100.0 + 2.0 * i, 1.0));
  EXPECT_LE(levels_of(ramp).size(), kMostLevels);
  EXPECT_GE(levels_of(ramp).size(), kMostLevels - 1);
  EXPECT_TRUE(levels_of({}).empty());
}

TEST(OperatingPoints, ThePageDrawsThemOverSpeedAndOverVoltageAndSaysWhyNotWhereNoModulationWasRecorded) {
  const test::TempFolder folder;
  StandEstimate e = estimate_stand(run_of(folder, {}, 3), at_hover());
  const std::string with = operating_figures(e);
  for (const char* title : {"thrust over speed", "supply current over speed", "power over speed", "thrust per electrical power over speed",
                            "thrust per supply current over speed", "efficiency of motor and ESC over speed", "thrust over voltage",
                            "efficiency of motor and ESC over voltage"})
    EXPECT_NE(with.find(std::string("<figcaption>") + title), std::string::npos) << title;
  EXPECT_NE(with.find(">g</text>"), std::string::npos) << "grams beside newtons";
  for (OperatingPoint& p : e.points) p.motor_V = kNotMeasured;
  const std::string without = operating_figures(e);
  EXPECT_EQ(without.find("over voltage</figcaption>"), std::string::npos);
  EXPECT_NE(without.find("no modulation of the ESC"), std::string::npos);
}

TEST(StandEstimate, In50RunsWithDrawnErrors86To100percentOfThe95percentIntervalsHoldTheTruth) {
  const test::TempFolder folder;
  const auto e = stats::stand_ensemble(reference_blade(), folder.path(), 9001, 50, 200);
  for (const auto& c : e.coefficients) {
    EXPECT_GE(c.covered, 0.86) << c.name;
    // Standard errors of the mean over 50 runs are 0.09 and 0.17 %: limits of the long study plus two of them.
    EXPECT_LE(std::abs(c.bias), c.name == "c_t" ? 0.004 : 0.0085) << c.name;
    EXPECT_LE(c.rmse, c.name == "c_t" ? 0.0075 : 0.015) << c.name;
  }
  for (const auto& v : e.values) EXPECT_GE(v.within, 0.90) << v.name;
}

TEST(StandEstimate, BudgetNamesEachTermAndItsSourceAndAddsUpToU) {
  const test::TempFolder folder;
  const StandEstimate e = estimate_stand(run_of(folder, {}, 3), at_hover());
  ASSERT_TRUE(e.thrust);
  double squares = 0.0;
  bool calibration = false;
  for (const BudgetTerm& b : e.thrust->budget) {
    squares += b.u * b.u;
    calibration |= b.name == "calibration" && b.source == "run" && b.u == 0.004;
    EXPECT_NE(b.name, "hysteresis") << "the run goes up and down: the fit has it";
    EXPECT_NE(b.name, "zero") << "the run has zeros of its own";
  }
  EXPECT_TRUE(calibration);
  EXPECT_NEAR(std::sqrt(squares), e.thrust->u / e.thrust->value, 1e-12);
}

TEST(StandEstimate, WithoutItsRunningOffsetTorqueMissesByMoreThan5percentAndWithItByLessThan3) {
  const test::TempFolder folder;
  const auto truth = simulated().truth({});
  const StandEstimate e = estimate_stand(run_of(folder, {}, 4), at_hover());
  ASSERT_TRUE(e.torque);
  EXPECT_LT(std::abs(e.reduced_c_q / truth.c_q_N_m_s2 - 1.0), 0.03);
  EXPECT_GT(std::abs(e.torque->proportional / e.torque->value - 1.0), 0.05) << "c ω² through 5 to 10 mN m";
  EXPECT_GE(std::abs(e.torque->fit.value("running offset")), 3e-3);
}

TEST(StandEstimate, ChirpOfTheTargetGivesTheLoops3dBFrequencyOfItsTimeConstant) {
  const test::TempFolder folder;
  const StandEstimate e = estimate_stand(run_of(folder, {.steps = false, .chirp = true, .errors = false}, 5), at_hover());
  ASSERT_TRUE(e.dynamics && e.dynamics->bandwidth);
  // A lag of 35 ms up and 50 ms down: between 1/(2π 50 ms) and 1/(2π 35 ms).
  EXPECT_GT(e.dynamics->bandwidth->minus_3dB_Hz, 3.0);
  EXPECT_LT(e.dynamics->bandwidth->minus_3dB_Hz, 4.8);
  for (const double c : e.dynamics->bandwidth->coherence) EXPECT_GE(c, kCoherenceGate);
}

// Thrust ∝ ω^2.25 as measured on some stands: c ω² must lose, and c_t at the middle must be right.
StandRecord steady(double exponent, double offset_N, std::size_t outlier) {
  StandRecord r;
  r.name = "steady.csv";
  r.air_density_kg_m3 = 1.2;
  r.diameter_m = 0.127;
  const RandomStream noise(7, 3);
  for (std::size_t i = 0; i < 24; ++i) {
    StandPoint p;
    p.row = i + 1;
    const double w = i < 12 ? 250.0 + 50.0 * static_cast<double>(i) : 250.0 + 50.0 * static_cast<double>(23 - i);
    p.omega_rad_s[0] = w;
    p.thrust_N = 2e-6 * w * w * std::pow(w / 525.0, exponent - 2.0) + offset_N + 0.004 * noise.gaussian(i) + (i == outlier ? 0.3 : 0.0);
    r.points.push_back(p);
  }
  return r;
}

TEST(StandEstimate, ThrustThatGoesWithSpeedTo2p25IsFoundSoAndCTHoldsAtTheMiddle) {
  const StandEstimate e = estimate_stand(stand_run(steady(2.25, 0.0, 99), {}), {});
  ASSERT_TRUE(e.thrust);
  EXPECT_TRUE(e.thrust->square_fails);
  EXPECT_NEAR(e.thrust->exponent, 2.25, 0.03);
  EXPECT_NEAR(e.thrust->value, 2e-6, 0.01e-6);
  const StandEstimate square = estimate_stand(stand_run(steady(2.0, 0.0, 99), {}), {});
  EXPECT_FALSE(square.thrust->square_fails);
  EXPECT_NEAR(square.thrust->value, 2e-6, 0.01e-6);
}

TEST(StandEstimate, OneStepThatReads300mNTooMuchIsNamedAndMovesCTByLessThan0p3percent) {
  const StandEstimate e = estimate_stand(stand_run(steady(2.0, 0.0, 6), {}), {}),
                      clean = estimate_stand(stand_run(steady(2.0, 0.0, 99), {}), {});
  ASSERT_EQ(e.thrust->down_weighted.size(), 1u);
  EXPECT_NE(e.thrust->down_weighted[0].find("step 7"), std::string::npos) << e.thrust->down_weighted[0];
  EXPECT_NEAR(e.thrust->value / clean.thrust->value, 1.0, 0.003);
}

TEST(StandEstimate, SpeedsInRPMTakenAsRadSShowInTheFigureOfMerit) {
  StandRecord r = steady(2.0, 0.0, 99);
  for (auto& p : r.points) {
    p.torque_N_m = 0.016 * p.thrust_N;
    p.omega_rad_s[0] *= kRpm_per_rad_s;
  }
  const StandEstimate e = estimate_stand(stand_run(std::move(r), {}), {});
  EXPECT_LT(e.figure_of_merit, 0.1);
  bool said = false;
  for (const auto& fault : e.faults) said |= fault.find("the speeds are RPM taken as rad/s") != std::string::npos;
  EXPECT_TRUE(said);
  EXPECT_FALSE(e.thrust || e.torque) << "no coefficient of such a file may be written anywhere";
}

TEST(StandEstimate, MotorFileRefusesWhatTheRunDoesNotShowAndSaysWhatWasMeasured) {
  const test::TempFolder folder;
  const StandEstimate e = estimate_stand(run_of(folder, {}, 6), at_hover());
  const std::string refused = test::error_of([&] { (void)motor_file_text(e, {}, "test"); }, ExitCode::data_quality);
  EXPECT_NE(refused.find("inductance_H"), std::string::npos) << refused;
  const auto base = std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "vehicles/motors/2306_2300kv.toml";
  const std::string text = motor_file_text(e, {base, 4.4e-6}, "test");
  EXPECT_NE(text.find("flux_linkage_Wb"), std::string::npos);
  EXPECT_NE(text.find("measured on the stand"), std::string::npos);
  EXPECT_NE(text.find("not measured: of 2306_2300kv.toml"), std::string::npos);
}

TEST(StandEstimate, VehicleFileGetsThrustAndTorqueOfOriginStandAtItsOwnDensity) {
  const test::TempFolder folder;
  const StandEstimate e = estimate_stand(run_of(folder, {}, 7), at_hover());
  const auto& effects = host::builtin_effect_catalogue();
  const auto before = host::read_vehicle(std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "vehicles/paper.toml", effects);
  const auto after = host::parse_vehicle(host::vehicle_text(with_stand_values(before, e, "test")), "after.toml", effects);
  const auto* s = after.static_thrust_of(host::Origin::stand);
  ASSERT_TRUE(s);
  EXPECT_NEAR(s->c_t_N_s2, e.thrust->value * before.air_density_kg_m3 / e.facts.air_density_kg_m3, 1e-12);
  EXPECT_NEAR(s->u_N_s2 / s->c_t_N_s2, e.thrust->u / e.thrust->value, 1e-9);
  EXPECT_EQ(after.c_q_N_m_s2.origin, host::Origin::stand);
}

const char* const kExport =
    "\xEF\xBB\xBFTime (s);ESC signal (\xB5s);Torque (N\xC2\xB7m);Thrust (gf);Voltage (V);Current (A);Motor Electrical Speed (RPM);Motor "
    "Optical Speed (RPM);App message;\n"
    "0;1100;-0,010;-20,0;16,0;0,5;3000;0;;\n2;1200;-0,040;-80,0;16,0;1,5;6000;0;;\n4;1300;-0,090;-180,0;15,9;3,5;9000;0;;\n"
    "6;1400;-0,160;-320,0;15,8;6,5;12000;0;;\n8;1300;-0,090;-180,0;15,9;3,5;9000;0;;\n10;1200;-0,040;-80,0;16,0;1,5;6000;0;;\n";

TEST(StandKnownHeaders, ExportWithByteOrderMarkSemicolonsCommaDecimalsLatinMicroSignAndNegativeThrustIsReadWithRemarks) {
  const test::TempFolder folder;
  const StandRun run = read_stand_run(folder.write("log.csv", kExport), {});
  ASSERT_EQ(run.steps.size(), 6u);
  EXPECT_NEAR(run.steps[3].thrust_N, 0.320 * kGravity_m_s2, 1e-6) << "turned, in N";
  EXPECT_NEAR(run.steps[3].omega_rad_s, 12000.0 * kRad_s_per_rpm, 1e-6) << "electrical: the optical probe reads 0 throughout";
  std::string all;
  for (const auto& r : run.remarks) all += r + "\n";
  for (const char* word : {"byte order mark", "separated by \";\", decimals by \",\"", "thrust is negative", "column without name"})
    EXPECT_NE(all.find(word), std::string::npos) << word << "\n" << all;
}

TEST(StandKnownHeaders, HeaderThatNobodyKnowsIsRefusedWithTheWayOut) {
  const std::string error = test::error_of([] { (void)recognise_csv("a,b\n1,2\n", "x.csv"); });
  EXPECT_NE(error.find("give -m MAPPING.toml"), std::string::npos) << error;
}

TEST(StandVariance, IntervalsOf95percentHoldTheMadeUpComponentsIn90To100percentOf200Sets) {
  const RandomStream random(11, 5);
  std::uint64_t k = 0;
  const double truth[] = {0.03, 0.01, 0.004};
  double held[3] = {}, mean[3] = {};
  constexpr int kSets = 200;
  for (int set = 0; set < kSets; ++set) {
    std::vector<LabelledValue> values;
    for (int p = 0; p < 8; ++p) {
      const double of_propeller = truth[0] * random.gaussian(k++);
      for (int m = 0; m < 4; ++m) {
        const double of_mount = truth[1] * random.gaussian(k++);
        for (int r = 0; r < 2 + (m == 0); ++r)
          values.push_back({"p" + std::to_string(p), "m" + std::to_string(m),
                            2e-6 * std::exp(of_propeller + of_mount + truth[2] * random.gaussian(k++))});
      }
    }
    const VarianceComponents v = variance_components(values);
    ASSERT_EQ(v.components.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
      held[i] += v.components[i].low <= truth[i] && truth[i] <= v.components[i].high;
      mean[i] += v.components[i].deviation * v.components[i].deviation / kSets;
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_GE(held[i] / kSets, 0.90) << i;
    EXPECT_NEAR(std::sqrt(mean[i]), truth[i], 0.08 * truth[i]) << "unbiased, but for what 200 sets leave";
  }
}

TEST(StandVariance, ThreePropellersLeaveAnIntervalThatIsWideAndSaysSo) {
  const VarianceComponents v =
      variance_components({{"a", "1", 1.00}, {"a", "1", 1.01}, {"b", "1", 1.03}, {"b", "1", 1.02}, {"c", "1", 0.98}, {"c", "1", 0.99}});
  ASSERT_EQ(v.components.size(), 2u);
  EXPECT_GT(v.components[0].high / v.components[0].deviation, 3.0) << "two degrees of freedom";
}

TEST(StandReport, PageIsWholeAndHoldsAFigureOfEachKind) {
  const test::TempFolder folder;
  EstimateDocument d;
  d.files.push_back({estimate_stand(run_of(folder, {}, 8), at_hover()), std::nullopt, "clean"});
  d.version = "rotorloop test";
  const std::string page = estimate_page(d);
  for (const char* words : {"over ω²", "Residuals of thrust", "Hysteresis of torque", "Budget of c_q", "figure of merit"})
    EXPECT_NE(page.find(words), std::string::npos) << words;
  EXPECT_NE(page.find("torque over the run</figcaption>\n<svg"), std::string::npos) << "visible without scripts";
  const std::size_t uplot = page.find("var uPlot=");
  EXPECT_NE(uplot, std::string::npos);
  EXPECT_EQ(page.find("var uPlot=", uplot + 1), std::string::npos) << "once for all plots";
  for (const char* fetched : {" src=", "<link", "@import", "url(", "fetch(", "XMLHttpRequest", "import("})
    EXPECT_EQ(page.find(fetched), std::string::npos) << fetched << ": nothing is fetched";
}

}  // namespace
}  // namespace rotorloop::stand
