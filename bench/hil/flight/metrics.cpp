#include "bench/hil/flight/metrics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace rotorloop::hil {
namespace {

constexpr double kCmPerM = 100.0;

double figure(const FlightResult& r, ErrorAxis axis) {
  return axis == ErrorAxis::z ? r.tracking.truth.mean_z_cm : r.tracking.truth.mean_3d_cm;
}

template <class Get>
Spread over_seeds(const std::vector<FlightResult>& results, const std::string& flight, Variant variant, Get get) {
  std::vector<double> values;
  for (const auto& r : results)
    if (r.flight == flight && r.variant == variant && r.end == FlightEnd::completed) values.push_back(get(r));
  return spread_of(values);
}

LimitResult judged(std::string name, double value, std::string unit, double limit, bool upper) {
  const bool pass = std::isfinite(value) && (upper ? value <= limit : value >= limit);
  return {std::move(name), value, std::move(unit), limit, upper, pass};
}

std::vector<LimitResult> judge(const Scenario& s, const std::vector<FlightResult>& results) {
  std::vector<LimitResult> out;
  for (const auto& l : s.limits.error) {
    const auto spread = over_seeds(results, l.flight, l.variant, [&](const auto& r) { return figure(r, l.axis); });
    out.push_back(judged(fmt::format("mean_tracking_error {} {} {}", l.flight, variant_name(l.variant), axis_name(l.axis)), spread.mean,
                         "cm", l.max_cm, true));
  }
  for (const auto& l : s.limits.reduction) {
    const auto r = reduction(results, l.flight, l.from, l.to, l.axis);
    out.push_back(judged(fmt::format("reduction {} {} to {} {}", l.flight, variant_name(l.from), variant_name(l.to), axis_name(l.axis)),
                         r.percent, "%", l.min_percent, false));
  }
  for (const auto& l : s.limits.bus_load) {
    for (const auto bus : {BusName::esc, BusName::state}) {
      if (l.bus && *l.bus != bus) continue;
      double worst = kNotMeasured;
      for (const auto& r : results) {
        const double load = r.bus_load_mean_percent[static_cast<std::size_t>(bus)];
        if (!(load <= worst)) worst = std::isnan(load) ? worst : load;
      }
      out.push_back(judged(fmt::format("bus_load_mean {}", bus_name(bus)), worst, "%", l.max_percent, true));
    }
  }
  return out;
}

}  // namespace

void TrackingMeter::Sums::add(const Eigen::Vector3d& e) {
  const double xy2 = e.x() * e.x() + e.y() * e.y();
  const double n2 = xy2 + e.z() * e.z(), n = std::sqrt(n2), abs_z = std::fabs(e.z());
  norm += n;
  square += n2;
  z += abs_z;
  horizontal += std::sqrt(xy2);
  max_norm = std::max(max_norm, n);
  max_z = std::max(max_z, abs_z);
}

void TrackingMeter::Sums::take(Sums& p) {
  norm += p.norm;
  square += p.square;
  z += p.z;
  horizontal += p.horizontal;
  max_norm = std::max(max_norm, p.max_norm);
  max_z = std::max(max_z, p.max_z);
  p = {};
}

ErrorFigures TrackingMeter::Sums::figures(std::uint64_t count) const {
  if (count == 0) return {};
  const double n = static_cast<double>(count);
  ErrorFigures f;
  f.mean_3d_cm = kCmPerM * norm / n;
  f.max_3d_cm = kCmPerM * max_norm;
  f.rms_3d_cm = kCmPerM * std::sqrt(square / n);
  f.mean_z_cm = kCmPerM * z / n;
  f.max_z_cm = kCmPerM * max_z;
  f.mean_horizontal_cm = kCmPerM * horizontal / n;
  return f;
}

void TrackingMeter::add(const TrackingSample& s) {
  const bool turns = any_ && std::fabs(s.sp_yaw_rad - previous_yaw_rad_) > kMotionYaw_rad;
  const bool moves = turns || s.sp_v_W_m_s.squaredNorm() > kMotionSpeed_m_s * kMotionSpeed_m_s;
  any_ = true;
  previous_yaw_rad_ = s.sp_yaw_rad;
  if (std::isnan(first_s_)) {
    if (!moves) return;
    first_s_ = s.t_s;
  }
  pending_truth_.add(s.true_p_W_m - s.sp_p_W_m);
  pending_estimate_.add(s.est_p_W_m - s.sp_p_W_m);
  pending_estimator_.add(s.est_p_W_m - s.true_p_W_m);
  ++pending_n_;
  if (!moves) return;
  truth_.take(pending_truth_);
  estimate_.take(pending_estimate_);
  estimator_.take(pending_estimator_);
  n_ += pending_n_;
  pending_n_ = 0;
  last_s_ = s.t_s;
}

TrackingFigures TrackingMeter::figures() const {
  TrackingFigures f;
  f.truth = truth_.figures(n_);
  f.estimate = estimate_.figures(n_);
  f.estimator_mean_3d_cm = estimator_.figures(n_).mean_3d_cm;
  f.first_motion_s = first_s_;
  f.last_motion_s = last_s_;
  f.samples = n_;
  return f;
}

std::string_view flight_end_name(FlightEnd end) {
  switch (end) {
    case FlightEnd::completed:
      return "completed";
    case FlightEnd::crashed:
      return "crashed";
    case FlightEnd::safe_state:
      return "safe_state";
    case FlightEnd::interrupted:
      return "interrupted";
    case FlightEnd::incomplete:
      return "incomplete";
    case FlightEnd::late:
      return "late";
  }
  return "?";
}

std::string_view verdict_name(Verdict v) {
  switch (v) {
    case Verdict::pass:
      return "pass";
    case Verdict::fail:
      return "fail";
    case Verdict::incomplete:
      return "incomplete";
  }
  return "?";
}

Spread spread_of(const std::vector<double>& values) {
  Spread s;
  double sum = 0;
  for (const double v : values) {
    if (std::isnan(v)) continue;
    s.min = s.n == 0 ? v : std::min(s.min, v);
    s.max = s.n == 0 ? v : std::max(s.max, v);
    sum += v;
    ++s.n;
  }
  if (s.n == 0) return s;
  s.mean = sum / s.n;
  double squares = 0;
  for (const double v : values)
    if (!std::isnan(v)) squares += (v - s.mean) * (v - s.mean);
  s.std = s.n > 1 ? std::sqrt(squares / (s.n - 1)) : 0.0;
  return s;
}

Reduction reduction(const std::vector<FlightResult>& results, const std::string& flight, Variant from, Variant to, ErrorAxis axis) {
  const auto get = [&](const FlightResult& r) { return figure(r, axis); };
  const auto a = over_seeds(results, flight, from, get), b = over_seeds(results, flight, to, get);
  Reduction out;
  if (a.n == 0 || b.n == 0 || !(a.mean > 0)) return out;
  out.percent = 100.0 * (1.0 - b.mean / a.mean);
  std::vector<double> by_seed;
  for (const auto& x : results)
    for (const auto& y : results)
      if (x.flight == flight && y.flight == flight && x.variant == from && y.variant == to && x.seed == y.seed &&
          x.end == FlightEnd::completed && y.end == FlightEnd::completed && get(x) > 0)
        by_seed.push_back(100.0 * (1.0 - get(y) / get(x)));
  const auto s = spread_of(by_seed);
  out.std_percent = s.std;
  out.n = s.n;
  return out;
}

ErrorAxis table_axis(const Scenario& s, const std::string& flight) {
  for (const auto& l : s.limits.error)
    if (l.flight == flight) return l.axis;
  for (const auto& l : s.limits.reduction)
    if (l.flight == flight) return l.axis;
  for (const auto& p : s.published)
    if (p.flight == flight) return p.axis;
  return ErrorAxis::norm_3d;
}

Assessment assess(const Scenario& s, const std::vector<FlightResult>& results, std::size_t planned) {
  Assessment a;
  for (const auto& plan : s.flights) {
    for (const auto& v : variants_of(results)) {
      TableCell c{.flight = plan.name,
                  .variant = v,
                  .error_3d_cm = {},
                  .error_z_cm = {},
                  .estimate_error_3d_cm = {},
                  .estimate_error_z_cm = {},
                  .estimator_error_cm = {},
                  .attitude_error_deg = {},
                  .command_mean_rad_s = {},
                  .command_std_rad_s = {}};
      for (const auto& r : results) {
        if (r.flight != plan.name || r.variant != v) continue;
        ++c.flown;
        c.completed += r.end == FlightEnd::completed;
      }
      if (c.flown == 0) continue;
      const auto over = [&](auto get) { return over_seeds(results, plan.name, v, get); };
      c.error_3d_cm = over([](const auto& r) { return r.tracking.truth.mean_3d_cm; });
      c.error_z_cm = over([](const auto& r) { return r.tracking.truth.mean_z_cm; });
      c.estimate_error_3d_cm = over([](const auto& r) { return r.tracking.estimate.mean_3d_cm; });
      c.estimate_error_z_cm = over([](const auto& r) { return r.tracking.estimate.mean_z_cm; });
      c.estimator_error_cm = over([](const auto& r) { return r.tracking.estimator_mean_3d_cm; });
      c.attitude_error_deg = over([](const auto& r) { return r.attitude_error_mean_deg; });
      c.command_mean_rad_s = over([](const auto& r) { return r.command_mean_rad_s; });
      c.command_std_rad_s = over([](const auto& r) { return r.command_std_rad_s; });
      a.table.push_back(std::move(c));
    }
  }
  a.limits = judge(s, results);
  const auto ended = [&](FlightEnd end) {
    return std::any_of(results.begin(), results.end(), [&](const auto& r) { return r.end == end; });
  };
  const bool unmeasured = std::any_of(a.limits.begin(), a.limits.end(), [](const auto& l) { return std::isnan(l.value); });
  const bool missed = std::any_of(a.limits.begin(), a.limits.end(), [](const auto& l) { return !l.pass; });
  if (results.empty() || results.size() < planned || ended(FlightEnd::interrupted) || ended(FlightEnd::incomplete) ||
      ended(FlightEnd::late))
    a.verdict = Verdict::incomplete;
  else if (ended(FlightEnd::crashed) || ended(FlightEnd::safe_state))
    a.verdict = Verdict::fail;  // a flight that did not finish is measured, whatever else could not be
  else if (unmeasured)
    a.verdict = Verdict::incomplete;
  else
    a.verdict = missed ? Verdict::fail : Verdict::pass;
  return a;
}

const TableCell* find_cell(const Assessment& a, const std::string& flight, Variant variant) {
  for (const auto& c : a.table)
    if (c.flight == flight && c.variant == variant) return &c;
  return nullptr;
}

}  // namespace rotorloop::hil
