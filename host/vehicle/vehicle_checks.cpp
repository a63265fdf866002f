#include "host/vehicle/vehicle_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/base/constants.hpp"
#include "host/base/nearest.hpp"
#include "host/base/symmetric_matrix.hpp"
#include "host/vehicle/thrust.hpp"

namespace rotorloop::host {

namespace {

// Wider than the 0.4 to 0.75 that small propellers reach (bench values with their uncertainty must pass), far narrower than a
// unit error: RPM read as rad/s divides the figure by 9.5.
constexpr double kMeritLow = 0.3, kMeritHigh = 0.85;

std::string three(double x) { return fmt::format("{:.3g}", x); }
bool credible(double merit) { return merit >= kMeritLow && merit <= kMeritHigh; }

void check_merit(const VehicleFile& v, const TomlTable& root) {
  const ThrustModel si = to_model(v).thrust;
  const double merit = figure_of_merit(si, v.c_q_N_m_s2.value);
  if (credible(merit)) return;
  const double s = 1.0 / kRad_s_per_rpm;  // the same digits, taken as per RPM
  ThrustModel from_rpm = si;
  from_rpm.k1_N_s2 *= s * s;
  from_rpm.k2_N_s2_m *= s;
  const double merit_rpm = figure_of_merit(from_rpm, v.c_q_N_m_s2.value * s * s);
  const bool per_rpm = credible(merit_rpm);
  root.table("thrust_model")
      .fail(
          "k1_N_s2",
          fmt::format("[thrust_model] and [torque_model] give figure of merit {:.2f}, credible is {} to {}", merit, kMeritLow, kMeritHigh),
          per_rpm ? fmt::format("the values are per RPM (that reading gives {:.2f})", merit_rpm)
                  : std::string("radius, air density or c_q does not belong to this propeller"),
          per_rpm ? fmt::format("multiply k1 and c_q by {} and k2 by {}", three(s * s), three(s))
                  : std::string("measure c_t and c_q of one propeller on one stand, and give its radius in m"));
}

void check_hover(const VehicleFile& v, const TomlTable& root) {
  const double rpm = hover_omega_rad_s(to_model(v)) / kRad_s_per_rpm;
  if (rpm >= v.rpm_window[0] && rpm <= v.rpm_window[1]) return;
  root.table("thrust_model")
      .fail("rpm_window",
            fmt::format("hover needs {:.0f} RPM, outside thrust_model.rpm_window = {:.0f} to {:.0f} RPM", rpm, v.rpm_window[0],
                        v.rpm_window[1]),
            "mass and thrust model belong to different vehicles, or the window is not the fitted one",
            "correct body.mass_kg, or fit the thrust model where this vehicle flies");
}

void check_window(const TomlTable& t, const std::array<double, 2>& window, std::string_view prefix) {
  if (window[0] < window[1]) return;
  t.fail("rpm_window", fmt::format("{}rpm_window = {:.0f} to {:.0f} RPM is empty", prefix, window[0], window[1]), "ends swapped",
         "give the lower speed first");
}

void check_inertia(const VehicleFile& v, const TomlTable& root) {
  const double x = v.inertia_kg_m2[0].value, y = v.inertia_kg_m2[1].value, z = v.inertia_kg_m2[2].value;
  const double largest = std::max({x, y, z});
  if (2.0 * largest <= x + y + z) return;
  root.table("body").fail(
      "inertia_kg_m2",
      fmt::format("body.inertia_kg_m2 = {}, {}, {} kg m²: the largest exceeds the sum of the others", three(x), three(y), three(z)),
      "a slipped digit, or inertias about another point than the centre of mass", "no rigid body has such inertias; correct the odd one");
}

void check_rotors(const VehicleFile& v, const TomlTable& root) {
  constexpr std::array<std::string_view, kRotors> place{"front-right", "rear-left", "front-left", "rear-right"};
  constexpr std::array<int, kRotors> sign_x{1, -1, 1, -1}, sign_y{-1, 1, 1, -1}, reaction{-1, -1, 1, 1};
  const auto tables = root.tables("rotor", kRotors, kRotors);
  // Rotors 1 and 2 turn one way, rotors 3 and 4 the other: outwards at the nose as most do, or inwards ("props in" and "props out").
  int sense = -1;
  for (std::size_t i = 0; i < kRotors; ++i) sense = v.rotors[i].reaction == -reaction[i] ? sense : 1;
  for (std::size_t i = 0; i < kRotors; ++i) {
    const double x = v.rotors[i].position_m[0] - v.com_offset_m[0].value, y = v.rotors[i].position_m[1] - v.com_offset_m[1].value;
    constexpr double kArmMin_m = 0.01;
    if (x * sign_x[i] < kArmMin_m || y * sign_y[i] < kArmMin_m)
      tables[i].fail("position_m",
                     fmt::format("rotor {} is at x = {} m, y = {} m from the centre of mass, but rotor {} is the {} one", i + 1, three(x),
                                 three(y), i + 1, place[i]),
                     "rotors listed in another order, or y taken to the right",
                     "list front-right, rear-left, front-left, rear-right, with x forward and y left");
    if (v.rotors[i].reaction != sense * reaction[i])
      tables[i].fail(
          "reaction",
          fmt::format("rotor {} ({}) has reaction = {}, expected {}", i + 1, place[i], v.rotors[i].reaction, sense * reaction[i]),
          "the sense of rotation was given instead of the torque on the body, or one motor turns the wrong way",
          "rotors 1 and 2 turn the body one way (-1: clockwise from above, or all four reversed), rotors 3 and 4 the other");
  }
}

void check_pose_sensor(const VehicleFile& v, const TomlTable& root) {
  const auto& q = v.pose_sensor.quaternion_wxyz;
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (std::fabs(norm - 1.0) <= 0.01) return;
  root.table("pose_sensor")
      .table("quaternion_wxyz")
      .fail("value", fmt::format("pose_sensor.quaternion_wxyz has norm {}, expected 1 within 0.01", three(norm)),
            "rounded too hard, or not a quaternion in the order w, x, y, z", "give w, x, y, z of a unit quaternion");
}

void check_covariance(const VehicleFile& v, const TomlTable& root) {
  const auto tables = root.tables("covariance", 0, 100);
  for (std::size_t b = 0; b < v.covariance.size(); ++b) {
    const CovarianceBlock& block = v.covariance[b];
    const std::size_t n = block.of.size();
    if (block.matrix.size() != n * n)
      tables[b].fail("matrix", fmt::format("covariance of {} quantities has {} numbers, expected {}", n, block.matrix.size(), n * n),
                     "only one triangle was given", "give the full matrix, row by row");
    Eigen::MatrixXd correlation(n, n);
    for (std::size_t i = 0; i < n; ++i) {
      const auto u = uncertainty_of(v, block.of[i]);
      if (!u)
        tables[b].fail("of", fmt::format("covariance names \"{}\", which is no quantity of this file", block.of[i]), "a misspelt name",
                       fmt::format("{}use one of: {}, or effect.ID.PARAMETER", did_you_mean(block.of[i], quantity_names()),
                                   fmt::join(quantity_names(), ", ")));
      const double variance = block.matrix[i * n + i], sigma = variance > 0.0 ? std::sqrt(variance) : 0.0;
      if (std::fabs(sigma - *u) > 0.05 * std::max(sigma, *u) || variance <= 0.0)
        tables[b].fail(
            "matrix",
            fmt::format("covariance gives {} a standard uncertainty of {}, but its u is {}", block.of[i], three(sigma), three(*u)),
            "standard deviations instead of variances on the diagonal, or one of the two was not updated", "put u² on the diagonal");
      for (std::size_t j = 0; j < n; ++j) {
        const double a = block.matrix[i * n + j], c = block.matrix[j * n + i];
        if (std::fabs(a - c) > 1e-6 * std::max(std::fabs(a), std::fabs(c)))
          tables[b].fail("matrix",
                         fmt::format("covariance is not symmetric: {} and {} for {} and {}", three(a), three(c), block.of[i], block.of[j]),
                         "a slipped number", "give the same value on both sides of the diagonal");
        correlation(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
            a / std::sqrt(block.matrix[i * n + i] * std::max(block.matrix[j * n + j], 1e-300));
      }
    }
    const double least = symmetric_eigenvalues(correlation).minCoeff();
    if (least < -1e-6)
      tables[b].fail("matrix",
                     fmt::format("covariance is not positive semi-definite (least eigenvalue of the correlations {})", three(least)),
                     "a correlation beyond ±1", "check the off-diagonal values against the product of the uncertainties");
  }
}

}  // namespace

namespace {

// The effect's law counts from the ceiling, which no flight log holds.
void check_room(const VehicleFile& v, const TomlTable& root) {
  for (const TomlTable& t : root.tables("effect", 0, 100)) {
    if (t.text("id") == effect("ceiling_effect").id && !v.ceiling_z_m)
      t.fail("id", "effect \"ceiling_effect\" without the height of the ceiling", "the room was not described",
             "add [room] with ceiling_z_m, its height in m in the world of the logs, 0.2 to 1000 m");
  }
}

// A rotor that takes power turns against its torque at every advance ratio of the range.
void check_advance(const VehicleFile& v, const TomlTable& root) {
  if (!v.advance) return;
  const auto& [low, high] = v.advance->j_range;
  const TomlTable torque = root.table("torque_model");
  if (!(low < high))
    torque.fail("j_range", fmt::format("from {} to {} is no range", low, high), "its ends are exchanged", "give the least J first");
  const double most = std::max(low * low, high * high), least = v.c_q_N_m_s2.value + std::min(0.0, v.advance->c_q2_N_m_s2.value * most);
  if (!(least > 0.0))
    torque.fail("c_q2_N_m_s2", fmt::format("c_q(J) falls to {} N m s² within j_range, must stay above 0", three(least)),
                "a windmilling propeller was measured, or the sign is wrong", "end j_range where the torque still is well above 0");
}

}  // namespace

void check_vehicle(const VehicleFile& v, const TomlTable& root) {
  check_window(root.table("thrust_model"), v.rpm_window, "thrust_model.");
  const auto found = root.tables("static_thrust", 0, 20);
  for (std::size_t i = 0; i < found.size(); ++i) check_window(found[i], v.static_thrust[i].rpm_window, "static_thrust.");
  check_merit(v, root);
  check_hover(v, root);
  check_inertia(v, root);
  check_rotors(v, root);
  check_pose_sensor(v, root);
  check_room(v, root);
  check_advance(v, root);
  check_covariance(v, root);
}

namespace {

// How well a quantity is known and from where; its value is not asked here (a rotation has none by axis).
struct Known {
  double u = 0.0;
  Origin origin = Origin::guess;
};
Known of(const Quantity& q) { return {q.u, q.origin}; }
Known offset_of(const VehicleFile& v, std::size_t axis) { return {v.pose_sensor.offset_u_m[axis], v.pose_sensor.offset_origin}; }
Known rotation_of(const VehicleFile& v, std::size_t axis) { return {v.pose_sensor.rotation_u_rad[axis], v.pose_sensor.rotation_origin}; }

struct Named {
  std::string_view name;
  Known (*known)(const VehicleFile&);
};

constexpr std::array kNamed{
    Named{"body.mass", [](const VehicleFile& v) { return of(v.mass_kg); }},
    Named{"body.inertia.xx", [](const VehicleFile& v) { return of(v.inertia_kg_m2[0]); }},
    Named{"body.inertia.yy", [](const VehicleFile& v) { return of(v.inertia_kg_m2[1]); }},
    Named{"body.inertia.zz", [](const VehicleFile& v) { return of(v.inertia_kg_m2[2]); }},
    Named{"body.com_offset.x", [](const VehicleFile& v) { return of(v.com_offset_m[0]); }},
    Named{"body.com_offset.y", [](const VehicleFile& v) { return of(v.com_offset_m[1]); }},
    Named{"thrust_model.k1", [](const VehicleFile& v) { return of(v.k1_N_s2); }},
    Named{"thrust_model.k2", [](const VehicleFile& v) { return of(v.k2_N_s2_m); }},
    Named{"torque_model.c_q", [](const VehicleFile& v) { return of(v.c_q_N_m_s2); }},
    Named{"torque_model.c_q2", [](const VehicleFile& v) { return v.advance ? of(v.advance->c_q2_N_m_s2) : Known{}; }},
    Named{"torque_model.rotor_inertia", [](const VehicleFile& v) { return of(v.rotor_inertia_kg_m2); }},
    Named{"drag.c_dh", [](const VehicleFile& v) { return of(v.c_dh_s_m); }},
    Named{"drag.c_dxy", [](const VehicleFile& v) { return of(v.c_dxy_N_s2_m2); }},
    Named{"drag.c_dz", [](const VehicleFile& v) { return of(v.c_dz_N_s2_m2); }},
    Named{"pose_sensor.offset.x", [](const VehicleFile& v) { return offset_of(v, 0); }},
    Named{"pose_sensor.offset.y", [](const VehicleFile& v) { return offset_of(v, 1); }},
    Named{"pose_sensor.offset.z", [](const VehicleFile& v) { return offset_of(v, 2); }},
    Named{"pose_sensor.rotation.x", [](const VehicleFile& v) { return rotation_of(v, 0); }},
    Named{"pose_sensor.rotation.y", [](const VehicleFile& v) { return rotation_of(v, 1); }},
    Named{"pose_sensor.rotation.z", [](const VehicleFile& v) { return rotation_of(v, 2); }},
};

std::optional<Known> known_of(const VehicleFile& v, std::string_view quantity_name) {
  for (const Named& n : kNamed)
    if (n.name == quantity_name) return n.known(v);
  for (const VehicleEffect& e : v.effects)
    for (const EffectParameter& p : e.parameters)
      if (quantity_name == "effect." + e.id + "." + p.name) return of(p.quantity);
  return std::nullopt;
}

}  // namespace

std::vector<std::string> quantity_names() {
  std::vector<std::string> out;
  for (const Named& n : kNamed) out.emplace_back(n.name);
  return out;
}

std::optional<double> uncertainty_of(const VehicleFile& v, std::string_view quantity_name) {
  const auto known = known_of(v, quantity_name);
  return known ? std::optional(known->u) : std::nullopt;
}

std::optional<Origin> origin_of(const VehicleFile& v, std::string_view quantity_name) {
  const auto known = known_of(v, quantity_name);
  return known ? std::optional(known->origin) : std::nullopt;
}

}  // namespace rotorloop::host
