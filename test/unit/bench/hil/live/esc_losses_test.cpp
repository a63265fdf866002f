// Frames lost between the tool and the whole ESC: an update through the tool's file server and a session with its parameters, each frame
// lost independently at each receiver; in virtual time over seeds, and updates on each backend.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "host/tools/firmware_update.hpp"
#include "host/tools/parameters.hpp"
#include "test/unit/bench/hil/live/esc_bench.hpp"
#include "test/unit/firmware/update/update_rig.hpp"

namespace rotorloop::live {
namespace {

struct Losses {
  double probability;
  double update_limit_s;
};
constexpr Losses kOnePercent{0.01, 45.0}, kFivePercent{0.05, 360.0};

std::vector<sim::BusFault> lost(const Losses& losses) {
  return {{.kind = sim::BusFaultKind::lose_received, .probability = losses.probability}};
}

double seconds(EscBench& b, std::int64_t since_ns) { return static_cast<double>(b.tool().now_ns() - since_ns) * 1e-9; }

double update_s(EscBench& b, const firmware::ImageOptions& options) {
  b.power_on();
  b.discover(10'000.0);
  const auto image = firmware::make_image(options);
  firmware::ImageHeader header;
  EXPECT_EQ(firmware::parse_image(image, header), firmware::ImageFault::none);
  tools::FirmwareUpdates updates(b.tool(), image, header.crc);
  const std::int64_t begun_ns = b.tool().now_ns();
  updates.start(kEscNode);
  b.tool().run_until(begun_ns + 600 * kSecond_ns, [&] { return updates.step(), updates.over(); });
  const tools::UpdateState& s = updates.nodes().at(kEscNode);
  EXPECT_EQ(s.phase, tools::UpdatePhase::done) << "seed " << options.seed << ": " << s.reason;
  EXPECT_TRUE(s.verified) << "seed " << options.seed;
  EXPECT_EQ(b.esc().flash().application(image.size()), image) << "seed " << options.seed;
  return seconds(b, begun_ns);
}

double update_takes_s(const Losses& losses, std::uint64_t seed) {
  EscBench b(Backend::virtual_bus, {.seed = seed, .faults = lost(losses)});
  return update_s(b, {.seed = static_cast<std::uint8_t>(seed)});
}

// All are read, one is set, saved, and there after the power was off.
double parameters_take_s(const Losses& losses, std::uint64_t seed) {
  const test::TempFolder folder;
  EscBench b(Backend::virtual_bus, {.seed = seed, .faults = lost(losses)});
  b.config.store = folder.path() / "esc.flash";
  b.power_on();
  b.discover(10'000.0);
  const std::int64_t begun_ns = b.tool().now_ns();
  const auto all = tools::read_parameters(b.tool(), kEscNode);
  EXPECT_EQ(all.size(), firmware::ParameterServer::kCount) << "seed " << seed;
  const double took_s = seconds(b, begun_ns);
  const auto p = tools::read_parameter(b.tool(), kEscNode, "status_Hz");
  tools::set_parameter(b.tool(), kEscNode, p, tools::parse_value(p, "77", "status_Hz"));
  tools::execute(b.tool(), kEscNode, tools::ParameterOrder::save);
  b.power_off();
  b.power_on();
  EXPECT_EQ(b.esc().node().parameters().status_Hz, 77) << "seed " << seed;
  return took_s;
}

template <class Run>
void over_seeds(int seeds, const std::string& what, const Losses& losses, double limit_s, const Run& run) {
  double worst_s = 0.0, sum_s = 0.0;
  for (int seed = 1; seed <= seeds; ++seed) {
    const double s = run(losses, static_cast<std::uint64_t>(seed));
    worst_s = std::max(worst_s, s);
    sum_s += s;
  }
  ::testing::Test::RecordProperty(what + "_worst_s", std::to_string(worst_s));
  ::testing::Test::RecordProperty(what + "_mean_s", std::to_string(sum_s / seeds));
  EXPECT_LE(worst_s, limit_s) << what << ", s";
}

TEST(EscWithLosses, OnePercentTwentySeedsTheUpdateTakesAtMost45Seconds) { over_seeds(20, "update", kOnePercent, 45.0, update_takes_s); }

TEST(EscWithLosses, OnePercentTwentySeedsAllParametersAreReadSetAndSaved) {
  over_seeds(20, "parameters", kOnePercent, 20.0, parameters_take_s);
}

TEST(EscWithLosses, FivePercentThreeSeedsTheUpdateTakesAtMost6Minutes) { over_seeds(3, "update", kFivePercent, 360.0, update_takes_s); }

TEST(EscWithLosses, FivePercentTwentySeedsAllParametersAreReadSetAndSaved) {
  over_seeds(20, "parameters", kFivePercent, 60.0, parameters_take_s);
}

TEST(EscWithLossesFull, FivePercentTwentySeedsTheUpdateTakesAtMost6Minutes) {
  over_seeds(20, "update", kFivePercent, 360.0, update_takes_s);
}

class EscOnABusWithLosses : public EscOnABus {
 protected:
  // Of 5 % at each receiver. The time is the bus's own, and judged where that is virtual.
  static void update(const firmware::ImageOptions& options) {
    EscBench b(GetParam(), {.seed = 1, .faults = lost(kFivePercent)});
    const double took_s = update_s(b, options);
    b.expect_within("update", took_s * 1e3, kFivePercent.update_limit_s * 1e3);
    std::printf("%s, 5 %% lost: %u bytes bit-exact after %.1f s\n", ::testing::PrintToString(GetParam()).c_str(), options.size, took_s);
  }
};

TEST_P(EscOnABusWithLosses, FivePercentTwoKilobytesAreInstalledBitExact) { update({.size = 2048 - firmware::kImageHeaderBytes}); }

TEST_P(EscOnABusWithLosses, FullFivePercentSixtyFourKilobytesAreInstalledBitExact) { update({}); }

INSTANTIATE_TEST_SUITE_P(Backends, EscOnABusWithLosses, ::testing::ValuesIn(backends()), backend_name);

}  // namespace
}  // namespace rotorloop::live
