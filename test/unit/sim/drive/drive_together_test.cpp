// Drives that step side by side in vector registers get, bit by bit, what each gets alone.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cstdint>
#include <tuple>
#include <vector>

#include "sim/drive/typical.hpp"

namespace {

using namespace rotorloop::sim;

enum class Law { simple, drawn_boards, mixed };

// No two alike, in parameters, load, supply, angle or speed.
Drive drive_number(std::size_t i, Law law) {
  const double x = static_cast<double>(i);
  DriveParameters p;
  p.motor.resistance_ohm *= 1.0 + 0.03 * x;
  p.motor.inductance_H.q *= 1.0 + 0.1 * x;
  p.motor.pole_pairs = i % 2 == 0 ? 7 : 6;
  p.motor.static_friction_N_m *= 1.0 + x;
  p.inverter.dead_time_s *= 1.0 - 0.05 * x;
  p.blade_inertia_kg_m2 *= 1.0 + 0.02 * x;
  if (law == Law::drawn_boards || (law == Law::mixed && i % 2 == 1)) p = typical_drive(p, 45.0, rotorloop::RandomStream(3, i)).drive;
  if (law == Law::mixed && i == 3) p.faults = {{.kind = DriveFaultKind::phase_open, .phase = 1, .from_s = 0.01, .until_s = 0.02}};
  Drive d(p, rotorloop::RandomStream(7, i), 0.4 * x);
  d.set_bus_V(14.0 + 0.3 * x);
  d.set_load({2.9e-8 * (1.0 + 0.1 * x), 1e-4 * x});
  d.motor().state().omega_rad_s = 1000.0 - 250.0 * x;  // some turn backwards
  return d;
}

// Six steps of a turning voltage vector with noise; the bridge of some drives is off for a while.
PwmCommand command(std::size_t drive, int period) {
  const rotorloop::RandomStream random(11, drive);
  PwmCommand c;
  c.top = 1771;
  const std::size_t highest = (static_cast<std::size_t>(period) / (40 + drive)) % 3;
  for (std::size_t k = 0; k < 3; ++k)
    c.compare[k] =
        static_cast<std::uint16_t>((k == highest ? 900.0 : 850.0) + 60.0 * random.uniform(static_cast<std::uint64_t>(period) * 3 + k));
  if (period == 500 && drive == 1) c.compare[0] = 1771;  // on for the whole period
  c.enabled = (static_cast<std::size_t>(period) / 300 + drive) % 5 != 0;
  return c;
}

std::array<std::uint64_t, 8> bits(const Drive& d) {
  const MotorState& s = d.motor().state();
  return {std::bit_cast<std::uint64_t>(s.i_d_A),          std::bit_cast<std::uint64_t>(s.i_q_A),
          std::bit_cast<std::uint64_t>(s.omega_rad_s),    std::bit_cast<std::uint64_t>(s.angle_rad),
          std::bit_cast<std::uint64_t>(s.cos_e),          std::bit_cast<std::uint64_t>(s.sin_e),
          std::bit_cast<std::uint64_t>(d.bus_energy_J()), 0};
}

std::array<std::uint16_t, 5> counts(const AdcReading& r) { return {r.phase[0], r.phase[1], r.phase[2], r.bus, r.temperature}; }

class DrivesTogether : public testing::TestWithParam<std::tuple<std::size_t, Law>> {};

TEST_P(DrivesTogether, GetTheBitsOfASingleDriveOver2000PwmPeriods) {
  std::vector<Drive> alone, together;
  const auto [count, law] = GetParam();
  for (std::size_t i = 0; i < count; ++i) {
    alone.push_back(drive_number(i, law));
    together.push_back(drive_number(i, law));
  }
  std::vector<Drive*> pointers;
  for (Drive& d : together) pointers.push_back(&d);
  for (int period = 0; period < 2000; period += 2) {
    std::vector<PwmCommand> pwm;
    for (std::size_t i = 0; i < alone.size(); ++i) pwm.push_back(command(i, period));
    Drive::step_together(pointers, pwm, 2);
    for (std::size_t i = 0; i < alone.size(); ++i) {
      for (int n = 0; n < 2; ++n) alone[i].step(pwm[i]);
      ASSERT_EQ(bits(together[i]), bits(alone[i])) << "drive " << i << " of " << alone.size() << ", period " << period;
      ASSERT_EQ(counts(together[i].sample()), counts(alone[i].sample())) << "drive " << i << ", period " << period;
    }
  }
  EXPECT_GT(alone[0].omega_rad_s(), 100.0);  // it still turns …
  EXPECT_LT(alone[0].omega_rad_s(), 990.0);  // … and was at work
}

INSTANTIATE_TEST_SUITE_P(FromOneToNine, DrivesTogether,
                         testing::Combine(testing::Values(1, 2, 3, 4, 5, 8, 9),
                                          testing::Values(Law::simple, Law::drawn_boards, Law::mixed)));

}  // namespace
