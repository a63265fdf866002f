#include "bench/identify/report/identify_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/identify/beside.hpp"
#include "bench/identify/identified_vehicle.hpp"

namespace rotorloop::identify {
namespace {

constexpr double kModelErrorRatio = 5.0;
constexpr std::size_t kBlocksEach = 2;  // of a parameter: below, the scatter of so few holds too little
constexpr double kContradicted = 2.0;   // standard deviations of the prior

// Columns count characters, not bytes.
std::size_t characters(const std::string& text) {
  std::size_t shown = 0;
  for (const char c : text) shown += (static_cast<unsigned char>(c) & 0xC0) != 0x80;
  return shown;
}
std::string padded(const std::string& text, std::size_t width) {
  const std::size_t shown = characters(text);
  return text + std::string(width > shown ? width - shown : 0, ' ');
}
// Of a column of names: the longest and a gap, at least `least`.
template <class List, class Name>
std::size_t column_width(const List& list, std::size_t least, Name&& name) {
  for (const auto& of : list) least = std::max(least, characters(name(of)) + 2);
  return least;
}

// Value of the vehicle file in the fit's parameter: the sensor's rotation starts from it, at zero.
double value_before(const Identification& r, int parameter) { return r.start.file[parameter]; }

}  // namespace

std::string mark_of(const estimate::Estimate& e) {
  if (e.at_bound) return "at its bound";
  if (e.prior_share > 0.5 && std::fabs(e.prior_z) > kContradicted) return "contradicted";
  if (e.prior_share > 0.5) return e.parameter == estimate::kMass ? "weighed" : "not identified";
  if (e.u > 0.0 && e.u_robust >= kModelErrorRatio * e.u) return "model error";
  return "";
}

std::string blocks_note(const estimate::Fit& fit) {
  if (fit.blocks >= kBlocksEach * fit.estimates.size()) return "";
  return fmt::format(
      "robust u rests on {} blocks of residuals for {} parameters, fewer than two each: too small; longer flights or shorter blocks "
      "(--block)",
      fit.blocks, fit.estimates.size());
}

std::string estimates_table(const Identification& r, const host::VehicleFile& before) {
  const std::size_t width = column_width(r.fit.estimates, 22, [&](const estimate::Estimate& e) { return estimate::estimate_name(e, r.problem); });
  std::string out = fmt::format("{}{:>13}  {:>9} {:>9}  {}{:>12} {:>7}  {}\n", padded("parameter", width), "estimate", "u", "robust u",
                                padded("unit", 9), "file says", "z", "origin");
  for (const estimate::Estimate& e : r.fit.estimates) {
    const estimate::ParameterInfo info = estimate::parameter_info(e.parameter, r.problem.start.terms);
    const double u_before = believed_u(before, e.parameter, r.problem.start.terms);
    const double was = value_before(r, e.parameter);
    out += fmt::format("{}{:>13.5g}  {:>9.2g} {:>9.2g}  {}{:>12.4g}", padded(estimate::estimate_name(e, r.problem), width), e.value, e.u, e.u_robust,
                       padded(info.unit, 9), was);
    // Against a prior of its own an estimate is compared with that prior alone: both hold the same knowledge.
    const bool free_of_it = e.prior_share <= 0.5;
    out += u_before > 0.0 && free_of_it ? fmt::format(" {:>7.1f}", (e.value - was) / std::hypot(u_before, reported_u(e)))
           : !free_of_it                ? fmt::format(" {:>7.1f}", e.prior_z)
                                        : "        ";
    const auto origin = host::origin_of(before, info.name);  // of what the file says
    const std::string mark = mark_of(e), from = origin ? std::string(host::name(*origin)) : "";
    out += (mark.empty() ? (from.empty() ? "" : "  " + from) : "  " + padded(from, 8) + mark) + "\n";
  }
  for (const ParameterRow& row : parameter_rows(r)) {
    if (row.estimate) continue;
    const estimate::ParameterInfo info = estimate::parameter_info(row.parameter, r.problem.start.terms);
    const auto origin = host::origin_of(before, info.name);
    out += fmt::format("{}{:>13.5g}  {:>9} {:>9}  {}{:>12.4g} {:>7}  {}held\n", padded(row.symbol, width), row.value, "", "",
                       padded(info.unit, 9), value_before(r, row.parameter), "", padded(origin ? std::string(host::name(*origin)) : "", 8));
  }
  return out;
}

std::string derived_table(const std::vector<DerivedQuantity>& derived) {
  std::string out;
  for (const DerivedQuantity& d : derived)
    out +=
        fmt::format("{}{:>13.5g}  {:>9.2g} {:>9.2g}  {}{}\n", padded(d.symbol, 22), d.value, d.u, d.u_robust, padded(d.unit, 9), d.meaning);
  return out;
}

std::string stages_table(const Identification& r) {
  if (r.comparison.empty()) return "";
  const auto symbol = [&](const StageComparison& c) { return estimate::parameter_info(c.parameter, r.problem.start.terms).symbol; };
  const std::size_t width = column_width(r.comparison, 12, symbol);
  std::string out = fmt::format("{}{}{:>13}  {:>9}  {:>13}  {:>9} {:>7}\n", padded("stage", 12), padded("parameter", width), "stage", "u",
                                "joint fit", "u", "z");
  std::size_t apart = 0;
  for (const StageComparison& c : r.comparison) {
    out += fmt::format("{}{}{:>13.5g}  {:>9.2g}  {:>13.5g}  {:>9.2g} {:>7.1f}{}\n", padded(std::string(name(c.role)), 12),
                       padded(symbol(c), width), c.stage, c.u_stage, c.joint, c.u_joint, c.z, c.agrees ? "" : "  apart");
    apart += !c.agrees;
  }
  if (apart == 0) return out + "Stages and joint fit agree within 3 standard uncertainties in every parameter.\n";
  out += "Stages and joint fit differ by more than 3 standard uncertainties in:";
  for (const StageComparison& c : r.comparison) {
    if (!c.agrees)
      out += fmt::format(" {} ({}, by {:+.3g} {}, z {:+.1f})", symbol(c), name(c.role), c.stage - c.joint,
                         estimate::parameter_info(c.parameter, r.problem.start.terms).unit, c.z);
  }
  return out + "\n";
}

std::string noise_table(const Identification& r) {
  std::string out;
  for (std::size_t f = 0; f < r.flights.size(); ++f) {
    const estimate::GridFlight& g = r.flights[f];
    const estimate::NoiseModel& n = r.fit.noise[f];
    const auto three = [](const Eigen::Vector3d& v) { return fmt::format("{:.3g} {:.3g} {:.3g}", v[0], v[1], v[2]); };
    out += fmt::format("{}: q_a {} m/s²/√Hz, q_α {} rad/s²/√Hz", g.name, three(n.force_m_s2_rtHz), three(n.angular_rad_s2_rtHz));
    if (!g.pose.empty()) out += fmt::format("; pose {} m, {} rad", three(n.position_m), three(n.attitude_rad));
    if (!g.velocity.empty()) out += fmt::format("; velocity {} m/s", three(n.velocity_m_s));
    if (!g.gyro.empty()) out += fmt::format("; gyro {} rad/s", three(n.gyro_rad_s));
    if (!g.accel.empty()) out += fmt::format("; accelerometer {} m/s²", three(n.accel_m_s2));
    out += "\n";
  }
  return out;
}

}  // namespace rotorloop::identify
