// Which bit rate a bus has, by a channel of an emulated adapter that only listens; two other channels are the nodes that talk.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "host/bus/live/gs_usb/bit_rate_search.hpp"
#include "host/bus/live/gs_usb/gs_usb_port.hpp"
#include "test/support/gs_usb/emulated_link.hpp"
#include "test/unit/host/bus/live_support.hpp"

namespace rotorloop::gs_usb {
namespace {

using emulated::EmulatedLink;
using emulated::UsbPlug;
using ::testing::HasSubstr;

constexpr std::int64_t kMs_ns = 1'000'000;

// Channels 0 and 1 talk at `rate`: 50 frames a second, as an ESC reports. Channel 2 is free.
struct TalkingBus {
  explicit TalkingBus(const std::string& rate) {
    a = open("/0@" + rate);
    b = open("/1@" + rate);
  }
  std::unique_ptr<GsUsbPort> open(const std::string& name) {
    return std::make_unique<GsUsbPort>(parse_settings(name, "test"), adapter, [this] { return plug.now_ns; });
  }
  // The time; what is due by then is sent.
  std::int64_t now() {
    for (; talks && plug.now_ns >= next_ns; next_ns += 20 * kMs_ns) a->send_any(test::frame_of(0x040A1501, true, 8));
    for (GsUsbPort* p : {a.get(), b.get()}) {
      while (p->receive_any()) {
      }
    }
    return plug.now_ns;
  }
  std::optional<std::uint32_t> searched(const std::string& name = "/2") {
    return search_bit_rate(parse_settings(name, "test"), *adapter, [this] { return now(); });
  }
  UsbPlug plug{true, {.channels = 3}};
  std::shared_ptr<Adapter> adapter = std::make_shared<Adapter>(Settings{}, std::make_unique<EmulatedLink>(plug));
  std::unique_ptr<GsUsbPort> a, b;
  bool talks = true;
  std::int64_t next_ns = plug.now_ns;
};

class GsUsbBitRate : public ::testing::TestWithParam<std::uint32_t> {};

TEST_P(GsUsbBitRate, OfABusThatTalksIsToldWithinASecondOfListeningWhateverRateWasAskedFor) {
  for (const char* asked : {"@1000000", "@500000", "@250000", "@125000"}) {
    TalkingBus bus(std::to_string(GetParam()));
    const std::int64_t begun_ns = bus.plug.now_ns;
    EXPECT_EQ(bus.searched(std::string("/2") + asked), GetParam()) << asked;
    EXPECT_LE(bus.plug.now_ns - begun_ns, 1'000 * kMs_ns) << asked;
    EXPECT_EQ(bus.a->counters().error_frames + bus.b->counters().error_frames, 0u) << "nobody was disturbed";
    EXPECT_EQ(bus.a->counters().dropped_tx, 0u);
  }
}

INSTANTIATE_TEST_SUITE_P(Rates, GsUsbBitRate, ::testing::Values(1'000'000u, 500'000u, 250'000u, 125'000u));

TEST(GsUsbBitRateSearch, FindsARateOfItsOwnWhereTheNameSaysIt) {
  TalkingBus bus("800000");
  EXPECT_EQ(bus.searched("/2@800000"), 800'000u);
  EXPECT_EQ(bus.searched("/2"), std::nullopt) << "800 kbit/s is none of those that are tried";
}

TEST(GsUsbBitRateSearch, OfASilentBusTellsNoneAfterASecondAndLeavesTheChannelStopped) {
  TalkingBus bus("500000");
  bus.talks = false;
  const std::int64_t begun_ns = bus.plug.now_ns;
  EXPECT_EQ(bus.searched(), std::nullopt);
  EXPECT_EQ(bus.plug.now_ns - begun_ns, 4 * kListened_ns);
  EXPECT_FALSE(bus.plug.device->controller(2).on);
  bus.open("/2@500000");
}

TEST(GsUsbBitRateSearch, OnAChannelThatThisProgramUsesIsRefused) {
  TalkingBus bus("500000");
  EXPECT_THAT(test::refused([&] { bus.searched("/1"); }), HasSubstr("channel 1 of this adapter is open in this program already"));
}

TEST(GsUsbBitRateSearch, EndsByNameAtWhateverTransferTheAdapterIsPulled) {
  for (std::uint64_t transfer = 1; transfer <= 14; ++transfer) {
    TalkingBus bus("500000");
    bus.talks = false;
    bus.plug.unplugged_at = bus.plug.transfers + transfer;
    EXPECT_THAT(test::refused([&] { bus.searched(); }), HasSubstr("the adapter is gone")) << transfer;
  }
}

}  // namespace
}  // namespace rotorloop::gs_usb
