#include "bench/studies/hover_diagnosis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "bench/studies/hover_patterns.hpp"
#include "host/base/error.hpp"
#include "host/base/statistics.hpp"
#include "host/base/symmetric_matrix.hpp"
#include "host/vehicle/effect_catalogue.hpp"

namespace rotorloop::studies {
namespace {

using diagnose::DiagnosisVerdict;

constexpr double kTests = 5.0;            // four rotors and their mean: the chance of an alarm is shared between them
constexpr double kSaturatedHover = 0.05;  // share of the hover
constexpr double kMajority = 0.5;        // of the squared change: the rest is what one rotor's defect does to the others, or something else
constexpr double kBlindReference = 0.5;  // a rise of that size would saturate most rotors: nothing is seen before it

std::string joined_ids(const HoverHypothesis& h) { return fmt::format("{}", fmt::join(h.ids, " + ")); }

HoverHypothesis fitted(const HoverPattern& p, const Eigen::Vector4d& change, const HoverReference& r) {
  const Eigen::MatrixXd A = r.u.cwiseInverse().asDiagonal() * p.change;
  const Eigen::Vector4d y = change.cwiseQuotient(r.u);
  const LdltFactor normal(A.transpose() * A);
  const Eigen::VectorXd c = normal.solve(Eigen::VectorXd(A.transpose() * y));
  const Eigen::MatrixXd inverse = normal.inverse();
  HoverHypothesis h;
  h.ids = p.ids;
  h.rotor = p.rotor;
  h.degrees = static_cast<int>(A.cols());
  for (Eigen::Index k = 0; k < c.size(); ++k) {
    const auto& [name, unit] = p.unknowns[static_cast<std::size_t>(k)];
    h.parameters.push_back({name, unit, c(k), std::sqrt(inverse(k, k))});
  }
  const double left = 4.0 - static_cast<double>(A.cols());
  h.misfit = (y - A * c).squaredNorm() / left;
  h.ruled_out_by = p.outside(c);
  if (const double chance = f_tail(h.misfit, left, r.degrees); h.ruled_out_by.empty() && chance < kHoverChance)
    h.ruled_out_by = fmt::format("it leaves {:.1f} times the scatter of the reference (chance {:.1g})", h.misfit, chance);
  return h;
}

double apart(const HoverDiagnosis& d, std::size_t a, std::size_t b) { return (d.change[a] - d.change[b]) / std::hypot(d.u[a], d.u[b]); }

// Every defect of the catalogue raises a demand by at least as much as it lowers another. A flight that falls by more than it rises was
// not flown with the rotors and the weight of the reference.
void refuse_other_vehicle(HoverDiagnosis& d, double limit) {
  const auto lowest = static_cast<std::size_t>(std::min_element(d.change.begin(), d.change.end()) - d.change.begin());
  const auto highest = static_cast<std::size_t>(std::max_element(d.change.begin(), d.change.end()) - d.change.begin());
  const double rise = std::max(0.0, d.change[highest]), fall = -d.change[lowest];
  if (fall < limit * d.u[lowest] || fall - rise < limit * std::hypot(d.u[lowest], d.u[highest])) return;
  d.refused = fmt::format(
      "rotor {} is asked for {:.1f} % less than in the reference and no rotor for more than {:.1f} % more; a defect raises a demand at "
      "least "
      "as much as it lowers another: the reference is of another vehicle or state",
      lowest + 1, 100.0 * fall, 100.0 * rise);
  d.verdict = DiagnosisVerdict::faulty;
}

// A load that swings beside the centre turns the vehicle about z, more than it pulls it about or down. Noise, a poor controller and a
// rotor at its limit show in height and tilt first.
bool yaw_swings(HoverDiagnosis& d, const HoverReference& r) {
  const bool saturated = d.share.saturated > kSaturatedHover;
  if (saturated)
    d.remarks.push_back(
        fmt::format("a rotor is at full command in {:.0f} % of the hover: forces do not balance there, and sizes are lower bounds",
                    100.0 * d.share.saturated));
  const auto& s = d.share.sway;
  if (r.sway_degrees <= 0.0 || *std::min_element(s.begin(), s.end()) <= 0.0) {
    d.remarks.push_back(fmt::format("no stretch of hover lasts {:.0f} s: whether a load swings was not looked at", 1.0 / kSwayLow_Hz));
    return false;
  }
  const Eigen::Vector4d rise = Eigen::Vector4d(s.data()).array().log().matrix() - r.log_sway;
  const double limit = student_limit(kHoverChance, r.sway_degrees) * r.u_sway;
  d.remarks.push_back(fmt::format(
      "demand sways between {} and {} Hz: yaw {:.1f} times as in the reference, roll {:.1f}, pitch {:.1f}, total {:.1f} (a load that "
      "swings: yaw most, and at least {:.1f})",
      kSwayLow_Hz, kSwayHigh_Hz, std::exp(rise(kYawDemand)), std::exp(rise(kRollDemand)), std::exp(rise(kPitchDemand)),
      std::exp(rise(kTotalDemand)), std::exp(limit)));
  return !saturated && rise(kYawDemand) > limit && rise(kYawDemand) >= rise.maxCoeff();
}

// Kinds at the one rotor whose demand stands out. Less thrust at the same command is all that the commands show: of a propeller, of a
// motor, or of what hangs or sticks near that rotor, which in measured flights takes thrust and torque of it alike and weighs little
// beside. Only a load that shows as a load, on the neighbours too, leaves out propeller and motor.
void name_at_rotor(HoverDiagnosis& d, int rotor) {
  bool weak = false, load = false, any = false;
  for (const auto& h : d.hypotheses) {
    if (h.rotor != rotor || !h.ruled_out_by.empty()) continue;
    any = true;
    if (h.degrees > 1) continue;
    (h.ids.front() == load_at_rotor_id(rotor) ? load : weak) = true;
  }
  if (load && !weak) {
    d.named = {load_at_rotor_id(rotor), blocked_wake_id(rotor)};
    d.remarks.push_back("to distinguish them: weigh the vehicle; a rotor that loses thrust and keeps its torque needs the same commands");
    return;
  }
  d.named = {weak_rotor_id(rotor), weak_motor_id(rotor), load_at_rotor_id(rotor)};
  d.remarks.push_back(
      "to distinguish them: look for what hangs or sticks at that rotor and weigh the vehicle; change the propeller, then the motor; or "
      "log "
      "rotor speed, which a bad propeller raises and a bad motor does not");
  if (!any)
    d.remarks.push_back("no defect of that rotor alone explains the change of the others: something else changed since the reference");
}

// The fewest unknowns that explain the change and are not of one rotor alone; all that do with as many are a class. Two rotors that are
// asked for more are suspects whatever else explains it with less.
void name_over_rotors(HoverDiagnosis& d) {
  int fewest = 0;
  for (const auto& h : d.hypotheses) {
    if (!h.ruled_out_by.empty() || h.rotor != 0 || (fewest > 0 && h.degrees > fewest)) continue;
    fewest = h.degrees;
    d.named.push_back(joined_ids(h));
  }
  if (d.rotors.size() != 2) return;
  const auto [a, b] = std::minmax(d.rotors[0], d.rotors[1]);
  const std::vector<std::string> pair{weak_rotor_id(a), weak_rotor_id(b)};
  for (const auto& h : d.hypotheses)
    if (h.ids == pair && h.ruled_out_by.empty() && std::find(d.named.begin(), d.named.end(), joined_ids(h)) == d.named.end())
      d.named.push_back(joined_ids(h));
}

void find_rotors(HoverDiagnosis& d, double single_limit) {
  std::array<std::size_t, 4> order{0, 1, 2, 3};
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return d.change[a] > d.change[b]; });
  for (const std::size_t k : order)
    if (d.change[k] > d.seen_from[k] && apart(d, order[0], k) <= single_limit) d.rotors.push_back(static_cast<int>(k) + 1);
  if (d.rotors.size() == 1) d.rotor = d.rotors.front();
}

}  // namespace

HoverDiagnosis judge_hover(const HoverShare& flight, const HoverReference& r, const host::VehicleModel& vehicle) {
  HoverDiagnosis d;
  d.share = flight;
  const Eigen::Vector4d change = Eigen::Vector4d(flight.demand.data()).cwiseQuotient(r.demand) - Eigen::Vector4d::Ones();
  const double limit = student_limit(kHoverChance / kTests, r.degrees), single_limit = student_limit(kHoverChance, r.degrees);
  for (std::size_t i = 0; i < 4; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    d.change[i] = change(k);
    d.u[i] = r.u(k);
    d.seen_from[i] = limit * r.u(k);
  }
  if (*std::max_element(d.seen_from.begin(), d.seen_from.end()) > kBlindReference)
    d.remarks.push_back("the reference flights scatter so much that hardly any defect would be seen: give more of them");
  refuse_other_vehicle(d, limit);
  if (!d.refused.empty()) return d;
  for (const auto& p : hover_patterns(vehicle)) d.hypotheses.push_back(fitted(p, change, r));
  std::stable_sort(d.hypotheses.begin(), d.hypotheses.end(),
                   [](const auto& a, const auto& b) { return a.degrees != b.degrees ? a.degrees < b.degrees : a.misfit < b.misfit; });
  find_rotors(d, single_limit);
  // The mean of four is no better known than one of them: what differs between flights, battery and air, is common to the rotors.
  const double total = change.mean() / r.u.mean();
  const bool swings = yaw_swings(d, r);
  if (d.rotors.empty() && total <= limit) return d;
  if (swings && total > single_limit) {
    d.named.push_back(host::effect("slung_load").id);
    d.remarks.push_back(fmt::format("demand rises by {:.1f} ± {:.1f} % in total", 100.0 * change.mean(), 100.0 * r.u.mean()));
  } else if (d.rotor && std::pow(d.change[static_cast<std::size_t>(*d.rotor - 1)], 2) > kMajority * change.squaredNorm()) {
    name_at_rotor(d, *d.rotor);
  } else {
    name_over_rotors(d);
  }
  d.verdict = d.named.empty() ? DiagnosisVerdict::unexplained : d.named.size() == 1 ? DiagnosisVerdict::named : DiagnosisVerdict::ambiguous;
  return d;
}

HoverDiagnosis diagnose_hover(const log::FlightRecord& flight, const std::vector<log::FlightRecord>& reference,
                              const host::VehicleModel& vehicle) {
  const CommandMeaning meaning = command_meaning(reference);
  std::vector<HoverShare> base;
  for (const auto& f : reference)
    if (auto s = hover_share(f, meaning)) base.push_back(*s);
  const auto own = hover_share(flight, meaning);
  if (base.size() < 2 || !own)
    throw Error(
        {flight.name,
         fmt::format("{} reference flights with 2 s of hover, at least 2 needed{}", base.size(), own ? "" : "; the flight itself has none"),
         "logs without motor commands, height or hover",
         "give flights of the same vehicle without the defect, each with some seconds of hover"},
        ExitCode::data_quality);
  HoverDiagnosis d = judge_hover(*own, hover_reference(base), vehicle);
  d.remarks.insert(d.remarks.begin(), meaning == CommandMeaning::thrust
                                          ? "commands ask for thrust: the reference flights' total does not go with the battery"
                                          : "commands are shares of the battery voltage");
  return d;
}

std::string hover_text(const HoverDiagnosis& d) {
  const auto percent = [](const std::array<double, 4>& v, const char* form) {
    std::string s;
    for (const double x : v) s += fmt::format(fmt::runtime(form), 100.0 * x);
    return s;
  };
  std::string s =
      fmt::format("{}: {}{}\n  demand of rotors 1 to 4 changes by{} %, u{} %, a defect from{} %, battery {:.2f} V, {} samples\n",
                  d.share.flight, d.refused.empty() ? std::string(name(d.verdict)) : "not judged, " + d.refused,
                  d.named.empty() ? "" : fmt::format(": {}", fmt::join(d.named, " | ")), percent(d.change, " {:+.1f}"),
                  percent(d.u, " {:.1f}"), percent(d.seen_from, " {:.1f}"), d.share.battery_V, d.share.samples);
  if (d.rotor) s += fmt::format("  rotor {} is asked for most\n", *d.rotor);
  if (d.rotors.size() > 1) s += fmt::format("  rotors {} are asked for more, alike\n", fmt::join(d.rotors, ", "));
  for (const auto& r : d.remarks) s += "  " + r + "\n";
  for (const auto& h : d.hypotheses) {
    s += fmt::format("    {:<32} misfit {:7.1f}", joined_ids(h), h.misfit);
    for (const auto& p : h.parameters) s += fmt::format(", {} {:+.3f} ± {:.3f} {}", p.name, p.value, p.u, p.unit);
    s += (h.ruled_out_by.empty() ? "" : "; " + h.ruled_out_by) + "\n";
  }
  return s;
}

}  // namespace rotorloop::studies
