// The claim "no plant state reaches the controller", proven by replay: a flight computer without any plant, given only the frames
// that other nodes put on the two buses, repeats every frame it sent in the closed loop bit by bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <vector>

#include "protocols/fast_channel.hpp"
#include "protocols/state_channel.hpp"
#include "test/integration/hil/short_flight.hpp"

namespace rotorloop::test {
namespace {

constexpr std::size_t kState = 0, kEsc = 1;

struct SentFrame {
  CanFrame frame;
  std::int64_t time_ns = 0;  // end of frame in the loop, of sending in the replay
};

// What the controller decided, step by step.
struct Decision {
  std::int64_t time_us = 0;
  host::FlightPhase phase = host::FlightPhase::boot;
  std::array<double, 4> commanded_rad_s{};
  std::array<double, 3> estimate_p_W_m{};
  bool operator==(const Decision&) const = default;
};

struct Recording {
  std::array<std::vector<SentFrame>, 2> heard, said;  // by bus: frames of all other nodes, frames of the computer
  std::vector<Decision> decisions;
  std::vector<std::int64_t> tick_ns;
};

void note_decision(Recording& r, const host::FlightRecord* record) {
  if (!record) return;
  const auto& p = record->estimate.p_W_m;
  r.decisions.push_back({record->time_us, record->phase, record->commanded_rad_s, {p.x(), p.y(), p.z()}});
}

std::function<void(const sim::BusEvent&)> recorder(Recording& r, std::size_t bus) {
  return [&r, bus](const sim::BusEvent& e) {
    if (!e.error) (e.port == hil::kComputerPort ? r.said : r.heard)[bus].push_back({e.frame, e.end_ns});
  };
}

Recording closed_loop(std::uint64_t seed) {
  Recording r;
  auto loop = short_flight(short_flight_config(seed));
  loop->state_bus().set_tap(recorder(r, kState));
  loop->esc_bus().set_tap(recorder(r, kEsc));
  while (loop->now_s() < kShortFlightEnd_s) {
    loop->tick();
    r.tick_ns.push_back(loop->now_ns());
    note_decision(r, loop->take_record());
  }
  EXPECT_EQ(loop->computer().phase(), host::FlightPhase::flying) << host::describe(loop->computer().safe_state());
  return r;
}

// A flight computer on two buses that have no other node than a player of the recorded frames.
Recording replay(const Recording& recorded, std::uint64_t seed) {
  Recording r;
  sim::BusConfig direct;
  direct.ideal = true;
  std::array<sim::VirtualBus, 2> bus{sim::VirtualBus(direct), sim::VirtualBus(direct)};
  std::array<CanBus*, 2> computer_port{}, player{};
  for (const std::size_t b : {kState, kEsc}) {
    computer_port[b] = &bus[b].attach({.name = "computer"});
    player[b] = &bus[b].attach({.name = "player"});
    bus[b].set_tap(recorder(r, b));
  }
  const auto controller = shipped_controller();
  host::FlightComputer computer(shipped_vehicle().model, short_flight_config(seed).computer, *controller, short_trajectory(),
                                *computer_port[kState], *computer_port[kEsc]);
  std::array<std::size_t, 2> next{};
  for (const std::int64_t now_ns : recorded.tick_ns) {
    for (const std::size_t b : {kState, kEsc}) {
      for (; next[b] < recorded.heard[b].size() && recorded.heard[b][next[b]].time_ns <= now_ns; ++next[b]) {
        bus[b].set_now(recorded.heard[b][next[b]].time_ns);
        player[b]->send(recorded.heard[b][next[b]].frame);
      }
      bus[b].set_now(now_ns);
    }
    computer.poll(now_ns / 1000);
    note_decision(r, computer.take_record());
  }
  return r;
}

// By identifier, because frames of different identifiers change places in arbitration; those of one identifier never do.
std::map<std::uint32_t, std::vector<SentFrame>> by_id(const std::vector<SentFrame>& frames) {
  std::map<std::uint32_t, std::vector<SentFrame>> out;
  for (const SentFrame& f : frames) out[f.frame.id | (f.frame.extended ? 1u << 31 : 0u)].push_back(f);
  return out;
}

const Recording& flown() {
  static const Recording recording = closed_loop(1);
  return recording;
}

TEST(Replay, FlightComputerAloneRepeatsItsFramesBitByBit) {
  const Recording again = replay(flown(), 1);
  for (const std::size_t b : {kState, kEsc}) {
    const auto in_loop = by_id(flown().said[b]), alone = by_id(again.said[b]);
    ASSERT_EQ(in_loop.size(), alone.size());
    ASSERT_GE(in_loop.size(), 2u);
    EXPECT_GT(flown().said[b].size(), 500u);
    for (const auto& [id, frames] : in_loop) {
      ASSERT_TRUE(alone.contains(id)) << std::hex << id;
      const auto& repeated = alone.at(id);
      // At the end of the recording a few frames may still wait for the bus.
      ASSERT_LE(frames.size(), repeated.size()) << std::hex << id;
      ASSERT_LE(repeated.size(), frames.size() + 4) << std::hex << id;
      for (std::size_t i = 0; i < frames.size(); ++i) {
        ASSERT_EQ(frames[i].frame, repeated[i].frame) << "bus " << b << ", id 0x" << std::hex << id << std::dec << ", frame " << i;
        ASSERT_GT(frames[i].time_ns, repeated[i].time_ns) << "heard on the bus before it was sent";
      }
    }
  }
}

TEST(Replay, FlightComputerAloneRepeatsItsDecisionsBitByBit) {
  const Recording again = replay(flown(), 1);
  ASSERT_GT(flown().decisions.size(), 4900u);  // 1 kHz
  ASSERT_EQ(flown().decisions.size(), again.decisions.size());
  for (std::size_t i = 0; i < again.decisions.size(); ++i)
    ASSERT_EQ(flown().decisions[i], again.decisions[i]) << "step " << i << " at " << flown().decisions[i].time_us << " us";
}

// The proof is worth what it can refuse: one changed bit of one sensor frame is noticed.
TEST(Replay, OneFlippedBitOfOneImuFrameChangesWhatIsSent) {
  Recording altered = flown();
  std::size_t struck = altered.heard[kState].size();
  for (std::size_t i = 0; i < altered.heard[kState].size() && struck == altered.heard[kState].size(); ++i) {
    const SentFrame& f = altered.heard[kState][i];
    if (f.time_ns > 3'000'000'000 && f.frame.id == protocols::state::kGyroId) struck = i;
  }
  ASSERT_LT(struck, altered.heard[kState].size());
  altered.heard[kState][struck].frame.data[1] ^= 0x08;
  const Recording again = replay(altered, 1);
  ASSERT_EQ(flown().decisions.size(), again.decisions.size());
  std::size_t first = 0;
  while (first < again.decisions.size() && flown().decisions[first] == again.decisions[first]) ++first;
  ASSERT_LT(first, again.decisions.size()) << "an altered IMU sample went unnoticed";
  // Not before the frame arrived, and in the very step it belongs to: 1 ms sampling, up to 1 ms on the bus.
  const std::int64_t struck_us = altered.heard[kState][struck].time_ns / 1000;
  EXPECT_GE(again.decisions[first].time_us, struck_us - 2'000);
  EXPECT_LE(again.decisions[first].time_us, struck_us + 2'000);
  std::size_t differing = 0;
  for (std::size_t i = 0; i < std::min(flown().said[kEsc].size(), again.said[kEsc].size()); ++i)
    differing += flown().said[kEsc][i].frame != again.said[kEsc][i].frame ? 1u : 0u;
  EXPECT_GT(differing, 0u);
}

// The sensors are not taken from anywhere else: without their frames the computer has no estimate and never leaves boot.
TEST(Replay, WithoutTheAirframesFramesTheComputerStaysDisarmed) {
  Recording deaf = flown();
  deaf.heard[kState].clear();
  const Recording again = replay(deaf, 1);
  EXPECT_TRUE(again.decisions.empty());
  const auto setpoints = [](const Recording& r) {
    return std::count_if(r.said[kEsc].begin(), r.said[kEsc].end(),
                         [](const SentFrame& f) { return protocols::fast::is_setpoint_id(f.frame); });
  };
  EXPECT_GT(setpoints(flown()), 2000);
  EXPECT_EQ(setpoints(again), 0);
}

}  // namespace
}  // namespace rotorloop::test
