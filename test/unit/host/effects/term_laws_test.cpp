// Each term obeys the law that effects/catalogue.toml states for it: the sign, and the size given there as typical for the paper's vehicle.
#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "test/unit/host/effects/flown.hpp"

namespace rotorloop::host {
namespace {

constexpr double kRad = 3.14159265358979323846 / 180.0;

struct Change {
  const Wrench &with, &without;
  Eigen::Vector3d force() const { return with.force - without.force; }
  Eigen::Vector3d torque() const { return with.torque - without.torque; }
  double thrust_share(std::size_t i = 0) const { return with.rotor[i].thrust_N / without.rotor[i].thrust_N - 1.0; }
  double torque_share(std::size_t i = 0) const { return with.rotor[i].torque_N_m / without.rotor[i].torque_N_m - 1.0; }
};
using Flight = std::function<void(LoadInput<double>&)>;  // changes hover
using Measure = std::function<double(const Change&)>;

struct Law {
  std::string id;
  std::vector<double> values;
  std::string words;
  Flight flight;
  Measure measure;
  double low, high;
};

Flight still() {
  return [](LoadInput<double>&) {};
}
Flight moving(double x, double y, double z) {
  return [=](LoadInput<double>& in) { in.v_B_m_s = {x, y, z}; };
}
Flight turning(double p, double q, double r) {
  return [=](LoadInput<double>& in) { in.rates_B_rad_s = {p, q, r}; };
}
Flight at(double x, double y, double z) {
  return [=](LoadInput<double>& in) { in.p_W_m = {x, y, z}; };
}
Flight heading_north() {  // the nose along y of the world
  return [](LoadInput<double>& in) { in.world_B = {{{0, -1, 0}, {1, 0, 0}, {0, 0, 1}}}; };
}
Flight speeding_up(double rad_s2) {
  return [=](LoadInput<double>& in) { in.omega_dot_rad_s2 = {rad_s2, 0, 0, 0}; };
}
Flight rotor_1_alone(Flight flight) {
  return [=](LoadInput<double>& in) {
    flight(in);
    in.omega_rad_s = {945.0, 0, 0, 0};
  };
}
Flight all_at(double rad_s) {
  return [=](LoadInput<double>& in) { in.omega_rad_s.fill(rad_s); };
}
Measure force(int axis) {
  return [=](const Change& c) { return c.force()[axis]; };
}
Measure torque(int axis) {
  return [=](const Change& c) { return c.torque()[axis]; };
}
Measure thrust(std::size_t i = 0) {
  return [=](const Change& c) { return c.thrust_share(i); };
}
Measure shaft(std::size_t i = 0) {
  return [=](const Change& c) { return c.torque_share(i); };
}

constexpr double R = 0.0635;

const std::vector<Law>& laws() {
  static const std::vector<Law> all{
      // sensors of rotor speed
      {"rotor_speed_scale", {0.03, 0, 0, 0}, "N: rotor 1 turns slower than reported", still(), thrust(0), -0.061, -0.055},
      {"rotor_speed_delay",
       {0.01},
       "reports of a rotor that speeds up are late: it turns faster",
       speeding_up(5000),
       thrust(0),
       0.10,
       0.12},
      // air
      {"wind_steady", {2, 0, 0}, "N: asks for 2 degrees of tilt", still(), force(0), 0.2, 0.28},
      {"wind_steady", {0, 2, 0}, "N", still(), force(1), 0.2, 0.28},
      {"wind_steady", {0, 0, 1}, "rising air lifts", still(), force(2), 0.1, 1.0},
      {"wind_shear", {0.5, 0}, "N at 2 m of height: wind of 1 m/s", at(0, 0, 2), force(0), 0.1, 0.14},
      {"air_density", {0.95}, "share of thrust", still(), thrust(), -0.0501, -0.0499},
      {"air_density", {0.95}, "share of torque", still(), shaft(), -0.0501, -0.0499},
      {"air_density", {0.5}, "N: half of 0.40 N of body drag and of the rotors' 1.0 N", moving(8.5, 0, 0), force(0), 0.6, 0.85},
      // inflow
      {"rotor_local_inflow", {1}, "N m: roll at 1 rad/s is damped", turning(1, 0, 0), torque(0), -2.0e-3, -1.6e-3},
      {"axial_inflow", {0}, "share of thrust that a climb of 3.1 m/s costs", moving(0, 0, 3.1), thrust(), 0.10, 0.14},
      {"axial_inflow", {0}, "and descent gains", moving(0, 0, -2), thrust(), -0.10, -0.02},
      {"translational_lift", {0}, "share of thrust that 8.5 m/s give", moving(6, 6.02, 0), thrust(), -0.15, -0.08},
      {"rotor_wake_interference", {0.35}, "N m: nose-up at 8.5 m/s", moving(8.5, 0, 0), torque(1), -57e-3, -19e-3},
      {"rotor_wake_interference", {0.35}, "N m: nose-down backwards", moving(-8.5, 0, 0), torque(1), 19e-3, 57e-3},
      {"rotor_wake_thrust_loss", {0.1, 0.5}, "N m: nose-up at 8.5 m/s", moving(8.5, 0, 0), torque(1), -57e-3, -19e-3},
      {"rotor_wake_thrust_loss", {0.1, 0.5}, "N m: nose-down backwards", moving(-8.5, 0, 0), torque(1), 19e-3, 57e-3},
      {"rotor_wake_thrust_loss", {0.1, 0.5}, "share of thrust of rotor 2, rear left", moving(8.5, 0, 0), thrust(1), -0.0708, -0.06},
      {"rotor_wake_thrust_loss", {0.1, 0.5}, "nothing at rotor 1, front right", moving(8.5, 0, 0), thrust(0), -1e-12, 1e-12},
      {"rotor_wake_thrust_loss", {0.1, 0.5}, "all of it along a diagonal, rotor 4", moving(12, 12, 0), thrust(3), -0.1, -0.097},
      {"rotor_wake_thrust_loss", {0.1, 0.5}, "torque stays", moving(8.5, 0, 0), shaft(), -1e-12, 1e-12},
      {"rotor_wake_thrust_loss", {0.1, 0.5}, "a tenth and less of it at 0.5 m/s", moving(0.5, 0, 0), thrust(1), -0.013, -0.004},
      {"rotor_wake_thrust_loss", {0.1, 0.5}, "nothing in climb", moving(0, 0, 3), thrust(), -1e-12, 1e-12},
      {"rotor_pair_interaction",
       {0.3, 0, 0},
       "N m: in flight to the left the left side, ahead, is lifted",
       moving(0, 8.5, 0),
       torque(0),
       19e-3,
       57e-3},
      {"rotor_pair_interaction",
       {0.3, 0, 0},
       "share of thrust of rotor 1, front right, behind in flight to the left",
       moving(0, 8.5, 0),
       thrust(0),
       -0.15,
       -0.04},
      {"rotor_pair_interaction", {0.3, 0, 0}, "nothing straight ahead", moving(8.5, 0, 0), thrust(1), -1e-12, 1e-12},
      {"rotor_pair_interaction", {0, 0.3, 0}, "N m: nose-up straight ahead", moving(8.5, 0, 0), torque(1), -57e-3, -19e-3},
      {"rotor_pair_interaction", {0, 0.3, 0}, "nothing at the front rotor", moving(8.5, 0, 0), thrust(0), -1e-12, 1e-12},
      {"rotor_pair_interaction",
       {0, -0.3, 0},
       "share of thrust of rotor 2, rear left: of either sign",
       moving(8.5, 0, 0),
       thrust(1),
       0.04,
       0.15},
      {"rotor_pair_interaction",
       {0, 0, 0.3},
       "share of thrust of rotor 4, rear right, along its diagonal",
       moving(6.01, 6.01, 0),
       thrust(3),
       -0.15,
       -0.04},
      {"rotor_pair_interaction", {0, 0, 0.3}, "the rotor ahead on it gains", moving(6.01, 6.01, 0), thrust(2), 0.04, 0.15},
      {"rotor_pair_interaction", {0, 0, 0.3}, "nothing at 45 degrees to both diagonals", moving(8.5, 0, 0), thrust(3), -1e-12, 1e-12},
      {"rotor_pair_interaction", {0, 0, 0.3}, "the other way beyond them", moving(-2, 8.26, 0), thrust(3), 0.005, 0.1},
      {"hover_interference", {0.03}, "share of thrust in hover", still(), thrust(), -0.0301, -0.0299},
      {"hover_interference", {0.03}, "little of it at 12 m/s", moving(12, 0, 0), thrust(), -0.006, -1e-4},
      {"descent_inflow", {0.17}, "share of thrust at 3.1 m/s of descent", moving(0, 0, -3.1), thrust(), -0.031, -0.024},
      {"descent_inflow", {0.17}, "nothing in climb", moving(0, 0, 3.1), thrust(), -1e-12, 1e-12},
      {"descent_inflow", {0.17}, "at most this share", moving(0, 0, -12.0), thrust(), -0.1701, -0.1699},
      {"vortex_ring_loss", {0.15}, "share of thrust in the ring", moving(0, 0, -8.0), thrust(), -0.15, -0.12},
      {"vortex_ring_loss", {0.15}, "nothing in slow descent", moving(0, 0, -1.5), thrust(), -1e-12, 1e-12},
      {"vortex_ring_loss", {0.15}, "nothing when it also moves sideways", moving(10, 0, -8), thrust(), -1e-12, 1e-12},
      // surroundings
      {"ground_effect_rotor", {1}, "share of thrust, 1 R", at(0, 0, R), thrust(), 0.064, 0.070},
      {"ground_effect_rotor", {1}, "share of thrust, 2 R", at(0, 0, 2 * R), thrust(), 0.015, 0.017},
      {"ground_effect_rotor", {1}, "share of thrust, 3 R", at(0, 0, 3 * R), thrust(), 0.0065, 0.0075},
      {"ground_effect_vehicle", {1}, "share of thrust, 1 R", at(0, 0, R), thrust(), 0.14, 0.18},
      {"ground_effect_vehicle", {1}, "share of thrust, 2 R", at(0, 0, 2 * R), thrust(), 0.08, 0.10},
      {"ground_effect_vehicle", {1}, "share of thrust, 5 R", at(0, 0, 5 * R), thrust(), 0.023, 0.029},
      {"ceiling_effect", {1}, "share of thrust, 1 R below 3 m", at(0, 0, 3.0 - R), thrust(), 0.064, 0.070},
      // thrust
      {"thrust_scale", {0.95}, "share of thrust", still(), thrust(), -0.0501, -0.0499},
      {"blockage_strut", {0.08}, "share of thrust", still(), thrust(), -0.0801, -0.0799},
      {"blockage_strut", {0.08}, "torque is unchanged", still(), shaft(), -1e-12, 1e-12},
      {"thrust_speed_exponent", {0.05}, "share of thrust at 147 rad/s", all_at(147), thrust(), -0.092, -0.086},
      {"thrust_speed_cubed", {1e-10}, "N of four rotors at 1000 rad/s", all_at(1000), force(2), 0.399, 0.401},
      {"thrust_speed_cubed", {1e-10}, "and eight times that at 2000 rad/s", all_at(2000), force(2), 3.19, 3.21},
      {"high_advance_thrust",
       {0.05},
       "share of thrust at 8.5 m/s: 32 mN of the 1.67 N of hover",
       moving(6, 6.02, 0),
       thrust(),
       0.012,
       0.022},
      {"high_advance_thrust", {0.05}, "nothing in a climb", moving(0, 0, 3), thrust(), -1e-12, 1e-12},
      {"weak_rotor", {-0.04, 0, 0, 0}, "N m: rolls towards the weak rotor, front right", still(), torque(0), 5e-3, 7e-3},
      {"weak_rotor", {-0.04, 0, 0, 0}, "N m: pitches towards it", still(), torque(1), 5e-3, 7e-3},
      {"thrust_drift", {-1e-3}, "share of thrust of each rotor, 20 s after the start", still(), thrust(3), -0.0201, -0.0199},
      {"thrust_drift", {-1e-3}, "torque stays", still(), shaft(), -1e-12, 1e-12},
      {"rotor_thrust_drift", {-2e-3, 0, 0, 0}, "N m: after 20 s as weak_rotor of -0.04", still(), torque(0), 5e-3, 7e-3},
      {"rotor_thrust_drift", {-2e-3, 0, 0, 0}, "nothing at rotor 2", still(), thrust(1), -1e-12, 1e-12},
      {"mass_drift", {-1e-3}, "N: 6.7 N carry 2 % less mass after 20 s, as if they were 2 % more", still(), force(2), 0.135, 0.138},
      {"mass_drift", {-1e-3}, "thrust stays", still(), thrust(), -1e-12, 1e-12},
      {"thrust_lag", {0.002}, "share of thrust while it speeds up by 5 rad/s a ms", speeding_up(5000), thrust(), -0.023, -0.019},
      {"thrust_lag", {0.002}, "share of torque", speeding_up(5000), shaft(), -0.023, -0.019},
      {"dynamic_inflow", {1}, "more thrust while it speeds up", speeding_up(5000), thrust(), 1e-3, 0.02},
      // torque
      {"torque_advance",
       {1},
       "share of torque at 8.5 m/s: profile and induced part change by as much",
       moving(8.5, 0, 0),
       shaft(),
       -0.03,
       0.06},
      {"torque_advance", {1}, "little in a climb at 3.1 m/s", moving(0, 0, 3.1), shaft(), -0.03, 0.08},
      {"inflow_torque",
       {1.9e-6},
       "share of torque in a climb at 3.1 m/s, with the flow that it adds",
       moving(0, 0, 3.1),
       shaft(),
       0.05,
       0.25},
      {"torque_speed_exponent", {-0.1}, "share of torque at 1.5 times hover speed", all_at(945 * 1.5), shaft(), -0.045, -0.035},
      {"rotor_torque_scale", {0.1, 0, 0, 0}, "N m: counter-clockwise rotor 1 turns the body clockwise", still(), torque(2), -3e-3, -2.6e-3},
      // drag of the rotors
      {"rotor_drag",
       {0},
       "N of 1.01 at 8.5 m/s with the thrust of hover, which edgewise flight raises",
       moving(8.5, 0, 0),
       force(0),
       0.95,
       1.2},
      {"rotor_body_interference", {1.56}, "N: 56 % more", moving(8.5, 0, 0), force(0), -0.68, -0.53},
      {"rotor_drag_with_speed", {3.1e-5}, "N at 8.5 m/s", moving(8.5, 0, 0), force(0), -1.1, -0.9},
      {"rotor_drag_with_inflow", {2.5e-3}, "N at 1 m/s with 7.4 m/s through the disks", moving(1, 0, 0), force(0), -78e-3, -70e-3},
      {"rotor_drag_with_inflow", {2.5e-3}, "N: a third more in a climb of 4 m/s", moving(1, 0, 4), force(0), -105e-3, -85e-3},
      {"rotor_drag_at_hubs", {1}, "N m: yaw at 1 rad/s is damped", turning(0, 0, 1), torque(2), -2.0e-3, -1.6e-3},
      {"rotor_plane_height", {0.02}, "N m: nose-up at 8.5 m/s", moving(8.5, 0, 0), torque(1), -24e-3, -19e-3},
      // flapping
      {"blade_flapping",
       {2.7e-4},
       "N: rotor 1 leans left by 0.13 degrees at 8.5 m/s",
       rotor_1_alone(moving(8.5, 0, 0)),
       force(1),
       3e-3,
       5e-3},
      {"soft_flapping", {1}, "N: 5.2 degrees back at 8.5 m/s", moving(8.5, 0, 0), force(0), -0.75, -0.55},
      {"soft_flapping", {1}, "N: stays behind by 2 degrees for 1 rad/s nose-down", turning(0, 1, 0), force(0), -0.27, -0.20},
      {"lateral_flapping", {2e-6}, "N: rotor 1 is pushed to the left", rotor_1_alone(moving(8.5, 0, 0)), force(1), 15e-3, 17e-3},
      {"rotor_rolling_moment", {1e-6}, "N m: rotor 1 rolls left-side-down", rotor_1_alone(moving(8.5, 0, 0)), torque(0), -8.2e-3, -7.8e-3},
      {"hub_moment", {0, 2.3e-6}, "N m: nose-up at 1 m/s", moving(1, 0, 0), torque(1), -9.2e-3, -8.2e-3},
      {"hub_moment", {2.3e-6, 0}, "N m: left side up at 1 m/s to the left", moving(0, 1, 0), torque(0), 8.2e-3, 9.2e-3},
      {"induced_flow_moment", {0, 5e-4}, "N m: nose-up at 1 m/s, four rotors of 7.4 m/s", moving(1, 0, 0), torque(1), -15.5e-3, -14e-3},
      {"induced_flow_moment", {5e-4, 0}, "N m: left side up at 1 m/s to the left", moving(0, 1, 0), torque(0), 14e-3, 15.5e-3},
      {"induced_flow_moment",
       {0, 5e-4},
       "N m: at 12 m/s four of 5.1 m/s, by momentum theory at 20 % more thrust",
       moving(12, 0, 0),
       torque(1),
       -130e-3,
       -110e-3},
      // inertia of the rotors
      {"rotor_inertia_reaction", {9.4e-6}, "N m: rotor 1 speeds up by 1e4 rad/s2", speeding_up(1e4), torque(2), -94.1e-3, -93.9e-3},
      {"gyroscopic",
       {9.4e-6},
       "N m: roll at 6.5 rad/s, pairs at 1.1 and 0.9 of hover speed",
       [](LoadInput<double>& in) {
         in.rates_B_rad_s = {6.5, 0, 0};
         in.omega_rad_s = {1039.5, 1039.5, 850.5, 850.5};
       },
       torque(1),
       22e-3,
       24e-3},
      // mass and geometry
      {"com_offset", {1.4e-3, 0}, "N m: nose-down", still(), torque(1), 9.2e-3, 9.6e-3},
      {"com_offset", {0, 1.4e-3}, "N m: left side down", still(), torque(0), -9.6e-3, -9.2e-3},
      {"payload_mass", {0.1, 0, 0, 0}, "N: the same force for 15 % more mass", still(), force(2), -0.86, -0.85},
      {"payload_mass", {0.1, 0.003, 0, 0}, "N m: hung 30 mm ahead it turns the nose down", still(), torque(1), 24e-3, 26e-3},
      {"rotor_tilt", {kRad / 4, 0, 0}, "N: one motor 1 degree askew", still(), force(0), 0.028, 0.031},
      {"rotor_tilt", {0, 0, 0.7071 * kRad / 4}, "N m: its yaw", still(), torque(2), 2.4e-3, 2.8e-3},
      // forces and moments on the body
      {"slung_load", {0.05, 0.5, 0, 0, 0}, "N: m M / (m + M) g when the thrust carries the body alone", still(), force(2), -0.458, -0.456},
      {"tether", {0.5, 0, 0, 0, 0}, "N at 2 m", at(2, 0, 0), force(0), -1.001, -0.999},
      {"tether", {0.0, 0.05, 0, 0, 0}, "N at 2 m/s", moving(0, 2, 0), force(1), -0.1001, -0.0999},
      {"world_force",
       {0.1, 0},
       "N, whatever the heading: nose along y, the world's x is to the right",
       heading_north(),
       force(1),
       -0.1001,
       -0.0999},
      {"world_force", {0, 0.1}, "N along the nose then", heading_north(), force(0), 0.0999, 0.1001},
      {"height_pull", {0.05}, "N down at 3 m", at(0, 0, 3), force(2), -0.1501, -0.1499},
      {"height_pull", {0.05}, "N m: none", at(0, 0, 3), torque(1), -1e-15, 1e-15},
      {"parasitic_drag", {0}, "N at 8.5 m/s", moving(8.5, 0, 0), force(0), 0.39, 0.41},
      {"drag_isotropy", {1}, "N along x at 8.5 m/s and 45 degrees", moving(6.01, 6.01, 0), force(0), -0.09, -0.075},
      {"drag_isotropy", {1}, "nothing straight ahead", moving(8.5, 0, 0), force(0), -1e-12, 1e-12},
      {"linear_drag", {0.05, 0, 0}, "N at 8.5 m/s", moving(8.5, 0, 0), force(0), -0.43, -0.42},
      {"drag_centre_offset", {0.02, 0, 0}, "N m: nose-up", moving(8.5, 0, 0), torque(1), -8.2e-3, -7.8e-3},
      {"body_lift", {-0.002}, "N at 8.5 m/s", moving(8.5, 0, 0), force(2), -0.15, -0.14},
      {"body_pitch_moment", {-5e-4}, "N m: nose-up at 8.5 m/s", moving(8.5, 0, 0), torque(1), -37e-3, -35e-3},
      {"sideslip_yaw_moment", {1e-3}, "N m: into the direction of flight, 45 degrees", moving(6.01, 6.01, 0), torque(2), 35e-3, 37e-3},
      {"rate_damping", {3.9e-3, 0}, "N m at 6.5 rad/s", turning(0, 6.5, 0), torque(1), -25.5e-3, -25e-3},
      {"rate_damping", {0, 3.9e-3}, "N m at 6.5 rad/s", turning(0, 0, 6.5), torque(2), -25.5e-3, -25e-3},
      {"quadratic_rate_damping", {1e-4}, "N m at 6.5 rad/s", turning(6.5, 0, 0), torque(0), -4.3e-3, -4.2e-3},
      {"body_force_bias", {0, 0, 0.1}, "N: lifts", still(), force(2), 0.0999, 0.1001},
      {"body_torque_bias", {0, 0, 5e-3}, "N m: nose to the left", still(), torque(2), 4.99e-3, 5.01e-3},
      {"gravity_tilt", {0.01, 0}, "N: gravity points backwards in a log turned about y", still(), force(0), -0.068, -0.066},
  };
  return all;
}

TEST(TermLaws, HaveTheSignAndTheSizeThatTheCatalogueGives) {
  VehicleModel m = paper_vehicle();
  m.com_offset_m.setZero();
  for (const Law& law : laws()) {
    const Term* term = find_term(law.id);
    ASSERT_NE(term, nullptr) << law.id;
    ASSERT_EQ(term->info.parameters.size(), law.values.size()) << law.id;
    LoadInput<double> in = hover(m);
    law.flight(in);
    const Wrench with = wrench(m, in, only(*term), law.values), without = wrench(m, in);
    const double change = law.measure({with, without});
    EXPECT_GE(change, law.low) << law.id << ": " << law.words;
    EXPECT_LE(change, law.high) << law.id << ": " << law.words;
  }
}

TEST(TermLaws, ALoadOf100gHung100MmBelowTurnsAQuarterSlowerAboutXAndAsFastAboutZ) {
  const VehicleModel m = paper_vehicle();
  LoadInput<double> in = hover(m);
  in.omega_rad_s = {900.0, 950.0, 1000.0, 940.0};
  const Wrench without = wrench(m, in), with = wrench(m, in, only("payload_mass"), {0.1, 0.0, 0.0, -0.01});
  const double more = m.mass_kg / (m.mass_kg + 0.1) * 0.1 * 0.1 * 0.1;  // reduced mass times distance squared
  EXPECT_NEAR(with.torque.x() / without.torque.x(), m.inertia_kg_m2.x() / (m.inertia_kg_m2.x() + more), 1e-12);
  EXPECT_NEAR(with.torque.z(), without.torque.z(), 1e-15);
}

TEST(TermLaws, FreelyHingedBladesPassNothingOnOfWhatStiffOnesWould) {
  const VehicleModel m = paper_vehicle();
  LoadInput<double> in = hover(m);
  in.v_B_m_s = {5.0, 2.0, 0.0};
  TermList both = only("soft_flapping");
  both.add(*find_term("hub_moment"));
  both.add(*find_term("rotor_rolling_moment"));
  const Wrench hinged = wrench(m, in, only("soft_flapping"), {1.0});
  EXPECT_LT((wrench(m, in, both, {1.0, 2e-6, 1e-6, 3e-6}).torque - hinged.torque).norm(), 1e-15);
  const Eigen::Vector3d stiff = wrench(m, in, both, {0.0, 2e-6, 1e-6, 3e-6}).torque - wrench(m, in).torque;
  const Eigen::Vector3d half = wrench(m, in, both, {0.5, 2e-6, 1e-6, 3e-6}).torque - wrench(m, in, only("soft_flapping"), {0.5}).torque;
  EXPECT_LT((half - 0.5 * stiff).norm(), 1e-15);
}

TEST(TermLaws, EveryTermOfTheLoadsHasOne) {
  for (const Term& t : all_terms()) {
    if (t.plain.reading && !t.plain.body) continue;
    bool found = false;
    for (const Law& law : laws()) found = found || law.id == t.info.id;
    EXPECT_TRUE(found) << t.info.id;
  }
}

struct Read {
  Eigen::Vector3d position, velocity, turn, gyro, accel;
};
Read reading(std::string_view id, double value, const LoadInput<double>& in) {
  ReadingState<double> r{in, {1.0, -2.0, 3.0}, {4.0, 5.0, -6.0}, {100.0, -200.0, 50.0}, {}, {}, {}, {}, {}};
  const TermList list = only(id);
  readings(r, TermSet<double>(list, &value));
  const auto v = [](const Vec3<double>& a) { return Eigen::Vector3d(a.x, a.y, a.z); };
  return {v(r.position_W_m), v(r.velocity_W_m_s), v(r.turn_B_rad), v(r.gyro_B_rad_s), v(r.accel_B_m_s2)};
}

TEST(CeilingEffect, DoesNothingOneRadiusBelow3mWhereNoCeilingIsKnown) {
  VehicleModel open_air = paper_vehicle();
  open_air.ceiling_z_m = VehicleModel{}.ceiling_z_m;
  LoadInput<double> in = hover(open_air);
  in.p_W_m.z = 3.0 - open_air.thrust.radius_m;
  const double without = wrench(open_air, in).force.z();
  EXPECT_EQ(wrench(open_air, in, only("ceiling_effect"), {1.0}).force.z(), without);
  EXPECT_GT(wrench(paper_vehicle(), in, only("ceiling_effect"), {1.0}).force.z(), 1.06 * without);
}

TEST(Readings, ScaledPoseReportsPlacesAndVelocitiesTooLong) {
  const Read r = reading("pose_scale", 0.02, general_flight());
  EXPECT_LT((r.position - 0.02 * Eigen::Vector3d(1, -2, 3)).norm(), 1e-15);
  EXPECT_LT((r.velocity - 0.02 * Eigen::Vector3d(4, 5, -6)).norm(), 1e-15);
  EXPECT_EQ(r.turn.norm() + r.gyro.norm() + r.accel.norm(), 0.0);
}

TEST(Readings, ALoadHungBelowLeavesThePoseSensorFurtherAboveTheCentreOfMass) {
  const LoadInput<double> in = hover(paper_vehicle());
  ReadingState<double> r{in, {}, {}, {}, 0.4};
  const double values[] = {0.1, 0.0, 0.0, -0.005};
  const TermList list = only("payload_mass");
  readings(r, TermSet<double>(list, values));
  EXPECT_NEAR(r.position_W_m.z, 0.01, 1e-15);
  EXPECT_NEAR(r.velocity_W_m_s.x, 0.0, 1e-15);
}

TEST(Readings, SoftMountLagsBy2MradAt200radS2And50Hz) {
  const Read r = reading("sensor_mount_compliance", 1e-5, general_flight());
  EXPECT_LT((r.turn - Eigen::Vector3d(-1e-3, 2e-3, -0.5e-3)).norm(), 1e-15);
}

TEST(Readings, RectifiedVibrationIs0p1mS2InHover) {
  const Read r = reading("vibration_rectification", 1.1e-7, hover(paper_vehicle()));
  EXPECT_NEAR(r.accel.z(), 0.1, 0.005);
  EXPECT_EQ(r.accel.x(), 0.0);
}

}  // namespace
}  // namespace rotorloop::host
