// Four emulated chips that run the ELF of the ESC's program fly the vehicle: as well as the native ESCs, and always with the same bytes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <future>
#include <string>

#include "host/control/trajectory_generator.hpp"
#include "sim/esc/esc_program.hpp"
#include "test/integration/hil/short_flight.hpp"

namespace rotorloop::test {
namespace {

const std::filesystem::path kElf = ROTORLOOP_FIRMWARE_ELF;
constexpr double kStart_s = 1.2, kEnd_s = 3.0;

// Sideways by 1 m and up by 0.5 m in 1.2 s.
const host::Trajectory& quick_move() {
  static const host::Trajectory trajectory =
      host::join({host::hover({0.0, 0.0, 2.0}, 0.0, 0.3), host::rest_to_rest({{0.0, 0.0, 2.0}, 0.0, 0.0}, {{1.0, 0.0, 2.5}, 0.0, 1.2}),
                  host::hover({1.0, 0.0, 2.5}, 0.0, 0.3)});
  return trajectory;
}

const sim::EscProgram& program() {
  static const sim::EscProgram p = sim::read_esc_program(kElf, shipped("vehicles/boards/b_g431b_esc1.toml"));
  return p;
}

struct Flown {
  double mean_error_cm = 0.0;
  std::string esc_bus;  // as candump writes it
  host::FlightPhase phase = host::FlightPhase::boot;
  std::string safe_state;
  sim::EmulatedCounters chips;
};

Flown fly(hil::EscModel model) {
  const ShippedVehicle& v = shipped_vehicle();
  hil::LoopConfig config = short_flight_config(1);
  config.computer.start_us = static_cast<std::int64_t>(kStart_s * 1e6);
  config.esc.fill(model);
  if (model == hil::EscModel::emulated) config.program = &program();
  hil::Loop loop(v.plant, sim::pointers(v.rotors), v.model, quick_move(), shipped_controller(), config);
  Flown flown;
  loop.esc_bus().set_tap([&](const sim::BusEvent& e) {
    flown.esc_bus += fmt::format("{} {} {:x}#", e.end_ns, e.port, e.frame.id);
    for (std::size_t i = 0; i < e.frame.length; ++i) flown.esc_bus += fmt::format("{:02x}", e.frame.data[i]);
    flown.esc_bus += e.error ? " error\n" : "\n";
  });
  double sum_m = 0.0;
  int samples = 0;
  while (loop.now_s() < kEnd_s && loop.computer().phase() != host::FlightPhase::safe && !loop.airframe().ended()) {
    loop.tick();
    const host::FlightRecord* r = loop.take_record();
    if (r == nullptr || r->phase != host::FlightPhase::flying) continue;
    if (const hil::PlantTruth* truth = loop.truth_at(r->time_us)) {
      sum_m += (truth->state.p_W_m - r->setpoint.p_W_m).norm();
      ++samples;
    }
  }
  flown.mean_error_cm = samples > 0 ? 100.0 * sum_m / samples : 0.0;
  flown.phase = loop.computer().phase();
  flown.safe_state = host::describe(loop.computer().safe_state());
  flown.chips = loop.emulated();
  return flown;
}

class EmulatedFlight : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(kElf)) GTEST_SKIP() << "the program was not built (firmware_image builds it)";
  }
};

TEST_F(EmulatedFlight, FourElfsTrackWithin3PercentOfFourNativeEscsAndTwiceWithTheSameBytes) {
  const Flown native = fly(hil::EscModel::native);
  ASSERT_EQ(native.phase, host::FlightPhase::flying) << native.safe_state;
  auto other = std::async(std::launch::async, [] { return fly(hil::EscModel::emulated); });
  const Flown emulated = fly(hil::EscModel::emulated);
  ASSERT_EQ(emulated.phase, host::FlightPhase::flying) << emulated.safe_state;
  EXPECT_NEAR(emulated.mean_error_cm, native.mean_error_cm, 0.03 * native.mean_error_cm);
  EXPECT_EQ(emulated.chips.resets, 0u);
  EXPECT_EQ(emulated.chips.both_gates, 0u);
  fmt::print("mean tracking error {:.3f} cm with four ELFs, {:.3f} cm with native ESCs; {:.1f} million instructions a simulated second\n",
             emulated.mean_error_cm, native.mean_error_cm, static_cast<double>(emulated.chips.instructions) * 1e-6 / kEnd_s);
  const Flown again = other.get();
  EXPECT_GT(emulated.esc_bus.size(), 100'000u);
  EXPECT_TRUE(emulated.esc_bus == again.esc_bus) << "the second flight left another bus log";
}

}  // namespace
}  // namespace rotorloop::test
