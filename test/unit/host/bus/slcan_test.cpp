// SLCAN: lines against the letter of the protocol, and both ends of it over a pseudo terminal.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "host/base/error.hpp"
#include "host/bus/live/live_clock.hpp"
#include "host/bus/live/slcan_port.hpp"
#include "host/bus/live/slcan_server.hpp"

namespace rotorloop {
namespace {

using ::testing::HasSubstr;

constexpr std::int64_t kGenerous_ns = 20'000'000'000;  // how long a test waits for an event before it fails

BusFrame frame(std::uint32_t id, bool extended, std::initializer_list<std::uint8_t> data) {
  BusFrame f;
  f.id = id;
  f.extended = extended;
  for (const std::uint8_t b : data) f.data[f.length++] = b;
  return f;
}

TEST(SlcanLine, ClassicFramesAreWrittenWithTheirIdentifierInThreeOrEightDigits) {
  EXPECT_EQ(format_slcan(frame(0x140, false, {0x88, 0x13})), "t14028813");
  EXPECT_EQ(format_slcan(frame(0x1401552A, true, {0xC0})), "T1401552A1C0");
  EXPECT_EQ(format_slcan(frame(0x7FF, false, {})), "t7FF0");
}

TEST(SlcanLine, FdFramesHaveTheirOwnLettersAndLengthCodes) {
  BusFrame f = frame(0x123, false, {});
  f.fd = true;
  f.length = 12;
  EXPECT_EQ(format_slcan(f), "d1239" + std::string(24, '0'));
  f.bit_rate_switch = true;
  f.extended = true;
  f.length = 64;
  EXPECT_EQ(format_slcan(f), "B00000123F" + std::string(128, '0'));
  BusFrame back;
  ASSERT_EQ(parse_slcan(format_slcan(f), back), SlcanContent::frame);
  EXPECT_EQ(back, f);
}

TEST(SlcanLine, AFrameOfAnyFormatAndLengthComesBackAsItWas) {
  for (const bool extended : {false, true}) {
    for (const bool fd : {false, true}) {
      for (std::size_t length = 0; length <= 64; ++length) {
        if (!possible_length(fd, length)) continue;
        BusFrame f = frame(extended ? 0x1ABCDEF0 : 0x5A5, extended, {});
        f.fd = fd;
        f.length = static_cast<std::uint8_t>(length);
        for (std::size_t i = 0; i < length; ++i) f.data[i] = static_cast<std::uint8_t>(251 * i + length);
        BusFrame back;
        ASSERT_EQ(parse_slcan(format_slcan(f), back), SlcanContent::frame);
        EXPECT_EQ(back, f);
      }
    }
  }
}

TEST(SlcanLine, ATimeStampBehindTheDataIsPassedOver) {
  BusFrame f;
  ASSERT_EQ(parse_slcan("t1402881312AB", f), SlcanContent::frame);
  EXPECT_EQ(f, frame(0x140, false, {0x88, 0x13}));
}

TEST(SlcanLine, HalfFramesWrongDigitsAndImpossibleIdentifiersAreMalformed) {
  BusFrame f;
  for (const char* line : {"t", "t14", "t1402", "t140288", "t1402881", "t14028813F", "t140288131", "t14088813", "tXYZ0", "T201234560",
                           "T2000000001AA", "t1409000000000000000000", "t8001AA", "d1401G0", "t1402ZZ13"})
    EXPECT_EQ(parse_slcan(line, f), SlcanContent::malformed) << line;
  EXPECT_EQ(parse_slcan("r1402", f), SlcanContent::remote);
  for (const char* line : {"", "O", "F00", "z", "V1013"}) EXPECT_EQ(parse_slcan(line, f), SlcanContent::other) << line;
}

TEST(SlcanLines, AreCutAtCarriageReturnsAndAtErrorBytesHoweverTheBytesCome) {
  SlcanLines lines;
  std::vector<std::string> got;
  for (const char c : std::string("\rt1400\r\aO\r")) {
    lines.add(std::string(1, c));
    while (const auto line = lines.next()) got.push_back(*line);
  }
  EXPECT_EQ(got, (std::vector<std::string>{"", "t1400", "\a", "O"}));
}

TEST(SlcanLines, ALineWithoutEndIsThrownAwayAndCounted) {
  SlcanLines lines;
  lines.add(std::string(100'000, 't'));
  EXPECT_FALSE(lines.next());
  EXPECT_EQ(lines.overlong(), 1u);
  lines.add("O\r");
  EXPECT_EQ(lines.next(), "O");
}

// The server end, run by a thread of its own, as it is a process of its own in use.
class ServedTerminal {
 public:
  explicit ServedTerminal(std::string link = {}) : server_(std::move(link)), thread_([this] { serve(); }) {}
  ~ServedTerminal() {
    stop_ = true;
    thread_.join();
  }
  const std::string& terminal() const { return server_.terminal(); }

 private:
  // What comes in goes back with its first data byte one higher.
  void serve() {
    while (!stop_) {
      while (auto f = server_.receive_any()) {
        ++f->frame.data[0];
        server_.send_any(f->frame);
      }
      server_.wait_until(live_now_ns() + 10'000'000);
    }
  }
  SlcanServer server_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

TEST(SlcanPort, FramesCrossAPseudoTerminalInBothDirectionsAndAreCounted) {
  const ServedTerminal served;
  SlcanPort port(parse_slcan_settings(served.terminal(), "test"));
  for (std::uint8_t i = 0; i < 200; ++i) ASSERT_EQ(port.send_any(frame(0x1401552A, true, {i, 2, 3})), SendStatus::queued);
  for (std::uint8_t i = 0; i < 200; ++i) {
    const auto back = port.receive_until(live_now_ns() + kGenerous_ns);
    ASSERT_TRUE(back) << int{i};
    EXPECT_EQ(back->frame, frame(0x1401552A, true, {static_cast<std::uint8_t>(i + 1), 2, 3}));
  }
  EXPECT_EQ(port.counters().sent, 200u);
  EXPECT_EQ(port.counters().received, 200u);
  EXPECT_EQ(port.link_counters().malformed, 0u);
  EXPECT_EQ(port.link_counters().refused_by_peer, 0u);
}

TEST(SlcanPort, OnlyFramesThatFitAFilterAreReceived) {
  const ServedTerminal served;
  SlcanPort port(parse_slcan_settings(served.terminal(), "test"));
  const CanFilter only{.id = 0x140, .mask = 0x7F0, .extended = false};
  ASSERT_TRUE(port.set_filters({&only, 1}));
  port.send_any(frame(0x1401552A, true, {1}));
  port.send_any(frame(0x200, false, {1}));
  port.send_any(frame(0x14F, false, {1}));
  const auto back = port.receive_until(live_now_ns() + kGenerous_ns);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->frame.id, 0x14Fu);
  EXPECT_EQ(port.counters().filtered, 2u);
}

TEST(SlcanPort, ADeviceThatNeverAnswersIsRefusedAfterItsTimeWithTheRemedy) {
  const int master = ::posix_openpt(O_RDWR | O_NOCTTY);
  ASSERT_GE(master, 0);
  ASSERT_EQ(::grantpt(master) + ::unlockpt(master), 0);
  SlcanSettings settings = parse_slcan_settings(::ptsname(master), "test");
  settings.answer_ns = 100'000'000;
  try {
    const SlcanPort port(settings);
    ADD_FAILURE() << "opened";
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::device);
    EXPECT_THAT(e.text().what, HasSubstr("no answer within 100 ms"));
    EXPECT_THAT(e.text().remedy, HasSubstr("115200"));
  }
  ::close(master);
}

TEST(SlcanPort, NamesOfDevicesAndRatesThatCannotBeAreRefusedWithWhatCan) {
  EXPECT_EQ(parse_slcan_settings("/dev/ttyACM0", "").bit_rate_Hz, 1'000'000);
  EXPECT_EQ(parse_slcan_settings("/dev/ttyACM0@500000,921600", "").baud, 921'600);
  for (const char* text :
       {"", "@500000", "/dev/ttyACM0@", "/dev/ttyACM0@fast", "/dev/ttyACM0@-5", "/dev/ttyACM0@300000", "/dev/ttyACM0@500000,42"}) {
    try {
      parse_slcan_settings(text, "bus");
      ADD_FAILURE() << text;
    } catch (const Error& e) {
      EXPECT_EQ(e.exit_code(), ExitCode::usage);
      EXPECT_FALSE(e.text().remedy.empty());
    }
  }
  try {
    const SlcanPort port(parse_slcan_settings("/dev/tty_that_is_not_there", "bus"));
    ADD_FAILURE();
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::device);
  }
}

TEST(SlcanServer, AnswersAsAnAdapterAndSendsNothingBeforeItsChannelIsOpen) {
  SlcanServer server("");
  const int program = ::open(server.terminal().c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK);
  ASSERT_GE(program, 0);
  std::string heard;
  const auto say = [&](const std::string& text, std::size_t expected) {
    ASSERT_EQ(::write(program, text.data(), text.size()), static_cast<ssize_t>(text.size()));
    heard.clear();
    const std::int64_t deadline_ns = live_now_ns() + kGenerous_ns;
    while (heard.size() < expected && live_now_ns() < deadline_ns) {
      server.receive_any();
      char bytes[64];
      const ssize_t size = ::read(program, bytes, sizeof bytes);
      if (size > 0) heard.append(bytes, static_cast<std::size_t>(size));
    }
  };
  EXPECT_EQ(server.send_any(frame(0x140, false, {1})), SendStatus::queue_full);
  say("t1400\r", 1);
  EXPECT_EQ(heard, "\a") << "a frame before the channel is open";
  say("\rC\rS8\rO\rF\r", 8);
  EXPECT_EQ(heard, "\r\r\r\rF00\r");
  EXPECT_EQ(server.send_any(frame(0x140, false, {1})), SendStatus::queued);
  say("S6\r", 9);
  EXPECT_EQ(heard, "t140101\r\a") << "the rate cannot change while the channel is open";
  say("r1400\r", 1);
  EXPECT_EQ(heard, "\a");
  EXPECT_EQ(server.link_counters().remote, 1u);
  ::close(program);
}

TEST(SlcanServer, MakesALinkRemovesItAndReplacesOneThatAKilledServerLeft) {
  const std::string link = ::testing::TempDir() + "slcan_link_" + std::to_string(::getpid());
  {
    const SlcanServer server(link);
    EXPECT_EQ(std::filesystem::read_symlink(link), server.terminal());
    EXPECT_THROW(SlcanServer{link}, Error) << "another server is there";
  }
  EXPECT_FALSE(std::filesystem::is_symlink(link));
  std::filesystem::create_symlink("/dev/pts/99999", link);
  { const SlcanServer server(link); }
  EXPECT_FALSE(std::filesystem::is_symlink(link));
}

}  // namespace
}  // namespace rotorloop
