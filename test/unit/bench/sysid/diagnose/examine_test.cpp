// Which candidates pass the criteria that need no refit, on regressions whose answers are known.
#include "bench/sysid/diagnose/examine.hpp"

#include <gtest/gtest.h>

#include "test/unit/bench/sysid/diagnose/made_up_regression.hpp"

namespace rotorloop::diagnose {
namespace {

using namespace made_up;

Candidate candidate(const std::string& id, const ColumnSet& columns, double scale) {
  Candidate c{.id = id};
  c.columns = columns;
  for (std::size_t k = 0; k < columns.size(); ++k)
    c.parameters.push_back({.name = "x", .unit = "1", .neutral = 0.0, .min = -10.0, .max = 10.0, .scale = scale});
  return c;
}

// Column 1 is a number of which `matters` matters; columns 2 and 3 are those of an effect whose first follows it closely.
// The data hold 0.3 of column 1, and `beside` of column 3.
struct Lesser {
  double matters = 2.0, beside = 0.0;

  std::vector<Tested> examined() {
    Regression r{{noise(7, 1), noise(7, 2), noise(7, 3), noise(7, 4)}, noise(7, 5)};
    for (std::size_t k = 0; k < kSamples; ++k) {
      r.columns[2][k] = 0.9 * r.columns[1][k] + 0.4 * r.columns[2][k];
      r.y[k] += 0.3 * r.columns[1][k] + beside * r.columns[3][k];
    }
    screening.table = r.table();
    screening.candidates = {candidate("prior", {1}, matters), candidate("new", {2, 3}, 0.1)};
    return examine_all(screening, Criteria{}, 8.0);
  }
  Screening screening = {};
};

const Tested& of(const std::vector<Tested>& all, const std::string& id) {
  return *std::find_if(all.begin(), all.end(), [&](const Tested& t) { return t.candidate->id == id; });
}

TEST(Examine, WhatASingleNumberTooSmallToMatterExplainsBetterIsNoNewEffect) {
  Lesser l;
  const auto all = l.examined();
  EXPECT_FALSE(of(all, "prior").real);
  EXPECT_TRUE(of(all, "prior").minor);
  EXPECT_FALSE(of(all, "new").real);
  EXPECT_EQ(of(all, "new").evidence.ruled_out_by.id, Rejection::lesser_cause);
  EXPECT_EQ(of(all, "new").evidence.ruled_out_by.effect, "prior");
}
TEST(Examine, ANumberThatMattersIsACandidateBesideTheOther) {
  Lesser l{.matters = 0.2};
  const auto all = l.examined();
  EXPECT_TRUE(of(all, "prior").real);
  EXPECT_TRUE(of(all, "new").real);
}
TEST(Examine, AnEffectThatExplainsMoreThanTheNumberTooSmallToMatterStays) {
  Lesser l{.beside = 0.5};
  const auto all = l.examined();
  EXPECT_TRUE(of(all, "prior").minor);
  EXPECT_TRUE(of(all, "new").real) << name(of(all, "new").evidence.ruled_out_by.id);
}

}  // namespace
}  // namespace rotorloop::diagnose
