// gs_usb on Debian's USB and with its own driver: emulated adapters behind USB/IP (candlelight_main.cpp, whose program is named by
// ROTORLOOP_TEST_CANDLELIGHT). Outside the guest every test is skipped.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>

#include "host/base/error.hpp"
#include "host/bus/frame_bits.hpp"
#include "host/bus/live/gs_usb/gs_usb_port.hpp"
#include "host/bus/live/gs_usb/libusb_link.hpp"
#include "host/bus/live/gs_usb/usb_tree.hpp"
#include "host/bus/live/live_clock.hpp"
#include "host/bus/live/open_bus.hpp"
#include "host/bus/live/waiting_bus.hpp"

namespace rotorloop {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::int64_t kSecond_ns = 1'000'000'000;

// The program of the adapters; they are pulled when this ends.
class Adapters {
 public:
  explicit Adapters(const char* option = "") {
    std::array<int, 2> to{}, from{};
    if (::pipe(to.data()) != 0 || ::pipe(from.data()) != 0) return;
    process_ = ::fork();
    if (process_ == 0) {
      ::dup2(to[0], 0);
      ::dup2(from[1], 1);
      for (const int end : {to[0], to[1], from[0], from[1]}) ::close(end);
      ::execl(std::getenv("ROTORLOOP_TEST_CANDLELIGHT"), "vm_candlelight", *option != 0 ? option : nullptr, nullptr);
      ::_exit(127);
    }
    ::close(to[0]);
    ::close(from[1]);
    commands_ = to[1];
    answers_ = ::fdopen(from[0], "r");
  }
  ~Adapters() {
    ::close(commands_);
    ::waitpid(process_, nullptr, 0);
    std::fclose(answers_);
    for (int i = 0; i < 100 && !gs_usb::plugged_in().empty(); ++i) pass();
  }
  Adapters(const Adapters&) = delete;
  Adapters& operator=(const Adapters&) = delete;
  std::string tell(const std::string& command) {
    const std::string line = command + "\n";
    if (::write(commands_, line.data(), line.size()) != static_cast<ssize_t>(line.size())) return "no program";
    std::array<char, 32> answer{};
    return std::fgets(answer.data(), answer.size(), answers_) != nullptr ? answer.data() : "no answer";
  }
  void plug(const std::string& serial, int channels, int interface = 0) {
    ASSERT_EQ(tell("plug " + serial + " " + std::to_string(channels) + " " + std::to_string(interface)), "done\n");
    // The kernel's driver takes interface 0 alone, and has it when its interfaces of CAN are there.
    const std::size_t expected = interface == 0 ? static_cast<std::size_t>(channels) : 0;
    for (int i = 0; i < 300 && (of(serial).serial.empty() || of(serial).interfaces.size() < expected); ++i) pass();
    ASSERT_EQ(of(serial).serial, serial);
    ASSERT_EQ(of(serial).interfaces.size(), expected) << serial;
  }
  static gs_usb::UsbAdapter of(const std::string& serial) {
    for (const auto& a : gs_usb::plugged_in()) {
      if (a.serial == serial) return a;
    }
    return {};
  }
  static void pass() { ::poll(nullptr, 0, 10); }  // of the guest's time

 private:
  pid_t process_ = -1;
  int commands_ = -1;
  std::FILE* answers_ = nullptr;
};

class GsUsbGuest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::getenv("ROTORLOOP_TEST_CANDLELIGHT") == nullptr || !std::filesystem::exists("/sys/devices/platform/vhci_hcd.0"))
      GTEST_SKIP() << "no vhci_hcd: this runs in a guest (test/vm)";
  }
  static std::unique_ptr<TimedBus> open(const std::string& name) { return open_bus(name, "test"); }
  // The interface that the kernel's driver made of an adapter, set up.
  static std::string up(const std::string& serial, const std::string& settings = "bitrate 1000000 dbitrate 4000000 fd on") {
    const std::string name = Adapters::of(serial).interfaces.at(0);
    shell("ip link set " + name + " type can " + settings + " && ip link set " + name + " up");
    return "socketcan:" + name;
  }
  static void shell(const std::string& command) { ASSERT_EQ(std::system(command.c_str()), 0) << command; }
  static std::string refused(const std::function<void()>& action) {
    try {
      action();
    } catch (const Error& e) {
      EXPECT_EQ(e.exit_code(), ExitCode::device);
      return e.what();
    }
    return "nothing was refused";
  }
};

BusFrame frame_of(std::uint32_t id, bool extended, std::size_t length, bool fd) {
  BusFrame f;
  f.id = id;
  f.extended = extended;
  f.fd = fd;
  f.bit_rate_switch = fd;
  f.length = static_cast<std::uint8_t>(length);
  for (std::size_t i = 0; i < length; ++i) f.data[i] = static_cast<std::uint8_t>(3 * i + length);
  return f;
}

std::uint64_t every_kind_of_frame(TimedBus& from, TimedBus& to) {
  std::uint64_t sent = 0;
  for (const bool extended : {false, true}) {
    for (const bool fd : {false, true}) {
      for (std::size_t length = 0; length <= 64; ++length) {
        if (!possible_length(fd, length)) continue;
        const BusFrame f = frame_of(extended ? 0x1401552A : 0x140, extended, length, fd);
        const std::int64_t begun_ns = from.now_ns();
        EXPECT_EQ(from.send_any(f), SendStatus::queued);
        ++sent;
        const auto heard = to.receive_until(to.now_ns() + kSecond_ns);
        if (!heard) {
          ADD_FAILURE() << from.name() << " to " << to.name() << ": nothing of " << length << " bytes came; sent " << from.counters().sent
                        << " unconfirmed " << from.link_counters().unconfirmed << " reports " << to.link_counters().error_reports
                        << " malformed " << to.link_counters().malformed << from.next_notice().value_or("")
                        << to.next_notice().value_or("");
          return sent;
        }
        EXPECT_EQ(heard->frame, f);
        EXPECT_GE(heard->time_ns, begun_ns);
        EXPECT_LE(heard->time_ns, to.now_ns());
      }
    }
  }
  EXPECT_FALSE(from.receive_until(from.now_ns() + kSecond_ns / 100)) << "one's own frames are no frames of others";
  EXPECT_EQ(from.counters().sent, sent);
  EXPECT_EQ(to.counters().received, sent);
  EXPECT_EQ(from.link_counters().unconfirmed, 0u);
  return sent;
}

TEST_F(GsUsbGuest, EveryKindAndLengthOfFramePassesBetweenThisBackendAndTheKernelsDriverBothWays) {
  Adapters adapters;
  adapters.plug("KERNEL", 1);
  adapters.plug("OURS", 1);
  {
    const auto kernel = open(up("KERNEL")), ours = open("gsusb:OURS@1000000,4000000");
    every_kind_of_frame(*ours, *kernel);
    every_kind_of_frame(*open(kernel->name()), *ours);
    EXPECT_EQ(Adapters::of("OURS").driver, "usbfs");
  }
  EXPECT_EQ(Adapters::of("OURS").driver, "gs_usb") << "the kernel's driver has it back";
  for (int i = 0; i < 100 && Adapters::of("OURS").interfaces.empty(); ++i) Adapters::pass();
  EXPECT_EQ(Adapters::of("OURS").interfaces.size(), 1u);
}

TEST_F(GsUsbGuest, BothChannelsOfAnAdapterAreBusesOfOneProgramAndAnotherProgramIsRefusedByName) {
  Adapters adapters;
  adapters.plug("TWO", 2);
  const auto a = open("gsusb:TWO/0@500000,2000000"), b = open("gsusb:TWO/1@500000,2000000");
  every_kind_of_frame(*a, *b);
  EXPECT_THAT(refused([&] { open("gsusb:TWO/2"); }), HasSubstr("no channel 2: it has 2"));
  const pid_t other = ::fork();
  if (other == 0) {
    const gs_usb::UsbAdapter two = Adapters::of("TWO");
    const std::string text = gs_usb::open_refusal({}, gs_usb::open_libusb(two).status, gs_usb::programs_with(two)).what();
    ::_exit(text.find("another program uses the adapter: ") != std::string::npos ? 0 : 1);
  }
  int status = 0;
  ::waitpid(other, &status, 0);
  EXPECT_EQ(status, 0);
}

TEST_F(GsUsbGuest, AnAdapterThatTheKernelUsesOrThatIsOfNoPermissionIsRefusedWithWhatToDo) {
  Adapters adapters;
  adapters.plug("ONE", 1);
  up("ONE");
  EXPECT_THAT(refused([&] { open("gsusb:ONE"); }), AllOf(HasSubstr("which is up"), HasSubstr("ip link set can")));
  shell("ip link set " + Adapters::of("ONE").interfaces[0] + " down");
  const pid_t user = ::fork();
  if (user == 0) {
    if (::setuid(65534) != 0) ::_exit(2);
    ::_exit(refused([&] { open("gsusb:ONE"); }).find("70-rotorloop-can.rules") != std::string::npos ? 0 : 1);
  }
  int status = 0;
  ::waitpid(user, &status, 0);
  EXPECT_EQ(status, 0);
  open("gsusb:ONE");
}

TEST_F(GsUsbGuest, PullingTheAdapterEndsByNameAndAReplugWithAnotherInterfaceNumberGoesOnWhereAsked) {
  Adapters adapters;
  adapters.plug("FAR", 1);
  adapters.plug("NEAR", 1);
  const auto far = open(up("FAR"));
  const auto plain = open("gsusb:NEAR@1000000,4000000");
  plain->send_any(frame_of(0x140, false, 4, false));
  EXPECT_TRUE(far->receive_until(far->now_ns() + kSecond_ns));
  EXPECT_EQ(adapters.tell("unplug NEAR"), "done\n");
  EXPECT_THAT(refused([&] {
                for (int i = 0; i < 20; ++i) plain->receive_until(plain->now_ns() + kSecond_ns / 10);
              }),
              HasSubstr("the adapter is gone: it was unplugged"));
  EXPECT_EQ(plain->send_any(frame_of(1, false, 1, false)), SendStatus::bus_off);
  WaitingBus waiting("gsusb:NEAR", [] { return open_bus("gsusb:NEAR@1000000,4000000", "test"); });
  EXPECT_THAT(waiting.next_notice().value_or(""), HasSubstr("waiting for it"));
  adapters.plug("NEAR", 1, 1);
  EXPECT_EQ(Adapters::of("NEAR").interface, 1u);
  for (int i = 0; i < 30 && !waiting.next_notice(); ++i) waiting.receive_until(waiting.now_ns() + kSecond_ns / 10);
  far->send_any(frame_of(0x141, false, 4, false));
  EXPECT_TRUE(waiting.receive_until(waiting.now_ns() + kSecond_ns));
}

TEST_F(GsUsbGuest, FaultsOfTheAdapterAndTheBusAreToldAndEveryFrameIsAccountedFor) {
  Adapters adapters;
  adapters.plug("FAR", 1);
  adapters.plug("NEAR", 1);
  const auto far = open(up("FAR")), near = open("gsusb:NEAR@1000000,4000000");
  std::uint64_t offered = 0;
  const auto exchange = [&] {
    for (int i = 0; i < 20; ++i, ++offered) {
      near->send_any(frame_of(0x140, false, 4, false));
      near->receive_until(near->now_ns() + kSecond_ns / 500);
    }
    near->receive_until(near->now_ns() + kSecond_ns / 20);
    while (far->receive_any()) {
    }
  };
  exchange();
  for (const char* fault : {"stall-out NEAR 2", "stall-in NEAR 2", "lose-echoes NEAR 3", "overflow NEAR"}) {
    EXPECT_EQ(adapters.tell(fault), "done\n");
    exchange();
  }
  EXPECT_EQ(near->link_counters().refused_by_peer, 2u);
  EXPECT_EQ(near->link_counters().unconfirmed, 3u);
  EXPECT_EQ(near->counters().sent + near->counters().dropped_tx + 3, offered);
  EXPECT_EQ(far->counters().received, offered - 2);
  EXPECT_EQ(adapters.tell("bus-off NEAR 0"), "done\n");
  near->receive_until(near->now_ns() + kSecond_ns / 20);
  EXPECT_EQ(near->state(), BusState::bus_off);
  for (int i = 0; i < 12; ++i) near->receive_until(near->now_ns() + kSecond_ns / 10);
  EXPECT_EQ(near->state(), BusState::error_active) << "started again after a second";
  exchange();
  EXPECT_EQ(near->counters().sent + near->counters().dropped_tx + near->link_counters().unconfirmed, offered);
  std::string said;
  while (const auto notice = near->next_notice()) said += *notice + "\n";
  EXPECT_THAT(said, AllOf(HasSubstr("receive buffer was full"), HasSubstr("bus-off"), HasSubstr("on the bus again")));
}

TEST_F(GsUsbGuest, AnotherBitRateThanTheOthersEndsInBusOffThatIsTold) {
  Adapters adapters;
  adapters.plug("FAR", 1);
  adapters.plug("NEAR", 1);
  const auto far = open(up("FAR", "bitrate 500000")), near = open("gsusb:NEAR@1000000");
  near->send_any(frame_of(0x140, false, 4, false));
  for (int i = 0; i < 10 && near->state() != BusState::bus_off; ++i) near->receive_until(near->now_ns() + kSecond_ns / 50);
  EXPECT_EQ(near->state(), BusState::bus_off);
  std::string said;
  while (const auto notice = near->next_notice()) said += *notice + "\n";
  EXPECT_THAT(said, HasSubstr("check wiring, termination and bit rate of all nodes"));
}

struct Passed {
  std::uint64_t received = 0;
  double frames_per_s = 0.0;
};
// `count` frames one way, the next one when the adapter took one: as fast as both go.
Passed pass_frames(TimedBus& from, TimedBus& to, std::uint64_t count) {
  const std::int64_t begun_ns = from.now_ns();
  const std::uint64_t sent_before = from.counters().sent;
  std::uint64_t offered = 0, received = 0;
  std::array<TimedBus*, 2> both{&from, &to};
  while (received < count && from.now_ns() - begun_ns < 20 * kSecond_ns) {
    for (; offered < count && offered - (from.counters().sent - sent_before) < 20; ++offered)
      from.send_any(frame_of(0x2AA, false, 8, false));
    wait_for_any(both, from.now_ns() + kSecond_ns / 10);
    while (from.receive_any()) {
    }
    while (to.receive_any()) ++received;
  }
  return {.received = received, .frames_per_s = static_cast<double>(received) * 1e9 / static_cast<double>(from.now_ns() - begun_ns)};
}

TEST_F(GsUsbGuest, RateOfAFullBusAt500KilobitASecondIsReachedWithoutALoss) {
  Adapters adapters;
  adapters.plug("TWO", 2);
  const auto a = open("gsusb:TWO/0@500000"), b = open("gsusb:TWO/1@500000");
  const Passed passed = pass_frames(*a, *b, 2'000);
  const double full = 500e3 / (frame_bits(*frame_of(0x2AA, false, 8, false).classic()) + kIntermissionBits);
  std::printf("gs_usb, 500 kbit/s: %.0f frames/s of %.0f that the bus has\n", passed.frames_per_s, full);
  EXPECT_EQ(passed.received, 2'000u);
  EXPECT_GT(passed.frames_per_s, 0.98 * full);
  EXPECT_EQ(a->counters().dropped_tx + a->link_counters().unconfirmed + b->counters().dropped_rx, 0u);
}

TEST_F(GsUsbGuest, RateOf5000And1000FramesASecondOnTwoChannelsAt1MegabitLosesNone) {
  Adapters adapters;
  adapters.plug("TWO", 2);
  const auto a = open("gsusb:TWO/0"), b = open("gsusb:TWO/1");
  std::array<TimedBus*, 2> both{a.get(), b.get()};
  std::uint64_t at_a = 0, at_b = 0;
  const std::int64_t begun_ns = a->now_ns();
  for (std::int64_t ms = 0; ms < 1'050; ++ms) {
    for (std::uint32_t i = 0; ms < 1'000 && i < 5; ++i) a->send_any(frame_of(0x100 + i, false, 8, false));
    if (ms < 1'000) b->send_any(frame_of(0x0F0, false, 8, false));
    while (a->now_ns() < begun_ns + (ms + 1) * kSecond_ns / 1000) {
      wait_for_any(both, begun_ns + (ms + 1) * kSecond_ns / 1000);
      while (a->receive_any()) ++at_a;
      while (b->receive_any()) ++at_b;
    }
  }
  EXPECT_EQ(at_b, 5'000u);
  EXPECT_EQ(at_a, 1'000u);
  for (TimedBus* bus : both) EXPECT_EQ(bus->counters().dropped_tx + bus->counters().dropped_rx + bus->link_counters().unconfirmed, 0u);
}

TEST_F(GsUsbGuest, RateThroughLibusbIsFourFifthsOfTheKernelsDriversOnTheSameAdapterOrMore) {
  Adapters adapters("--unpaced");
  adapters.plug("TWO", 2);
  double ours = 0.0, kernels = 0.0;
  {
    const auto a = open("gsusb:TWO/0"), b = open("gsusb:TWO/1");
    const Passed passed = pass_frames(*a, *b, 1'500);
    EXPECT_EQ(passed.received, 1'500u);
    ours = passed.frames_per_s;
  }
  for (int i = 0; i < 300 && Adapters::of("TWO").interfaces.size() < 2; ++i) Adapters::pass();
  const auto names = Adapters::of("TWO").interfaces;
  ASSERT_EQ(names.size(), 2u);
  for (const std::string& name : names) shell("ip link set " + name + " type can bitrate 1000000 && ip link set " + name + " up");
  const auto a = open("socketcan:" + names[0]), b = open("socketcan:" + names[1]);
  const Passed passed = pass_frames(*a, *b, 1'500);
  EXPECT_EQ(passed.received, 1'500u);
  kernels = passed.frames_per_s;
  std::printf("gs_usb, no pace: %.0f frames/s through libusb, %.0f through the kernel's driver\n", ours, kernels);
  EXPECT_GT(ours, 0.8 * kernels);
}

}  // namespace
}  // namespace rotorloop
