#include "bench/studies/hover_reference.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/base/error.hpp"
#include "host/base/statistics.hpp"

namespace rotorloop::studies {
namespace {

// Two flights may agree by chance, never for a reason: brushed windings change by 0.4 % of their resistance a kelvin, and air by 0.3 % of
// its density, so that a few kelvin between two flights move a rotor's demand by this much, relative.
constexpr double kLeastScatter = 0.005;
constexpr double kUnequal = 0.05;  // chance of calling equal scatters unequal (Cochran)

Eigen::Vector4d relative(const HoverShare& f, const Eigen::Vector4d& demand) {
  return Eigen::Vector4d(f.demand.data()).cwiseQuotient(demand) - Eigen::Vector4d::Ones();
}

// Cochran's test of whether the largest of four variances may be pooled with the others.
bool alike(const Eigen::Vector4d& variance, double degrees) {
  const double rest = variance.sum() - variance.maxCoeff();
  return 4.0 * f_tail(3.0 * variance.maxCoeff() / rest, degrees, 3.0 * degrees) > kUnequal;
}

struct Split {
  std::vector<bool> first;
  double chance = 1.0;  // of so large a distance between the groups, were all of one vehicle
  double distance = 0.0;
};

// Mean square between the groups against that within them. One rotor may scatter more than the others (a loose propeller): degrees of
// freedom are those of a sum of unequal variances (Satterthwaite), one per flight and rotor at most.
Split judged_split(const std::vector<Eigen::Vector4d>& change, std::vector<bool> first) {
  const auto n = static_cast<double>(change.size()), n1 = static_cast<double>(std::count(first.begin(), first.end(), true));
  Eigen::Vector4d mean[2] = {Eigen::Vector4d::Zero(), Eigen::Vector4d::Zero()}, within = Eigen::Vector4d::Zero();
  for (std::size_t i = 0; i < change.size(); ++i) mean[first[i]] += change[i] / (first[i] ? n1 : n - n1);
  for (std::size_t i = 0; i < change.size(); ++i) within += (change[i] - mean[first[i]]).cwiseAbs2() / (n - 2.0);
  within = within.cwiseMax(kLeastScatter * kLeastScatter);
  const double between = (mean[1] - mean[0]).squaredNorm(), rotors = within.sum() * within.sum() / within.squaredNorm();
  Split s;
  s.first = std::move(first);
  s.distance = std::sqrt(between / 4.0);
  s.chance = f_tail(between * n1 * (n - n1) / n / within.sum(), rotors, rotors * (n - 2.0));
  return s;
}

void refuse_two_vehicles(const std::vector<HoverShare>& flights, const std::vector<Eigen::Vector4d>& change) {
  if (flights.size() < 3) return;
  // Every split that two of the flights make when the others go to the nearer one: groups that are apart are among them.
  Split best;
  double tried = 0.0;
  for (std::size_t a = 0; a < change.size(); ++a)
    for (std::size_t b = a + 1; b < change.size(); ++b) {
      std::vector<bool> first;
      for (const auto& c : change) first.push_back((c - change[a]).squaredNorm() < (c - change[b]).squaredNorm());
      if (std::count(first.begin(), first.end(), true) == 0) continue;  // the two are equal
      tried += 1.0;
      if (Split s = judged_split(change, std::move(first)); s.chance < best.chance) best = std::move(s);
    }
  if (tried * best.chance >= kHoverChance) return;
  std::vector<std::string> group[2];
  for (std::size_t i = 0; i < flights.size(); ++i) group[best.first[i]].push_back(flights[i].flight);
  if (group[0].size() > group[1].size()) std::swap(group[0], group[1]);
  throw Error(
      {fmt::format("{}", fmt::join(group[0], ", ")),
       fmt::format("demand of the rotors differs by {:.1f} % (rms) from the other reference flights, {}; flights of one vehicle differ "
                   "by that with a chance of {:.1g}, at least {} allowed",
                   100.0 * best.distance, fmt::join(group[1], ", "), tried * best.chance, kHoverChance),
       "reference flights of two vehicles, or of one before and after a repair or with a defect",
       "give as --reference flights of one vehicle in one state, and judge the others apart"},
      ExitCode::data_quality);
}

void add_reference_sway(HoverReference& r, const std::vector<HoverShare>& flights) {
  const double n = static_cast<double>(flights.size());
  double length_s = 0.0, squares = 0.0;
  std::vector<Eigen::Vector4d> log_sway;
  for (const auto& f : flights) {
    if (*std::min_element(f.sway.begin(), f.sway.end()) <= 0.0) return;
    log_sway.push_back(Eigen::Vector4d(f.sway.data()).array().log());
    r.log_sway += log_sway.back() / n;
    length_s += f.sway_s / n;
  }
  for (const auto& s : log_sway) squares += (s - r.log_sway).squaredNorm();
  r.sway_degrees = 4.0 * (n - 1.0);
  // A band of B Hz over T s holds 2 B T independent figures; the rms of so many is known to 1/sqrt(4 B T), however well flights agree.
  const double least = 1.0 / std::sqrt(4.0 * (kSwayHigh_Hz - kSwayLow_Hz) * length_s);
  r.u_sway = std::max(least, std::sqrt(squares / r.sway_degrees)) * std::sqrt(1.0 + 1.0 / n);
}

}  // namespace

HoverReference hover_reference(const std::vector<HoverShare>& flights) {
  HoverReference r;
  r.flights = flights.size();
  const double n = static_cast<double>(flights.size());
  for (const auto& f : flights) r.demand += Eigen::Vector4d(f.demand.data()) / n;
  std::vector<Eigen::Vector4d> change;
  Eigen::Vector4d variance = Eigen::Vector4d::Zero();
  for (const auto& f : flights) {
    change.push_back(relative(f, r.demand));
    variance += change.back().cwiseAbs2() / (n - 1.0);
  }
  refuse_two_vehicles(flights, change);
  r.pooled = alike(variance.cwiseMax(kLeastScatter * kLeastScatter), n - 1.0);
  r.degrees = r.pooled ? 4.0 * (n - 1.0) : n - 1.0;
  if (r.pooled) variance.setConstant(variance.mean());
  r.u = variance.cwiseSqrt().cwiseMax(kLeastScatter) * std::sqrt(1.0 + 1.0 / n);
  add_reference_sway(r, flights);
  return r;
}

double student_limit(double chance, double degrees) { return student_quantile(1.0 - 2.0 * chance, degrees); }

}  // namespace rotorloop::studies
