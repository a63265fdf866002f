#include "bench/sysid/identify/gauge.hpp"

#include <algorithm>

#include "host/effects/rotor_groups.hpp"

namespace rotorloop::identify {

std::vector<std::vector<int>> rotor_groups(const host::TermList& terms, std::span<const estimate::FreeParameter> free) {
  const auto shared = [&](int parameter) {
    return std::any_of(free.begin(), free.end(),
                       [&](const estimate::FreeParameter& f) { return f.parameter == parameter && !f.per_flight; });
  };
  std::vector<std::vector<int>> out;
  for (std::size_t t = 0; t < terms.size(); ++t) {
    const host::TermInfo& info = terms.term(t).info;
    if (host::common_part(info.id).empty()) continue;
    std::vector<int> group;
    for (std::size_t k = 0; k < info.parameters.size(); ++k)
      group.push_back(estimate::kCoreParameters + static_cast<int>(terms.first_parameter(t) + k));
    if (std::all_of(group.begin(), group.end(), shared)) out.push_back(std::move(group));
  }
  return out;
}

bool common_part_known(std::string_view term_id, std::span<const estimate::JointPrior> priors) {
  // Thrust's common part is k_1's (k_2's goes with it), torque's is c_q's.
  const int holder = host::common_part(term_id).starts_with("k_1") ? estimate::kK1 : estimate::kCq;
  return std::any_of(priors.begin(), priors.end(), [&](const estimate::JointPrior& p) {
    return !p.weak && std::find(p.parameters.begin(), p.parameters.end(), holder) != p.parameters.end();
  });
}

estimate::JointPrior prior_of_sum(const std::vector<int>& group, const estimate::ModelValues& at, bool known) {
  constexpr double kSure = 1e-3;  // of a size that matters: flights determine no difference between rotors as well
  const auto n = static_cast<Eigen::Index>(group.size());
  const double u = (known ? 1.0 : kSure) * estimate::parameter_info(group.front(), at.terms).scale;
  estimate::JointPrior out{group, Eigen::VectorXd(n), Eigen::MatrixXd::Constant(n, n, 1.0 / (u * u))};
  for (Eigen::Index i = 0; i < n; ++i) out.mean[i] = at[group[static_cast<std::size_t>(i)]];
  return out;
}

}  // namespace rotorloop::identify
