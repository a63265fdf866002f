#include "bench/stand/evaluate/stand_diagnosis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>
#include <numbers>
#include <optional>

#include "bench/stand/evaluate/stand_comparison.hpp"
#include "host/base/symmetric_matrix.hpp"
#include "host/vehicle/effect_catalogue.hpp"

namespace rotorloop::stand {
namespace {

using host::effect;

constexpr double kRunGap_s = 3.0;         // a longer pause in speed at rest begins another run
constexpr double kRunGap_m_s = 1.0;       // so does another airspeed
constexpr double kBlock_s = 5.0;          // of a run: longer than the slowest thing on a stand, the motor's warming aside
constexpr double kLeastFallOfRms = 0.02;  // least fall of held-out rms, at 95 %, from one candidate to another that is better
constexpr int kParts = 5;                 // of a file of steady points, to be left out in turn
constexpr double kStillAir_m_s = 0.5;     // the air in a room with a propeller in it

struct ChannelData {
  Eigen::VectorXd y, w2, omega_rad_s, J, t_s;
  std::vector<int> block, run;
};

ChannelData channel_data(const StandRecord& r, double StandPoint::*value) {
  std::vector<const StandPoint*> use;
  for (const auto& p : r.points)
    if (p.*value == p.*value && sum_omega_squared(r, p) > 0.0) use.push_back(&p);
  const auto n = static_cast<Eigen::Index>(use.size());
  ChannelData d{Eigen::VectorXd(n), Eigen::VectorXd(n), Eigen::VectorXd(n), Eigen::VectorXd::Zero(n), Eigen::VectorXd(n), {}, {}};
  int run = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const StandPoint& p = *use[static_cast<std::size_t>(i)];
    d.y(i) = p.*value;
    d.w2(i) = sum_omega_squared(r, p);
    d.omega_rad_s(i) = std::sqrt(d.w2(i) / static_cast<double>(r.rotors));
    if (p.airspeed_m_s > kStillAir_m_s && r.diameter_m > 0.0)
      d.J(i) = p.airspeed_m_s / (d.omega_rad_s(i) / (2.0 * std::numbers::pi) * r.diameter_m);
    d.t_s(i) = p.t_s == p.t_s ? p.t_s : static_cast<double>(p.row);
    // Another airspeed is another run: an effect of the air must predict the speed that it was not fitted to.
    if (i > 0 && std::abs(p.airspeed_m_s - use[static_cast<std::size_t>(i - 1)]->airspeed_m_s) > kRunGap_m_s) ++run;
    d.run.push_back(run);
    d.block.push_back(r.means ? run * 10000 + static_cast<int>((d.t_s(i) - d.t_s(0)) / kBlock_s) : static_cast<int>(i));
  }
  // One sweep has no runs: its points are dealt out in turn, so that each part spans the speeds.
  if (run < 1)
    for (std::size_t i = 0; i < d.run.size(); ++i) d.run[i] = (r.means ? d.block[i] : static_cast<int>(i)) % kParts;
  return d;
}

struct CandidateTerm {
  std::string id, law, unit;
  std::vector<std::string> parameters;
  std::function<Eigen::MatrixXd(const ChannelData&)> columns;
  bool of_the_rotor = true;  // else it may describe best, but is never named as an effect
};

std::vector<CandidateTerm> terms_for(bool thrust, const ChannelData& d) {
  std::vector<CandidateTerm> out;
  const double middle = d.omega_rad_s.mean();
  const std::string c = thrust ? "N s^2" : "N m s^2";
  if (d.J.maxCoeff() > 0.0 && d.J.maxCoeff() - d.J.minCoeff() > 0.05)
    for (const bool both : {false, true})
      out.push_back({thrust ? effect("axial_inflow").id : effect("torque_advance").id,
                     both ? "ω² (a J + b J²), J = V / (n D)" : "b ω² J², J = V / (n D)", c,
                     both ? std::vector<std::string>{"a", "b"} : std::vector<std::string>{"b"},
                     [both](const ChannelData& x) {
                       Eigen::MatrixXd m(x.y.size(), both ? 2 : 1);
                       m.rightCols(1) = x.w2.cwiseProduct(x.J).cwiseProduct(x.J);
                       if (both) m.col(0) = x.w2.cwiseProduct(x.J);
                       return m;
                     },
                     true});
  out.push_back({thrust ? effect("thrust_speed_exponent").id : effect("torque_speed_exponent").id,
                 fmt::format("a ω² log(ω / {:.0f} rad/s): exponent a / c", middle),
                 c,
                 {"a"},
                 [middle](const ChannelData& x) -> Eigen::MatrixXd { return x.w2.array() * (x.omega_rad_s.array() / middle).log(); },
                 true});
  out.push_back({"constant",
                 "a constant a: a wrong zero",
                 thrust ? "N" : "N m",
                 {"a"},
                 [](const ChannelData& x) -> Eigen::MatrixXd { return Eigen::VectorXd::Ones(x.y.size()); },
                 false});
  out.push_back({"drift",
                 "a ω² (t - middle): a gain that drifts",
                 c + "/s",
                 {"a"},
                 [](const ChannelData& x) -> Eigen::MatrixXd { return x.w2.array() * (x.t_s.array() - x.t_s.mean()); },
                 false});
  return out;
}

// z of several coefficients together: the square root of their Wald statistic over its degrees of freedom.
double joint_z(const BlockFit& f, Eigen::Index d) {
  const Eigen::Index n = f.c.size();
  Eigen::MatrixXd V = f.covariance.bottomRightCorner(d, d);
  for (Eigen::Index i = 0; i < d; ++i) V(i, i) = std::max(V(i, i), f.u(n - d + i) * f.u(n - d + i));
  const Eigen::VectorXd scale = V.diagonal().cwiseSqrt();
  const Eigen::MatrixXd unit = scale.cwiseInverse().asDiagonal() * V * scale.cwiseInverse().asDiagonal();
  const Eigen::VectorXd c = f.c.tail(d).cwiseQuotient(scale);
  return std::sqrt(std::max(0.0, c.dot(LdltFactor(unit).solve(c)) / static_cast<double>(d)));
}

// The best for held-out runs is named, unless another kind of thing does about as well.
void decide(StandChannelFit& f, const std::vector<Eigen::VectorXd>& held_out, const std::vector<int>& block, std::uint64_t seed) {
  if (f.candidates.empty() || !f.candidates.front().ruled_out_by.empty()) return;
  f.best = 0;
  const StandCandidate& best = f.candidates.front();
  for (std::size_t k = 1; k < f.candidates.size(); ++k) {
    StandCandidate& c = f.candidates[k];
    if (!c.ruled_out_by.empty()) continue;
    if (c.id == best.id)
      c.ruled_out_by = "the same effect with fewer terms serves held-out runs better";
    else if (rms_reduction(held_out[k], held_out[0], block, seed).low <= kLeastFallOfRms)
      f.aliases.push_back(c.id);
    else
      c.ruled_out_by =
          fmt::format("{} serves held-out runs better: {:.3g} against {:.3g} {}", best.id, best.held_out_rms, c.held_out_rms, f.unit);
  }
  f.verdict = !f.aliases.empty()  ? diagnose::DiagnosisVerdict::ambiguous
              : best.of_the_rotor ? diagnose::DiagnosisVerdict::named
                                  : diagnose::DiagnosisVerdict::unexplained;
}

// Without any one of its runs a channel has two points or more: what is held out can be predicted from the rest.
bool can_hold_out(const ChannelData& d) {
  std::map<int, Eigen::Index> points;
  for (const int run : d.run) ++points[run];
  return !points.empty() && std::all_of(points.begin(), points.end(), [&](const auto& run) { return d.y.size() - run.second >= 2; });
}

// Nothing where no run can be held out.
std::optional<StandChannelFit> fit_channel(const StandRecord& r, bool thrust, const StandDiagnosisOptions& o) {
  const ChannelData d = channel_data(r, thrust ? &StandPoint::thrust_N : &StandPoint::torque_N_m);
  if (!can_hold_out(d)) return std::nullopt;
  StandChannelFit f;
  f.channel = thrust ? "thrust" : "torque";
  f.unit = thrust ? "N" : "N m";
  const BlockFit plain = fit_in_blocks(d.w2, d.y, d.block);
  f.coefficient = {thrust ? "c_t" : "c_q", thrust ? "N s^2" : "N m s^2", plain.c(0), plain.u(0)};
  f.rms = plain.rms;
  f.r2 = plain.r2;
  f.largest = d.y.cwiseAbs().maxCoeff();
  f.points = d.block.size();
  f.runs = static_cast<std::size_t>(*std::max_element(d.run.begin(), d.run.end()) + 1);
  const Eigen::VectorXd held_out_plain = left_out_errors(d.w2, d.y, d.run);
  std::vector<BlockFit> fits;
  std::vector<Eigen::VectorXd> errors;
  for (const auto& term : terms_for(thrust, d)) {
    const Eigen::MatrixXd extra = term.columns(d);
    if (d.y.size() < 2 * (extra.cols() + 2)) continue;
    Eigen::MatrixXd X(d.y.size(), 1 + extra.cols());
    X << d.w2, extra;
    const BlockFit with = fit_in_blocks(X, d.y, d.block);
    StandCandidate c;
    c.id = term.id;
    c.law = term.law;
    for (Eigen::Index k = 0; k < extra.cols(); ++k)
      c.parameters.push_back({term.parameters[static_cast<std::size_t>(k)], term.unit, with.c(1 + k), with.u(1 + k)});
    c.z = joint_z(with, extra.cols());
    c.rms = with.rms;
    const Eigen::VectorXd held_out = left_out_errors(X, d.y, d.run);
    c.held_out_rms_before = rms_of(held_out_plain);
    c.held_out_rms = rms_of(held_out);
    c.held_out_fall = rms_reduction(held_out_plain, held_out, d.block, o.seed);
    c.of_the_rotor = term.of_the_rotor;
    if (c.z < o.least_z)
      c.ruled_out_by = fmt::format("{:.1f} standard errors from none, {:.1f} asked", c.z, o.least_z);
    else if (c.held_out_fall.value < o.least_fall || c.held_out_fall.low <= 0.0)
      c.ruled_out_by = fmt::format("held-out runs gain {:.1f} % (95 %: {:.1f} to {:.1f})", 100.0 * c.held_out_fall.value,
                                   100.0 * c.held_out_fall.low, 100.0 * c.held_out_fall.high);
    f.candidates.push_back(std::move(c));
    fits.push_back(with);
    errors.push_back(held_out);
  }
  std::vector<std::size_t> order(fits.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const auto &x = f.candidates[a], &y = f.candidates[b];
    return x.ruled_out_by.empty() != y.ruled_out_by.empty() ? x.ruled_out_by.empty() : x.held_out_rms < y.held_out_rms;
  });
  std::vector<StandCandidate> sorted;
  for (const auto i : order) sorted.push_back(f.candidates[i]);
  f.candidates = std::move(sorted);
  std::vector<Eigen::VectorXd> errors_sorted;
  for (const auto i : order) errors_sorted.push_back(errors[i]);
  decide(f, errors_sorted, d.block, o.seed);
  if (f.best) f.with_best = fits[order[*f.best]];
  return f;
}

// Speed and current per volt at the largest command, where the controller connects the motor to the supply throughout.
void take_full_command(StandFileDiagnosis& d, const StandRecord& r) {
  const StandPoint* top = nullptr;
  for (const auto& p : r.points)
    if (p.command == p.command && p.voltage_V > 0.0 && p.current_A == p.current_A && (!top || p.command > top->command)) top = &p;
  if (!top || r.rotors != 1) return;
  d.full_speed_per_volt = top->omega_rad_s[0] / top->voltage_V;
  d.full_current_per_volt = top->current_A / top->voltage_V;
}

}  // namespace

StandFileDiagnosis diagnose_stand(StandRecord record, const StandDiagnosisOptions& o) {
  CheckedStand s = check_stand(std::move(record));
  StandFileDiagnosis d;
  d.name = s.record.name;
  d.motor = s.record.motor;
  d.propeller = s.record.propeller;
  d.faults = s.faults;
  d.notes = s.record.notes;
  d.notes.insert(d.notes.end(), s.notes.begin(), s.notes.end());
  take_full_command(d, s.record);
  if (s.speed == StandChannelState::good) {
    const auto fit = [&](bool thrust) {
      if (auto f = fit_channel(s.record, thrust, o))
        d.channels.push_back(std::move(*f));
      else
        d.notes.push_back(fmt::format("{}: too few points to hold some of them out: not diagnosed", thrust ? "thrust" : "torque"));
    };
    if (s.thrust == StandChannelState::good) fit(true);
    if (s.torque == StandChannelState::good) fit(false);
  }
  const bool any = s.thrust == StandChannelState::good || s.torque == StandChannelState::good;
  if (d.channels.empty() && d.faults.empty() && !any) d.notes.push_back("neither thrust nor torque in this file: nothing to diagnose");
  for (const auto& c : d.channels)
    d.verdict = std::max(d.verdict, c.verdict);  // in the order of DiagnosisVerdict: a class says less than a name
  if (!d.faults.empty()) d.verdict = diagnose::DiagnosisVerdict::faulty;
  return d;
}

StandDiagnosis diagnose_stands(const std::vector<std::filesystem::path>& files, const StandMapping& mapping,
                               const StandDiagnosisOptions& o) {
  StandDiagnosis all;
  for (const auto& f : files) all.files.push_back(diagnose_stand(read_stand_file(f, mapping), o));
  compare_stands(all);
  return all;
}

}  // namespace rotorloop::stand
