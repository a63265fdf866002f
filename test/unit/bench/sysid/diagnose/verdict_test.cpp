// What the residuals say by themselves becomes a verdict only where it is real and large enough to matter to this vehicle.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "bench/sysid/diagnose/report/diagnosis_report.hpp"
#include "bench/sysid/diagnose/report/diagnosis_text.hpp"
#include "bench/sysid/diagnose/residual_verdict.hpp"
#include "bench/sysid/diagnose/residuals/residual_findings.hpp"
#include "test/unit/bench/sysid/diagnose/small_quadrotor.hpp"

namespace rotorloop::diagnose {
namespace {

using testing::kForceZ;
using testing::kTorqueX;
using testing::quadrotor_of_0_7_kg_and_125_mm;

ResidualFindings left(std::size_t axis, ResidualKind kind, double rms, double expected, double explainable = 0.0) {
  ResidualFindings out;
  out.unexplained.kind[axis] = kind;
  out.unexplained.axis[axis].rms = rms;
  out.unexplained.axis[axis].rms_expected = expected;
  out.unexplained.axis[axis].explainable.share = explainable;
  return out;
}

DiagnosisVerdict verdict(const ResidualFindings& findings, Diagnosis d = {}) {
  judge_residuals(findings, quadrotor_of_0_7_kg_and_125_mm(), d);
  return d.verdict;
}

TEST(Verdict, IsUnexplainedWhereTorqueBurstsOf3mNMStandOverNoiseOf1) {
  EXPECT_EQ(verdict(left(kTorqueX, ResidualKind::bursts, 3e-3, 1e-3)), DiagnosisVerdict::unexplained);
}

TEST(Verdict, StaysCleanWhereBurstsAreATenthOfAPerCentOfWeightTimesArm) {
  EXPECT_EQ(verdict(left(kTorqueX, ResidualKind::bursts, 1e-3, 0.5e-3)), DiagnosisVerdict::clean);
}

TEST(Verdict, IsUnexplainedWhereTheMotionPredictsAFifthOfAForceOf50mN) {
  EXPECT_EQ(verdict(left(kForceZ, ResidualKind::systematic, 0.08, 0.06, 0.2)), DiagnosisVerdict::unexplained);
  EXPECT_EQ(verdict(left(kForceZ, ResidualKind::stochastic, 0.08, 0.06, 0.05)), DiagnosisVerdict::clean) << "next to nothing of it";
  EXPECT_EQ(verdict(left(kForceZ, ResidualKind::systematic, 0.065, 0.06, 0.2)), DiagnosisVerdict::clean) << "25 mN of 6.9 N";
}

TEST(Verdict, StaysCleanWhereALargeResidualIsWhatTheNoiseFiguresSay) {
  EXPECT_EQ(verdict(left(kForceZ, ResidualKind::none, 0.5, 0.5)), DiagnosisVerdict::clean);
}

// Verdict on an effect that took torque x from `before` down to `after`, both N m beyond noise, where some of the rest is predictable.
Diagnosis explained(double before, double after) {
  Diagnosis d;
  d.verdict = DiagnosisVerdict::named;
  d.added.push_back({.id = "linear_drag"});
  const ResidualFindings is = left(kTorqueX, ResidualKind::systematic, after, 0.0, 0.3);
  judge_residuals(is, quadrotor_of_0_7_kg_and_125_mm(), d);
  judge_explained(left(kTorqueX, ResidualKind::systematic, before, 0.0, 0.3), is, quadrotor_of_0_7_kg_and_125_mm(), d);
  return d;
}

TEST(Verdict, IsUnexplainedWhereANameLeavesTheLargerPartOfWhatWasMissing) {
  const Diagnosis most_left = explained(10e-3, 8e-3);
  EXPECT_EQ(most_left.verdict, DiagnosisVerdict::unexplained);
  EXPECT_NE(most_left.remarks.front().find("explains 36 % of the power"), std::string::npos) << most_left.remarks.front();
  EXPECT_EQ(most_left.added.size(), 1u) << "the name stands beside it";
  EXPECT_EQ(explained(10e-3, 5e-3).verdict, DiagnosisVerdict::named) << "three quarters of the power are explained, and something remains";
  EXPECT_EQ(explained(1e-3, 1e-3).verdict, DiagnosisVerdict::named) << "what is left does not matter";
}

DiagnosisRun named_with(const ResidualFindings& findings) {
  DiagnosisRun run;
  run.diagnosis.verdict = DiagnosisVerdict::named;
  run.diagnosis.added.push_back({.id = "linear_drag"});
  judge_residuals(findings, quadrotor_of_0_7_kg_and_125_mm(), run.diagnosis);
  return run;
}

TEST(Verdict, KeepsTheNameOfAnEffectThatWasFoundAndSaysBesideItThat74percentOfATorqueRemains) {
  const DiagnosisRun run = named_with(left(kTorqueX, ResidualKind::systematic, 3e-3, 1e-3, 0.74));
  EXPECT_EQ(run.diagnosis.verdict, DiagnosisVerdict::named);
  ASSERT_EQ(run.diagnosis.remains.size(), 1u);
  EXPECT_EQ(run.diagnosis.remains[0].axis, "torque x");
  EXPECT_NEAR(run.diagnosis.remains[0].beyond, 2.83e-3, 1e-5);
  EXPECT_EQ(verdict_name(diagnosis_tree(run, {})), "named, and something remains");
  EXPECT_NE(diagnosis_text(run).find("something remains"), std::string::npos);
  EXPECT_NE(diagnosis_text(run).find("74 % of the power of the residual torque x is predictable"), std::string::npos);
  const auto json = nlohmann::json::parse(diagnosis_json(run, {}));
  EXPECT_EQ(json.at("verdict"), "named");
  EXPECT_EQ(json.at("remains").at(0).at("axis"), "torque x");
  EXPECT_EQ(json.at("remains").at(0).at("share"), 0.74);
  EXPECT_NE(diagnosis_report_html(run, "made up").find("named, and something remains"), std::string::npos);
}

TEST(Verdict, SaysOfANameAfterWhich25mNRemainOf6p9NNothingMore) {
  const DiagnosisRun run = named_with(left(kForceZ, ResidualKind::systematic, 0.065, 0.06, 0.2));
  EXPECT_TRUE(run.diagnosis.remains.empty());
  EXPECT_EQ(verdict_name(diagnosis_tree(run, {})), "named");
  EXPECT_EQ(diagnosis_text(run).find("remains"), std::string::npos);
}

TEST(Verdict, NamesGustsOfAMetrePerSecondUnlessTheUserSaysThatThereAreNone) {
  ResidualFindings gusts;
  VarianceEffect e;
  e.id = "wind_dryden";
  e.parameter = "sigma_m_s";
  e.unit = "m/s";
  e.size = 1.0;
  e.u = 0.1;
  e.found = true;
  gusts.variance.effects.push_back(e);
  Diagnosis outdoors, indoors;
  judge_residuals(gusts, quadrotor_of_0_7_kg_and_125_mm(), outdoors);
  judge_residuals(gusts, quadrotor_of_0_7_kg_and_125_mm(), indoors, {"wind_dryden"});
  EXPECT_EQ(outdoors.verdict, DiagnosisVerdict::named);
  EXPECT_EQ(indoors.verdict, DiagnosisVerdict::clean);
}

}  // namespace
}  // namespace rotorloop::diagnose
