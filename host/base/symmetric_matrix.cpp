#include "host/base/symmetric_matrix.hpp"

#include <Eigen/Eigenvalues>

namespace rotorloop {

using Eigen::MatrixXd;
using Eigen::VectorXd;

SymmetricEigen symmetric_eigen(const MatrixXd& m) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(m);
  return {solver.eigenvalues(), solver.eigenvectors()};
}
VectorXd symmetric_eigenvalues(const MatrixXd& m) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(m, Eigen::EigenvaluesOnly).eigenvalues();
}

LdltFactor::LdltFactor(const MatrixXd& m) : factor_(m) {}
VectorXd LdltFactor::solve(const VectorXd& rhs) const { return factor_.solve(rhs); }
MatrixXd LdltFactor::solve(const MatrixXd& rhs) const { return factor_.solve(rhs); }
MatrixXd LdltFactor::inverse() const { return solve(MatrixXd::Identity(factor_.rows(), factor_.cols()).eval()); }

LltFactor::LltFactor(const MatrixXd& m) : factor_(m) {}
MatrixXd LltFactor::solve(const MatrixXd& rhs) const { return factor_.solve(rhs); }
MatrixXd LltFactor::inverse() const { return solve(MatrixXd::Identity(factor_.rows(), factor_.cols()).eval()); }
VectorXd LltFactor::solve_lower(const VectorXd& rhs) const { return factor_.matrixL().solve(rhs); }
MatrixXd LltFactor::solve_lower(const MatrixXd& rhs) const { return factor_.matrixL().solve(rhs); }

}  // namespace rotorloop
