#include "bench/identify/identified_vehicle.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "bench/estimate/model/rotations.hpp"
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

// Standard uncertainties below zero within which a drag coefficient is none: nothing is pushed along by its drag.
constexpr double kNothing = 3.0;

// No rigid body has a moment of inertia above the sum of the other two. Where the fit leaves one above by no more than that, in standard
// uncertainties of the difference, all three move to the nearest such body, each as far as its own uncertainty allows.
void onto_a_rigid_body(VehicleFile& v) {
  auto& inertia = v.inertia_kg_m2;
  double u2 = 0.0;
  for (const host::Quantity& q : inertia) u2 += q.u * q.u;
  for (host::Quantity& largest : inertia) {
    double excess = 2.0 * largest.value;
    for (const host::Quantity& q : inertia) excess -= q.value;
    if (excess <= 0.0 || excess > kNothing * std::sqrt(u2)) continue;
    constexpr double kInside = 1.0 + 1e-9;  // past the bound by more than rounding
    for (host::Quantity& q : inertia) q.value += (&q == &largest ? -1.0 : 1.0) * kInside * excess * q.u * q.u / u2;
    return;
  }
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
        if (e.parameter == p) q = {e.value, e.u, Origin::flight};
      }
      found->parameters.push_back({std::string(terms.parameter(k).name), q});
    }
  }
}

// The rotors' inertia that yaw steps determined, or else their gyroscopic moment, is that of [torque_model] too: the controller shapes yaw by it.
void put_rotor_inertia(VehicleFile& v) {
  for (const std::string_view name : estimate::kRotorInertiaNames) {
    for (const host::VehicleEffect& e : v.effects) {
      for (const host::EffectParameter& p : e.parameters) {
        if ("effect." + e.id + "." + p.name != name || p.quantity.origin != Origin::flight || p.quantity.value <= 0.0) continue;
        const bool better = v.rotor_inertia_kg_m2.u <= 0.0 || p.quantity.u < v.rotor_inertia_kg_m2.u;
        if (better) v.rotor_inertia_kg_m2 = p.quantity;
        return;
      }
    }
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
      each([&](const estimate::Estimate& f, double w) { weights += w, sum += w * f.value, count += 1.0; });
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

VehicleFile identified_vehicle(const estimate::Fit& fit, const VehicleFile& base, const std::array<double, 2>& rpm_flown,
                               const std::string& written_by, const std::vector<std::string>& inputs) {
  VehicleFile v = base;
  SharedEstimates s = shared_estimates(fit);
  estimate::ModelValues values = fit.values.front();
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
    to_file(turn, turn) = estimate::right_jacobian(Eigen::Vector3d(values[estimate::kTurnX], values[estimate::kTurnY], values[estimate::kTurnZ]));
    const Eigen::MatrixXd c = to_file * u.asDiagonal() * s.correlation * u.asDiagonal() * to_file.transpose();
    for (Eigen::Index i = 0; i < n; ++i) s.estimates[static_cast<std::size_t>(i)].u = u[i] = std::sqrt(c(i, i));
    s.correlation = u.cwiseInverse().asDiagonal() * c * u.cwiseInverse().asDiagonal();
  }

  for (const estimate::Estimate& e : s.estimates) {
    if (host::Quantity* q = place_of(v, e.parameter)) {
      // A mass that only its prior knows is still the weighed one, unless the flights moved it beyond what the scales allow.
      const bool still_weighed = e.prior_share > 0.5 && std::fabs(e.value - q->value) <= q->u;
      const bool no_drag = e.parameter >= estimate::kCdh && e.parameter <= estimate::kCdz && e.value < 0.0 && e.value > -kNothing * e.u;
      *q = {no_drag ? 0.0 : e.value, e.u, still_weighed ? q->origin : Origin::flight};
    } else if (const int axis = e.parameter - estimate::kOffsetX; axis >= 0 && axis < 3) {
      v.pose_sensor.offset_m[static_cast<std::size_t>(axis)] = e.value;
      v.pose_sensor.offset_u_m[static_cast<std::size_t>(axis)] = e.u;
      v.pose_sensor.offset_origin = Origin::flight;
    } else if (const int about = e.parameter - estimate::kTurnX; about >= 0 && about < 3) {
      v.pose_sensor.rotation_u_rad[static_cast<std::size_t>(about)] = e.u;
      v.pose_sensor.rotation_origin = Origin::flight;
    }
  }
  onto_a_rigid_body(v);
  const Eigen::Quaterniond q = values.q_BS();
  v.pose_sensor.quaternion_wxyz = {q.w(), q.x(), q.y(), q.z()};
  put_effects(v, s, values);
  put_rotor_inertia(v);
  put_covariance(v, s, values.terms);

  const host::VehicleModel model = host::to_model(v);
  if (rpm_flown[1] > rpm_flown[0]) v.rpm_window = rpm_flown;
  if (fit.find(estimate::kK1) || fit.find(estimate::kK2)) {
    const DerivedQuantity c_t = propagated(fit, [&](const estimate::ModelValues& x) { return host::static_c_t(estimate::vehicle_model(x, model).thrust); });
    std::erase_if(v.static_thrust, [](const host::StaticThrust& t) { return t.origin == Origin::flight; });
    v.static_thrust.push_back(
        {Origin::flight, host::static_c_t(model.thrust), std::max(c_t.u, c_t.u_robust), v.rpm_window, v.air_density_kg_m3});
  }
  v.written_by = written_by;
  v.inputs = inputs;
  return v;
}

}  // namespace rotorloop::identify
