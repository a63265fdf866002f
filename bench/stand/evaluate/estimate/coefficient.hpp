// One coefficient of a run with everything that its uncertainty rests on.
#pragma once
#include <limits>
#include <string>
#include <vector>

#include "bench/stand/evaluate/estimate/joint_fit.hpp"

namespace rotorloop::stand {

enum class BudgetKind { A, B };
struct BudgetTerm {
  std::string name;
  double u = 0.0;  // relative to the coefficient
  BudgetKind kind = BudgetKind::B;
  std::string source;  // of a type B: "typical", "stand file", …
  double degrees = std::numeric_limits<double>::infinity();
};

struct LawRow {
  std::string text;                // "c ω² + zero"
  double c = 0.0, exponent = 0.0;  // at the window's middle; exponent beyond 2
  double aicc_loss = 0.0;          // above the best law
  double rms = 0.0;
};

struct CoefficientEstimate {
  std::string channel, name, unit;          // "thrust", "c_t", "N s^2"
  double value = 0.0;                       // SI, at the middle of the window and the run's density
  double u = 0.0;                           // combined standard uncertainty
  double degrees = 0.0;                     // Welch-Satterthwaite
  double low = 0.0, high = 0.0;             // 95 %
  double proportional = 0.0;                // of c ω² alone, which most tables print
  double exponent = 2.0, exponent_u = 0.0;  // local: y ∝ ω^exponent at the middle; u 0 where c ω² holds
  bool square_fails = false;                // c ω² loses by more than kAicLoss
  std::vector<LawRow> laws;
  std::vector<BudgetTerm> budget;
  Bootstrap bootstrap;
  double model_based_u = 0.0;  // cross-check of the bootstrap
  JointFit fit;
  FitRows rows;
  std::vector<std::string> down_weighted;  // steps that the fit takes for outliers, in words
};
// Two-sided 95 % of a value with u and degrees of freedom.
double coverage_factor(double degrees);

}  // namespace rotorloop::stand
