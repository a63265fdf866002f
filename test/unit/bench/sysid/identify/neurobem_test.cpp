// NeuroBEM, four test flights up to 17.7 m/s: how far the paper's terms go, and that a parameter which pays for what they lack says so.
// Limits and what was tried: docs/acceptance/identify_measured.md.
#include <fmt/format.h>

#include "test/support/force_score.hpp"
#include "test/unit/bench/sysid/identify/measured_fit.hpp"

namespace rotorloop::identify {
namespace {

const MeasuredSet kSet{"neurobem_test"};
const std::vector<std::string> kFlights{"figure8_1_20210218_170320_seg2", "race_track_1_20210218_171908_seg2",
                                        "melon_1_20210223_114138_seg3", "figure8_4_20210223_172724_seg2"};

struct Result {
  Identification fit;
  std::vector<log::FlightRecord> records;
  score::ForceScore model, published;
};

Result run(const ParameterSelection& wishes) {
  Result r;
  r.records = kSet.flights(kFlights);
  IdentifyOptions o;
  o.grid.rate_Hz = 100.0;  // the authors filtered everything to some 20 Hz
  o.wishes = wishes;
  o.fit.noise.rounds = 4;
  r.fit = identify(without_roles(r.records), kSet.vehicle(), o);
  std::vector<score::ForceScore> model, published;
  for (std::size_t f = 0; f < r.records.size(); ++f) {
    model.push_back(score::score_force(r.records[f], r.fit.fit.values[f]));
    published.push_back(*score::score_logged_force(r.records[f], r.fit.fit.values[f], "bemnn_f"));
    fmt::print("{:<36} {:.3f} N ({:.3f} {:.3f} {:.3f}), published {:.3f} N\n", model.back().flight, model.back().rms_N,
               model.back().axis_rms_N.x(), model.back().axis_rms_N.y(), model.back().axis_rms_N.z(), published.back().rms_N);
  }
  r.model = score::pooled(model);
  r.published = score::pooled(published);
  fmt::print("pooled {:.3f} N, published {:.3f} N\n", r.model.rms_N, r.published.rms_N);
  for (const estimate::Estimate& e : r.fit.fit.estimates)
    fmt::print("  {:<12} {:>12.5g} ± {:.2g}, robust {:.2g}\n", estimate::estimate_name(e, r.fit.problem), e.value, e.u, e.u_robust);
  return r;
}

// Mass as in the published predictions; the log is synchronised and its pose is that of the body.
const std::vector<std::string> kKnown{"body.mass", "pose_sensor", "pose_delay"};

TEST(NeuroBem, PapersTermsReach1p10NAndTheInertiaThatPaysForTheirLackIs5TimesLessSure) {
  if (!MeasuredSet::present()) GTEST_SKIP() << "ROTORLOOP_DATA is not set: NeuroBEM is not fitted";
  const Result r = run({.free = {}, .hold = kKnown, .per_flight = {}});
  EXPECT_NEAR(r.published.rms_N, 0.467, 0.001);  // the published prediction, scored by the same samples
  EXPECT_LE(r.model.rms_N, 1.10);
  const estimate::Estimate* xx = r.fit.fit.find(estimate::kIxx);
  ASSERT_TRUE(xx);
  EXPECT_GE(xx->u_robust, 5.0 * xx->u);
  EXPECT_GT(xx->value, 4.0 * 2.5e-3) << "the published inertia is 2.5e-3: nothing to mark";

  // Ablation: thrust alone, without drag.
  std::vector<score::ForceScore> bare;
  for (std::size_t f = 0; f < r.records.size(); ++f) {
    estimate::ModelValues v = r.fit.fit.values[f];
    v[estimate::kCdh] = v[estimate::kCdxy] = v[estimate::kCdz] = 0.0;
    bare.push_back(score::score_force(r.records[f], v));
  }
  EXPECT_GT(score::pooled(bare).rms_N, 1.5);
}

}  // namespace
}  // namespace rotorloop::identify
