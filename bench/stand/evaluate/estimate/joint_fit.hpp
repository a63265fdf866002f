// The joint robust fit of one channel of a stand: coefficient, speed exponent, zero, running offset, drift and hysteresis together.
//   y_k = c ω*² (ω_k/ω*)^(2 + e + f l + g l²) + zero + running + drift t_k + hysteresis s_k + error,  l = ln(ω_k/ω*)
// Cauchy weights with their scale from the median distance; error variance u_k² + (dy/dω u_ω)² (effective variance: speed is known to
// 0.05 %, where total least squares gives nothing more). Stopped zeros are rows of ω = 0. e, f, g and drift have priors about 0
// (joint_fit.cpp).
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace rotorloop::stand {

struct FitRows {
  Eigen::VectorXd y, omega_rad_s, t_s, direction;  // direction: -1, 0, 1
  Eigen::VectorXd u;                               // of y; not-a-number where it is not known
  std::vector<int> block;
  std::vector<std::size_t> step;  // of the run, from 0, that each row comes from; empty where rows come from elsewhere
  double u_omega = 0.0;           // relative
  double centre_rad_s = 0.0;      // ω*: c is the coefficient there
  double running_sd = 0.0;        // what is known of the running offset: its standard deviation about 0, in y's unit; 0: nothing
};

// Which terms a fit has beside c.
struct FitLaw {
  bool exponent = false, curved = false;  // e; f and g
  bool zero = false;                      // a constant of all rows
  bool running = false;                   // a constant of the rows with ω > 0 alone
  bool drift = false, hysteresis = false;
  friend bool operator==(const FitLaw&, const FitLaw&) = default;
};
std::string law_text(const FitLaw& law, const std::string& quantity);  // "c ω^p + zero + drift"

struct FittedTerm {
  std::string name;             // "c", "exponent", "curvature", "change of curvature", "zero", "running offset", "drift", "hysteresis"
  double value = 0.0, u = 0.0;  // u: model-based
};

struct JointFit {
  FitLaw law;
  std::vector<FittedTerm> terms;  // c first
  Eigen::MatrixXd covariance;     // model-based, in the order of the terms
  Eigen::VectorXd residual;       // y - model
  Eigen::VectorXd weight;         // 0 to 1: the Cauchy weight
  Eigen::VectorXd influence;      // of each row on c: dc/dy
  double rms = 0.0;
  double aicc = 0.0;  // set by compare_laws
  double degrees = 0.0;
  bool converged = false;
  double value(const std::string& name) const;  // 0 for a term that the law has not
};

// Derivation. Thrust and torque of a rotor in still air go with ω² as long as the air behaves alike at all speeds. That the coefficient
// changes with the Reynolds number is written as a polynomial of l = ln(ω/ω*) in the exponent; e, f and g are small, and their priors say
// how small they are on other propellers. A stand has outliers (gusts, a jammed bearing), so errors z = (y - model)/u are
// taken as Cauchy's of scale s, whose negative log likelihood is ln(1 + (z/s)²) a row. Its slope is that of a square with the weight
//   w(z) = 1 / (1 + (z/s)²)
// so that the minimum is found by least squares with the weights of the last round, repeated until c rests (iteratively reweighted least
// squares; Holland, Welsch 1977). s is 2.385 times the robust deviation of z: 95 % of the efficiency of least squares for normal errors
// (Rey 1983). A round is a Gauss-Newton step of the terms β, with X = ∂model/∂β, W = diag(w/u²), P the information of the priors and σ² the
// variance of a row of weight 1, as the weights know no unit:
//   (XᵀWX + σ²P) δβ = XᵀW (y - model) - σ²P β
// An error of the speed is one of y through the slope of the model, hence u² = u_y² + (∂model/∂ω u_ω)² (effective variance; Orear 1982).
//
// Throws Error (data_quality) for fewer rows than unknowns + 1.
JointFit fit_jointly(const FitRows& rows, const FitLaw& law);

// Each law on the same rows with the outliers' weights of the widest law, so that none is preferred for calling an awkward row an outlier;
// aicc: Akaike's criterion for small samples, lower is better.
std::vector<JointFit> compare_laws(const FitRows& rows, const std::vector<FitLaw>& laws);

// c with its uncertainty from drawing blocks of rows anew, zeros and neighbouring speeds apart.
struct Bootstrap {
  double u = 0.0, low = 0.0, high = 0.0;  // standard deviation, 95 % interval
  int draws = 0;
  std::uint64_t seed = 0;
};
Bootstrap bootstrap_c(const FitRows& rows, const JointFit& fit, int draws, std::uint64_t seed);

}  // namespace rotorloop::stand
