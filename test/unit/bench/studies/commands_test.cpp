// Made-up hovers of a quadrotor: each defect's pattern of motor commands comes out as that defect, and none as none.
#include <gtest/gtest.h>

#include <cmath>

#include "bench/studies/hover_shares.hpp"
#include "host/base/random.hpp"

namespace rotorloop::studies {
namespace {

constexpr double kArm_m = 0.0325;

host::VehicleModel vehicle() {
  host::VehicleModel v;
  const double x[4] = {1.0, -1.0, 1.0, -1.0}, y[4] = {-1.0, 1.0, 1.0, -1.0};
  for (std::size_t i = 0; i < 4; ++i) {
    v.rotors[i].position_m = {kArm_m * x[i], kArm_m * y[i], 0.0};
    v.rotors[i].reaction = i < 2 ? -1 : 1;
  }
  return v;
}

struct HoverCase {
  std::array<double, 4> change{};
  double volts = 3.6;
  bool duty = false;      // commands are shares of the battery's voltage
  double sway_rad = 0.0;  // of yaw, amplitude at 0.4 Hz
};

// 10 s at 100 Hz, 0.5 m high; unlike rotors, 0.4 % of scatter from flight to flight.
log::FlightRecord hover(const HoverCase& c, std::uint64_t flight) {
  constexpr double kGain[4] = {1.03, 1.11, 0.89, 0.97};
  const RandomStream random(9, flight);
  log::FlightRecord f;
  f.name = "flight " + std::to_string(flight);
  for (int i = 0; i < 1000; ++i) {
    const double t = 0.01 * i;
    f.position_W_m.add(t, {0.0, 0.0, i == 0 ? 0.0 : 0.5});
    log::RotorValues u{};
    for (std::size_t r = 0; r < 4; ++r) {
      const double thrust = 0.6 * kGain[r] * (1.0 + c.change[r]) * (1.0 + 0.004 * random.gaussian(r));
      u[r] = c.duty ? std::pow(thrust, 1.0 / 1.58) * 2.6 / c.volts : thrust;
    }
    f.motor_command.add(t, u);
    f.battery_V.add(t, c.volts);
    f.extra["yaw[rad]"].add(t, 1e-3 * random.gaussian(static_cast<std::uint64_t>(10 + i)) + c.sway_rad * std::sin(2.513 * t));
  }
  return f;
}
std::vector<log::FlightRecord> reference(bool duty = false) {
  return {hover({.volts = 3.5, .duty = duty}, 1), hover({.volts = 3.6, .duty = duty}, 2), hover({.volts = 3.7, .duty = duty}, 3)};
}

TEST(HoverShares, another_flight_without_defect_is_clean) {
  const auto d = diagnose_hover(hover({}, 4), reference(), vehicle());
  EXPECT_EQ(d.verdict, diagnose::DiagnosisVerdict::clean) << hover_text(d);
  EXPECT_FALSE(d.rotor);
}

TEST(HoverShares, load_of_3_percent_under_the_rear_left_rotor_is_a_class_with_a_blocked_wake_there) {
  // m/M (1 ± 1 ± 1): 9 % on the arm that carries it, -3 % opposite, 3 % on the others.
  const auto d = diagnose_hover(hover({.change = {-0.03, 0.09, 0.03, 0.03}}, 4), reference(), vehicle());
  EXPECT_EQ(d.verdict, diagnose::DiagnosisVerdict::ambiguous);
  EXPECT_EQ(d.named, (std::vector<std::string>{"payload_mass at rotor 2", "blockage_strut 2"})) << hover_text(d);
}

TEST(HoverShares, load_of_4_percent_half_an_arm_ahead_is_payload_with_its_place) {
  const auto d = diagnose_hover(hover({.change = {0.06, 0.02, 0.06, 0.02}}, 4), reference(), vehicle());
  ASSERT_EQ(d.named, (std::vector<std::string>{"payload_mass + com_offset"})) << hover_text(d);
  for (const auto& h : d.hypotheses) {
    if (h.ids.size() != 2 || h.ids[0] != "payload_mass") continue;
    EXPECT_NEAR(h.parameters[0].value, 0.04, 3.0 * h.parameters[0].u);
    EXPECT_NEAR(h.parameters[1].value / h.parameters[0].value, 0.5, 0.2) << "arms ahead";
    EXPECT_NEAR(h.parameters[2].value / h.parameters[0].value, 0.0, 0.2) << "arms to the left";
  }
}

TEST(HoverShares, load_in_the_middle_is_payload_alone) {
  const auto d = diagnose_hover(hover({.change = {0.04, 0.04, 0.04, 0.04}}, 4), reference(), vehicle());
  EXPECT_EQ(d.named, (std::vector<std::string>{"payload_mass"})) << hover_text(d);
}

TEST(HoverShares, rotor_that_loses_8_percent_is_a_class_of_propeller_and_motor) {
  for (std::size_t i = 0; i < 4; ++i) {
    HoverCase c;
    c.change[i] = 0.087;
    const auto d = diagnose_hover(hover(c, 4), reference(), vehicle());
    EXPECT_EQ(d.verdict, diagnose::DiagnosisVerdict::ambiguous);
    ASSERT_EQ(d.named.size(), 2u) << hover_text(d);
    EXPECT_EQ(d.named[0], "weak_rotor " + std::to_string(i + 1));
    EXPECT_EQ(d.rotor, static_cast<int>(i) + 1);
  }
}

TEST(HoverShares, load_on_a_string_is_determined_by_yaw_that_sways) {
  const auto d = diagnose_hover(hover({.change = {-0.02, 0.08, 0.03, 0.03}, .sway_rad = 0.04}, 4), reference(), vehicle());
  EXPECT_EQ(d.named, (std::vector<std::string>{"slung_load"})) << hover_text(d);
}

TEST(HoverShares, pattern_that_no_defect_makes_is_unexplained) {
  const auto d = diagnose_hover(hover({.change = {-0.05, 0.10, -0.08, 0.04}}, 4), reference(), vehicle());
  EXPECT_EQ(d.verdict, diagnose::DiagnosisVerdict::unexplained) << hover_text(d);
}

TEST(HoverShares, commands_that_are_shares_of_the_battery_are_recognised_and_its_voltage_is_no_defect) {
  EXPECT_EQ(command_meaning(reference(false)), CommandMeaning::thrust);
  EXPECT_EQ(command_meaning(reference(true)), CommandMeaning::duty);
  const auto d = diagnose_hover(hover({.volts = 3.3, .duty = true}, 4), reference(true), vehicle());
  EXPECT_EQ(d.verdict, diagnose::DiagnosisVerdict::clean) << hover_text(d);
}

}  // namespace
}  // namespace rotorloop::studies
