// The backend of gs_usb on an emulated candleLight in this program: frames, faults, bus-off, unplugging. Time is the test's.
#include "host/bus/live/gs_usb/gs_usb_port.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <vector>

#include "host/bus/live/waiting_bus.hpp"
#include "test/support/gs_usb/emulated_link.hpp"
#include "test/unit/host/bus/live_support.hpp"

namespace rotorloop::gs_usb {
namespace {

using emulated::CandlelightOptions;
using emulated::EmulatedLink;
using emulated::UsbPlug;
using test::refused;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::int64_t kMillisecond_ns = 1'000'000;

std::shared_ptr<Adapter> adapter_in(UsbPlug& plug) { return std::make_shared<Adapter>(Settings{}, std::make_unique<EmulatedLink>(plug)); }
std::unique_ptr<GsUsbPort> port_of(UsbPlug& plug, const std::shared_ptr<Adapter>& adapter, const char* name) {
  return std::make_unique<GsUsbPort>(parse_settings(name, "test"), adapter, [&plug] { return plug.now_ns; });
}

// An adapter with both channels open; they are the two ends of one bus.
struct TwoEnds {
  explicit TwoEnds(bool paced = false, CandlelightOptions options = {}, const char* rates = "@1000000,4000000")
      : plug(paced, std::move(options)), adapter(adapter_in(plug)) {
    a = port_of(plug, adapter, (std::string("/0") + rates).c_str());
    b = port_of(plug, adapter, (std::string("/1") + rates).c_str());
  }
  void pass(std::int64_t time_ns) {
    for (const std::int64_t end_ns = plug.now_ns + time_ns; plug.now_ns < end_ns; plug.now_ns += kMillisecond_ns / 10) {
      for (GsUsbPort* p : {a.get(), b.get()}) {
        if (!p) continue;
        p->flush();
        while (const auto f = p->receive_any()) (p == a.get() ? at_a : at_b).push_back(*f);
      }
    }
  }
  UsbPlug plug;
  std::shared_ptr<Adapter> adapter;
  std::unique_ptr<GsUsbPort> a, b;
  std::vector<StampedBusFrame> at_a, at_b;
};

BusFrame numbered(std::uint32_t n, bool extended = true, std::size_t length = 8, bool fd = false) {
  BusFrame f;
  f.id = n;
  f.extended = extended;
  f.fd = fd;
  f.bit_rate_switch = fd;
  f.length = static_cast<std::uint8_t>(length);
  for (std::size_t i = 0; i < length; ++i) f.data[i] = static_cast<std::uint8_t>(n + 3 * i);
  return f;
}

// Whatever was offered to `p` is confirmed, dropped, or on its way.
std::uint64_t accounted(const GsUsbPort& p) { return p.counters().sent + p.counters().dropped_tx + p.link_counters().unconfirmed; }

std::string notices(GsUsbPort& p) {
  std::string all;
  while (const auto n = p.next_notice()) all += *n + "\n";
  return all;
}

TEST(GsUsbPort, CarriesEveryKindAndLengthOfFrameEqualStampedAndConfirmed) {
  TwoEnds bus(true);
  std::uint64_t sent = 0;
  for (const bool extended : {false, true}) {
    for (const bool fd : {false, true}) {
      for (std::size_t length = 0; length <= 64; ++length) {
        if (!possible_length(fd, length)) continue;
        const BusFrame f = numbered(extended ? 0x1401552A : 0x140, extended, length, fd);
        const std::int64_t begun_ns = bus.plug.now_ns;
        ASSERT_EQ(bus.a->send_any(f), SendStatus::queued);
        ++sent;
        bus.pass(2 * kMillisecond_ns);
        ASSERT_EQ(bus.at_b.size(), sent);
        EXPECT_EQ(bus.at_b.back().frame, f);
        EXPECT_GE(bus.at_b.back().time_ns, begun_ns);
        EXPECT_LE(bus.at_b.back().time_ns, bus.plug.now_ns);
      }
    }
  }
  EXPECT_TRUE(bus.at_a.empty()) << "one's own frames are no frames of others";
  EXPECT_EQ(bus.a->counters().sent, sent);
  EXPECT_EQ(bus.b->counters().received, sent);
  EXPECT_EQ(bus.a->link_counters().unconfirmed, 0u);
}

TEST(GsUsbPort, SetsTheBitRateThatIsAskedForAndStampsByTheAdaptersClock) {
  TwoEnds bus(true, {}, "@500000");
  EXPECT_EQ(bus.plug.device->controller(0).rate_Hz, 500e3);
  bus.a->send_any(numbered(1));
  bus.a->send_any(numbered(2));
  bus.pass(5 * kMillisecond_ns);
  ASSERT_EQ(bus.at_b.size(), 2u);
  const double apart_us = static_cast<double>(bus.at_b[1].time_ns - bus.at_b[0].time_ns) * 1e-3;
  EXPECT_NEAR(apart_us, 2 * 135, 30) << "a frame's time at 500 kbit/s, though both were read in one go";
}

TEST(GsUsbPort, SendsWhatIsUrgentBeforeWhatWaitsAndDropsWhatWaited100Milliseconds) {
  TwoEnds bus(true);
  for (std::uint32_t n = 1000; n < 2000; ++n) ASSERT_EQ(bus.a->send_any(numbered(n)), SendStatus::queued);
  EXPECT_EQ(bus.a->link_counters().unconfirmed, InFlight::kMost) << "as many on their way as there are echo ids";
  ASSERT_EQ(bus.a->send_any(numbered(0x50)), SendStatus::queued);
  bus.pass(300 * kMillisecond_ns);
  const auto urgent = std::find_if(bus.at_b.begin(), bus.at_b.end(), [](const auto& f) { return f.frame.id == 0x50; });
  EXPECT_EQ(urgent - bus.at_b.begin(), InFlight::kMost) << "right behind those that the adapter had";
  EXPECT_EQ(accounted(*bus.a), 1001u);
  EXPECT_EQ(bus.at_b.size(), bus.a->counters().sent);
  EXPECT_GT(bus.a->counters().sent, 700u);
  EXPECT_EQ(bus.a->link_counters().stale, bus.a->counters().dropped_tx);
  EXPECT_GT(bus.a->counters().dropped_tx, 100u) << "the bus takes some 800 in that time";
}

TEST(GsUsbPort, SendsOnThoughItsCallerNeverReceives) {
  TwoEnds bus;
  for (std::uint32_t n = 0; n < 100; ++n) bus.a->send_any(numbered(n));
  std::size_t heard = 0;
  while (bus.b->receive_any()) ++heard;
  EXPECT_EQ(heard, 100u) << "echoes free the numbers of ten frames at a time";
}

TEST(GsUsbPort, Accounts100000FramesOfWhichMoreAreOfferedThanTheBusTakes) {
  TwoEnds bus(true);
  std::uint64_t offered = 0;
  for (int ms = 0; ms < 10'000; ++ms) {
    for (int i = 0; i < 10; ++i, ++offered) bus.a->send_any(numbered(static_cast<std::uint32_t>(offered)));
    bus.plug.now_ns += kMillisecond_ns;
    while (bus.b->receive_any()) bus.at_b.push_back({});
    while (bus.a->receive_any()) ADD_FAILURE();
  }
  bus.pass(300 * kMillisecond_ns);
  const PortCounters a = bus.a->counters();
  EXPECT_EQ(offered, 100'000u);
  EXPECT_EQ(a.sent + a.dropped_tx, offered);
  EXPECT_EQ(bus.a->link_counters().unconfirmed, 0u);
  EXPECT_GT(a.dropped_tx, 10'000u) << "it never was too much: nothing was tested";
  EXPECT_EQ(bus.at_b.size(), a.sent);
  std::printf("gs_usb, overload: %llu confirmed, %llu dropped, %llu of them as stale\n", static_cast<unsigned long long>(a.sent),
              static_cast<unsigned long long>(a.dropped_tx), static_cast<unsigned long long>(bus.a->link_counters().stale));
}

TEST(GsUsbPort, AloneOnTheBusSaysSoDropsWhatIsOldAndGoesOnWhenAnotherComes) {
  TwoEnds bus(true);
  bus.b.reset();
  for (std::uint32_t n = 0; n < 50; ++n) bus.a->send_any(numbered(n));
  bus.pass(500 * kMillisecond_ns);
  EXPECT_EQ(bus.a->state(), BusState::error_passive);
  EXPECT_THAT(notices(*bus.a), HasSubstr("nobody acknowledges"));
  EXPECT_EQ(bus.a->counters().sent, 0u);
  bus.b = port_of(bus.plug, bus.adapter, "/1@1000000,4000000");
  bus.pass(20 * kMillisecond_ns);
  EXPECT_EQ(bus.at_b.size(), 10u) << "those that the adapter has cannot be called back; those that waited here are dropped";
  EXPECT_EQ(bus.a->link_counters().stale, 40u);
  bus.a->send_any(numbered(99));
  bus.pass(5 * kMillisecond_ns);
  EXPECT_EQ(bus.at_b.back().frame.id, 99u);
  EXPECT_EQ(accounted(*bus.a), 51u);
}

TEST(GsUsbPort, AtAnotherBitRateLeavesTheBusSaysSoAndIsStartedAgainAfterASecond) {
  TwoEnds bus(true);
  bus.b.reset();
  bus.b = port_of(bus.plug, bus.adapter, "/1@500000");
  for (std::uint32_t n = 0; n < 20; ++n) bus.a->send_any(numbered(n));
  bus.pass(100 * kMillisecond_ns);
  EXPECT_EQ(bus.a->state(), BusState::bus_off);
  EXPECT_THAT(notices(*bus.a), AllOf(HasSubstr("bus-off"), HasSubstr("started again after a second")));
  EXPECT_EQ(bus.a->send_any(numbered(20)), SendStatus::bus_off);
  EXPECT_EQ(bus.a->counters().dropped_tx, 21u);
  EXPECT_EQ(bus.a->link_counters().unconfirmed, 0u);
  bus.b.reset();
  bus.b = port_of(bus.plug, bus.adapter, "/1@1000000");
  bus.pass(800 * kMillisecond_ns);
  EXPECT_EQ(bus.a->state(), BusState::bus_off);
  bus.pass(300 * kMillisecond_ns);
  EXPECT_EQ(bus.a->state(), BusState::error_active);
  EXPECT_THAT(notices(*bus.a), HasSubstr("on the bus again"));
  EXPECT_TRUE(bus.at_b.empty()) << "no set-point from before leaves then";
  bus.a->send_any(numbered(21));
  bus.pass(5 * kMillisecond_ns);
  EXPECT_EQ(bus.at_b.size(), 1u);
}

TEST(GsUsbPort, ThatLosesFramesInTheAdapterSaysSoOnce) {
  TwoEnds bus;
  bus.plug.device->faults.overflows = 3;
  for (std::uint32_t n = 0; n < 5; ++n) bus.a->send_any(numbered(n));
  bus.pass(2 * kMillisecond_ns);
  EXPECT_EQ(bus.a->counters().dropped_rx + bus.b->counters().dropped_rx, 3u);
  const std::string said = notices(*bus.a) + notices(*bus.b);
  EXPECT_THAT(said, HasSubstr("receive buffer was full"));
}

TEST(GsUsbPort, GoesOnAfterEachFaultOfATransferAndCountsIt) {
  TwoEnds bus;
  auto& faults = bus.plug.device->faults;
  const auto send = [&](std::uint32_t from) {
    for (std::uint32_t n = from; n < from + 5; ++n) bus.a->send_any(numbered(n));
    bus.pass(2 * kMillisecond_ns);
  };
  faults.stalled_out = 2;
  send(0);
  EXPECT_EQ(bus.a->counters().sent, 3u);
  EXPECT_EQ(bus.a->link_counters().refused_by_peer, 2u);
  EXPECT_EQ(accounted(*bus.a), 5u);
  faults.stalled_in = 2;
  send(5);
  EXPECT_EQ(bus.at_b.size(), 8u) << "a stall in loses no frame: the transfer is begun again";
  faults.cut_in = 2;  // an echo and the frame itself
  send(10);
  EXPECT_EQ(bus.a->link_counters().malformed + bus.b->link_counters().malformed, 4u);
  EXPECT_EQ(bus.at_b.size(), 12u);
  EXPECT_EQ(accounted(*bus.a), 15u);
  faults.lost_out = 1;
  send(15);
  EXPECT_EQ(bus.a->counters().dropped_tx, 2u) << "not given up yet";
  bus.pass(1100 * kMillisecond_ns);
  EXPECT_EQ(bus.a->counters().dropped_tx, 3u) << "given up after a second";
  EXPECT_EQ(accounted(*bus.a), 20u);
}

TEST(GsUsbPort, GetsItsEchoNumbersBackThoughEchoesAreLost) {
  TwoEnds bus;
  bus.plug.device->faults.lost_echoes = 9;
  for (std::uint32_t n = 0; n < 9; ++n) bus.a->send_any(numbered(n));
  bus.pass(1500 * kMillisecond_ns);
  for (std::uint32_t n = 9; n < 40; ++n) {
    bus.a->send_any(numbered(n));
    bus.pass(kMillisecond_ns);
  }
  EXPECT_EQ(bus.at_b.size(), 40u);
  EXPECT_EQ(bus.a->counters().sent, 31u);
  EXPECT_EQ(bus.a->link_counters().unconfirmed, 9u) << "they are told as not confirmed for ever";
  EXPECT_EQ(bus.adapter->lost(), std::nullopt);
}

TEST(GsUsbPort, WhoseTransfersAllFailEndsByName) {
  TwoEnds bus;
  bus.plug.device->faults.stalled_in = 1000;
  bus.a->send_any(numbered(1));
  EXPECT_THAT(refused([&] { bus.pass(5 * kMillisecond_ns); }), HasSubstr("transfers fail: refused by the adapter (stall)"));
  EXPECT_EQ(bus.b->send_any(numbered(2)), SendStatus::bus_off);
}

TEST(GsUsbPort, ClosingWaitsForTheLastFrameStopsTheChannelAndGivesTheAdapterBack) {
  UsbPlug plug(true, {});
  auto adapter = adapter_in(plug);
  auto a = port_of(plug, adapter, "/0"), b = port_of(plug, adapter, "/1");
  for (std::uint32_t n = 0; n < 30; ++n) a->send_any(numbered(n));
  a.reset();
  EXPECT_FALSE(plug.device->controller(0).on);
  std::size_t heard = 0;
  while (b->receive_any()) ++heard;
  EXPECT_EQ(heard, 30u) << "a disarm is sent before the channel closes";
  b.reset();
  adapter.reset();
  EXPECT_FALSE(plug.device->controller(1).on);
  EXPECT_FALSE(plug.claimed);
  EXPECT_EQ(plug.transfers_pending, 0);
}

TEST(GsUsbPort, ClosingDoesNotWaitLongerThan100MillisecondsForASilentBus) {
  UsbPlug plug(true, {});
  auto a = port_of(plug, adapter_in(plug), "/0");
  a->send_any(numbered(1));
  const std::int64_t begun_ns = plug.now_ns;
  a.reset();
  EXPECT_LE(plug.now_ns - begun_ns, 101 * kMillisecond_ns);
}

TEST(GsUsbPort, StartsAChannelAnewThatAKilledProgramLeftStarted) {
  UsbPlug plug(true, {});
  plug.device->controller(0).on = true;
  plug.device->controller(0).rate_Hz = 125e3;
  plug.device->controller(0).to_send.push_back({.frame = numbered(0x666), .echo_id = 3, .since_ns = plug.now_ns});
  auto adapter = adapter_in(plug);
  const auto a = port_of(plug, adapter, "/0"), b = port_of(plug, adapter, "/1");
  plug.now_ns += 10 * kMillisecond_ns;
  EXPECT_FALSE(b->receive_any()) << "its last set-point";
  EXPECT_EQ(plug.device->controller(0).rate_Hz, 1e6);
}

TEST(GsUsbPort, OfAnAdapterWithWrongAnswersIsRefusedByName) {
  const auto opening = [](CandlelightOptions options, const char* name, std::optional<int> stalled, std::optional<int> garbled,
                          emulated::Bytes garbage = {}) {
    UsbPlug plug(false, std::move(options));
    if (stalled) plug.device->faults.stalled_request = static_cast<std::uint8_t>(*stalled);
    if (garbled) plug.device->faults.garbled_request = static_cast<std::uint8_t>(*garbled);
    plug.device->faults.garbage = std::move(garbage);
    const std::string text = refused([&] { port_of(plug, adapter_in(plug), name); });
    EXPECT_FALSE(plug.claimed) << "given back";
    EXPECT_EQ(plug.transfers_pending, 0);
    return text;
  };
  for (const int request : {0, 1, 2, 4, 5, 11})
    EXPECT_THAT(opening({}, "/0", request, {}), HasSubstr("refused by the adapter (stall)")) << request;
  EXPECT_THAT(opening({}, "/0", 2, {}), HasSubstr("\"start or stop\""));
  EXPECT_THAT(opening({}, "/2", {}, {}), HasSubstr("no channel 2: it has 2"));
  EXPECT_THAT(opening({.reported_channels = 3}, "/2", {}, {}), HasSubstr("does not answer the request \"limits of bit timing\""));
  EXPECT_THAT(opening({.reported_channels = 256}, "/0", {}, {}), HasSubstr("tells of 256 channels; none has more than 16"));
  for (const int request : {4, 5, 11})
    EXPECT_THAT(opening({}, "/0", {}, request, emulated::Bytes(7, 1)), HasSubstr("cut short")) << request;
  EXPECT_THAT(opening({}, "/0", {}, 4, emulated::Bytes(40, 0)), HasSubstr("limits of its bit timing that no controller has"));
  EXPECT_THAT(opening({.fd = false}, "/0", {}, 4, emulated::Bytes(40, 0xFF)), HasSubstr("does not answer the request"))
      << "tells of limits for CAN FD, and has none";
  EXPECT_THAT(opening({.fd = false}, "/0@1000000,4000000", {}, {}), HasSubstr("carries no CAN FD"));
  EXPECT_THAT(opening({.clock_Hz = 48'000'000}, "/0@830000", {}, {}),
              AllOf(HasSubstr("cannot do 830000 bit/s with its clock of 48000000 Hz"), HasSubstr("ppm")));
}

TEST(GsUsbPort, OfAChannelThatThisProgramHasOpenIsRefused) {
  TwoEnds bus;
  EXPECT_THAT(refused([&] { port_of(bus.plug, bus.adapter, "/1"); }), HasSubstr("open in this program already"));
  bus.a->send_any(numbered(1));
  bus.pass(kMillisecond_ns);
  EXPECT_EQ(bus.at_b.size(), 1u) << "and the other goes on";
}

TEST(GsUsbPort, ThatIsPumpedByTheOtherChannelTellsOfItsInput) {
  TwoEnds bus;
  bus.a->send_any(numbered(1));
  while (bus.a->receive_any()) ADD_FAILURE();
  EXPECT_TRUE(bus.b->input_waits()) << "the frame was taken from USB: polling would say nothing";
  EXPECT_TRUE(bus.b->receive_any());
}

TEST(GsUsbPort, RefusesFdOnAChannelThatWasStartedClassic) {
  TwoEnds bus(false, {}, "@1000000");
  EXPECT_EQ(bus.a->send_any(numbered(1, true, 12, true)), SendStatus::queue_full);
  EXPECT_EQ(bus.a->link_counters().fd_refused, 1u);
}

// 200 frames there and 200 back, unplugged at each transfer of it, requests of opening and closing among them.
TEST(GsUsbUnplug, AtEveryTransferOfAnExchangeOf200FramesEndsByNameAndAccountsForEveryFrame) {
  const auto exchange = [](std::uint64_t at, std::uint64_t& transfers) {
    UsbPlug plug(true, {});
    plug.unplugged_at = at;
    std::string end;
    try {
      auto adapter = adapter_in(plug);
      const auto a = port_of(plug, adapter, "/0"), b = port_of(plug, adapter, "/1");
      std::uint64_t offered = 0, heard = 0;
      try {
        for (std::uint32_t n = 0; n < 200; ++n) {
          a->send_any(numbered(n));
          b->send_any(numbered(n + 1000));
          ++offered;
          plug.now_ns += kMillisecond_ns;
          for (GsUsbPort* p : {a.get(), b.get()}) {
            while (p->receive_any()) ++heard;
          }
        }
        plug.now_ns += 10 * kMillisecond_ns;
        for (GsUsbPort* p : {a.get(), b.get()}) {
          while (p->receive_any()) ++heard;
        }
        EXPECT_EQ(heard, 400u);
      } catch (const Error& e) {
        EXPECT_EQ(e.exit_code(), ExitCode::device);
        end = e.what();
        EXPECT_EQ(a->send_any(numbered(1)), SendStatus::bus_off);
        ++offered;
        EXPECT_EQ(a->link_counters().unconfirmed, 0u);
        EXPECT_EQ(a->counters().sent + a->counters().dropped_tx, offered);
      }
    } catch (const Error& e) {
      EXPECT_EQ(e.exit_code(), ExitCode::device);
      end = e.what();
    }
    EXPECT_FALSE(plug.claimed) << at;
    EXPECT_EQ(plug.transfers_pending, 0) << at;
    transfers = plug.transfers;
    return end;
  };
  std::uint64_t all = 0, unused = 0;
  ASSERT_EQ(exchange(UINT64_MAX, all), "");
  ASSERT_GT(all, 800u);
  std::uint64_t named = 0;
  for (std::uint64_t at = 0; at < all; ++at) named += exchange(at, unused).find("the adapter is gone") != std::string::npos;
  EXPECT_GE(named, all - 4) << "but for the last ones, which stop the channels";
  std::printf("gs_usb, unplugged: %llu transfers, %llu ends by name\n", static_cast<unsigned long long>(all),
              static_cast<unsigned long long>(named));
}

TEST(GsUsbUnplug, IsWaitedForWhereAskedAndAReplugWithAnotherInterfaceNumberGoesOn) {
  auto plug = std::make_unique<UsbPlug>(false, CandlelightOptions{});
  std::shared_ptr<GsUsbPort> other;
  const auto open = [&]() -> std::unique_ptr<TimedBus> {
    if (!plug || plug->unplugged()) throw refusal({}, "no gs_usb adapter is plugged in", "", "");
    auto adapter = adapter_in(*plug);
    other = port_of(*plug, adapter, "/1");
    return port_of(*plug, adapter, "/0");
  };
  WaitingBus waiting("gsusb:", open);
  other->send_any(numbered(1));
  EXPECT_TRUE(waiting.receive_any());
  plug->unplugged_at = 0;
  EXPECT_FALSE(waiting.receive_any());
  EXPECT_THAT(waiting.next_notice().value_or(""), AllOf(HasSubstr("the adapter is gone"), HasSubstr("waiting for it")));
  EXPECT_EQ(waiting.send_any(numbered(2)), SendStatus::bus_off);
  other.reset();
  plug = std::make_unique<UsbPlug>(false, CandlelightOptions{.interface = 1});
  while (!other) {
    waiting.wait_until(waiting.now_ns() + 10 * kMillisecond_ns);
    waiting.receive_any();
  }
  other->send_any(numbered(3));
  const auto heard = waiting.receive_any();
  ASSERT_TRUE(heard);
  EXPECT_EQ(heard->frame.id, 3u);
  EXPECT_EQ(waiting.counters().received, 2u);
}

}  // namespace
}  // namespace rotorloop::gs_usb
