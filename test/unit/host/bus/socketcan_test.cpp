// SocketCAN without a socket: frames, error reports, the kernel's list of interfaces, and every refusal with the command that mends it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/can/error.h>
#include <linux/can/netlink.h>
#include <linux/if.h>
#include <linux/if_link.h>
#include <linux/rtnetlink.h>

#include <cstring>
#include <string>
#include <vector>

#include "host/base/error.hpp"
#include "host/bus/live/socketcan/can_interfaces.hpp"
#include "host/bus/live/socketcan/socketcan_bus.hpp"
#include "host/bus/live/socketcan/socketcan_frame.hpp"

namespace rotorloop {
namespace {

using ::testing::HasSubstr;

BusFrame frame_with(std::uint32_t id, bool extended, bool fd, std::uint8_t length) {
  BusFrame f;
  f.id = id, f.extended = extended, f.fd = fd, f.bit_rate_switch = fd, f.length = length;
  for (std::uint8_t i = 0; i < length; ++i) f.data[i] = static_cast<std::uint8_t>(3 * i + 1);
  return f;
}

std::span<const std::uint8_t> bytes_of(const SocketCanFrame& f) { return {reinterpret_cast<const std::uint8_t*>(&f.raw), f.size}; }

TEST(SocketCanFrame, EveryKindAndLengthComesBackAsItWas) {
  int checked = 0;
  for (const bool extended : {false, true})
    for (const bool fd : {false, true})
      for (std::uint8_t length = 0; length <= 64; ++length) {
        if (!possible_length(fd, length)) continue;
        const BusFrame sent = frame_with(extended ? 0x1ABCDEF3u : 0x7F1u, extended, fd, length);
        const SocketCanFrame raw = to_socketcan(sent);
        EXPECT_EQ(raw.size, fd ? 72u : 16u);
        BusFrame back;
        ASSERT_EQ(from_socketcan(bytes_of(raw), back), SocketCanContent::frame);
        EXPECT_EQ(back, sent);
        ++checked;
      }
  EXPECT_EQ(checked, 2 * (9 + 16));
}

TEST(SocketCanFrame, RemoteFramesErrorReportsAndCutFramesAreNoFrames) {
  BusFrame out;
  SocketCanFrame f = to_socketcan(frame_with(0x123, false, false, 4));
  f.raw.can_id |= CAN_RTR_FLAG;
  EXPECT_EQ(from_socketcan(bytes_of(f), out), SocketCanContent::remote);
  f.raw.can_id = CAN_ERR_FLAG | CAN_ERR_BUSOFF;
  EXPECT_EQ(from_socketcan(bytes_of(f), out), SocketCanContent::error_report);
  EXPECT_EQ(from_socketcan(bytes_of(f).first(15), out), SocketCanContent::malformed);
  f = to_socketcan(frame_with(0x123, false, false, 4));
  f.raw.len = 9;  // no classic frame has
  EXPECT_EQ(from_socketcan(bytes_of(f), out), SocketCanContent::malformed);
}

BusErrorReport report_of(std::uint32_t classes, std::uint8_t controller = 0, std::uint8_t sent = 0, std::uint8_t heard = 0) {
  can_frame f{};
  f.can_id = CAN_ERR_FLAG | classes;
  f.can_dlc = 8;
  f.data[1] = controller, f.data[6] = sent, f.data[7] = heard;
  return error_report(f);
}

TEST(BusErrorReport, FollowsTheControllerFromActiveToBusOffAndBack) {
  EXPECT_EQ(report_of(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_WARNING, 97).state, BusState::error_active);
  const BusErrorReport passive = report_of(CAN_ERR_CRTL | CAN_ERR_ACK, CAN_ERR_CRTL_TX_PASSIVE, 128);
  EXPECT_EQ(passive.state, BusState::error_passive);
  EXPECT_EQ(words(passive), "error passive, nobody acknowledges, error counters 128 sending, 0 receiving");
  EXPECT_EQ(report_of(CAN_ERR_BUSOFF).state, BusState::bus_off);
  const BusErrorReport restarted = report_of(CAN_ERR_RESTARTED);
  EXPECT_EQ(restarted.state, BusState::error_active);
  EXPECT_EQ(words(restarted), "restarted after bus-off");
}

TEST(BusErrorReport, AnOverflowOfTheControllerIsAFrameLostAndChangesNoState) {
  const BusErrorReport r = report_of(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_OVERFLOW);
  EXPECT_TRUE(r.receive_overflow);
  EXPECT_FALSE(r.state);
  EXPECT_EQ(words(report_of(0)), "an error that the driver does not describe");
}

// Attributes and messages as rtnetlink lays them out.
class Netlink {
 public:
  static std::vector<std::uint8_t> attribute(unsigned type, const std::vector<std::uint8_t>& value) {
    rtattr a{};
    a.rta_len = static_cast<unsigned short>(RTA_LENGTH(value.size()));
    a.rta_type = static_cast<unsigned short>(type);
    std::vector<std::uint8_t> out(RTA_SPACE(value.size()));
    std::memcpy(out.data(), &a, sizeof a);
    std::copy(value.begin(), value.end(), out.begin() + RTA_LENGTH(0));
    return out;
  }
  template <class T>
  static std::vector<std::uint8_t> bytes(const T& value) {
    const auto* p = reinterpret_cast<const std::uint8_t*>(&value);
    return {p, p + sizeof value};
  }
  static std::vector<std::uint8_t> text(const std::string& s) { return {s.c_str(), s.c_str() + s.size() + 1}; }
  static std::vector<std::uint8_t> joined(std::initializer_list<std::vector<std::uint8_t>> parts) {
    std::vector<std::uint8_t> out;
    for (const auto& p : parts) out.insert(out.end(), p.begin(), p.end());
    return out;
  }
  static std::vector<std::uint8_t> link(unsigned short hardware, int index, unsigned flags, const std::vector<std::uint8_t>& attributes) {
    ifinfomsg info{};
    info.ifi_type = hardware, info.ifi_index = index, info.ifi_flags = flags;
    nlmsghdr header{};
    header.nlmsg_type = RTM_NEWLINK;
    header.nlmsg_len = static_cast<std::uint32_t>(NLMSG_LENGTH(sizeof info + attributes.size()));
    return joined({bytes(header), bytes(info), attributes});
  }
};

std::vector<std::uint8_t> dump_of_three_interfaces() {
  can_bittiming nominal{}, data{};
  nominal.bitrate = 1'000'000, data.bitrate = 4'000'000;
  const std::uint32_t passive = 2, mtu_fd = 72, mtu = 16;
  const auto controller = Netlink::joined({Netlink::attribute(IFLA_CAN_BITTIMING, Netlink::bytes(nominal)),
                                           Netlink::attribute(IFLA_CAN_DATA_BITTIMING, Netlink::bytes(data)),
                                           Netlink::attribute(IFLA_CAN_STATE, Netlink::bytes(passive))});
  const auto info =
      Netlink::joined({Netlink::attribute(IFLA_INFO_KIND, Netlink::text("can")), Netlink::attribute(IFLA_INFO_DATA, controller)});
  return Netlink::joined(
      {Netlink::link(1, 1, IFF_UP, Netlink::attribute(IFLA_IFNAME, Netlink::text("eth0"))),
       Netlink::link(280, 3, IFF_UP,
                     Netlink::joined({Netlink::attribute(IFLA_IFNAME, Netlink::text("can0")),
                                      Netlink::attribute(IFLA_MTU, Netlink::bytes(mtu_fd)), Netlink::attribute(IFLA_LINKINFO, info)})),
       Netlink::link(
           280, 4, 0,
           Netlink::joined({Netlink::attribute(IFLA_IFNAME, Netlink::text("vcan0")), Netlink::attribute(IFLA_MTU, Netlink::bytes(mtu)),
                            Netlink::attribute(IFLA_LINKINFO, Netlink::attribute(IFLA_INFO_KIND, Netlink::text("vcan")))}))});
}

TEST(CanInterfaces, AreThoseOfTheKernelsListThatAreCanWithRatesAndState) {
  const auto found = can_interfaces(dump_of_three_interfaces());
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].name, "can0");
  EXPECT_EQ(found[0].index, 3);
  EXPECT_EQ(words(found[0]), "can, up, 1000000 bit/s, FD data 4000000 bit/s, error-passive");
  EXPECT_EQ(found[1].name, "vcan0");
  EXPECT_EQ(words(found[1]), "vcan, down");
}

TEST(CanInterfaces, AListThatIsCutAtAnyByteIsReadWithoutHarm) {
  const auto whole = dump_of_three_interfaces();
  for (std::size_t n = 0; n < whole.size(); ++n) {
    const std::vector<std::uint8_t> cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n));
    EXPECT_LE(can_interfaces(cut).size(), 2u) << n;
  }
}

ErrorText refusal(const std::string& settings, std::vector<CanInterface> present) {
  try {
    ready_interface(parse_socketcan_settings(settings, "--bus"), present);
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::device);
    return e.text();
  }
  ADD_FAILURE() << settings << " was accepted";
  return {};
}

CanInterface can0() {
  return {.name = "can0",
          .index = 3,
          .kind = "can",
          .up = true,
          .fd = true,
          .bit_rate_Hz = 500'000,
          .data_bit_rate_Hz = 2'000'000,
          .state = "error-active"};
}
CanInterface vcan0() { return {.name = "vcan0", .index = 4, .kind = "vcan", .up = true}; }

TEST(ReadyInterface, TakesWhatIsUpAtTheRateThatWasAskedForOrAtAny) {
  const std::vector<CanInterface> present{can0(), vcan0()};
  EXPECT_EQ(ready_interface(parse_socketcan_settings("can0", ""), present).index, 3);
  EXPECT_EQ(ready_interface(parse_socketcan_settings("can0@500000,2000000", ""), present).index, 3);
  EXPECT_EQ(ready_interface(parse_socketcan_settings("vcan0@1000000", ""), present).index, 4) << "vcan has no bit rate";
}

TEST(ReadyInterface, NamesThoseThatThereAre) {
  EXPECT_EQ(refusal("can7", {can0(), vcan0()}).remedy, "use one of: can0 (up), vcan0 (up)");
  EXPECT_THAT(refusal("can0", {}).remedy, HasSubstr("ip link add vcan0 type vcan"));
}

TEST(ReadyInterface, PrintsTheCommandThatSetsItUp) {
  CanInterface down = can0(), virtual_down = vcan0();
  down.up = virtual_down.up = false;
  EXPECT_EQ(refusal("can0@1000000", {down}).remedy, "ip link set can0 down; ip link set can0 up type can bitrate 1000000");
  EXPECT_EQ(refusal("vcan0", {virtual_down}).remedy, "ip link set vcan0 up");
}

TEST(ReadyInterface, RefusesAnotherBitRateWithBothNumbers) {
  EXPECT_EQ(refusal("can0@1000000", {can0()}).what, "runs at 500000 bit/s, not at 1000000");
  EXPECT_EQ(refusal("can0@500000,4000000", {can0()}).what, "sends FD data at 2000000 bit/s, not at 4000000");
}

TEST(ReadyInterface, RefusesFdWhereTheInterfaceTakesNoneAndABusThatIsOff) {
  EXPECT_EQ(refusal("vcan0@1000000,4000000", {vcan0()}).remedy, "ip link set vcan0 mtu 72");
  CanInterface off = can0();
  off.state = "bus-off";
  EXPECT_EQ(refusal("can0", {off}).what, "the controller is bus-off");
}

TEST(SocketCanSettings, RefuseNamesAndRatesThatCannotBe) {
  for (const char* text : {"", "@1000000", "a_name_of_sixteen", "can0@", "can0@9999", "can0@1000000,", "can0@8000001", "can0@1M"})
    EXPECT_THROW(parse_socketcan_settings(text, "--bus"), Error) << text;
}

TEST(SocketCanBus, AnInterfaceThatIsNotThereIsRefusedWithWhatToDo) {
  try {
    const SocketCanBus bus(parse_socketcan_settings("no_such_can", ""));
    ADD_FAILURE() << "it was opened";
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::device);
    EXPECT_EQ(e.text().where, "socketcan:no_such_can");
    EXPECT_FALSE(e.text().remedy.empty());
  }
}

}  // namespace
}  // namespace rotorloop
