#include "bench/stand/evaluate/estimate/stand_estimate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "bench/stand/evaluate/estimate/credibility.hpp"
#include "bench/stand/evaluate/estimate/uncertainty_budget.hpp"
#include "host/base/constants.hpp"
#include "host/base/error.hpp"

namespace rotorloop::stand {
namespace {

constexpr std::size_t kLevelsForOffset = 5;  // fewer speeds cannot part an offset from the coefficient
constexpr double kLevelsApart = 0.03;        // of the speed
constexpr double kStillAir_m_s = 0.5;
constexpr double kMountFriction = 0.02;  // of the largest thrust, standard deviation between stands
constexpr double kOutlierWeight = 0.3;   // below: named as down-weighted

FitRows rows_for(const StandRun& run, bool thrust, double centre) {
  FitRows r;
  for (std::size_t k = 0; k < run.steps.size(); ++k)
    if (const StandStep& s = run.steps[k]; !std::isnan(thrust ? s.thrust_N : s.torque_N_m) && !(s.airspeed_m_s > kStillAir_m_s))
      r.step.push_back(k);
  const auto n = static_cast<Eigen::Index>(r.step.size());
  for (auto* v : {&r.y, &r.omega_rad_s, &r.t_s, &r.direction, &r.u}) v->resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const StandStep& s = run.steps[r.step[static_cast<std::size_t>(i)]];
    r.y(i) = thrust ? s.thrust_N : s.torque_N_m;
    r.u(i) = thrust ? s.thrust_u_N : s.torque_u_N_m;
    r.omega_rad_s(i) = s.omega_rad_s;
    r.direction(i) = s.direction;
    r.t_s(i) = s.t_s == s.t_s ? s.t_s : static_cast<double>(i);
    r.block.push_back(s.block);
  }
  // Where not all steps have an error of their own, none is used: a mixture would weigh by what was recorded.
  if (!(r.u.array() > 0.0).all()) r.u.setConstant(kNotMeasured);
  // Of the steps' relative speeds only what differs from step to step matters here; the common part is in the budget.
  r.u_omega = 2e-4;
  r.centre_rad_s = centre;
  // Of thrust a running offset is friction in the mount; torque has what bearings and wires add as well.
  if (thrust && n > 0) r.running_sd = kMountFriction * r.y.cwiseAbs().maxCoeff();
  return r;
}

std::size_t levels(const FitRows& r) {
  std::vector<double> w;
  for (Eigen::Index i = 0; i < r.omega_rad_s.size(); ++i)
    if (r.omega_rad_s(i) > 0.0) w.push_back(r.omega_rad_s(i));
  std::sort(w.begin(), w.end());
  std::size_t n = 0;
  double last = -1.0;
  for (const double v : w)
    if (v > last * (1.0 + kLevelsApart)) {
      ++n;
      last = v;
    }
  return n;
}

struct RunShape {
  std::size_t zeros = 0, zero_times = 0, levels = 0;
  bool up_and_down = false, timed = false;
};
RunShape shape_of(const StandRun& run, const FitRows& r) {
  RunShape s;
  s.levels = levels(r);
  bool before_was_zero = false;
  for (Eigen::Index i = 0; i < r.y.size(); ++i) {
    const bool zero = !(r.omega_rad_s(i) > 0.0);
    s.zeros += zero;
    s.zero_times += zero && !before_was_zero;
    before_was_zero = zero;
  }
  const auto up = (r.direction.array() > 0.5).count(), down = (r.direction.array() < -0.5).count();
  s.up_and_down = up >= 4 && down >= 4;
  s.timed = !run.steps.empty() && run.steps.front().t_s == run.steps.front().t_s;
  return s;
}

// What this run can show beside c.
FitLaw base_law(const RunShape& s, bool thrust) {
  FitLaw law;
  law.zero = s.zeros > 0;
  // Friction in the mount of a run that goes one way is a constant of the rows that turn, which zeros beside them show.
  const bool one_way = s.zeros > 0 && !s.up_and_down;
  law.running = s.levels >= kLevelsForOffset && (!thrust || one_way);
  law.drift = s.timed && (s.zero_times >= 2 || (s.up_and_down && s.zeros > 0));
  law.hysteresis = s.up_and_down;
  return law;
}

struct Laws {
  std::vector<FitLaw> all;
  std::size_t base = 0, exponent = 0, square = 0;  // indices; equal to base where they are the same
};
Laws laws_for(const RunShape& s, bool thrust) {
  Laws out;
  const FitLaw base = base_law(s, thrust);
  const auto add = [&](FitLaw law) {
    const auto found = std::find(out.all.begin(), out.all.end(), law);
    if (found != out.all.end()) return static_cast<std::size_t>(found - out.all.begin());
    out.all.push_back(law);
    return out.all.size() - 1;
  };
  out.base = add(base);
  out.square = add({});
  if (s.levels >= kLevelsForOffset) {
    FitLaw exponent = base;
    exponent.exponent = true;
    out.exponent = add(exponent);
    FitLaw other = base;
    other.running = !base.running;
    add(other);
    if (base.running) {
      other.exponent = true;
      add(other);
    }
    if (s.levels >= 8) {
      exponent.curved = true;
      add(exponent);
    }
  }
  return out;
}

void name_outliers(CoefficientEstimate& e, const std::string& unit) {
  for (Eigen::Index i = 0; i < e.fit.weight.size(); ++i)
    if (e.fit.weight(i) < kOutlierWeight)
      e.down_weighted.push_back(fmt::format("step {} at {:.0f} rad/s: {:+.3g} {} from the fit, weight {:.2f}", i + 1, e.rows.omega_rad_s(i),
                                            e.fit.residual(i), unit, e.fit.weight(i)));
}

// The law that the figures stand on: the base law, or with an exponent (curved, if that is better still) where c ω² loses. Beside a running
// offset the steps say little of the exponent, and c ω² takes the offset for whatever it lacks: there the widest law stands, held by the
// exponents' priors, so that u holds what is not known of the law.
std::size_t chosen_law(const Laws& laws, const std::vector<JointFit>& fits) {
  std::size_t chosen = laws.base;
  if (laws.all[laws.base].running) {
    for (std::size_t i = 0; i < fits.size(); ++i)
      if (fits[i].law.running && fits[i].terms.size() > fits[chosen].terms.size()) chosen = i;
    return chosen;
  }
  for (std::size_t i = 0; i < fits.size(); ++i) {
    FitLaw like_base = fits[i].law;
    like_base.exponent = like_base.curved = false;
    if (like_base == laws.all[laws.base] && fits[i].aicc < fits[chosen].aicc - kAicLoss) chosen = i;
  }
  return chosen;
}

CoefficientEstimate estimate_channel(const StandRun& run, bool thrust, double centre, const EstimateOptions& o) {
  CoefficientEstimate e;
  e.channel = thrust ? "thrust" : "torque";
  e.name = thrust ? "c_t" : "c_q";
  e.unit = thrust ? "N s^2" : "N m s^2";
  e.rows = rows_for(run, thrust, centre);
  const RunShape shape = shape_of(run, e.rows);
  const Laws laws = laws_for(shape, thrust);
  const std::vector<JointFit> fits = compare_laws(e.rows, laws.all);
  double best = std::numeric_limits<double>::infinity();
  for (const JointFit& f : fits) best = std::min(best, f.aicc);
  for (const JointFit& f : fits) e.laws.push_back({law_text(f.law, e.name), f.terms[0].value, f.value("exponent"), f.aicc - best, f.rms});
  const std::size_t chosen = chosen_law(laws, fits);
  e.square_fails = chosen != laws.base && fits[laws.base].aicc > fits[chosen].aicc + kAicLoss;
  e.proportional = fits[laws.square].terms[0].value;
  e.fit = fit_jointly(e.rows, laws.all[chosen]);
  e.value = e.fit.terms[0].value;
  e.model_based_u = e.fit.terms[0].u;
  for (const FittedTerm& t : e.fit.terms)
    if (t.name == "exponent") {
      e.exponent = 2.0 + t.value;
      e.exponent_u = t.u;
    }
  e.bootstrap = bootstrap_c(e.rows, e.fit, o.draws, o.seed);
  name_outliers(e, thrust ? "N" : "N m");
  return e;
}

// A channel's faults: those that a term of the fit allows for become remarks.
bool usable(const StandRun& run, bool thrust, std::vector<std::string>& remarks) {
  const StandChannelState state = thrust ? run.checked.thrust : run.checked.torque;
  if (state == StandChannelState::absent) return false;
  if (state == StandChannelState::good) return true;
  const std::string channel = thrust ? "thrust" : "torque";
  const bool zeros = std::any_of(run.steps.begin(), run.steps.end(), [](const StandStep& s) { return !(s.omega_rad_s > 0.0); });
  for (const StandFault& f : run.checked.faults) {
    if (f.channel != channel) continue;
    // A zero that the run itself measured is allowed for; torque has a running offset of its own.
    const double rest = run.checked.rest_thrust_N;
    const bool allowed = f.zero && (!thrust || (zeros && rest == rest && f.likely.find("contradict") == std::string::npos));
    if (!allowed) return false;
    remarks.push_back(fmt::format("{} {}; {}", channel, f.what,
                                  thrust ? "the zeros of the run take it up" : "the running offset of the fit takes it up"));
  }
  return true;
}

void derive(StandEstimate& e, const StandRun& run, const EstimateOptions& o) {
  const double rho = run.facts.air_density_kg_m3, D = run.facts.diameter_m, to_reference = o.reference_density_kg_m3 / rho;
  const double per_n2 = 4.0 * std::numbers::pi * std::numbers::pi;  // ω² = (2π n)²
  if (rho > 0.0) {
    if (e.thrust) e.reduced_c_t = e.thrust->value * to_reference;
    if (e.torque) e.reduced_c_q = e.torque->value * to_reference;
  }
  if (rho > 0.0 && D > 0.0) {
    if (e.thrust) e.C_T = e.thrust->value * per_n2 / (rho * std::pow(D, 4));
    if (e.torque) {
      e.C_Q = e.torque->value * per_n2 / (rho * std::pow(D, 5));
      e.C_P = 2.0 * std::numbers::pi * e.C_Q;
    }
    if (e.thrust && e.torque) {
      const double area = 0.25 * std::numbers::pi * D * D, c_t = e.thrust->value;
      e.figure_of_merit = c_t * std::sqrt(c_t / (2.0 * rho * area)) / e.torque->value;
    }
  }
  double nearest = 1e300;
  for (const StandStep& s : run.steps)
    if (const double away = std::abs(s.omega_rad_s - e.centre_rad_s);
        s.omega_rad_s > 0.0 && s.voltage_V * s.current_A > 0.0 && s.thrust_N > 0.0 && away < nearest) {
      nearest = away;
      e.grams_per_watt = 1000.0 * s.thrust_N / kGravity_m_s2 / (s.voltage_V * s.current_A);
    }
}

}  // namespace

std::array<double, 2> speeds_of(const StandRun& run) {
  std::array<double, 2> w{std::numeric_limits<double>::infinity(), 0.0};
  for (const StandStep& s : run.steps)
    if (s.omega_rad_s > 0.0) {
      w[0] = std::min(w[0], s.omega_rad_s);
      w[1] = std::max(w[1], s.omega_rad_s);
    }
  return w;
}

StandEstimate estimate_stand(const StandRun& run, const EstimateOptions& o) {
  StandEstimate e;
  e.name = run.name;
  e.facts = run.facts;
  e.remarks = run.remarks;
  e.samples = run.samples;
  for (const StandFault& f : run.checked.faults)
    e.faults.push_back(f.channel + " " + f.what + (f.likely.empty() ? "" : "; likely: " + f.likely));
  for (const StandStep& s : run.steps) s.omega_rad_s > 0.0 ? ++e.steps : ++e.zeros;
  if (run.checked.speed == StandChannelState::faulty) return e;
  if (e.steps == 0) {
    e.remarks.push_back(
        "no steady step in this run, so no coefficients and no J: they take the sequence staircase, shuffled or return-to-base");
    e.dynamics = run_dynamics(run, std::nullopt, 2.0, 0.0, 0.0);
    return e;
  }
  e.window_rad_s = o.window_rad_s.value_or(speeds_of(run));
  e.centre_rad_s = 0.5 * (e.window_rad_s[0] + e.window_rad_s[1]);
  const auto seen = speeds_of(run);
  if (e.centre_rad_s < seen[0] || e.centre_rad_s > seen[1])
    throw Error({run.name,
                 fmt::format("the window {:.0f} to {:.0f} rad/s has its middle outside the run's speeds, {:.0f} to {:.0f} rad/s",
                             e.window_rad_s[0], e.window_rad_s[1], seen[0], seen[1]),
                 "RPM given as rad/s, or another propeller", "give --rpm-window LOW,HIGH in RPM within the run"});
  for (const bool thrust : {true, false}) {
    if (!usable(run, thrust, e.remarks)) continue;
    const bool still = std::any_of(run.steps.begin(), run.steps.end(),
                                   [](const StandStep& s) { return s.omega_rad_s > 0.0 && !(s.airspeed_m_s > kStillAir_m_s); });
    if (!still) continue;  // in wind coefficients go with the advance ratio (advance_torque.hpp)
    try {
      CoefficientEstimate c = estimate_channel(run, thrust, e.centre_rad_s, o);
      (thrust ? e.thrust : e.torque) = std::move(c);
    } catch (const Error& error) {
      if (error.exit_code() != ExitCode::data_quality) throw;
      e.remarks.push_back(std::string(thrust ? "thrust: " : "torque: ") + error.text().what);
    }
  }
  if (e.thrust) add_budget(*e.thrust, run, nullptr);
  if (e.torque) add_budget(*e.torque, run, e.thrust ? &*e.thrust : nullptr);
  derive(e, run, o);
  e.points = operating_points(run, e.thrust ? &*e.thrust : nullptr, e.torque ? &*e.torque : nullptr);
  const double offset = e.torque ? e.torque->fit.value("zero") + e.torque->fit.value("running offset") : 0.0;
  e.motor = motor_constants(run, offset, o.inductance_H);
  e.dynamics = run_dynamics(run, e.torque ? std::optional(e.torque->value) : std::nullopt, e.torque ? e.torque->exponent : 2.0,
                            e.centre_rad_s, offset);
  if (e.dynamics)
    for (const std::string& why : {e.dynamics->no_inertia, e.dynamics->no_lag})
      if (!why.empty()) e.remarks.push_back(why);
  refuse_incredible(e, run, o.accepted);
  return e;
}

}  // namespace rotorloop::stand
