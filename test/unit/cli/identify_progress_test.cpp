// What identify says while it works, with the seconds given by hand: when a part or a round begins, how long it has taken, and a time
// left only where the fit predicts it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "cli/progress/identify_progress_text.hpp"

namespace rotorloop::cli {
namespace {

using testing::HasSubstr;
using testing::Not;

estimate::FitOptions given_noise() {
  estimate::FitOptions o;
  o.noise.rounds = 0;
  o.max_iterations = 40;
  o.tolerance = 1e-4;
  return o;
}
estimate::FitOptions searched_noise() {
  estimate::FitOptions o = given_noise();
  o.noise.rounds = 30;
  return o;
}
identify::IdentifyProgress joint(int iteration, double to_fall, int noise_round = 0) {
  return {"joint fit", 4, 4, {.iteration = iteration, .cost = 3834.5, .decrement = to_fall, .noise_round = noise_round}};
}

TEST(IdentifyProgress, NamesPartIterationCostAndTheTimeSinceTheBeginning) {
  IdentifyProgressText text(searched_noise());
  EXPECT_EQ(text(joint(0, 3.8e6), 65.0).text,
            "[4/4] joint fit: iteration 0 of at most 40, cost 3834.5, predicted decrease 3.8e+06, noise round 0; 1:05 so far");
}

TEST(IdentifyProgress, SaysThatAPartIsFittedAgainWhenItsIterationsBeginAnew) {
  IdentifyProgressText text(given_noise());
  EXPECT_THAT(text(joint(0, 1e6), 10.0).text, HasSubstr("joint fit: iteration 0"));
  EXPECT_THAT(text(joint(20, 1e-5), 400.0).text, HasSubstr("joint fit: iteration 20"));
  EXPECT_THAT(text(joint(0, 1e5), 401.0).text, HasSubstr("joint fit again, round 2: iteration 0"));
  EXPECT_THAT(text(joint(1, 1e4), 402.0).text, HasSubstr("joint fit again, round 2: iteration 1"));
  EXPECT_THAT(text(joint(0, 1e5), 403.0).text, HasSubstr("joint fit again, round 3: iteration 0"));
  identify::IdentifyProgress other = joint(0, 1e5);
  other.part = "check by Ceres";
  other.part_number = other.parts = 5;
  EXPECT_THAT(text(other, 404.0).text, HasSubstr("[5/5] check by Ceres: iteration 0"));
}

TEST(IdentifyProgress, PredictsTheTimeLeftWithinOneIterationWhenTheCostFallsByAFactor) {
  IdentifyProgressText text(given_noise());
  // 0.6 a step from 1 down: below 1e-4 after 19 steps of 2 s.
  for (int i = 0; i < 19; ++i) {
    const std::string line = text(joint(i, std::pow(0.6, i)), 100.0 + 2.0 * i).text;
    if (i < 2) {
      EXPECT_THAT(line, Not(HasSubstr("left"))) << "two falls are needed to see a factor";
    } else {
      EXPECT_THAT(line,
                  HasSubstr("about 0:" + std::string(2 * (19 - i) < 10 ? "0" : "") + std::to_string(2 * (19 - i)) + " left in this part"));
    }
  }
}

TEST(IdentifyProgress, TakesThePaceOfARoundFromThatRoundAlone) {
  IdentifyProgressText text(given_noise());
  for (int i = 0; i < 5; ++i) text(joint(i, std::pow(0.1, i)), 1000.0 * i);
  // A second round with 1 s a step, tenfold down each: from 1e-2 two more steps reach 1e-4.
  text(joint(0, 1.0), 5000.0);
  text(joint(1, 0.1), 5001.0);
  EXPECT_THAT(text(joint(2, 0.01), 5002.0).text, HasSubstr("1:23:22 so far, about 0:02 left in this round"));
}

TEST(IdentifyProgress, GivesNoTimeLeftWhereTheCostRisesOrTheNoiseIsSearchedToo) {
  IdentifyProgressText zigzag(given_noise());
  for (int i = 0; i < 10; ++i) EXPECT_THAT(zigzag(joint(i, i % 2 ? 5.0 : 50.0), i).text, Not(HasSubstr("left")));
  IdentifyProgressText noise(searched_noise());
  for (int i = 0; i < 10; ++i) EXPECT_THAT(noise(joint(i, std::pow(0.1, i), 3), i).text, Not(HasSubstr("left")));
}

TEST(IdentifyProgress, IsDueAsALineWhenAPartOrRoundBeginsAndThenEveryTenSeconds) {
  IdentifyProgressText text(given_noise());
  EXPECT_TRUE(text(joint(0, 9.0), 3.0).due) << "a part begins";
  EXPECT_FALSE(text(joint(1, 8.0), 12.9).due);
  EXPECT_TRUE(text(joint(2, 7.0), 13.0).due);
  EXPECT_FALSE(text(joint(3, 6.0), 22.0).due) << "10 s after the last line, not after the part began";
  EXPECT_TRUE(text(joint(0, 5.0), 22.5).due) << "another round begins";
  EXPECT_FALSE(text(joint(1, 4.0), 32.0).due);
  EXPECT_TRUE(text(joint(2, 3.0), 60.0).due);
}

}  // namespace
}  // namespace rotorloop::cli
