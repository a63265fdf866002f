// New firmware for the whole ESC on each backend: the tool serves the image, the ESC's updater fetches it into its flash.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "host/tools/firmware_update.hpp"
#include "test/unit/bench/hil/live/esc_bench.hpp"
#include "test/unit/firmware/update/update_rig.hpp"

namespace rotorloop::live {
namespace {

using firmware::make_image;
using ::testing::HasSubstr;

class EscUpdate : public EscOnABus {};

std::uint64_t crc_of(const std::vector<std::uint8_t>& image) {
  firmware::ImageHeader h;
  EXPECT_EQ(firmware::parse_image(image, h), firmware::ImageFault::none);
  return h.crc;
}

const tools::UpdateState& run(
    EscBench& b, tools::FirmwareUpdates& updates, const std::function<bool()>& until = [] { return false; }) {
  EXPECT_TRUE(b.tool().run_until(b.tool().now_ns() + 120 * kSecond_ns, [&] { return updates.step(), updates.over() || until(); }));
  return updates.nodes().at(kEscNode);
}

TEST_P(EscUpdate, SixtyFourKilobytesAreInstalledBitExactAndTheRestartedNodeReportsTheirCrc) {
  EscBench b(GetParam());
  b.power_on();
  b.discover();
  const auto image = make_image({.seed = 7});
  tools::FirmwareUpdates updates(b.tool(), image, crc_of(image));
  const std::int64_t begun_ns = b.tool().now_ns();
  updates.start(kEscNode);
  const tools::UpdateState& s = run(b, updates);
  b.expect_within("update", static_cast<double>(b.tool().now_ns() - begun_ns) * 1e-6, 5000.0);
  EXPECT_EQ(s.phase, tools::UpdatePhase::done) << s.reason;
  EXPECT_TRUE(s.verified);
  ASSERT_TRUE(s.info);
  EXPECT_EQ((std::pair<int, int>{s.info->software_major, s.info->software_minor}), (std::pair<int, int>{1, 7}));
  EXPECT_EQ(b.esc().flash().application(image.size()), image);
  EXPECT_TRUE(b.esc().operational());
}

TEST_P(EscUpdate, AnImageForAnotherBoardIsRefusedWithTheReasonAndTheOldOneRunsOn) {
  EscBench b(GetParam());
  b.power_on();
  b.discover();
  const std::uint64_t before = b.esc().image().crc;
  const auto image = make_image({.board = "other_board"});
  tools::FirmwareUpdates updates(b.tool(), image, crc_of(image));
  updates.start(kEscNode);
  const tools::UpdateState& s = run(b, updates);
  EXPECT_EQ(s.phase, tools::UpdatePhase::failed);
  EXPECT_THAT(s.reason, HasSubstr("image is for another board"));
  EXPECT_TRUE(b.esc().operational());
  EXPECT_EQ(b.esc().image().crc, before);
}

// A file that says nothing of itself: that it was not taken shows in what the node says and runs.
TEST_P(EscUpdate, AFileThatIsNoImageIsReportedAsRefusedThoughItDoesNotNameItsCrc) {
  EscBench b(GetParam());
  b.power_on();
  b.discover();
  tools::FirmwareUpdates updates(b.tool(), {'h', 'e', 'l', 'l', 'o'});
  updates.start(kEscNode);
  const tools::UpdateState& s = run(b, updates);
  EXPECT_EQ(s.phase, tools::UpdatePhase::failed);
  EXPECT_THAT(s.reason, HasSubstr("runs its old firmware again"));
  EXPECT_THAT(s.reason, HasSubstr("it said: "));
  EXPECT_TRUE(b.esc().operational());
}

TEST_P(EscUpdate, AnImageThatItRunsAlreadyIsDoneWithoutBeingReadAgainWhateverElseTheNodeComplainsOf) {
  EscBench b(GetParam());
  b.power_on();
  b.discover();
  const auto image = make_image({.seed = 7});
  tools::FirmwareUpdates first(b.tool(), image, crc_of(image));
  first.start(kEscNode);
  ASSERT_EQ(run(b, first).phase, tools::UpdatePhase::done);
  tools::FirmwareUpdates again(b.tool(), image, crc_of(image));
  again.start(kEscNode);
  const tools::UpdateState& s = run(b, again);
  EXPECT_EQ(s.phase, tools::UpdatePhase::done) << s.reason;
  EXPECT_TRUE(s.verified);
  EXPECT_LT(s.read_B, 2048u);
}

TEST_P(EscUpdate, AKillInTheMiddleIsFollowedByTheRestOfTheUpdate) {
  EscBench b(GetParam());
  b.config.store = folder_.path() / "esc.flash";
  b.power_on();
  b.discover();
  const auto image = make_image({.seed = 9});
  tools::FirmwareUpdates updates(b.tool(), image, crc_of(image));
  updates.start(kEscNode);
  run(b, updates, [&] { return updates.nodes().at(kEscNode).read_B > image.size() / 2; });
  b.power_off();
  b.tool().run_for(500 * kMs_ns);
  b.power_on();
  EXPECT_TRUE(b.esc().updating()) << "there is no whole image to start";
  const tools::UpdateState& s = run(b, updates);
  EXPECT_EQ(s.phase, tools::UpdatePhase::done) << s.reason;
  EXPECT_TRUE(s.verified);
  EXPECT_LT(s.blocks, 256u + 64u) << "pages in place were read again";
  EXPECT_EQ(b.esc().flash().application(image.size()), image);
}

INSTANTIATE_TEST_SUITE_P(Backends, EscUpdate, ::testing::ValuesIn(backends()), backend_name);

}  // namespace
}  // namespace rotorloop::live
