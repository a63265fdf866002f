#include "bench/sysid/diagnose/residuals/flight_inputs.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/sysid/estimate/model/rotations.hpp"
#include "host/effects/loads.hpp"

namespace rotorloop::diagnose {
namespace {

using Eigen::Vector3d;

// In the order in which add_flight_inputs() writes them.
struct InputName {
  const char *id, *name, *unit;
};
constexpr InputName kInputs[] = {
    {"v_x", "speed forward", "m/s"},
    {"v_y", "speed to the left", "m/s"},
    {"v_z", "speed upward along the thrust", "m/s"},
    {"v_xy", "speed across the thrust", "m/s"},
    {"roll", "roll", "rad"},
    {"pitch", "pitch", "rad"},
    {"heading", "heading", "rad"},
    {"rate_x", "roll rate", "rad/s"},
    {"rate_y", "pitch rate", "rad/s"},
    {"rate_z", "yaw rate", "rad/s"},
    {"height", "height", "m"},
    {"place_x", "place in x", "m"},
    {"place_y", "place in y", "m"},
    {"time", "time in the flight", "s"},
    {"omega", "mean rotor speed", "rad/s"},
    {"omega_roll", "rotor speed, left less right", "rad/s"},
    {"omega_pitch", "rotor speed, rear less front", "rad/s"},
    {"omega_yaw", "rotor speed, + less − reaction", "rad/s"},
    {"omega_dot", "mean rotor acceleration", "rad/s2"},
    {"omega_dot_roll", "rotor acceleration, left less right", "rad/s2"},
    {"omega_dot_pitch", "rotor acceleration, rear less front", "rad/s2"},
    {"omega_dot_yaw", "rotor acceleration, + less − reaction", "rad/s2"},
    {"thrust", "thrust of the model", "N"},
    {"battery", "battery voltage", "V"},
};

double sign_of(double v) { return v > 0.0 ? 1.0 : v < 0.0 ? -1.0 : 0.0; }

// A quarter of the sum over rotors, each with its sign.
double pattern(const std::array<double, 4>& v, const std::array<double, 4>& sign) {
  double sum = 0.0;
  for (std::size_t i = 0; i < 4; ++i) sum += 0.25 * sign[i] * v[i];
  return sum;
}

estimate::BodyState between(const estimate::BodyState& a, const estimate::BodyState& b) {
  return estimate::moved(a, 0.5 * estimate::difference(a, b));
}

// Signs of the rotors in the sum, and in its differences about the three axes.
struct RotorPatterns {
  std::array<double, 4> one{}, roll{}, pitch{}, yaw{};
  explicit RotorPatterns(const host::LoadGeometry& geometry) {
    for (std::size_t i = 0; i < 4; ++i) {
      one[i] = 1.0;
      roll[i] = sign_of(geometry.rotors[i].position_m.y());
      pitch[i] = -sign_of(geometry.rotors[i].position_m.x());
      yaw[i] = geometry.rotors[i].reaction;
    }
  }
};

// The state in the middle of a step, with what the rotors do there.
SampleState sample_state(const estimate::ModelValues& values, const estimate::BodyState& x, const estimate::RotorInputSample& u,
                         double& thrust) {
  const host::LoadGeometry& geometry = values.geometry;
  host::LoadParameters<double> p;
  p.k1_N_s2 = values[estimate::kK1];
  p.k2_N_s2_m = values[estimate::kK2];
  SampleState s;
  s.x = x;
  s.v_B_m_s = x.q_WB.toRotationMatrix().transpose() * x.v_W_m_s;
  s.omega_rad_s = u.omega_rad_s;
  thrust = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    double through = 0.0;
    s.thrust_N[i] = host::rotor_thrust(p, geometry, u.omega_rad_s[i], {s.v_B_m_s.x(), s.v_B_m_s.y(), s.v_B_m_s.z()}, through);
    s.arm_B_m[i] = geometry.rotors[i].position_m - Vector3d(values[estimate::kComX], values[estimate::kComY], geometry.com_z_m);
    s.yaw_by_omega_N_m_s[i] = 2.0 * values[estimate::kCq] * u.omega_rad_s[i] * geometry.rotors[i].reaction;
    thrust += s.thrust_N[i];
  }
  const double disk_m2 = std::numbers::pi * geometry.radius_m * geometry.radius_m;
  s.induced_hover_m_s = std::sqrt(std::max(0.0, 0.25 * thrust) / (2.0 * geometry.air_density_kg_m3 * disk_m2));
  s.mass_kg = values[estimate::kMass];
  return s;
}

// Wind is motion through the air the other way.
void differentiate_by_wind(const estimate::Model& model, const estimate::RotorInputSample& u, double t, SampleState& s) {
  constexpr double kStep_m_s = 0.05;
  for (Eigen::Index a = 0; a < 2; ++a) {
    estimate::BodyState with = s.x, against = s.x;
    with.v_W_m_s[a] -= kStep_m_s;
    against.v_W_m_s[a] += kStep_m_s;
    const estimate::Instant more = model.instant(with, u, t), less = model.instant(against, u, t);
    s.wrench_by_wind.col(a) << more.force_B_N - less.force_B_N, more.torque_B_N_m - less.torque_B_N_m;
  }
  s.wrench_by_wind /= 2.0 * kStep_m_s;
}

std::array<double, std::size(kInputs)> input_row(const SampleState& s, const estimate::RotorInputSample& u, const RotorPatterns& by,
                                                 double flown_s, double thrust) {
  const Eigen::Matrix3d r = s.x.q_WB.toRotationMatrix();
  const Vector3d& w = s.x.w_B_rad_s;
  return {s.v_B_m_s.x(),
          s.v_B_m_s.y(),
          s.v_B_m_s.z(),
          std::hypot(s.v_B_m_s.x(), s.v_B_m_s.y()),
          std::atan2(r(2, 1), r(2, 2)),
          -std::asin(std::clamp(r(2, 0), -1.0, 1.0)),
          std::atan2(r(1, 0), r(0, 0)),
          w.x(),
          w.y(),
          w.z(),
          s.x.p_W_m.z(),
          s.x.p_W_m.x(),
          s.x.p_W_m.y(),
          flown_s,
          pattern(u.omega_rad_s, by.one),
          pattern(u.omega_rad_s, by.roll),
          pattern(u.omega_rad_s, by.pitch),
          pattern(u.omega_rad_s, by.yaw),
          pattern(u.omega_dot_rad_s2, by.one),
          pattern(u.omega_dot_rad_s2, by.roll),
          pattern(u.omega_dot_rad_s2, by.pitch),
          pattern(u.omega_dot_rad_s2, by.yaw),
          thrust,
          u.battery_V};
}

}  // namespace

std::vector<Channel> input_channels() {
  std::vector<Channel> out;
  for (const InputName& n : kInputs) out.push_back({n.id, n.name, n.unit, {}, false});
  return out;
}

std::vector<Channel> products_of_motion(const std::vector<Channel>& inputs) {
  constexpr const char* kMotion[] = {"rate_x", "rate_y", "rate_z", "v_x", "v_y", "v_z"};
  std::vector<Channel> out;
  const auto find = [&](const char* id) {
    return std::find_if(inputs.begin(), inputs.end(), [&](const Channel& c) { return c.id == id; });
  };
  for (std::size_t i = 0; i < std::size(kMotion); ++i) {
    for (std::size_t j = i + 1; j < std::size(kMotion); ++j) {
      const auto a = find(kMotion[i]), b = find(kMotion[j]);
      if (a == inputs.end() || b == inputs.end()) continue;
      Channel c{a->id + "*" + b->id, a->name + " times " + b->name, a->unit + " " + b->unit, {}, true};
      for (std::size_t k = 0; k < a->value.size(); ++k) c.value.push_back(a->value[k] * b->value[k]);
      out.push_back(std::move(c));
    }
  }
  return out;
}

void add_flight_inputs(const estimate::GridFlight& g, const estimate::ModelValues& values, const std::vector<estimate::BodyState>& states,
                       std::vector<SampleState>& out, std::vector<Channel>& inputs, Axes& wrench) {
  const estimate::Model model(values);
  estimate::RotorInput input = g.input;
  input.prepare(values);
  const RotorPatterns patterns(values.geometry);
  std::size_t hint = 0;
  for (std::size_t k = 0; k + 1 < g.nodes; ++k) {
    if (!g.linked[k]) continue;
    const double t = g.time_s(k) + 0.5 * g.step_s;
    const estimate::RotorInputSample u = input.at(t, hint, false);
    double thrust = 0.0;
    SampleState s = sample_state(values, between(states[k], states[k + 1]), u, thrust);
    s.step_s = g.step_s;
    const estimate::Instant now = model.instant(s.x, u, t);
    for (std::size_t a = 0; a < 3; ++a) {
      wrench[a].push_back(now.force_B_N[static_cast<Eigen::Index>(a)]);
      wrench[a + 3].push_back(now.torque_B_N_m[static_cast<Eigen::Index>(a)]);
    }
    differentiate_by_wind(model, u, t, s);
    const auto row = input_row(s, u, patterns, t - g.start_s, thrust);
    for (std::size_t i = 0; i < inputs.size(); ++i) inputs[i].value.push_back(row[i]);
    out.push_back(std::move(s));
  }
}

}  // namespace rotorloop::diagnose
