// SocketCAN without a CAN kernel: frames as the kernel has them, its error reports, its netlink, and every refusal in its own words.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/can/error.h>
#include <linux/can/netlink.h>
#include <linux/if.h>
#include <linux/if_arp.h>
#include <linux/if_link.h>
#include <linux/rtnetlink.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <functional>
#include <vector>

#include "host/bus/live/error_report.hpp"
#include "host/bus/live/open_bus.hpp"
#include "host/bus/live/socketcan/frame_codec.hpp"
#include "host/bus/live/socketcan/interface_choice.hpp"
#include "host/bus/live/socketcan/interface_info.hpp"
#include "host/bus/live/stamp_clock.hpp"
#include "host/bus/live/transmit_queue.hpp"
#include "test/unit/host/bus/live_support.hpp"

namespace rotorloop {
namespace {

using test::frame_of;
using test::refused;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(SocketCanFrame, OfEveryKindAndLengthComesBackAsItWas) {
  for (const bool extended : {false, true}) {
    for (const bool fd : {false, true}) {
      for (std::size_t length = 0; length <= 64; ++length) {
        if (!possible_length(fd, length)) continue;
        const BusFrame sent = frame_of(extended ? 0x1401552Au : 0x7E0u, extended, length, fd);
        canfd_frame raw{};
        const std::size_t bytes = encode_socketcan(sent, raw);
        EXPECT_EQ(bytes, fd ? 72u : 16u);
        BusFrame read;
        EXPECT_EQ(decode_socketcan(raw, bytes, read), SocketCanContent::frame);
        EXPECT_EQ(read, sent);
      }
    }
  }
}

TEST(SocketCanFrame, HasTheBytesOfLinuxCanH) {
  canfd_frame raw{};
  encode_socketcan(frame_of(0x123, true, 2), raw);
  std::array<std::uint8_t, 10> bytes{};
  std::memcpy(bytes.data(), &raw, bytes.size());
  const std::uint32_t id = 0x80000123;  // CAN_EFF_FLAG and the identifier, in the machine's order
  EXPECT_EQ(std::memcmp(bytes.data(), &id, 4), 0);
  EXPECT_THAT((std::vector<int>{bytes[4], bytes[8], bytes[9]}), ElementsAre(2, 1, 8));  // length, then data from byte 8 on
}

TEST(SocketCanFrame, ThatIsRemoteAnErrorReportOrOfAnImpossibleLengthIsNone) {
  BusFrame kept = frame_of(1, false, 1);
  canfd_frame raw{};
  raw.can_id = 0x123 | CAN_RTR_FLAG;
  EXPECT_EQ(decode_socketcan(raw, CAN_MTU, kept), SocketCanContent::remote);
  raw.can_id = CAN_ERR_FLAG | CAN_ERR_BUSOFF;
  EXPECT_EQ(decode_socketcan(raw, CAN_MTU, kept), SocketCanContent::error_report);
  raw.can_id = 0x123;
  for (const auto& [length, bytes] : {std::pair{9, CAN_MTU}, {13, CANFD_MTU}, {65, CANFD_MTU}, {255, CANFD_MTU}, {1, std::size_t{15}}}) {
    raw.len = static_cast<std::uint8_t>(length);
    EXPECT_EQ(decode_socketcan(raw, bytes, kept), SocketCanContent::malformed) << length << " in " << bytes;
  }
  EXPECT_EQ(kept, frame_of(1, false, 1));
}

TEST(SocketCanFilter, InTheKernelPassesWhatItFitsAndNothingElse) {
  const auto passes = [](const can_filter& f, std::uint32_t id) { return (id & f.can_mask) == (f.can_id & f.can_mask); };  // as in af_can.c
  for (const CanFilter& ours :
       {CanFilter{.id = 0x00040A00, .mask = 0x00FFFF00, .extended = true}, CanFilter{.id = 0x140, .mask = 0x7F0, .extended = false},
        CanFilter{.id = 0x140, .mask = 0x1FFFFFFF, .extended = false}}) {
    const can_filter kernel = kernel_filter(ours);
    for (const std::uint32_t id : {0x140u, 0x141u, 0x150u, 0x7FFu, 0x00040A15u, 0x1C040A15u, 0x00040B15u}) {
      for (const bool extended : {false, true}) {
        if (!extended && id > 0x7FF) continue;
        EXPECT_EQ(passes(kernel, id | (extended ? CAN_EFF_FLAG : 0u)), ours.fits(id, extended)) << std::hex << id << ours.id;
      }
    }
  }
}

canfd_frame report(std::uint32_t classes, std::uint8_t controller = 0, std::uint8_t tx = 0, std::uint8_t rx = 0) {
  canfd_frame raw{};
  raw.can_id = CAN_ERR_FLAG | classes;
  raw.len = CAN_ERR_DLC;
  raw.data[1] = controller;
  raw.data[6] = tx;
  raw.data[7] = rx;
  return raw;
}

TEST(SocketCanErrors, GiveTheStateOfTheControllerAndOneSentenceAChange) {
  ErrorState s("set it down and up");
  const auto take = [&](const canfd_frame& raw) { return s.take(decode_error_report(raw)).value_or(""); };
  EXPECT_THAT(take(report(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_WARNING, 97)), HasSubstr("above 96 (errors counted: 97 sending, 0 receiving)"));
  EXPECT_EQ(s.state(), BusState::error_active);
  EXPECT_EQ(take(report(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_WARNING, 99)), "");
  EXPECT_THAT(take(report(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE, 128)), HasSubstr("error passive: many errors"));
  EXPECT_EQ(s.state(), BusState::error_passive);
  EXPECT_EQ(take(report(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE, 129)), "");
  EXPECT_EQ(take(report(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE | CAN_ERR_CRTL_RX_PASSIVE, 129)), "");
  EXPECT_THAT(take(report(CAN_ERR_BUSOFF)), AllOf(HasSubstr("bus-off"), HasSubstr("; set it down and up")));
  EXPECT_EQ(s.state(), BusState::bus_off);
  EXPECT_EQ(take(report(CAN_ERR_BUSOFF)), "");
  EXPECT_THAT(take(report(CAN_ERR_RESTARTED)), HasSubstr("after a restart"));
  EXPECT_EQ(s.state(), BusState::error_active);
  take(report(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_PASSIVE));
  EXPECT_THAT(take(report(CAN_ERR_CRTL, CAN_ERR_CRTL_ACTIVE)), HasSubstr("the bus is well"));
}

TEST(SocketCanErrors, SayOnceThatNobodyAcknowledgesUntilSomebodyDid) {
  ErrorState s("set it down and up");
  const auto take = [&](const canfd_frame& raw) { return s.take(decode_error_report(raw)).value_or(""); };
  EXPECT_THAT(take(report(CAN_ERR_ACK)), HasSubstr("nobody acknowledges"));
  EXPECT_EQ(take(report(CAN_ERR_ACK)), "");
  EXPECT_THAT(take(report(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE, 128)), HasSubstr("error passive, as nobody acknowledges"));
  s.confirmed();
  EXPECT_THAT(take(report(CAN_ERR_ACK)), HasSubstr("nobody acknowledges"));
  EXPECT_EQ(s.state(), BusState::error_passive);
}

TEST(SocketCanErrors, OfTheBusAloneChangeNoState) {
  ErrorState s("set it down and up");
  EXPECT_FALSE(s.take(decode_error_report(report(CAN_ERR_PROT | CAN_ERR_BUSERROR))));
  EXPECT_TRUE(decode_error_report(report(CAN_ERR_PROT)).bus_error);
  EXPECT_EQ(s.state(), BusState::error_active);
  EXPECT_THAT(s.take(decode_error_report(report(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_OVERFLOW))).value_or(""),
              HasSubstr("receive buffer was full"));
  EXPECT_FALSE(s.take(decode_error_report(report(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_OVERFLOW))));
}

// Messages of netlink, built as the kernel builds them.
class Netlink {
 public:
  void put(const void* data, std::size_t size) {
    const auto* const begin = static_cast<const std::byte*>(data);
    bytes.insert(bytes.end(), begin, begin + size);
    bytes.resize((bytes.size() + 3) / 4 * 4);
  }
  void nest(std::uint16_t type, const std::function<void()>& content) {
    const std::size_t at = bytes.size();
    rtattr head{.rta_len = 0, .rta_type = type};
    put(&head, sizeof head);
    content();
    head.rta_len = static_cast<std::uint16_t>(bytes.size() - at);
    std::memcpy(&bytes[at], &head, sizeof head);
  }
  void attribute(std::uint16_t type, const void* data, std::size_t size) {
    const rtattr head{.rta_len = static_cast<std::uint16_t>(sizeof(rtattr) + size), .rta_type = type};
    put(&head, sizeof head);
    put(data, size);
  }
  void text(std::uint16_t type, const char* value) { attribute(type, value, std::strlen(value) + 1); }
  void number(std::uint16_t type, std::uint32_t value) { attribute(type, &value, sizeof value); }
  void link(int index, unsigned short hardware, unsigned flags, const std::function<void()>& attributes) {
    const std::size_t at = bytes.size();
    nlmsghdr head{};
    head.nlmsg_type = RTM_NEWLINK;
    put(&head, sizeof head);
    ifinfomsg body{};
    body.ifi_type = hardware;
    body.ifi_index = index;
    body.ifi_flags = flags;
    put(&body, sizeof body);
    attributes();
    head.nlmsg_len = static_cast<std::uint32_t>(bytes.size() - at);
    std::memcpy(&bytes[at], &head, sizeof head);
  }
  std::vector<std::byte> bytes;
};

Netlink three_links() {
  Netlink n;
  n.link(1, ARPHRD_LOOPBACK, IFF_UP, [&] { n.text(IFLA_IFNAME, "lo"); });
  n.link(4, ARPHRD_CAN, IFF_UP, [&] {
    n.text(IFLA_IFNAME, "can0");
    n.number(IFLA_MTU, 72);
    n.nest(IFLA_LINKINFO, [&] {
      n.text(IFLA_INFO_KIND, "can");
      n.nest(IFLA_INFO_DATA, [&] {
        can_bittiming timing{}, data{};
        timing.bitrate = 500'000;
        data.bitrate = 2'000'000;
        n.attribute(IFLA_CAN_BITTIMING, &timing, sizeof timing);
        n.attribute(IFLA_CAN_DATA_BITTIMING, &data, sizeof data);
        n.number(IFLA_CAN_STATE, CAN_STATE_ERROR_PASSIVE);
      });
    });
  });
  n.link(7, ARPHRD_CAN, 0, [&] {
    n.text(IFLA_IFNAME, "vcan0");
    n.number(IFLA_MTU, 16);
    n.nest(IFLA_LINKINFO, [&] { n.text(IFLA_INFO_KIND, "vcan"); });
  });
  return n;
}

TEST(SocketCanInterfaces, AreReadWithKindStateRatesAndFd) {
  const std::vector<CanInterface> links = parse_links(three_links().bytes);
  ASSERT_EQ(links.size(), 2u);
  const CanInterface &can0 = links[0], &vcan0 = links[1];
  EXPECT_EQ(can0.name, "can0");
  EXPECT_EQ(can0.index, 4);
  EXPECT_EQ(can0.kind, "can");
  EXPECT_TRUE(can0.fd());
  EXPECT_EQ(can0.bit_rate_Hz, 500'000);
  EXPECT_EQ(can0.data_rate_Hz, 2'000'000);
  EXPECT_EQ(can0.state_text(), "up, error-passive");
  EXPECT_EQ(vcan0.name, "vcan0");
  EXPECT_EQ(vcan0.kind, "vcan");
  EXPECT_FALSE(vcan0.fd());
  EXPECT_FALSE(vcan0.bit_rate_Hz);
  EXPECT_EQ(vcan0.state_text(), "down");
}

TEST(SocketCanInterfaces, CutAnywhereOrWithAnyByteTurnedAreReadWithoutReachingOutside) {
  const std::vector<std::byte> whole = three_links().bytes;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const std::vector<std::byte> cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));  // the sanitizer sees its end
    EXPECT_LE(parse_links(cut).size(), 2u);
    for (const int value : {0x00, 0x01, 0x7F, 0xFF}) {
      std::vector<std::byte> turned = whole;
      turned[size] = static_cast<std::byte>(value);
      EXPECT_LE(parse_links(turned).size(), 3u);
    }
  }
}

std::vector<CanInterface> a_bench() {
  return {{.name = "can0",
           .index = 4,
           .kind = "can",
           .up = true,
           .mtu_B = 16,
           .bit_rate_Hz = 500'000,
           .data_rate_Hz = {},
           .state = "error-active"},
          {.name = "can1", .index = 5, .kind = "can", .up = false, .mtu_B = 16, .bit_rate_Hz = {}, .data_rate_Hz = {}, .state = "stopped"},
          {.name = "can2",
           .index = 6,
           .kind = "can",
           .up = true,
           .mtu_B = 72,
           .bit_rate_Hz = 1'000'000,
           .data_rate_Hz = 4'000'000,
           .state = "bus-off"},
          {.name = "vcan0", .index = 7, .kind = "vcan", .up = true, .mtu_B = 16, .bit_rate_Hz = {}, .data_rate_Hz = {}, .state = {}}};
}

TEST(SocketCanRefusal, NamesWhatIsWrongWithTheInterfaceAndTheCommandThatMendsIt) {
  const std::vector<CanInterface> there = a_bench();
  const auto choosing = [&](const std::string& name) {
    return refused([&] { choose_interface(parse_socketcan_settings(name, "--bus"), there); });
  };
  EXPECT_THAT(choosing("can9"),
              AllOf(HasSubstr("socketcan:can9: error: there is no CAN interface of this name"), HasSubstr("can0, can1, can2, vcan0")));
  EXPECT_THAT(choosing("can1"),
              AllOf(HasSubstr("is down"), HasSubstr("sudo ip link set can1 type can bitrate 1000000; sudo ip link set can1 up")));
  EXPECT_THAT(choosing("can0@1000000"), AllOf(HasSubstr("bit rate is 500000 bit/s, 1000000 bit/s is asked for"),
                                              HasSubstr("sudo ip link set can0 down; sudo ip link set can0 type can bitrate 1000000")));
  EXPECT_THAT(choosing("can0@500000,2000000"), AllOf(HasSubstr("carries no CAN FD (MTU 16"), HasSubstr("dbitrate 2000000 fd on")));
  EXPECT_THAT(choosing("can2"), HasSubstr("is bus-off"));
  EXPECT_THAT(choosing("vcan0@1000000,4000000"), HasSubstr("sudo ip link set vcan0 mtu 72"));
  EXPECT_EQ(choosing("can0"), "nothing was refused");
  EXPECT_EQ(choosing("can0@500000"), "nothing was refused");
  EXPECT_EQ(choosing("vcan0@1000000"), "nothing was refused") << "vcan has no bit rate";
  EXPECT_THAT(refused([] { choose_interface({.interface = "can0", .bit_rate_Hz = {}, .data_rate_Hz = {}}, {}); }),
              HasSubstr("there is none at all"));
}

TEST(SocketCanRefusal, OfANameThatCannotBeOneIsBadUsage) {
  const auto parsing = [](const std::string& name) { return refused([&] { parse_socketcan_settings(name, "--bus"); }, ExitCode::usage); };
  EXPECT_THAT(parsing("a_name_of_16_cha"), HasSubstr("1 to 15 characters"));
  EXPECT_THAT(parsing("/dev/can0"), HasSubstr("cannot be an interface"));
  EXPECT_THAT(parsing("can0@fast"), HasSubstr("out of range: 10000 to 1000000 bit/s"));
  EXPECT_THAT(parsing("can0@2000000"), HasSubstr("out of range"));
  EXPECT_THAT(parsing("can0@1000000,9000000"), HasSubstr("10000 to 8000000"));
  const SocketCanSettings s = parse_socketcan_settings("can0@1000000,4000000", "");
  EXPECT_EQ(s.interface, "can0");
  EXPECT_EQ(s.bit_rate_Hz, 1'000'000);
  EXPECT_EQ(s.data_rate_Hz, 4'000'000);
}

TEST(SocketCanRefusal, OfTheSystemSaysWhatToDo) {
  const SocketCanSettings s{.interface = "can0", .bit_rate_Hz = {}, .data_rate_Hz = {}};
  EXPECT_THAT(socket_refusal(s, "cannot make a CAN socket", EAFNOSUPPORT).what(), HasSubstr("modprobe can_raw"));
  EXPECT_THAT(socket_refusal(s, "cannot make a CAN socket", EPERM).what(), HasSubstr("sandbox or container"));
  EXPECT_THAT(interface_lost(s, ENETDOWN).what(), AllOf(HasSubstr("went down"), HasSubstr("--wait")));
  EXPECT_THAT(interface_lost(s, ENODEV).what(), HasSubstr("is gone"));
  EXPECT_TRUE(ends_the_connection(ENETDOWN) && ends_the_connection(ENODEV) && ends_the_connection(ENXIO));
  EXPECT_FALSE(ends_the_connection(EAGAIN) || ends_the_connection(ENOBUFS));
}

TEST(SocketCanRefusal, ComesFromOpeningAnInterfaceThatIsNotThere) {
  const int can = ::socket(PF_CAN, SOCK_RAW, 1);
  if (can >= 0) ::close(can);
  EXPECT_THAT(refused([] { open_bus("socketcan:no_such_if", "--bus"); }),
              HasSubstr(can < 0 ? "this kernel has no CAN" : "there is no CAN interface of this name"));
}

TEST(StampClock, PutsFramesWhereTheyWereOnTheBusThoughTheSystemSawThemUpToTwoMillisecondsLate) {
  StampClock clock;
  std::int64_t worst_ns = 0;
  for (std::int64_t i = 0; i < 20'000; ++i) {
    const std::int64_t bus_ns = 1'000'000'000'000 + i * 1'000'000;
    const std::int64_t adapter_ns = 5'000 + (bus_ns - 1'000'000'000'000) / 1'000'000 * 1'000'050;  // 50 ppm fast
    const std::int64_t late_ns = i % 50 == 0 ? 10'000 : (i * 7919) % 2'000'000;
    const std::int64_t estimated_ns = clock.on_the_bus_ns(adapter_ns, bus_ns + late_ns);
    EXPECT_LE(estimated_ns, bus_ns + late_ns);
    if (i > 0) worst_ns = std::max(worst_ns, std::abs(estimated_ns - bus_ns));
  }
  EXPECT_LE(worst_ns, 25'000) << "10 us of the best frames, and 50 ms of drift";
}

TEST(StampClock, GoesOnAfterTheAdaptersClockWrapped) {
  StampClock clock;
  constexpr std::int64_t kWrap_ns = 4'294'967'296'000;  // 32 bits of microseconds
  EXPECT_EQ(clock.on_the_bus_ns(kWrap_ns - 1'000, 10'000'000'000), 10'000'000'000);
  EXPECT_EQ(clock.on_the_bus_ns(500, 10'000'001'500), 10'000'001'500);
  EXPECT_EQ(clock.on_the_bus_ns(1'000'500, 10'001'101'500), 10'001'001'720) << "100 us late; 1.1 ms allow for 220 ns of drift";
}

TEST(TransmitQueue, SendsInTheOrderOfArbitrationAndEqualIdentifiersInTheirOwn) {
  TransmitQueue queue;
  BusFrame first = frame_of(0x140, false, 1), second = first;
  second.data[0] = 2;
  queue.push(frame_of(0x1401552A, true, 8), 0);
  queue.push(first, 0);
  queue.push(second, 0);
  queue.push(frame_of(0x00040A15, true, 8), 0);
  queue.push(frame_of(0x001, false, 8), 0);
  std::vector<BusFrame> order;
  for (; !queue.empty(); queue.pop()) order.push_back(queue.front());
  EXPECT_THAT(order, ElementsAre(frame_of(0x001, false, 8), frame_of(0x00040A15, true, 8), first, second, frame_of(0x1401552A, true, 8)));
}

TEST(TransmitQueue, DropsWhatWaitedLongerThan100MillisecondsAndTakesNoMoreThan1024Frames) {
  TransmitQueue queue;
  queue.push(frame_of(1, false, 1), 0);
  queue.push(frame_of(2, false, 1), 1);
  EXPECT_EQ(queue.drop_stale(100'000'000), 0u);
  EXPECT_EQ(queue.drop_stale(100'000'001), 1u);
  EXPECT_EQ(queue.front().id, 2u);
  for (std::size_t i = 1; i < 1024; ++i) EXPECT_TRUE(queue.push(frame_of(3, false, 1), 2));
  EXPECT_FALSE(queue.push(frame_of(3, false, 1), 2));
  EXPECT_EQ(queue.clear(), 1024u);
}

}  // namespace
}  // namespace rotorloop
