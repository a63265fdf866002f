// Decompositions of symmetric matrices of a size known at run time. Eigen's solvers are templates that take seconds to compile in each
// file that uses one (docs/decisions/0103); here they are compiled once.
#pragma once
#include <Eigen/Cholesky>

namespace rotorloop {

struct SymmetricEigen {
  Eigen::VectorXd values;   // ascending
  Eigen::MatrixXd vectors;  // orthonormal columns, in the order of the values
};
// Reads the lower triangle of `m`, which must be square and finite.
SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& m);
Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& m);  // ascending

// Cholesky decomposition L D Lᵀ with pivots, for semi-definite matrices too.
class LdltFactor {
 public:
  explicit LdltFactor(const Eigen::MatrixXd& m);
  bool succeeded() const { return factor_.info() == Eigen::Success; }
  double least_pivot() const { return factor_.vectorD().minCoeff(); }
  Eigen::VectorXd solve(const Eigen::VectorXd& rhs) const;
  Eigen::MatrixXd solve(const Eigen::MatrixXd& rhs) const;
  Eigen::MatrixXd inverse() const;

 private:
  Eigen::LDLT<Eigen::MatrixXd> factor_;
};

// Cholesky decomposition L Lᵀ of a positive definite matrix.
class LltFactor {
 public:
  explicit LltFactor(const Eigen::MatrixXd& m);
  bool succeeded() const { return factor_.info() == Eigen::Success; }
  Eigen::MatrixXd solve(const Eigen::MatrixXd& rhs) const;
  Eigen::MatrixXd inverse() const;
  Eigen::VectorXd solve_lower(const Eigen::VectorXd& rhs) const;  // L⁻¹ rhs
  Eigen::MatrixXd solve_lower(const Eigen::MatrixXd& rhs) const;

 private:
  Eigen::LLT<Eigen::MatrixXd> factor_;
};

}  // namespace rotorloop
