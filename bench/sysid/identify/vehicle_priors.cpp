#include "bench/sysid/identify/vehicle_priors.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>

#include "host/base/symmetric_matrix.hpp"
#include "host/vehicle/thrust.hpp"

namespace rotorloop::identify {
namespace {

// Of a parameter's scale: a finer figure is a fit's rounding, and would only spoil the arithmetic.
constexpr double kFinestShare = 1e-4;
// A guess is right to a factor of three, or to three of the uncertainties that it was given, whichever is more: without weight wherever
// flights determine a parameter, and enough to keep one that they leave open from running away.
constexpr double kWeakFactor = 1.0986;  // ln 3, of the value
constexpr double kWeakUncertainties = 3.0;

// What the file says of a parameter.
struct FileValue {
  double u = 0.0;
  host::Origin origin = host::Origin::guess;
};

// A rotor's inertia stands in [torque_model] where no effect has it.
std::optional<FileValue> said_of(const host::VehicleFile& v, int parameter, const host::TermList& terms) {
  const std::string name = estimate::parameter_info(parameter, terms).name;
  if (const auto u = host::uncertainty_of(v, name)) return FileValue{*u, host::origin_of(v, name).value_or(host::Origin::guess)};
  const bool of_rotor =
      std::find(estimate::kRotorInertiaNames.begin(), estimate::kRotorInertiaNames.end(), name) != estimate::kRotorInertiaNames.end();
  if (of_rotor && v.rotor_inertia_kg_m2.value > 0.0) return FileValue{v.rotor_inertia_kg_m2.u, v.rotor_inertia_kg_m2.origin};
  return std::nullopt;
}

double at_least_fine(double u, const estimate::ParameterInfo& info) { return std::max(u, kFinestShare * info.scale); }

estimate::JointPrior single(int parameter, double mean, double u, bool weak) {
  return {{parameter}, Eigen::VectorXd::Constant(1, mean), Eigen::MatrixXd::Constant(1, 1, 1.0 / (u * u)), 1.0, weak};
}

// Of the nominal vehicle alone: what an effect of the file is worth is what a diagnosis asks.
bool takes_weak_prior(int parameter, const host::TermList& terms) {
  if (parameter < estimate::kCoreParameters) return parameter != estimate::kMass;
  const std::string name = estimate::parameter_info(parameter, terms).name;
  return std::find(estimate::kRotorInertiaNames.begin(), estimate::kRotorInertiaNames.end(), name) != estimate::kRotorInertiaNames.end();
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

// Values with their covariance where the file has one, else with their single uncertainties.
std::vector<estimate::JointPrior> priors_of_known(const host::VehicleFile& v, const std::map<int, double>& known,
                                                  const estimate::ModelValues& at) {
  std::vector<estimate::JointPrior> out;
  std::map<std::string, int> of_name;
  for (const auto& [parameter, u] : known) of_name[estimate::parameter_info(parameter, at.terms).name] = parameter;
  std::map<int, double> left = known;  // standard uncertainties that no covariance block has spoken for
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
      covariance(k, k) = std::pow(at_least_fine(std::sqrt(covariance(k, k)), estimate::parameter_info(p.parameters[i], at.terms)), 2);
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
  for (const auto& [parameter, u] : left) out.push_back(single(parameter, at[parameter], u, false));
  return out;
}

// What flights found counts only where `flights` says so; else it is a start value, as a guess is, and both are weak priors.
std::vector<estimate::JointPrior> priors_from(const host::VehicleFile& v, std::span<const estimate::FreeParameter> free,
                                              const estimate::ModelValues& at, bool flights) {
  std::map<int, double> known;
  std::vector<estimate::JointPrior> weak;
  for (const estimate::FreeParameter& f : free) {
    // The fit itself asks the file about the mass.
    if (f.per_flight || f.prior_u > 0.0 || f.parameter == estimate::kMass) continue;
    const auto said = said_of(v, f.parameter, at.terms);
    if (!said) continue;
    const estimate::ParameterInfo info = estimate::parameter_info(f.parameter, at.terms);
    if (said->origin != host::Origin::guess && (flights || said->origin != host::Origin::flight)) {
      if (said->u > 0.0) known[f.parameter] = at_least_fine(said->u, info);
      continue;
    }
    if (flights) continue;
    const double u = std::max(kWeakFactor * std::fabs(at[f.parameter]), kWeakUncertainties * said->u);
    if (u > 0.0 && takes_weak_prior(f.parameter, at.terms))
      weak.push_back(single(f.parameter, at[f.parameter], at_least_fine(u, info), true));
  }
  std::vector<estimate::JointPrior> out = priors_of_known(v, known, at);
  if (flights) add_stand(v, at, out);
  out.insert(out.end(), weak.begin(), weak.end());
  return out;
}

}  // namespace

std::vector<estimate::JointPrior> vehicle_priors(const host::VehicleFile& v, std::span<const estimate::FreeParameter> free,
                                                 const estimate::ModelValues& at) {
  return priors_from(v, free, at, true);
}

std::vector<estimate::JointPrior> priors_beside_flights(const host::VehicleFile& v, std::span<const estimate::FreeParameter> free,
                                                        const estimate::ModelValues& at) {
  return priors_from(v, free, at, false);
}

}  // namespace rotorloop::identify
