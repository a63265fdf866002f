#include "host/base/rotation_between.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <vector>

namespace rotorloop {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

const std::vector<Vector3d> kDirections{{1, 0, 0}, {0, -2, 0}, {0, 0, 1}, {0, 0, -1}, {1, 2, -3}, {-1e-7, 0, 1}, {1e-7, 0, -1}};

TEST(RotationBetween, TurnsOneDirectionIntoTheOtherWhateverTheirLengthsOppositeOnesToo) {
  for (const Vector3d& from : kDirections) {
    for (const Vector3d& to : kDirections) {
      const Quaterniond q = rotation_between(from, to);
      EXPECT_NEAR(q.norm(), 1.0, 1e-9);
      EXPECT_LT((q * from.normalized() - to.normalized()).norm(), 3e-6) << from.transpose() << " to " << to.transpose();
    }
  }
}

TEST(RotationBetween, IsTheShortestOne) {
  const Quaterniond q = rotation_between({0, 0, 1}, {0, 1, 0});
  EXPECT_NEAR(q.angularDistance(Quaterniond::Identity()), 0.5 * std::numbers::pi, 1e-12) << "a quarter turn, rad";
  EXPECT_NEAR(q.x(), -std::sqrt(0.5), 1e-12) << "about -x";
}

TEST(RotationBetween, EqualDirectionsNeedNone) { EXPECT_NEAR(rotation_between({1, 2, 3}, {2, 4, 6}).w(), 1.0, 1e-12); }

}  // namespace
}  // namespace rotorloop
