// Which candidates are refitted, what gusts explain better, and the pose time offset: rules that need no flight.
#include "bench/sysid/diagnose/ranking/refit_ranking.hpp"

#include <gtest/gtest.h>

#include "bench/sysid/diagnose/pose_time_offset.hpp"
#include "bench/sysid/diagnose/ranking/gust.hpp"
#include "host/effects/term.hpp"

namespace rotorloop::diagnose {
namespace {

// Candidates of one parameter each, independent of each other unless said otherwise, whose size matters from 1 on.
class Made {
 public:
  Made& candidate(const std::string& id, double chi2, double wald, bool real, double size = 2.0) {
    Candidate c{.id = id};
    c.parameters.push_back({.name = "x", .unit = "1", .neutral = 0.0, .min = -10.0, .max = 10.0, .scale = 1.0});
    c.columns = {static_cast<ScoreTable::Index>(screening_.candidates.size())};
    screening_.candidates.push_back(c);
    Tested t;
    t.test.chi2 = chi2;
    t.test.wald = wald;
    t.test.degrees = 1;
    t.test.estimate = Eigen::VectorXd::Constant(1, size);
    t.real = real;
    tested_.push_back(t);
    return *this;
  }
  Made& alike(const std::string& a, const std::string& b) {
    pairs_.emplace_back(place(a), place(b));
    return *this;
  }
  std::vector<std::string> refitted() {
    std::vector<std::string> out;
    for (const RefitCandidate& c : shortlist(screened(), tested_, Criteria{})) {
      out.push_back(c.tested->candidate->id);
      for (const Tested* t : c.same) out.back() += "=" + t->candidate->id;
    }
    return out;
  }
  // Of the first of those refitted, none of the others standing.
  std::vector<std::string> class_of_first() {
    std::vector<RefitCandidate> ranked = shortlist(screened(), tested_, Criteria{});
    ranked.resize(1);
    std::vector<std::string> out;
    for (const ClassMember& m : indistinguishable_from_best(screening_, tested_, ranked, Criteria{})) out.push_back(m.id);
    return out;
  }

 private:
  const Screening& screened() {
    const auto n = static_cast<Eigen::Index>(tested_.size());
    screening_.table.information = 100.0 * Eigen::MatrixXd::Identity(n, n);
    for (const auto& [a, b] : pairs_) screening_.table.information(a, b) = screening_.table.information(b, a) = 99.9;
    screening_.table.score = Eigen::VectorXd::Zero(n);
    screening_.table.measurements = 3000.0;
    for (std::size_t i = 0; i < tested_.size(); ++i) tested_[i].candidate = &screening_.candidates[i];
    std::stable_sort(tested_.begin(), tested_.end(), [](const Tested& a, const Tested& b) { return a.test.wald > b.test.wald; });
    return screening_;
  }
  Eigen::Index place(const std::string& id) const {
    for (std::size_t i = 0; i < screening_.candidates.size(); ++i) {
      if (screening_.candidates[i].id == id) return static_cast<Eigen::Index>(i);
    }
    return 0;
  }
  Screening screening_;
  std::vector<Tested> tested_;
  std::vector<std::pair<Eigen::Index, Eigen::Index>> pairs_;
};

using Names = std::vector<std::string>;

TEST(ModelSelection, RefitsTheThreeLikeliestOfThoseThatPassAndTheThreeThatScatterLeast) {
  Made made;
  made.candidate("a", 500, 20, true).candidate("b", 400, 30, true).candidate("c", 300, 10, true).candidate("d", 200, 90, true);
  made.candidate("e", 100, 5, true).candidate("f", 450, 80, false);
  EXPECT_EQ(made.refitted(), (Names{"a", "b", "c", "d"}));
}

TEST(ModelSelection, RefitsWhatExplainsMoreThanAnythingThatPasses) {
  Made made;
  made.candidate("part", 103, 33, true).candidate("whole", 1394, 27, false).candidate("less", 95, 25, false);
  EXPECT_EQ(made.refitted(), (Names{"part", "whole"}));
}

TEST(ModelSelection, RefitsNothingWhereNothingPassesAndNothingThatIsTooSmallToMatter) {
  EXPECT_EQ(Made().candidate("burst", 1394, 27, false).refitted(), Names{});
  EXPECT_EQ(Made().candidate("part", 103, 33, true).candidate("small", 1394, 27, false, 0.1).refitted(), (Names{"part"}));
}

TEST(ModelSelection, RefitsOneOfTwoWhoseColumnsAreTheSameAndKeepsTheOtherBesideIt) {
  Made made;
  made.candidate("a", 500, 20, true).candidate("b", 490, 19, true).candidate("c", 300, 10, true).alike("a", "b");
  EXPECT_EQ(made.refitted(), (Names{"a=b", "c"}));
}

TEST(ModelSelection, ListsAsAnAliasWhatHasTheColumnOfTheBestThoughAGateOfChanceKeptItOut) {
  Made made;
  made.candidate("a", 143, 40, true).candidate("b", 100, 31, false).candidate("c", 100, 30, false).alike("a", "b");
  EXPECT_EQ(made.class_of_first(), (Names{"b"}));
}

TEST(ModelSelection, ATetherIsOneByItsStiffnessAndAWindByNoneOfItsThreeSpeeds) {
  const std::vector<NamedValue> tether{
      {"damping_N_s_m", "N s/m", 0.1, 0.01}, {"stiffness_N_m", "N/m", 0.5, 0.01}, {"pull_z_N", "N", 0.1, 0.01}};
  const NamedValue* stiffness = defining_number({.id = "tether"}, tether);
  ASSERT_NE(stiffness, nullptr);
  EXPECT_EQ(stiffness->name, "stiffness_N_m");
  EXPECT_EQ(defining_number({.id = "drag_centre_offset"}, {{"z_m", "m", 0.1, 0.01}, {"x_m", "m", 0.1, 0.01}}), nullptr);
  EXPECT_EQ(defining_number({.id = "torque_advance"}, {{"share", "1", 0.1, 0.01}}), nullptr);
  EXPECT_EQ(defining_number({.id = "one of a user's own"}, tether), nullptr);
}

// Two laws, the second with a number more; `within`: the first law's column is one of the second's.
struct Nested {
  Screening screening;
  std::vector<Tested> tested{2};
  std::vector<RefitCandidate> ranked{2};

  Nested(double richer_predicts, double richer_score, bool within) {
    screening.table.information = Eigen::Matrix3d(Eigen::Vector3d(100.0, 100.0, 100.0).asDiagonal());
    if (within) screening.table.information(0, 1) = screening.table.information(1, 0) = 99.9;
    screening.table.score = Eigen::VectorXd::Zero(3);
    screening.candidates = {{.id = "simple"}, {.id = "rich"}};
    screening.candidates[0].columns = {0};
    screening.candidates[1].columns = {1, 2};
    const double score[]{100.0, richer_score}, predicts[]{90.0, richer_predicts};
    for (std::size_t i = 0; i < 2; ++i) {
      tested[i].candidate = &screening.candidates[i];
      tested[i].evidence.cross_validated = predicts[i];
      ranked[i].tested = &tested[i];
      ranked[i].score = score[i];
      ranked[i].values.resize(i + 1);
    }
    if (richer_score > 100.0) std::swap(ranked[0], ranked[1]);
    prefer_the_simpler(ranked, screening, Criteria{});
  }
  const std::string& first() const { return ranked.front().tested->candidate->id; }
};

TEST(ModelSelection, ALawThatHoldsASimplerOneAndPredictsLessThanItFailsThoughItFitsBetter) {
  const Nested laws(60.0, 125.0, true);
  EXPECT_EQ(laws.first(), "simple");
  EXPECT_EQ(laws.ranked[1].failure.id, Rejection::predicts_less);
  EXPECT_EQ(laws.ranked[1].failure.effect, "simple");
}
TEST(ModelSelection, ALawThatHoldsASimplerOneAndPredictsMoreLeads) { EXPECT_EQ(Nested(110.0, 125.0, true).first(), "rich"); }
TEST(ModelSelection, ALawOfAnotherFormIsNotMeasuredByThePredictionsOfTheSimplerOne) {
  EXPECT_EQ(Nested(60.0, 125.0, false).first(), "rich");
}
TEST(ModelSelection, OfTwoLawsAsLikelyThatOfFewerNumbersLeadsAndTheOtherStaysInItsClass) {
  const Nested laws(60.0, 102.0, true);
  EXPECT_EQ(laws.first(), "simple");
  EXPECT_TRUE(laws.ranked[1].failure.none());
}

RefitCandidate settled_at(double cost_held, double delta_log_likelihood = 0.0) {
  RefitCandidate c;
  c.refit.cost_held = cost_held;
  c.delta_log_likelihood = delta_log_likelihood;
  return c;
}

TEST(ModelSelection, NeedsNoRefitOfWhatExplainsLessThanHalfOfWhatTheLeaderDoes) {
  const RefitCandidate leader = settled_at(4000.0, 700.0);
  EXPECT_TRUE(far_behind(settled_at(9000.0), leader, 10000.0, 5000.0));
  EXPECT_TRUE(far_behind(settled_at(10050.0), leader, 10000.0, 5000.0));
  EXPECT_FALSE(far_behind(settled_at(6900.0), leader, 10000.0, 5000.0));
}

TEST(ModelSelection, RefitsWhatIsBehindByLessThan30OfLogLikelihood) {
  EXPECT_FALSE(far_behind(settled_at(9000.0), settled_at(4000.0, 35.0), 10000.0, 5000.0));
}

TEST(ModelSelection, RefitsAllWhereTheLeaderExplainsLessThanHalfOfWhatFreeingThePriorsParametersDoes) {
  EXPECT_FALSE(far_behind(settled_at(9900.0), settled_at(9000.0, 700.0), 10000.0, 5000.0));
}

TEST(ModelSelection, RefitsAllWhereThereAreNoPriors) {
  RefitCandidate leader, other;
  leader.delta_log_likelihood = 700.0;
  EXPECT_FALSE(far_behind(other, leader, 10000.0, 5000.0));
}

struct Ranked {
  Candidate wind{.id = "wind_steady", .term = host::find_term("wind_steady")}, drag{.id = "linear_drag"};
  Tested of_wind{.candidate = &wind}, of_drag{.candidate = &drag};
  // Two refitted candidates: `first` leads.
  std::vector<RefitCandidate> of(const Tested& first, double first_gain, const Tested& second, double second_gain, double wind_m_s) const {
    std::vector<RefitCandidate> out;
    for (const auto& [tested, gain] : {std::pair{&first, first_gain}, std::pair{&second, second_gain}}) {
      out.push_back({.tested = tested});
      out.back().delta_log_likelihood = gain;
      if (tested == &of_wind) out.back().values = {{"x", "m/s", wind_m_s, 0.05}};
    }
    return out;
  }
};

GustScore gusts(double sigma_m_s, double time_s, double gain) {
  GustScore g;
  g.sigma_m_s = sigma_m_s;
  g.time_s = time_s;
  g.gain = gain;
  return g;
}

TEST(ModelSelection, LeavesToGustsOf0p5mSThatLast3sAWindOf1mSAndWhatElseExplainsItButNotOneOf2) {
  const Ranked f;
  auto ranked = f.of(f.of_wind, 900.0, f.of_drag, 700.0, 1.0);
  reject_explained_by_gusts(gusts(0.5, 3.0, 200.0), ranked, Criteria{});
  EXPECT_EQ(ranked[0].failure.id, Rejection::mean_of_gusts);
  EXPECT_FALSE(ranked[1].failure.none());
  ranked = f.of(f.of_wind, 900.0, f.of_drag, 700.0, 2.0);
  reject_explained_by_gusts(gusts(0.5, 3.0, 200.0), ranked, Criteria{});
  EXPECT_TRUE(ranked[0].failure.none() && ranked[1].failure.none());
}

TEST(ModelSelection, LeavesToGustsWhatRaisesTheLikelihoodLessThanTheyDo) {
  const Ranked f;
  auto ranked = f.of(f.of_drag, 300.0, f.of_wind, 150.0, 0.4);
  reject_explained_by_gusts(gusts(0.5, 3.0, 200.0), ranked, Criteria{});
  EXPECT_TRUE(ranked[0].failure.none());
  EXPECT_FALSE(ranked[1].failure.none());
}

TEST(ModelSelection, LeavesNothingToGustsThatLastHalfASecondOrAreATenthOfAMetrePerSecond) {
  const Ranked f;
  auto ranked = f.of(f.of_wind, 100.0, f.of_drag, 50.0, 0.2);
  reject_explained_by_gusts(gusts(0.5, 0.5, 200.0), ranked, Criteria{});
  reject_explained_by_gusts(gusts(0.1, 3.0, 200.0), ranked, Criteria{});
  EXPECT_TRUE(ranked[0].failure.none() && ranked[1].failure.none());
}

estimate::Fit fit_with_poses_late_by(double first_s, double second_s, double u_s) {
  estimate::Fit f;
  f.estimates = {{.parameter = estimate::kPoseDelay, .flight = 0, .value = first_s, .u = u_s, .u_robust = u_s},
                 {.parameter = estimate::kPoseDelay, .flight = 1, .value = second_s, .u = u_s, .u_robust = u_s}};
  return f;
}

TEST(PoseTimeOffset, Of20msIsAFindingWithTheMeanOfTheFlightsAndItsUncertainty) {
  const auto found = pose_time_offset(fit_with_poses_late_by(0.019, 0.021, 1e-3), Criteria{});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->id, "pose_delay");
  EXPECT_NEAR(found->parameters[0].value, 0.020, 1e-12);
  EXPECT_NEAR(found->parameters[0].u, 1e-3 / std::sqrt(2.0), 1e-12);
}

TEST(LatePoses, AreNoneWhereTheyAreAMillisecondOrNotKnown) {
  EXPECT_FALSE(pose_time_offset(fit_with_poses_late_by(1e-3, 1e-3, 1e-5), Criteria{}));
  EXPECT_FALSE(pose_time_offset(fit_with_poses_late_by(0.02, 0.02, 0.01), Criteria{})) << "2.8 standard errors";
  EXPECT_FALSE(pose_time_offset(estimate::Fit{}, Criteria{}));
}

}  // namespace
}  // namespace rotorloop::diagnose
