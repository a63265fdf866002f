// The step of the parameters from their normal equations, inside the range of each, and the equations' inverse. All of it is scaled to
// unit diagonal, so that grams and kilometres may stand side by side.
#pragma once
#include "bench/sysid/estimate/fit_layout.hpp"

namespace rotorloop::estimate {

Eigen::VectorXd unit_scaling(const Eigen::MatrixXd& s);  // k with diag(k) S diag(k) of unit diagonal
// x of S x = rhs, the diagonal of S raised by the share `damping`.
Eigen::VectorXd solve_scaled(const Eigen::MatrixXd& s, const Eigen::VectorXd& rhs, double damping = 0.0);
Eigen::MatrixXd inverse_scaled(const Eigen::MatrixXd& s);

// The Newton step that keeps every value inside its range: a value that would leave it stops at its bound, and the others make the
// best of that. A positive value loses at most four fifths in one step, for its curvature is known here only.
Eigen::VectorXd step_inside(const FitProblem& problem, const Layout& layout, const Eigen::VectorXd& theta,
                            const Eigen::MatrixXd& information, const Eigen::VectorXd& score, double damping);

}  // namespace rotorloop::estimate
