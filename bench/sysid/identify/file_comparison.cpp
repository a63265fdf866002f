#include "bench/sysid/identify/file_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/sysid/estimate/model/rotations.hpp"
#include "bench/sysid/identify/identified_vehicle.hpp"
#include "bench/sysid/identify/start_values.hpp"

namespace rotorloop::identify {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

bool of_pose_sensor(int p) { return p >= estimate::kOffsetX && p <= estimate::kPoseDelay; }
bool of_rotation(int p) { return p >= estimate::kTurnX && p <= estimate::kTurnZ; }

bool any_poses(const Identification& r) {
  return std::any_of(r.flights.begin(), r.flights.end(), [](const estimate::GridFlight& g) { return !g.pose.empty(); });
}

// What a reader of Table I looks for when it was held: the paper's θ, the delay of the poses, and the numbers of added terms but not
// their state at the start of a flight.
std::vector<int> table_parameters(const host::TermList& terms, bool poses) {
  std::vector<int> out;
  for (int p = 0; p < estimate::kCoreParameters; ++p) {
    const bool theta = p <= estimate::kIzz || (p >= estimate::kCq && p <= estimate::kCdz);
    if (theta || (poses && of_pose_sensor(p))) out.push_back(p);
  }
  for (std::size_t k = 0; k < terms.parameters(); ++k) {
    if (!terms.is_start(k)) out.push_back(estimate::kCoreParameters + static_cast<int>(k));
  }
  return out;
}

FileValue said(double value, double u, host::Origin origin, double found, double u_found) {
  return {value, u, origin, value != 0.0 ? 100.0 * (found - value) / std::fabs(value) : kNone,
          u > 0.0 && u_found > 0.0 ? (found - value) / std::hypot(u, u_found) : kNone};
}

// What the file says of each row, and what follows from all it says.
ComparisonColumn column_of(const ComparedVehicle& other, const Identification& r, const std::vector<ParameterRow>& rows,
                           const std::vector<DerivedQuantity>& derived, double drag_speed_m_s) {
  const host::TermList& terms = r.problem.start.terms;
  const estimate::ModelValues values = start_values({}, other.file, terms).file;
  ComparisonColumn out{.label = other.label, .parameters = {}, .derived = {}, .q_BS = values.start_q_BS};
  const Eigen::Vector3d turn = estimate::log_q(r.problem.start.start_q_BS.conjugate() * values.start_q_BS);
  for (const ParameterRow& row : rows) {
    const std::string name = estimate::parameter_info(row.parameter, terms).name;
    const auto u = host::uncertainty_of(other.file, name);
    if (!u) {
      out.parameters.push_back(std::nullopt);
      continue;
    }
    const bool rotation = of_rotation(row.parameter);
    FileValue s =
        said(rotation ? turn[row.parameter - estimate::kTurnX] : values[row.parameter], *u,
             host::origin_of(other.file, name).value_or(host::Origin::guess), row.value, row.estimate ? reported_u(*row.estimate) : 0.0);
    if (rotation) s.percent = kNone;  // about the start value: of no size of its own
    out.parameters.push_back(s);
  }
  estimate::Fit exact;
  exact.values = {values};
  const auto follows = derived_quantities(exact, host::to_model(other.file), drag_speed_m_s);
  for (std::size_t i = 0; i < follows.size() && i < derived.size(); ++i)
    out.derived.push_back(said(follows[i].value, 0.0, host::Origin::guess, derived[i].value, 0.0));
  return out;
}

}  // namespace

std::vector<ParameterRow> parameter_rows(const Identification& r) {
  std::vector<ParameterRow> out;
  for (const estimate::Estimate& e : r.fit.estimates) out.push_back({e.parameter, estimate::estimate_name(e, r.problem), e, e.value});
  for (const int p : table_parameters(r.problem.start.terms, any_poses(r))) {
    const bool estimated =
        std::any_of(r.fit.estimates.begin(), r.fit.estimates.end(), [&](const estimate::Estimate& e) { return e.parameter == p; });
    if (!estimated) out.push_back({p, estimate::parameter_info(p, r.problem.start.terms).symbol, std::nullopt, r.fit.values.front()[p]});
  }
  std::stable_sort(out.begin(), out.end(), [](const ParameterRow& a, const ParameterRow& b) { return a.parameter < b.parameter; });
  return out;
}

FileComparison compared(const Identification& r, const std::vector<DerivedQuantity>& derived, double drag_speed_m_s,
                        const ComparedVehicle& start, const std::vector<ComparedVehicle>& others) {
  FileComparison out;
  out.rows = parameter_rows(r);
  out.start = column_of(start, r, out.rows, derived, drag_speed_m_s);
  for (std::size_t i = 0; i < out.rows.size(); ++i) {
    const bool from_prior = !out.rows[i].estimate || out.rows[i].estimate->prior_share > 0.5;
    if (from_prior && out.start.parameters[i]) out.start.parameters[i]->z = kNone;
  }
  for (const ComparedVehicle& b : others) out.others.push_back(column_of(b, r, out.rows, derived, drag_speed_m_s));

  const DerivedQuantity* c_t = derived_named("static_c_t", derived);
  if (!c_t || !(r.fit.find(estimate::kK1) || r.fit.find(estimate::kK2))) return out;
  const auto add = [&](const ComparedVehicle& b) {
    for (const host::StaticThrust& t : b.file.static_thrust) {
      // Thrust goes with the density of the air: both at that of the fit's model.
      const double denser = start.file.air_density_kg_m3 / t.air_density_kg_m3;
      out.static_thrust.push_back(
          {b.label, t.rpm_window, said(denser * t.c_t_N_s2, denser * t.u_N_s2, t.origin, c_t->value, std::max(c_t->u, c_t->u_robust))});
    }
  };
  add(start);
  for (const ComparedVehicle& b : others) add(b);
  return out;
}

const DerivedQuantity* derived_named(std::string_view id, const std::vector<DerivedQuantity>& derived) {
  const auto found = std::find_if(derived.begin(), derived.end(), [&](const DerivedQuantity& d) { return d.id == id; });
  return found == derived.end() ? nullptr : &*found;
}

std::optional<Eigen::Quaterniond> sensor_rotation(const Identification& r) {
  const bool one_each = std::any_of(r.fit.estimates.begin(), r.fit.estimates.end(),
                                    [](const estimate::Estimate& e) { return of_rotation(e.parameter) && e.flight >= 0; });
  if (!any_poses(r) || one_each) return std::nullopt;
  return r.fit.values.front().q_BS().normalized();
}

}  // namespace rotorloop::identify
