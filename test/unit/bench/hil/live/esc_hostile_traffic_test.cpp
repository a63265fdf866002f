// A bus full of what an ESC must not mind, on each backend: it stays alive, its parameters stay as they are, its motor does what its own
// commander says or stands still.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>

#include "host/base/random.hpp"
#include "host/tools/parameters.hpp"
#include "test/unit/bench/hil/live/esc_bench.hpp"

namespace rotorloop::live {
namespace {

using namespace protocols;
using firmware::MotorState;

class EscUnderHostileTraffic : public EscOnABus {};

std::map<std::string, std::string> settable_values(EscBench& b) {
  std::map<std::string, std::string> values;
  for (const auto& p : tools::read_parameters(b.tool(), kEscNode)) {
    if (!tools::only_read(p.name)) values[p.name] = tools::value_text(p.value);
  }
  return values;
}

// Any identifier and any data: identifiers of both lengths, and every third one a transfer of a type that the ESC listens to, cut, doubled
// or with a wrong tail. Nothing that is a valid command or request: tails of commands are those of a broken multi-frame transfer.
class Noise {
 public:
  CanFrame next() {
    CanFrame f;
    const std::uint64_t kind = bits() % 3;
    f.extended = kind != 0;
    f.id = static_cast<std::uint32_t>(bits()) & (f.extended ? 0x1FFFFFFFu : 0x7FFu);
    f.length = static_cast<std::uint8_t>(bits() % 9);
    for (auto& byte : f.data) byte = static_cast<std::uint8_t>(bits());
    if (f.extended && (f.id & 127u) == kEscNode) f.id ^= 1u;  // duplicates of the id are a test of their own
    if (f.extended && (f.id & 127u) == kToolNode) f.id ^= 1u;
    if (!f.extended && (f.id & 0x7F0u) == 0x0A0u) f.id ^= 0x100u;  // valid set-points would be orders
    if (kind == 2) {
      constexpr std::uint32_t kTypes[] = {1030, 1031, 1100, 1034, 1, 341};
      const bool service = bits() % 2 == 0;
      constexpr std::uint32_t kServices[] = {1, 5, 10, 11, 15, 40};
      const std::uint32_t which = static_cast<std::uint32_t>(bits() % 6), source = 30 + static_cast<std::uint32_t>(bits() % 20);
      f.id =
          service ? 24u << 24 | kServices[which] << 16 | 0x8000u | kEscNode << 8 | 0x80u | source : 8u << 24 | kTypes[which] << 8 | source;
      f.length = 8;
      f.data[7] = static_cast<std::uint8_t>((f.data[7] & 0x3Fu) | (bits() % 2 == 0 ? 0x80u : 0x00u));  // begins or goes on, never whole
    }
    return f;
  }

 private:
  std::uint64_t bits() { return random_.bits(n_++) >> 16; }
  RandomStream random_{1, 0x4051};
  std::uint64_t n_ = 0;
};

TEST_P(EscUnderHostileTraffic, NoiseChangesNoParameterAndAMotorGoesOnForItsCommander) {
  EscBench b(GetParam());
  b.power_on();
  b.discover();
  const auto before = settable_values(b);
  Noise noise;
  b.rpm_for(1.5, 5000, ArmingStatus::kFullyArmed);
  b.on_tick = [&](std::int64_t) { b.send_foreign(BusFrame(noise.next())); };  // up to 4000 a second
  b.rpm_for(2.0, 5000, ArmingStatus::kFullyArmed);
  EXPECT_EQ(b.esc().telemetry().state, MotorState::running);
  EXPECT_NEAR(b.esc().omega_rad_s() * 30.0 / 3.14159265, 5000.0, 50.0);
  b.tool().run_for(kSecond_ns);
  EXPECT_EQ(b.esc().telemetry().state, MotorState::off) << "nobody commands any more";
  b.on_tick = nullptr;
  EXPECT_EQ(settable_values(b), before);
  EXPECT_EQ(b.esc().starts(), 1);
  EXPECT_TRUE(b.esc().operational());
}

// Identifier 0 wins every arbitration: on a bus with arbitration nothing else comes through.
TEST_P(EscUnderHostileTraffic, AFloodStopsTheMotorAtTheLatestByTheTimeOutAndTheNodeAnswersAfterIt) {
  EscBench b(GetParam());
  b.power_on();
  b.discover();
  const auto before = settable_values(b);
  b.rpm_for(1.5, 5000, ArmingStatus::kFullyArmed);
  ASSERT_EQ(b.esc().telemetry().state, MotorState::running);
  b.on_tick = [&](std::int64_t) {
    for (int i = 0; i < 3; ++i) b.send_foreign(BusFrame(CanFrame{.id = 0, .extended = false, .length = 8, .data = {}}));
  };
  b.tool().run_for(kSecond_ns);  // no commands
  EXPECT_EQ(b.esc().telemetry().state, MotorState::off);
  b.on_tick = nullptr;
  b.tool().run_for(kSecond_ns);
  EXPECT_EQ(settable_values(b), before);
  EXPECT_EQ(b.esc().starts(), 1);
}

TEST_P(EscUnderHostileTraffic, ASecondNodeWithItsIdSilencesItAndItComesBackWhenThatOneIsGone) {
  EscBench b(GetParam());
  b.power_on();
  b.discover();
  const auto before = settable_values(b);
  CanFrame status{.id = 20u << 24 | 341u << 8 | kEscNode, .extended = true, .length = 8, .data = {}};
  status.data[7] = 0xC0;
  b.send_foreign(BusFrame(status));
  b.tool().run_for(100 * kMs_ns);
  const std::int64_t heard_ns = b.tool().nodes().at(kEscNode).heard_ns;
  b.tool().run_for(2 * kSecond_ns);
  EXPECT_GT(b.esc().node().counters().id_conflicts, 0u);
  if (b.judges_time()) {
    EXPECT_EQ(b.tool().nodes().at(kEscNode).heard_ns, heard_ns) << "it talks over the other one";
  }
  b.rpm_for(0.3, 4000);
  EXPECT_EQ(b.esc().telemetry().state, MotorState::off);
  ASSERT_TRUE(b.tool().run_until(b.tool().now_ns() + 10 * kSecond_ns, [&] { return b.tool().nodes().at(kEscNode).heard_ns > heard_ns; }));
  EXPECT_EQ(settable_values(b), before);
}

TEST_P(EscUnderHostileTraffic, ASecondEscWithItsIndexIsReportedAsAnError) {
  EscBench b(GetParam());
  b.power_on();
  b.discover();
  for (int i = 0; i < 3; ++i) {
    CanFrame feedback{.id = 0x140, .extended = false, .length = 4, .data = {}};
    b.send_foreign(BusFrame(feedback));
    b.tool().run_for(300 * kMs_ns);
  }
  EXPECT_TRUE(
      b.tool().run_until(b.tool().now_ns() + 3 * kSecond_ns, [&] { return b.tool().nodes().at(kEscNode).status.health == Health::error; }));
  EXPECT_GT(b.esc().node().counters().index_conflicts, 0u);
  EXPECT_EQ(b.esc().telemetry().state, MotorState::off);
}

INSTANTIATE_TEST_SUITE_P(Backends, EscUnderHostileTraffic, ::testing::ValuesIn(backends()), backend_name);

}  // namespace
}  // namespace rotorloop::live
