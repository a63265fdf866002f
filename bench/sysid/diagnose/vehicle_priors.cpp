#include "bench/sysid/diagnose/vehicle_priors.hpp"

#include <algorithm>
#include <cmath>

#include "bench/sysid/identify/identified_vehicle.hpp"
#include "host/base/symmetric_matrix.hpp"

namespace rotorloop::diagnose {
namespace {

constexpr double kLeastLearned = 0.1;  // of a prior variance that the flights must take away to say anything of it
constexpr double kContradicts = 3.5;   // of forty numbers one in fifty diagnoses has such a one by chance

}  // namespace

std::vector<Contradiction> contradictions(const estimate::FitProblem& problem, const estimate::Fit& fit) {
  std::vector<Contradiction> out;
  for (const estimate::JointPrior& prior : problem.priors) {
    if (prior.weak) continue;  // a guess may be wrong
    const LltFactor factor(prior.information);
    if (!factor.succeeded()) continue;  // one direction of several numbers: it says nothing of each
    const Eigen::MatrixXd covariance = factor.inverse();
    for (std::size_t k = 0; k < prior.parameters.size(); ++k) {
      const estimate::Estimate* e = fit.find(prior.parameters[k]);
      const auto at = static_cast<Eigen::Index>(k);
      const double prior_variance = covariance(at, at), taken = e ? prior_variance - e->u * e->u : 0.0;
      if (!(taken > kLeastLearned * prior_variance)) continue;
      const double z = (e->value - prior.mean[at]) / std::sqrt(taken) / std::max(1.0, e->u_robust / e->u);
      if (std::fabs(z) > kContradicts)
        out.push_back({e->parameter, prior.mean[at], std::sqrt(prior_variance), e->value, identify::reported_u(*e), z});
    }
  }
  std::stable_sort(out.begin(), out.end(), [](const Contradiction& a, const Contradiction& b) { return std::fabs(a.z) > std::fabs(b.z); });
  return out;
}

}  // namespace rotorloop::diagnose
