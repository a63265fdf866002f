// Decompositions against matrices whose factors are known by hand, and against their own definition.
#include "host/base/symmetric_matrix.hpp"

#include <gtest/gtest.h>

#include "host/base/random.hpp"

namespace rotorloop {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kRounding = 1e-12;

MatrixXd positive_definite(Eigen::Index n) {
  const RandomStream random(1, 1);
  MatrixXd a(n, n + 2);
  for (Eigen::Index i = 0; i < a.size(); ++i) a.data()[i] = random.gaussian(static_cast<std::uint64_t>(i));
  return a * a.transpose();
}

TEST(SymmetricMatrix, EigenvaluesOfTwoCoupledDirectionsAreAscendingAndThoseByHand) {
  const MatrixXd m = (MatrixXd(2, 2) << 2.0, 1.0, 1.0, 2.0).finished();
  const SymmetricEigen eigen = symmetric_eigen(m);
  EXPECT_NEAR(eigen.values[0], 1.0, kRounding);
  EXPECT_NEAR(eigen.values[1], 3.0, kRounding);
  EXPECT_NEAR(eigen.vectors(0, 0), -eigen.vectors(1, 0), kRounding) << "of 1: the difference of the two";
  EXPECT_NEAR(eigen.vectors(0, 1), eigen.vectors(1, 1), kRounding) << "of 3: their sum";
  EXPECT_TRUE(symmetric_eigenvalues(m).isApprox(eigen.values, kRounding));
}

TEST(SymmetricMatrix, EigenvectorsGiveTheMatrixBack) {
  const MatrixXd m = positive_definite(7);
  const SymmetricEigen eigen = symmetric_eigen(m);
  EXPECT_TRUE((eigen.vectors * eigen.values.asDiagonal() * eigen.vectors.transpose()).isApprox(m, kRounding));
}

TEST(SymmetricMatrix, FactorsSolveForVectorsAndMatricesAndInvert) {
  const MatrixXd m = positive_definite(5), x = positive_definite(5).leftCols(2);
  const LdltFactor ldlt(m);
  const LltFactor llt(m);
  ASSERT_TRUE(ldlt.succeeded());
  ASSERT_TRUE(llt.succeeded());
  EXPECT_TRUE(ldlt.solve(MatrixXd(m * x)).isApprox(x, 1e-9));
  EXPECT_TRUE(ldlt.solve(VectorXd(m * x.col(0))).isApprox(x.col(0), 1e-9));
  EXPECT_TRUE(llt.solve(m * x).isApprox(x, 1e-9));
  EXPECT_TRUE((m * ldlt.inverse()).isIdentity(1e-9));
  EXPECT_TRUE((m * llt.inverse()).isIdentity(1e-9));
}

TEST(SymmetricMatrix, LowerFactorWhitensItsOwnMatrix) {
  const MatrixXd m = positive_definite(4);
  const LltFactor llt(m);
  const MatrixXd half = llt.solve_lower(m);
  EXPECT_TRUE(llt.solve_lower(MatrixXd(half.transpose())).isIdentity(1e-9)) << "L⁻¹ M L⁻ᵀ";
  EXPECT_TRUE(llt.solve_lower(VectorXd(m.col(1))).isApprox(half.col(1), kRounding));
}

TEST(SymmetricMatrix, ADirectionWithoutInformationHasNoPivotAndNoCholeskyFactor) {
  const MatrixXd m = (MatrixXd(2, 2) << 1.0, 2.0, 2.0, 1.0).finished();
  EXPECT_FALSE(LltFactor(m).succeeded()) << "eigenvalues 3 and -1";
  EXPECT_LT(LdltFactor(m).least_pivot(), 0.0);
  EXPECT_EQ(LdltFactor(MatrixXd::Zero(2, 2)).least_pivot(), 0.0);
}

}  // namespace
}  // namespace rotorloop
