#include "bench/sysid/identify/identified_vehicle.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "bench/sysid/estimate/model/rotations.hpp"
#include "host/vehicle/thrust.hpp"

namespace rotorloop::identify {
namespace {

using host::Origin;
using host::VehicleFile;

// Where a parameter stands in the file; nullptr for those the file has no place for.
host::Quantity* place_of(VehicleFile& v, int p) {
  switch (p) {
    case estimate::kMass:
      return &v.mass_kg;
    case estimate::kIxx:
      return &v.inertia_kg_m2[0];
    case estimate::kIyy:
      return &v.inertia_kg_m2[1];
    case estimate::kIzz:
      return &v.inertia_kg_m2[2];
    case estimate::kCq:
      return &v.c_q_N_m_s2;
    case estimate::kComX:
      return &v.com_offset_m[0];
    case estimate::kComY:
      return &v.com_offset_m[1];
    case estimate::kK1:
      return &v.k1_N_s2;
    case estimate::kK2:
      return &v.k2_N_s2_m;
    case estimate::kCdh:
      return &v.c_dh_s_m;
    case estimate::kCdxy:
      return &v.c_dxy_N_s2_m2;
    case estimate::kCdz:
      return &v.c_dz_N_s2_m2;
    default:
      return nullptr;
  }
}

// Standard uncertainties beyond what can be within which an estimate is taken for what can be.
constexpr double kNothing = 3.0;
// Of its u, by what a number moved along: below it none is named, below the other none counts.
constexpr double kWorthALine = 0.1, kRounding = 1e-9;

// Moves the estimates the least, in terms of their covariance, so that slope · estimates changes by `change`: what is tied to a number that
// has to move goes with it.
void move_along(SharedEstimates& s, const Eigen::VectorXd& slope, double change) {
  Eigen::VectorXd u(slope.size());
  for (Eigen::Index i = 0; i < u.size(); ++i) u[i] = s.estimates[static_cast<std::size_t>(i)].u;
  const Eigen::VectorXd way = u.asDiagonal() * s.correlation * u.asDiagonal() * slope;
  const double length = slope.dot(way);
  if (!(length > 0.0)) return;
  for (Eigen::Index i = 0; i < u.size(); ++i) s.estimates[static_cast<std::size_t>(i)].value += way[i] * change / length;
}

int row_of(const SharedEstimates& s, int parameter) {
  for (std::size_t i = 0; i < s.estimates.size(); ++i) {
    if (s.estimates[i].parameter == parameter) return static_cast<int>(i);
  }
  return -1;
}

// Nothing is pushed along by its drag.
bool onto_drag(SharedEstimates& s) {
  bool moved = false;
  for (int p = estimate::kCdh; p <= estimate::kCdz; ++p) {
    const int row = row_of(s, p);
    if (row < 0) continue;
    estimate::Estimate& e = s.estimates[static_cast<std::size_t>(row)];
    if (!(e.value < 0.0 && e.value > -kNothing * e.u)) continue;
    Eigen::VectorXd slope = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(s.estimates.size()));
    slope[row] = 1.0;
    move_along(s, slope, -e.value);
    e.value = 0.0;  // without rounding
    moved = true;
  }
  return moved;
}

// No rigid body has a moment of inertia above the sum of the other two. `held`: moments that are no estimates.
bool onto_a_rigid_body(SharedEstimates& s, const estimate::ModelValues& held) {
  std::array<int, 3> row{};
  std::array<double, 3> value{};
  double u2 = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const int parameter = estimate::kIxx + static_cast<int>(i);
    row[i] = row_of(s, parameter);
    value[i] = row[i] < 0 ? held[parameter] : s.estimates[static_cast<std::size_t>(row[i])].value;
    if (row[i] >= 0) u2 += std::pow(s.estimates[static_cast<std::size_t>(row[i])].u, 2);
  }
  for (std::size_t largest = 0; largest < 3; ++largest) {
    const double excess = 2.0 * value[largest] - value[0] - value[1] - value[2];
    if (excess <= 0.0 || excess > kNothing * std::sqrt(u2)) continue;
    Eigen::VectorXd slope = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(s.estimates.size()));
    for (std::size_t i = 0; i < 3; ++i) {
      if (row[i] >= 0) slope[row[i]] = i == largest ? 1.0 : -1.0;
    }
    constexpr double kInside = 1.0 + 1e-9;  // past the bound by more than rounding
    move_along(s, slope, -kInside * excess);
    return true;
  }
  return false;
}

// No rotor lifts with less than the ideal power, nor with three times it: the torque coefficient of one within three of its u of what a
// rotor reaches is moved there.
bool onto_a_figure_of_merit(SharedEstimates& s, const estimate::ModelValues& held) {
  constexpr double kLeast = 0.3, kLargest = 0.85, kInside = 1e-3;  // what the reader of vehicle files takes for credible
  const int row = row_of(s, estimate::kCq);
  if (row < 0) return false;
  const auto value = [&](int parameter) {
    const int at = row_of(s, parameter);
    return at < 0 ? held[parameter] : s.estimates[static_cast<std::size_t>(at)].value;
  };
  bool moved = false;
  for (int again = 0; again < 3; ++again) {  // what moves along changes the thrust a little
    const estimate::Estimate& e = s.estimates[static_cast<std::size_t>(row)];
    const host::ThrustModel thrust{value(estimate::kK1), value(estimate::kK2), held.geometry.radius_m, held.geometry.air_density_kg_m3};
    const double merit = host::figure_of_merit(thrust, e.value);
    if (!(merit > 0.0) || (merit >= kLeast && merit <= kLargest)) break;
    const double change = e.value * (merit / (merit > kLargest ? kLargest - kInside : kLeast + kInside) - 1.0);
    if (std::fabs(change) > kNothing * e.u) break;
    Eigen::VectorXd slope = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(s.estimates.size()));
    slope[row] = 1.0;
    move_along(s, slope, change);
    moved = true;
  }
  return moved;
}

// What cannot be is moved to what can; a line says what moved, and why.
std::vector<std::string> move_to_what_can_be(SharedEstimates& s, const estimate::ModelValues& held) {
  const SharedEstimates before = s;
  std::string why;
  bool drag = false, merit = false, body = false;
  for (int again = 0; again < 5; ++again) {  // what one moves, moves the others along
    const bool by_drag = onto_drag(s), by_merit = onto_a_figure_of_merit(s, held), by_body = onto_a_rigid_body(s, held);
    drag = drag || by_drag;
    merit = merit || by_merit;
    body = body || by_body;
    if (!by_merit && !by_body) break;
  }
  for (estimate::Estimate& e : s.estimates) {
    if (e.parameter >= estimate::kCdh && e.parameter <= estimate::kCdz && e.value < 0.0 && e.value > -kWorthALine * e.u) e.value = 0.0;
  }
  const auto because = [&](bool so, const char* what) {
    if (so) why += std::string(why.empty() ? "" : ", and ") + what;
  };
  because(drag, "nothing is pushed along by its drag");
  because(merit, "a rotor's figure of merit is between 0.3 and 0.85");
  because(body, "no body has a moment of inertia above the sum of the other two");
  std::vector<std::string> out;
  if (why.empty()) return out;
  std::string moved;
  std::size_t others = 0;
  for (std::size_t i = 0; i < s.estimates.size(); ++i) {
    const estimate::Estimate &was = before.estimates[i], &is = s.estimates[i];
    if (std::fabs(is.value - was.value) <= kRounding * is.u) continue;
    if (std::fabs(is.value - was.value) <= kWorthALine * is.u) {
      ++others;
      continue;
    }
    const estimate::ParameterInfo info = estimate::parameter_info(is.parameter, held.terms);
    moved += fmt::format("{}{} {:.4g} instead of {:.4g} {}", moved.empty() ? "" : ", ", info.symbol, is.value, was.value, info.unit);
  }
  if (others > 0)
    moved += fmt::format("{}{} other{} by less than a tenth of {} u", moved.empty() ? "" : ", ", others, others > 1 ? "s" : "",
                         others > 1 ? "their" : "its");
  out.push_back(fmt::format("{}: {}", why, moved));
  return out;
}

// A number that its prior determines is still the file's, but for one of CAD, a stand or scales that the flights moved by more than its u.
Origin origin_after(const estimate::Estimate& e, double was, double was_u, Origin origin) {
  const bool still = e.prior_share > 0.5 && (origin == Origin::guess || std::fabs(e.value - was) <= was_u);
  return still ? origin : Origin::flight;
}

void put_effects(VehicleFile& v, const SharedEstimates& s, const estimate::ModelValues& values) {
  const host::TermList& terms = values.terms;
  for (std::size_t t = 0; t < terms.size(); ++t) {
    const std::string id(terms.term(t).info.id);
    auto found = std::find_if(v.effects.begin(), v.effects.end(), [&](const host::VehicleEffect& e) { return e.id == id; });
    if (found == v.effects.end()) found = v.effects.insert(v.effects.end(), {id, {}, {}});
    const auto before = std::exchange(found->parameters, {});
    for (std::size_t k = 0; k < terms.parameters(); ++k) {
      if (terms.term_of(k) != t || terms.is_start(k)) continue;
      const int p = estimate::kCoreParameters + static_cast<int>(k);
      host::Quantity q{values[p], 0.0, Origin::guess};  // held: as it was
      for (const host::EffectParameter& was : before) {
        if (was.name == terms.parameter(k).name) q = was.quantity;
      }
      for (const estimate::Estimate& e : s.estimates) {
        if (e.parameter == p) q = {e.value, e.u, origin_after(e, q.value, q.u, q.origin)};
      }
      found->parameters.push_back({std::string(terms.parameter(k).name), q});
    }
  }
}

// The rotors' inertia that yaw steps determined, or else their gyroscopic moment, is that of [torque_model] too: the controller shapes yaw
// by it. What a drawing or a stand knows better stays, and a line says so.
void put_rotor_inertia(VehicleFile& v, const SharedEstimates& s, const host::TermList& terms, std::vector<std::string>& differences) {
  for (const std::string_view name : estimate::kRotorInertiaNames) {
    const int row = row_of(s, estimate::find_parameter(name, terms));
    if (row < 0) continue;
    const estimate::Estimate& e = s.estimates[static_cast<std::size_t>(row)];
    host::Quantity& q = v.rotor_inertia_kg_m2;
    const bool known = q.origin == Origin::cad || q.origin == Origin::stand;
    if (e.value > 0.0 && !(known && q.u > 0.0 && q.u <= e.u)) {
      q = {e.value, e.u, origin_after(e, q.value, q.u, q.origin)};
    } else if (q.value != e.value) {
      differences.push_back(
          fmt::format("[torque_model] keeps its rotor inertia of {:.4g} ± {:.2g} kg m² ({}), for the flights' {:.4g} ± {:.2g} is {}",
                      q.value, q.u, host::name(q.origin), e.value, e.u, e.value > 0.0 ? "less certain" : "none that a rotor can have"));
    }
    return;
  }
}

// Standard uncertainties and correlations into blocks: one of all estimated quantities that the file knows. Older blocks go when
// they name one of these.
void put_covariance(VehicleFile& v, const SharedEstimates& s, const host::TermList& terms) {
  std::vector<Eigen::Index> rows;
  host::CovarianceBlock block;
  for (std::size_t i = 0; i < s.estimates.size(); ++i) {
    const std::string name = estimate::parameter_info(s.estimates[i].parameter, terms).name;
    if (!host::uncertainty_of(v, name)) continue;
    rows.push_back(static_cast<Eigen::Index>(i));
    block.of.push_back(name);
  }
  for (std::size_t a = 0; a < rows.size(); ++a) {
    for (std::size_t b = 0; b < rows.size(); ++b) {
      const double ua = host::uncertainty_of(v, block.of[a]).value_or(0.0), ub = host::uncertainty_of(v, block.of[b]).value_or(0.0);
      block.matrix.push_back(ua * ub * s.correlation(rows[a], rows[b]));
    }
  }
  std::erase_if(v.covariance, [&](const host::CovarianceBlock& old) {
    return std::any_of(old.of.begin(), old.of.end(),
                       [&](const std::string& name) { return std::find(block.of.begin(), block.of.end(), name) != block.of.end(); });
  });
  if (rows.size() > 1) v.covariance.push_back(std::move(block));
}

}  // namespace

double reported_u(const estimate::Estimate& e) { return std::max(e.u, e.u_robust); }

SharedEstimates shared_estimates(const estimate::Fit& fit) {
  SharedEstimates out;
  std::vector<Eigen::Index> row;  // in the fit's covariance; -1: a mean
  for (std::size_t i = 0; i < fit.estimates.size(); ++i) {
    const estimate::Estimate& e = fit.estimates[i];
    if (e.flight > 0) continue;  // counted with the first
    estimate::Estimate shared = e;
    shared.u = reported_u(e);
    row.push_back(e.flight < 0 ? static_cast<Eigen::Index>(i) : -1);
    if (e.flight == 0) {
      double weights = 0.0, sum = 0.0, scatter = 0.0, count = 0.0;
      const auto each = [&](auto&& act) {
        for (const estimate::Estimate& f : fit.estimates) {
          if (f.parameter == e.parameter && reported_u(f) > 0.0) act(f, 1.0 / (reported_u(f) * reported_u(f)));
        }
      };
      each([&](const estimate::Estimate& f, double w) {
        weights += w;
        sum += w * f.value;
        count += 1.0;
      });
      shared.value = sum / weights;
      each([&](const estimate::Estimate& f, double) { scatter += (f.value - shared.value) * (f.value - shared.value); });
      shared.u = std::max(1.0 / std::sqrt(weights), count > 1.0 ? std::sqrt(scatter / (count - 1.0)) : 0.0);
      shared.flight = -1;
    }
    shared.u_robust = shared.u;
    out.estimates.push_back(shared);
  }
  const auto n = static_cast<Eigen::Index>(out.estimates.size());
  out.correlation = Eigen::MatrixXd::Identity(n, n);
  for (Eigen::Index a = 0; a < n; ++a) {
    for (Eigen::Index b = 0; b < n; ++b) {
      const auto i = row[static_cast<std::size_t>(a)], j = row[static_cast<std::size_t>(b)];
      if (a != b && i >= 0 && j >= 0) out.correlation(a, b) = fit.covariance(i, j) / std::sqrt(fit.covariance(i, i) * fit.covariance(j, j));
    }
  }
  return out;
}

std::array<double, 2> flown_rpm(const std::vector<estimate::GridFlight>& flights) {
  std::vector<double> speeds;
  for (const estimate::GridFlight& g : flights) {
    if (g.input.from_commands()) continue;
    std::size_t hint = 0;
    for (std::size_t k = 0; k + 1 < g.nodes; ++k) {
      if (!g.linked[k]) continue;
      for (const double w : g.input.at(g.time_s(k), hint, false).omega_rad_s) speeds.push_back(w * 30.0 / std::numbers::pi);
    }
  }
  if (speeds.empty()) return {0.0, 0.0};
  std::sort(speeds.begin(), speeds.end());
  const std::size_t cut = speeds.size() / 1000;
  return {std::floor(speeds[cut]), std::ceil(speeds[speeds.size() - 1 - cut])};
}

WrittenVehicle written_vehicle(const estimate::Fit& fit, const VehicleFile& base, const std::array<double, 2>& rpm_flown,
                               const std::string& written_by, const std::vector<std::string>& inputs) {
  WrittenVehicle out{base, {}};
  VehicleFile& v = out.file;
  SharedEstimates s = shared_estimates(fit);
  estimate::ModelValues values = fit.values.front();
  out.differences = move_to_what_can_be(s, values);
  for (const estimate::Estimate& e : s.estimates) values[e.parameter] = e.value;

  // The fit's three numbers turn q_BS about its start value; the file's are a small rotation about the result: J_r maps one to the other.
  std::array<Eigen::Index, 3> turn{-1, -1, -1};
  for (std::size_t i = 0; i < s.estimates.size(); ++i) {
    if (const int axis = s.estimates[i].parameter - estimate::kTurnX; axis >= 0 && axis < 3)
      turn[static_cast<std::size_t>(axis)] = static_cast<Eigen::Index>(i);
  }
  if (std::all_of(turn.begin(), turn.end(), [](Eigen::Index i) { return i >= 0; })) {
    const auto n = static_cast<Eigen::Index>(s.estimates.size());
    Eigen::VectorXd u(n);
    for (Eigen::Index i = 0; i < n; ++i) u[i] = s.estimates[static_cast<std::size_t>(i)].u;
    Eigen::MatrixXd to_file = Eigen::MatrixXd::Identity(n, n);
    to_file(turn, turn) =
        estimate::right_jacobian(Eigen::Vector3d(values[estimate::kTurnX], values[estimate::kTurnY], values[estimate::kTurnZ]));
    const Eigen::MatrixXd c = to_file * u.asDiagonal() * s.correlation * u.asDiagonal() * to_file.transpose();
    for (Eigen::Index i = 0; i < n; ++i) s.estimates[static_cast<std::size_t>(i)].u = u[i] = std::sqrt(c(i, i));
    s.correlation = u.cwiseInverse().asDiagonal() * c * u.cwiseInverse().asDiagonal();
  }

  for (const estimate::Estimate& e : s.estimates) {
    if (host::Quantity* q = place_of(v, e.parameter)) {
      *q = {e.value, e.u, origin_after(e, q->value, q->u, q->origin)};
    } else if (const int axis = e.parameter - estimate::kOffsetX; axis >= 0 && axis < 3) {
      v.pose_sensor.offset_m[static_cast<std::size_t>(axis)] = e.value;
      v.pose_sensor.offset_u_m[static_cast<std::size_t>(axis)] = e.u;
      v.pose_sensor.offset_origin = Origin::flight;
    } else if (const int about = e.parameter - estimate::kTurnX; about >= 0 && about < 3) {
      v.pose_sensor.rotation_u_rad[static_cast<std::size_t>(about)] = e.u;
      v.pose_sensor.rotation_origin = Origin::flight;
    }
  }
  const Eigen::Quaterniond q = values.q_BS();
  v.pose_sensor.quaternion_wxyz = {q.w(), q.x(), q.y(), q.z()};
  put_effects(v, s, values);
  put_rotor_inertia(v, s, values.terms, out.differences);
  put_covariance(v, s, values.terms);

  const host::VehicleModel model = host::to_model(v);
  if (rpm_flown[1] > rpm_flown[0]) v.rpm_window = rpm_flown;
  if (fit.find(estimate::kK1) || fit.find(estimate::kK2)) {
    const DerivedQuantity c_t =
        propagated(fit, [&](const estimate::ModelValues& x) { return host::static_c_t(estimate::vehicle_model(x, model).thrust); });
    std::erase_if(v.static_thrust, [](const host::StaticThrust& t) { return t.origin == Origin::flight; });
    v.static_thrust.push_back(
        {Origin::flight, host::static_c_t(model.thrust), std::max(c_t.u, c_t.u_robust), v.rpm_window, v.air_density_kg_m3});
  }
  v.written_by = written_by;
  v.inputs = inputs;
  return out;
}

VehicleFile identified_vehicle(const estimate::Fit& fit, const VehicleFile& base, const std::array<double, 2>& rpm_flown,
                               const std::string& written_by, const std::vector<std::string>& inputs) {
  return written_vehicle(fit, base, rpm_flown, written_by, inputs).file;
}

}  // namespace rotorloop::identify
