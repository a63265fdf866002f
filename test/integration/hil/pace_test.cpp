// Paced flights on a clock of the test: what is flown is that of lockstep, and a machine that falls behind ends in the safe state.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bench/hil/flight/flight.hpp"
#include "test/integration/hil/cli_run.hpp"

namespace rotorloop::test {
namespace {

// Wakes on time but for one deadline, after which it is `late_ns` behind.
class VirtualClock final : public WaitClock {
 public:
  VirtualClock(std::int64_t at_ns, std::int64_t late_ns) : at_ns_(at_ns), late_ns_(late_ns) {}
  std::int64_t now_ns() override { return now_ns_; }
  void wait_until(std::int64_t deadline_ns) override {
    now_ns_ = std::max(now_ns_, deadline_ns);
    if (deadline_ns < at_ns_ || late_ns_ == 0) return;
    now_ns_ += late_ns_;
    late_ns_ = 0;
  }

 private:
  std::int64_t now_ns_ = 0, at_ns_, late_ns_;
};

constexpr std::int64_t kSecond = 1'000'000'000, kMs = 1'000'000;

class Pace : public testing::Test {
 protected:
  hil::FlightResult fly(double pace, WaitClock* clock) {
    hil::Scenario scenario = hil::read_scenario(write_short_scenario(folder_.path(), "", "[1]"));
    scenario.bus.pace = pace;
    hil::FlightRequest q;
    q.variant = scenario.variants.front();
    q.clock = clock;
    return hil::fly(scenario, hil::read_inputs(scenario), q, nullptr, nullptr, nullptr).result;
  }
  ScratchFolder folder_;
};

TEST_F(Pace, AFlightInTimeIsThatOfLockstepToTheBit_WithADeadlineForEveryMillisecond) {
  const hil::FlightResult lockstep = fly(0.0, nullptr);
  EXPECT_FALSE(lockstep.pace.has_value());
  VirtualClock clock(0, 0);
  const hil::FlightResult paced = fly(0.25, &clock);
  ASSERT_TRUE(paced.pace.has_value());
  EXPECT_EQ(paced.end, hil::FlightEnd::completed);
  EXPECT_EQ(paced.tracking.truth.mean_3d_cm, lockstep.tracking.truth.mean_3d_cm);
  EXPECT_EQ(paced.duration_s, lockstep.duration_s);
  EXPECT_EQ(paced.pace->lateness.missed, 0u);
  EXPECT_NEAR(static_cast<double>(paced.pace->lateness.steps), 1000.0 * lockstep.duration_s, 1.0);
  EXPECT_NEAR(1e-9 * static_cast<double>(clock.now_ns()), 4.0 * lockstep.duration_s, 0.01) << "a quarter of real time";
}

TEST_F(Pace, NineteenMillisecondsBehindAreCaughtUp) {
  VirtualClock clock(2 * kSecond, 19 * kMs);
  const hil::FlightResult r = fly(1.0, &clock);
  EXPECT_EQ(r.end, hil::FlightEnd::completed);
  EXPECT_EQ(r.pace->lateness.missed, 18u);
  EXPECT_EQ(r.pace->lateness.worst_ns, 19 * kMs);
}

TEST_F(Pace, TwentyOneMillisecondsBehindDisarmTheMotorsAndSaySo) {
  VirtualClock clock(2 * kSecond, 21 * kMs);
  const hil::FlightResult r = fly(1.0, &clock);
  EXPECT_EQ(r.end, hil::FlightEnd::late);
  EXPECT_THAT(r.end_detail, testing::HasSubstr("too far behind real time at 1.999 s"));
  EXPECT_THAT(r.end_detail, testing::HasSubstr("motors disarmed; 21.0 ms behind"));
  EXPECT_NEAR(r.duration_s, 2.5, 0.05) << "half a second more shows what the motors did";
}

// No machine flies ten times faster than real time: the command is behind from the first step on.
TEST_F(Pace, TheCommandWritesLatenessIntoItsResult_AndTheLogsAreThoseOfLockstep) {
  const auto scenario = write_short_scenario(folder_.path(), "", "[1]");
  const auto run = [&](const std::string& name, const std::string& options) {
    const auto done = rotorloop_command("hil '" + scenario.string() + "' -q --name " + name + options, folder_.path());
    EXPECT_EQ(done.exit_code, 0) << done.err;
    return result_of(folder_ / "runs" / name);
  };
  const auto lockstep = run("lockstep", " --pace lockstep"), paced = run("paced", " --pace 10 --catch-up 1000000");
  EXPECT_EQ(paced["log_sha256"], lockstep["log_sha256"]);
  EXPECT_FALSE(lockstep["flights"][0].contains("pace"));
  EXPECT_FALSE(lockstep.contains("real_time"));
  const auto& pace = paced["flights"][0]["pace"];
  EXPECT_EQ(pace["pace"], 10.0);
  EXPECT_GT(pace["deadlines"], 4000);
  std::uint64_t counted = 0;
  for (const auto& n : pace["late_counts"]) counted += n.get<std::uint64_t>();
  EXPECT_EQ(counted, pace["deadlines"].get<std::uint64_t>());
  EXPECT_THAT(read_text(folder_ / "runs/paced/report.html"), testing::HasSubstr("pace 10: "));
  // What the system granted of the three things asked for, and what it refused: nothing is passed over.
  std::size_t told = paced.contains("real_time") ? paced["real_time"].size() : 0;
  for (const auto& w : paced["warnings"]) told += w["where"] == "real time" ? 1 : 0;
  EXPECT_EQ(told, 3u);
}

TEST_F(Pace, TheCommandEndsWith4WhenItCannotKeepUp) {
  const auto scenario = write_short_scenario(folder_.path(), "", "[1, 2]");
  const auto done = rotorloop_command("hil '" + scenario.string() + "' -q --pace 10 --catch-up 1", folder_.path());
  EXPECT_EQ(done.exit_code, 4) << done.err;
  EXPECT_THAT(done.out, testing::HasSubstr("too far behind real time"));
  EXPECT_THAT(done.out, testing::HasSubstr("fly it at a lower --pace"));
}

TEST_F(Pace, TextThatIsNoPaceIsRefusedByTheCommand) {
  const auto scenario = write_short_scenario(folder_.path(), "", "[1]");
  const auto done = rotorloop_command("hil '" + scenario.string() + "' --pace fast", folder_.path());
  EXPECT_EQ(done.exit_code, 2);
  EXPECT_THAT(done.err, testing::HasSubstr("give lockstep, realtime, or seconds of flight per second of real time, 0.01 to 10"));
}

}  // namespace
}  // namespace rotorloop::test
