#include "bench/diagnose/vehicle_priors.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "bench/identify/identified_vehicle.hpp"
#include "host/base/symmetric_matrix.hpp"
#include "host/vehicle/thrust.hpp"

namespace rotorloop::diagnose {
namespace {

// Of a parameter's scale: a finer figure is a fit's rounding, and would only spoil the arithmetic.
constexpr double kFinestShare = 1e-4;
constexpr double kLeastLearned = 0.1;  // of a prior variance that the flights must take away to say anything of it
constexpr double kContradicts = 3.5;   // of forty numbers one in fifty diagnoses has such a one by chance

// Standard uncertainty of what the file knows of a parameter; nothing where it guesses.
std::optional<double> known_u(const host::VehicleFile& v, int parameter, const host::TermList& terms) {
  const auto unless_guess = [](const host::Quantity& q) -> std::optional<double> {
    if (q.origin == host::Origin::guess || q.u <= 0.0) return std::nullopt;
    return q.u;
  };
  const auto of_sensor = [](host::Origin origin, double u) -> std::optional<double> {
    if (origin == host::Origin::guess || u <= 0.0) return std::nullopt;
    return u;
  };
  switch (parameter) {
    case estimate::kMass:
      return std::nullopt;  // the fit itself asks the file
    case estimate::kIxx:
      return unless_guess(v.inertia_kg_m2[0]);
    case estimate::kIyy:
      return unless_guess(v.inertia_kg_m2[1]);
    case estimate::kIzz:
      return unless_guess(v.inertia_kg_m2[2]);
    case estimate::kCq:
      return unless_guess(v.c_q_N_m_s2);
    case estimate::kComX:
      return unless_guess(v.com_offset_m[0]);
    case estimate::kComY:
      return unless_guess(v.com_offset_m[1]);
    case estimate::kK1:
      return unless_guess(v.k1_N_s2);
    case estimate::kK2:
      return unless_guess(v.k2_N_s2_m);
    case estimate::kCdh:
      return unless_guess(v.c_dh_s_m);
    case estimate::kCdxy:
      return unless_guess(v.c_dxy_N_s2_m2);
    case estimate::kCdz:
      return unless_guess(v.c_dz_N_s2_m2);
    default:
      break;
  }
  if (parameter >= estimate::kOffsetX && parameter <= estimate::kOffsetZ)
    return of_sensor(v.pose_sensor.offset_origin, v.pose_sensor.offset_u_m[static_cast<std::size_t>(parameter - estimate::kOffsetX)]);
  if (parameter >= estimate::kTurnX && parameter <= estimate::kTurnZ)
    return of_sensor(v.pose_sensor.rotation_origin, v.pose_sensor.rotation_u_rad[static_cast<std::size_t>(parameter - estimate::kTurnX)]);
  if (parameter < estimate::kCoreParameters) return std::nullopt;
  const auto flat = static_cast<std::size_t>(parameter - estimate::kCoreParameters);
  const auto id = terms.term(terms.term_of(flat)).info.id;
  for (const host::VehicleEffect& e : v.effects) {
    if (e.id != id) continue;
    for (const host::EffectParameter& q : e.parameters) {
      if (q.name == terms.parameter(flat).name) return unless_guess(q.quantity);
    }
  }
  return std::nullopt;
}

// Static thrust found on a stand ties k1 and k2 in one direction.
void add_stand(const host::VehicleFile& v, const estimate::ModelValues& at, std::vector<estimate::JointPrior>& out) {
  const host::StaticThrust* stand = v.static_thrust_of(host::Origin::stand);
  if (!stand || stand->u_N_s2 <= 0.0) return;
  const auto c_t = [&](double k1, double k2) { return host::static_c_t({k1, k2, at.geometry.radius_m, at.geometry.air_density_kg_m3}); };
  const double k1 = at[estimate::kK1], k2 = at[estimate::kK2], here = c_t(k1, k2);
  constexpr double kStep = 1e-4;
  const Eigen::Vector2d slope((c_t(k1 * (1 + kStep), k2) - here) / (k1 * kStep), (c_t(k1, k2 * (1 + kStep)) - here) / (k2 * kStep));
  // Thrust scales with the density of the air at a given c_t; the stand's figure is taken to this model's density.
  const double density = stand->air_density_kg_m3 > 0.0 ? at.geometry.air_density_kg_m3 / stand->air_density_kg_m3 : 1.0;
  estimate::JointPrior p{
      {estimate::kK1, estimate::kK2}, Eigen::Vector2d(k1, k2), slope * slope.transpose() / (stand->u_N_s2 * stand->u_N_s2)};
  p.mean[0] += (stand->c_t_N_s2 * density - here) / slope[0];
  out.push_back(std::move(p));
}

}  // namespace

std::vector<estimate::JointPrior> vehicle_priors(const host::VehicleFile& v, std::span<const estimate::FreeParameter> free,
                                                 const estimate::ModelValues& at) {
  std::vector<estimate::JointPrior> out;
  std::map<std::string, int> of_name;
  std::map<int, double> left;  // standard uncertainties that no covariance block has spoken for
  for (const estimate::FreeParameter& f : free) {
    if (f.per_flight || f.prior_u > 0.0) continue;
    if (const auto u = known_u(v, f.parameter, at.terms)) {
      const estimate::ParameterInfo info = estimate::parameter_info(f.parameter, at.terms);
      of_name[info.name] = f.parameter;
      left[f.parameter] = std::max(*u, kFinestShare * info.scale);
    }
  }
  for (const host::CovarianceBlock& block : v.covariance) {
    std::vector<Eigen::Index> rows;
    estimate::JointPrior p;
    for (std::size_t i = 0; i < block.of.size(); ++i) {
      const auto found = of_name.find(block.of[i]);
      if (found == of_name.end() || !left.contains(found->second)) continue;
      rows.push_back(static_cast<Eigen::Index>(i));
      p.parameters.push_back(found->second);
    }
    if (rows.empty()) continue;
    const auto n = static_cast<Eigen::Index>(block.of.size());
    const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> all(block.matrix.data(), n, n);
    Eigen::MatrixXd covariance = all(rows, rows);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      covariance(k, k) = std::max(covariance(k, k), std::pow(kFinestShare * estimate::parameter_info(p.parameters[i], at.terms).scale, 2));
    }
    const Eigen::VectorXd scale = covariance.diagonal().cwiseSqrt().cwiseInverse();
    const LltFactor factor(scale.asDiagonal() * covariance * scale.asDiagonal());
    if (!factor.succeeded() || !scale.allFinite()) continue;  // the single uncertainties then speak
    p.information = scale.asDiagonal() * factor.inverse() * scale.asDiagonal();
    p.mean.resize(scale.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      p.mean[static_cast<Eigen::Index>(i)] = at[p.parameters[i]];
      left.erase(p.parameters[i]);
    }
    out.push_back(std::move(p));
  }
  for (const auto& [parameter, u] : left) {
    estimate::JointPrior p{{parameter}, Eigen::VectorXd::Constant(1, at[parameter]), Eigen::MatrixXd::Constant(1, 1, 1.0 / (u * u))};
    out.push_back(std::move(p));
  }
  add_stand(v, at, out);
  return out;
}

std::vector<Contradiction> contradictions(const estimate::FitProblem& problem, const estimate::Fit& fit) {
  std::vector<Contradiction> out;
  for (const estimate::JointPrior& prior : problem.priors) {
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
