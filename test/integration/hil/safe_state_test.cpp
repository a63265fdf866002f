// Faults on the buses and in the ESCs end a flight in a safe state that names its reason, with the motors off, and never in a pass.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <ostream>
#include <string>
#include <utility>

#include "bench/hil/flight/flight.hpp"
#include "test/integration/hil/cli_run.hpp"
#include "test/integration/hil/short_flight.hpp"

namespace rotorloop::test {
namespace {

constexpr double kFault_s = 3.2;  // in the climb
constexpr double kAfter_s = 0.5;  // within which the motors have to be off

std::string fault(const std::string& kind, const std::string& target, const std::string& more = "") {
  return "[[fault]]\nkind = \"" + kind + "\"\ntarget = " + target + "\nat_s = 3.2\n" + more + "\n";
}

bool drives(const firmware::Telemetry& esc) {
  return esc.state != firmware::MotorState::off && esc.state != firmware::MotorState::braking && esc.state != firmware::MotorState::fault;
}

struct Flown {
  host::FlightPhase phase = host::FlightPhase::boot;
  host::SafeState safe;
  bool ended = false;  // the airframe met the ground or diverged
  double end_s = 0.0;
  std::array<double, 4> off_after_fault_s{-1, -1, -1, -1};  // when each motor was first not driven after the fault
  hil::PlantTruth at_fault, last;
  double max_rate_rad_s = 0.0;  // of the body, after the fault
  std::uint64_t error_frames = 0, control_steps = 0;
};

// The scenario's fault as the runner would translate it; `unprotected`: a flight computer that waits a thousand seconds.
Flown flown(const std::string& faults, bool unprotected = false) {
  const ScratchFolder folder;
  const hil::Scenario scenario = hil::read_scenario(write_short_scenario(folder.path(), faults));
  static const hil::Inputs inputs = hil::read_inputs(scenario);  // the same files for every fault
  const hil::FlightRequest request{.flight = 0, .variant = host::Variant::pd_ff_thrust_drag, .seed = 1, .folder = {}};
  hil::LoopConfig config = hil::loop_config(scenario, inputs, request);
  if (unprotected) config.computer.imu_timeout_us = config.computer.esc_timeout_us = config.computer.not_following_us = 1'000'000'000;
  auto controller =
      std::make_unique<host::CascadeController>(inputs.vehicle, host::controller_config(inputs.gains, host::Variant::pd_ff_thrust_drag));
  hil::Loop loop(inputs.plant, sim::pointers(inputs.rotors), inputs.vehicle, inputs.trajectories[0], std::move(controller), config);
  Flown f;
  double end_s = hil::flight_duration_s(config, inputs.trajectories[0]);
  bool safe_seen = false;
  while (loop.now_s() < end_s && !loop.airframe().ended()) {
    loop.tick();
    if (loop.take_record()) ++f.control_steps;
    if (!safe_seen && loop.computer().phase() == host::FlightPhase::safe) {
      safe_seen = true;
      end_s = loop.now_s() + kAfter_s;
    }
    const hil::PlantTruth* truth = loop.truth_at(loop.now_ns() / 1000);
    if (!truth) continue;
    f.last = *truth;
    if (loop.now_s() < kFault_s)
      f.at_fault = *truth;
    else
      f.max_rate_rad_s = std::max(f.max_rate_rad_s, truth->state.w_B_rad_s.norm());
    for (std::size_t i = 0; i < 4; ++i)
      if (loop.now_s() >= kFault_s && f.off_after_fault_s[i] < 0 && !drives(truth->esc[i]))
        f.off_after_fault_s[i] = loop.now_s() - kFault_s;
  }
  f.phase = loop.computer().phase();
  f.safe = loop.computer().safe_state();
  f.ended = loop.airframe().ended();
  f.end_s = loop.now_s();
  f.error_frames = loop.esc_bus().statistics().error_frames + loop.state_bus().statistics().error_frames;
  return f;
}

void expect_motors_off(const Flown& f) {
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(f.at_fault.esc[i].state, firmware::MotorState::running) << "ESC " << i + 1;
    EXPECT_FALSE(drives(f.last.esc[i])) << "ESC " << i + 1 << " is driven 0.5 s after the safe state";
    EXPECT_LT(f.last.omega_rad_s[i], 0.7 * f.at_fault.omega_rad_s[i]) << "ESC " << i + 1;
    EXPECT_GE(f.off_after_fault_s[i], 0.0) << "ESC " << i + 1;
  }
}

struct Case {
  const char* name;
  std::string fault;
  host::SafeReason reason;
  int esc;           // from 0; -1: none named
  double latest_s;   // from the fault to the safe state
  const char* says;  // in end_detail
};
std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.name; }

class Faults : public testing::TestWithParam<Case> {};

TEST_P(Faults, EndInASafeStateWithTheMotorsOff) {
  const Case& c = GetParam();
  const Flown f = flown(c.fault);
  ASSERT_EQ(f.phase, host::FlightPhase::safe);
  EXPECT_EQ(f.safe.reason, c.reason) << host::describe(f.safe);
  EXPECT_EQ(f.safe.esc, c.esc);
  const double after_s = static_cast<double>(f.safe.time_us) * 1e-6 - kFault_s;
  EXPECT_GE(after_s, 0.0);
  EXPECT_LE(after_s, c.latest_s);
  expect_motors_off(f);
}

TEST_P(Faults, AreNamedByTheCommandWhichFails) {
  const Case& c = GetParam();
  const ScratchFolder folder;
  const auto scenario = write_short_scenario(folder.path(), c.fault);
  const auto done = rotorloop_command("hil '" + scenario.string() + "' --jobs 1", folder.path());
  EXPECT_EQ(done.exit_code, 6) << done.err;
  EXPECT_NE(done.out.find("verdict: fail"), std::string::npos) << done.out;
  EXPECT_NE(done.err.find(c.says), std::string::npos) << done.err;
  const auto result = result_of(folder / "runs/short");
  ASSERT_TRUE(result.is_object());
  EXPECT_EQ(result["verdict"], "fail");
  ASSERT_EQ(result["flights"].size(), 1u);
  EXPECT_EQ(result["flights"][0]["end"], "safe_state");
  EXPECT_NE(result["flights"][0].dump().find(c.says), std::string::npos) << result["flights"][0].dump();
}

INSTANTIATE_TEST_SUITE_P(
    AllKinds, Faults,
    testing::Values(
        Case{"EscSilent", fault("esc_silent", "2"), host::SafeReason::esc_silent, 1, 0.035, "ESC 2 silent"},
        Case{"NodeSilent", fault("node_silent", "3"), host::SafeReason::esc_silent, 2, 0.035, "ESC 3 silent"},
        Case{"BabbleOnEscBus", fault("bus_babble", "\"esc\""), host::SafeReason::esc_bus_silent, -1, 0.035, "ESC bus silent"},
        Case{"BabbleOnStateBus", fault("bus_babble", "\"state\""), host::SafeReason::imu_lost, -1, 0.025, "IMU samples stopped"},
        Case{"AllFramesDroppedOnStateBus", fault("frame_drop", "\"state\"", "probability = 1"), host::SafeReason::imu_lost, -1, 0.025,
             "IMU samples stopped"},
        Case{"AllFramesDroppedOnEscBus", fault("frame_drop", "\"esc\""), host::SafeReason::esc_bus_silent, -1, 0.035, "ESC bus silent"}),
    [](const auto& c) { return std::string(c.param.name); });

// An ESC that hears nothing any more must not wait for others to notice: its own set-point timeout is 20 ms.
TEST(SafeState, AnEscCutFromTheBusStopsItsMotorByItself) {
  for (const bool unprotected : {false, true}) {
    const Flown f = flown(fault("node_silent", "3"), unprotected);
    EXPECT_GE(f.off_after_fault_s[2], 0.015);
    EXPECT_LE(f.off_after_fault_s[2], 0.025);
  }
}

TEST(SafeState, NoMotorIsDrivenLongerThanTheSetpointTimeoutWithoutSetpoints) {
  const Flown f = flown(fault("bus_babble", "\"esc\""), true);  // the computer goes on as if nothing were wrong
  for (const double off_s : f.off_after_fault_s) {
    EXPECT_GE(off_s, 0.015);
    EXPECT_LE(off_s, 0.025);
  }
}

// The damage that the watch prevents: the other motors go on driving the vehicle into a tumble.
TEST(SafeState, WithoutTheTimeoutsTheOtherMotorsDriveTheVehicleIntoATumble) {
  const std::string dead = fault("esc_silent", "2");
  const Flown watched = flown(dead), unwatched = flown(dead, true);
  for (const std::size_t other : {0u, 2u, 3u}) {
    EXPECT_LE(watched.off_after_fault_s[other], 0.035) << "ESC " << other + 1;
    const double off_s = unwatched.off_after_fault_s[other];  // below zero: driven to the end
    EXPECT_TRUE(off_s < 0.0 || off_s >= 0.2) << "ESC " << other + 1 << ": " << off_s;
  }
  EXPECT_GT(unwatched.max_rate_rad_s, 3.0 * watched.max_rate_rad_s) << "rad/s of the body; watched: " << watched.max_rate_rad_s;
}

TEST(SafeState, OnePercentOfCorruptFramesIsRepairedByRetransmission) {
  const std::string both =
      "[[fault]]\nkind = \"frame_corrupt\"\ntarget = \"esc\"\nat_s = 0\nprobability = 0.01\n"
      "[[fault]]\nkind = \"frame_corrupt\"\ntarget = \"state\"\nat_s = 0\nprobability = 0.01\n";
  const Flown clean = flown(""), struck = flown(both);
  EXPECT_EQ(clean.error_frames, 0u);
  EXPECT_GT(struck.error_frames, 100u);
  EXPECT_EQ(struck.phase, host::FlightPhase::flying) << host::describe(struck.safe);
  EXPECT_FALSE(struck.ended);
  EXPECT_LT((struck.last.state.p_W_m - clean.last.state.p_W_m).norm(), 0.02) << "metres at the end of the flight";

  const ScratchFolder folder;
  const auto done = rotorloop_command("hil '" + write_short_scenario(folder.path(), both).string() + "' -q", folder.path());
  EXPECT_EQ(done.exit_code, 0) << done.err;
}

// What retransmission is worth: destroyed frames come again, lost ones leave the controller without a sample.
TEST(SafeState, CorruptFramesCostNoControlStepButLostFramesDo) {
  const auto struck = [](const char* kind) {
    return flown("[[fault]]\nkind = \"" + std::string(kind) + "\"\ntarget = \"state\"\nat_s = 0\nprobability = 0.05\n");
  };
  const Flown clean = flown(""), corrupt = struck("frame_corrupt"), lost = struck("frame_drop");
  EXPECT_GT(corrupt.error_frames, 500u);
  EXPECT_GE(corrupt.control_steps + 1, clean.control_steps);  // the last one may still be under way
  EXPECT_LT(static_cast<double>(lost.control_steps), 0.93 * static_cast<double>(clean.control_steps));  // two frames a sample
}

TEST(SafeState, PosesThatStopAreNamed) {
  hil::LoopConfig config = short_flight_config(1);
  sim::BusFault lost;
  lost.kind = sim::BusFaultKind::lose_sent;
  lost.port = hil::kAirframePort;
  lost.id = 0x110;
  lost.id_mask = 0x7F0;  // stamp, position, attitude and velocity of a pose
  lost.at_ns = 3'000'000'000;
  config.state_bus_faults = {lost};
  auto loop = short_flight(config);
  fly_until(*loop, kShortFlightEnd_s);
  ASSERT_EQ(loop->computer().phase(), host::FlightPhase::safe);
  EXPECT_EQ(loop->computer().safe_state().reason, host::SafeReason::pose_lost) << host::describe(loop->computer().safe_state());
}

// A fault before take-off: nothing is armed that cannot fly.
TEST(SafeState, AnEscThatIsDeadFromTheStartIsFoundBeforeTakeOff) {
  const ScratchFolder folder;
  const auto scenario = write_short_scenario(folder.path(), "[[fault]]\nkind = \"esc_silent\"\ntarget = 4\nat_s = 0\n");
  const auto done = rotorloop_command("hil '" + scenario.string() + "'", folder.path());
  EXPECT_EQ(done.exit_code, 6);
  EXPECT_NE(done.err.find("ESC 4 not ready to fly in time"), std::string::npos) << done.err;
}

}  // namespace
}  // namespace rotorloop::test
