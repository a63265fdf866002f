#include "bench/sysid/identify/stages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "bench/sysid/estimate/newton_step.hpp"
#include "bench/sysid/identify/parameter_choice.hpp"
#include "host/base/error.hpp"

namespace rotorloop::identify {
namespace {

constexpr double kHeldPrior = 1e-7;  // of a parameter's scale: held, but its cross-information is in the answer
constexpr int kNoiseRounds = 4;      // a stage gives start values; the joint fit settles the noise
constexpr double kAgreement = 3.0;   // standard deviations; 1 in 370 parameters beyond it by chance

bool is_sensor(int p) {
  return (p >= estimate::kOffsetX && p <= estimate::kPoseDelay) || (p >= estimate::kGyroBiasX && p <= estimate::kImuZ);
}
// Lever arms and the time between attitude and rotor speeds show in turns only.
bool needs_turns(int p) {
  return (p >= estimate::kOffsetX && p <= estimate::kOffsetZ) || p == estimate::kPoseDelay ||
         (p >= estimate::kImuX && p <= estimate::kImuZ);
}
bool is_com(int p) { return p == estimate::kComX || p == estimate::kComY; }

// Uncertainty of what the stage holds goes into what it estimates. With S the information of the flights and C the prior covariance of the
// held parameters h: a = â + K (h - ĥ), K = -S_aa⁻¹ S_ah, hence C_aa = S_aa⁻¹ + K C_hh Kᵀ, C_ah = K C_hh.
void carry_held(const Eigen::MatrixXd& s_aa_inverse, const Eigen::MatrixXd& s_ah, const std::vector<Eigen::Index>& active,
                const std::vector<Eigen::Index>& held, Eigen::MatrixXd& covariance) {
  const Eigen::MatrixXd gain = -s_aa_inverse * s_ah;
  const Eigen::MatrixXd c_hh = covariance(held, held);
  const Eigen::MatrixXd cross = gain * c_hh;
  covariance(active, active) = s_aa_inverse + cross * gain.transpose();
  covariance(active, held) = cross;
  covariance(held, active) = cross.transpose();
}

}  // namespace

Solver own_solver() {
  return [](const estimate::FitProblem& p, const estimate::FitOptions& o,
            const std::function<void(const estimate::FitProgress&)>& progress) { return estimate::fit(p, o, progress); };
}

std::string_view name(FlightRole role) {
  switch (role) {
    case FlightRole::vertical:
      return "vertical";
    case FlightRole::horizontal:
      return "horizontal";
    case FlightRole::rotation:
      return "rotation";
    case FlightRole::any:
      break;
  }
  return "flight";
}

std::vector<int> stage_parameters(FlightRole role, const std::vector<estimate::FreeParameter>& all) {
  const auto wanted = [&](int p) {
    const bool thrust = p == estimate::kK1 || p == estimate::kK2 || (p >= estimate::kCommandGain && p < estimate::kCoreParameters);
    const bool inertia = (p >= estimate::kIxx && p <= estimate::kCq) || p == estimate::kRotorDelay || p >= estimate::kCoreParameters;
    switch (role) {
      case FlightRole::vertical:
        return is_com(p) || (is_sensor(p) && !needs_turns(p)) || p == estimate::kTiltX || p == estimate::kTiltY || thrust;
      case FlightRole::horizontal:
        return is_com(p) || (p >= estimate::kCdh && p <= estimate::kCdz);
      case FlightRole::rotation:
        return is_com(p) || is_sensor(p) || inertia;
      case FlightRole::any:
        break;
    }
    return false;
  };
  std::vector<int> out;
  for (const estimate::FreeParameter& f : all) {
    if (wanted(f.parameter)) out.push_back(f.parameter);
  }
  return out;
}

Knowledge first_knowledge(const std::vector<estimate::FreeParameter>& free, const host::VehicleFile& vehicle,
                          const estimate::ModelValues& values) {
  Knowledge b;
  const auto n = static_cast<Eigen::Index>(free.size());
  b.covariance = Eigen::MatrixXd::Zero(n, n);
  b.estimated.assign(free.size(), false);
  for (Eigen::Index i = 0; i < n; ++i) {
    const estimate::FreeParameter& f = free[static_cast<std::size_t>(i)];
    b.parameters.push_back(f.parameter);
    double u = f.prior_u > 0.0 ? f.prior_u : prior_u_of(vehicle, f.parameter, values.terms);
    if (u <= 0.0) u = std::max(std::fabs(values[f.parameter]), estimate::parameter_info(f.parameter, values.terms).scale);
    b.covariance(i, i) = u * u;
  }
  return b;
}

StageResult run_stage(FlightRole role, const std::vector<const estimate::GridFlight*>& flights,
                      const std::vector<estimate::FreeParameter>& free, const std::vector<estimate::JointPrior>& priors,
                      estimate::ModelValues& values, Knowledge& known, estimate::NoiseModel& noise, const estimate::FitOptions& options,
                      const Solver& solver, const std::function<void(const estimate::FitProgress&)>& progress) {
  const std::vector<int> freed = stage_parameters(role, free);
  const std::set<int> is_freed(freed.begin(), freed.end());
  estimate::FitOptions of_stage = options;
  of_stage.innovations = false;
  of_stage.noise.rounds = std::min(options.noise.rounds, kNoiseRounds);
  StageResult out{.role = role, .flights = {}, .estimates = {}, .u_alone = {}, .fit = {}};
  if (freed.empty()) return out;
  // Sensor placement and delays are refined from stage to stage; the centre of mass may have moved, it starts afresh.
  estimate::FitProblem problem{.start = values, .free = {}, .flights = flights, .noise = noise, .flight_noise = {}, .flight_start = {}};
  std::vector<Eigen::Index> active, held;  // into the covariance carried
  for (std::size_t i = 0; i < known.parameters.size(); ++i) {
    const int p = known.parameters[i];
    const auto at = static_cast<Eigen::Index>(i);
    const double u = std::sqrt(known.covariance(at, at));
    const bool act = is_freed.contains(p);
    (act ? active : held).push_back(at);
    problem.free.push_back({p, false, !act ? kHeldPrior * estimate::parameter_info(p, values.terms).scale : is_sensor(p) ? u : 0.0});
  }
  for (const estimate::JointPrior& prior : priors) {
    const bool of_stage_only = prior.weak && prior.parameters.size() == 1 && is_freed.contains(prior.parameters.front());
    if (of_stage_only && !is_sensor(prior.parameters.front())) problem.priors.push_back(prior);
  }
  try {
    out.fit = solver(problem, of_stage, progress);
  } catch (const Error& e) {
    ErrorText text = e.text();
    text.what = fmt::format("stage {}: {}", name(role), text.what);
    throw Error(text, e.exit_code());
  }

  Eigen::MatrixXd s_aa = out.fit.information(active, active);
  for (std::size_t i = 0; i < active.size(); ++i) {
    const double prior_u = problem.free[static_cast<std::size_t>(active[i])].prior_u;
    const auto at = static_cast<Eigen::Index>(i);
    if (prior_u > 0.0) s_aa(at, at) += 1.0 / (prior_u * prior_u);
    for (const estimate::JointPrior& prior : problem.priors) {
      if (prior.parameters.front() == problem.free[static_cast<std::size_t>(active[i])].parameter) s_aa(at, at) += prior.information(0, 0);
    }
  }
  const Eigen::MatrixXd alone = estimate::inverse_scaled(s_aa);
  carry_held(alone, out.fit.information(active, held), active, held, known.covariance);
  for (std::size_t i = 0; i < active.size(); ++i) {
    const auto k = static_cast<std::size_t>(active[i]);
    estimate::Estimate e = out.fit.estimates[k];
    const double own = std::sqrt(alone(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(i)));
    out.u_alone.push_back(std::max(own, e.u_robust));
    e.u = std::sqrt(known.covariance(active[i], active[i]));
    e.u_robust = std::sqrt(std::max(e.u * e.u + e.u_robust * e.u_robust - own * own, 0.0));
    values[e.parameter] = e.value;
    known.estimated[k] = true;
    out.estimates.push_back(e);
  }
  if (!out.fit.noise.empty()) noise = out.fit.noise.front();
  return out;
}

std::vector<StageComparison> compare_stages(const std::vector<StageResult>& stages, const estimate::Fit& joint) {
  std::vector<StageComparison> out;
  for (const StageResult& s : stages) {
    for (const estimate::Estimate& e : s.estimates) {
      const int flight = s.flights.empty() ? -1 : static_cast<int>(s.flights.front());
      const estimate::Estimate* j = joint.find(e.parameter, flight);
      if (!j) continue;
      StageComparison c{s.role, e.parameter, e.value, std::max(e.u, e.u_robust), j->value, std::max(j->u, j->u_robust), 0.0, true};
      // By the stage's own uncertainty: could its flight have had the joint value? Where model error makes the joint fit the less certain
      // one, a larger u would hide just that.
      c.z = c.u_stage > 0.0 ? (c.stage - c.joint) / c.u_stage : 0.0;
      c.agrees = std::fabs(c.z) <= kAgreement;
      out.push_back(c);
    }
  }
  return out;
}

}  // namespace rotorloop::identify
