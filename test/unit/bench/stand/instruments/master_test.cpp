// The bus master in virtual time: what it accepts over a bad line, how fast it is, and when it says that a device is dead.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>

#include "bench/stand/instruments/poller.hpp"
#include "bench/stand/instruments/serial_hub.hpp"
#include "test/stats/modbus_study.hpp"

namespace rotorloop::modbus {
namespace {

TEST(ModbusMaster, Of100000ExchangesOverABadLineNoneGivesAWrongRegisterOrAWrongTime) {
  const auto r = test::run_modbus_study({.exchanges = 100'000, .seed = 20});
  EXPECT_EQ(r.wrong_registers, 0u) << r.text();
  EXPECT_EQ(r.wrong_times, 0u) << r.text();
  // the line was bad, and a good part came through all the same
  EXPECT_GT(r.line.flipped, 10'000u);
  EXPECT_GT(r.line.bytes_lost, 3'000u);
  EXPECT_GT(r.line.late, 2'000u);
  EXPECT_GT(r.failures, 100'000u / 3) << "a third asks a slave that is not there";
  EXPECT_GT(r.accepted_values, 80'000u);
}

TEST(ModbusMaster, WithoutSilenceAfterErrorsLateAnswersPassForAnswersToTheNextQuestion) {
  const auto r = test::run_modbus_study({.exchanges = 20'000, .seed = 20, .late_max_ms = 20.0});
  EXPECT_GT(r.wrong_registers + r.wrong_times, 20u) << r.text();
}

Profile eight_registers(std::string_view more = "") {
  return parse_profile(std::string(R"(format = 1
[device]
vendor = "test"
model = "eight"
source = "made up"
evidence = "emulated"
[bus]
baud = [115200]
format = "8N1"
timeout_ms = 50
late_max_ms = 100
turnaround_ms = 2
max_regs = 8
source = "made up"
[[channel]]
name = "force"
quantity = "force"
unit = "N"
addr = 0
type = "f32"
count = 4
)") + std::string(more),
                       "eight.toml");
}

struct Bench {
  explicit Bench(const Profile& p, std::vector<std::uint8_t> ids, std::int64_t dies_at_ns = std::int64_t{1} << 62)
      : hub(serial_format(p), {}), bus(hub, Exchanger::Framing::rtu) {
    for (const std::uint8_t id : ids) {
      hub.add({id, std::make_shared<SlaveDevice>(p), 2'000'000, 0, id == ids.back() ? dies_at_ns : std::int64_t{1} << 62});
      devices.push_back({"cell" + std::to_string(id), p, id, {}, rtu_timing(p, serial_format(p))});
    }
  }
  SerialHub hub;
  Exchanger bus;
  std::vector<PolledDevice> devices;
};

// By hand, 8N1 at 115200: 10 bits a character; gap 1.75 ms, 8 characters, 2 ms, 5 + 16 characters.
constexpr double kIdeal_s = 1.75e-3 + 2e-3 + 29.0 * 10.0 / 115200.0;

TEST(ModbusMaster, EightRegistersAt1152008N1ComeAt97percentOfWhatTheLineAllowsAndAt120Hz) {
  Bench b(eight_registers(), {1});
  Poller poller(b.bus, b.devices, {});
  poller.run_until(10'000'000'000);
  const double rate = poller.statistics(0).channels[0].rate_Hz();
  EXPECT_GE(rate, 0.97 / kIdeal_s);
  EXPECT_LE(rate, 1.0001 / kIdeal_s) << "faster than the line: the hub's time is wrong";
  EXPECT_GE(rate, 120.0);
  RecordProperty("rate_Hz", std::to_string(rate));
  EXPECT_EQ(poller.statistics(0).failed(), 0u);
}

TEST(ModbusMaster, ThreeSlavesWithSlowChannelsStillUse97percentOfTheLine) {
  const Profile p = eight_registers(
      "[[channel]]\nname = \"temperature\"\nquantity = \"temperature\"\nunit = \"degC\"\naddr = 300\ntype = \"s16\"\nrate = \"slow\"\n");
  Bench b(p, {1, 2, 3});
  Poller poller(b.bus, b.devices, {.slow_divider = 10});
  poller.run_until(20'000'000'000);
  // ten cycles of three fast reads and one slow read of each: 7 characters answer one register
  const double slow_s = 1.75e-3 + 2e-3 + 15.0 * 10.0 / 115200.0, ten_cycles_s = 30.0 * kIdeal_s + 3.0 * slow_s;
  for (std::size_t d = 0; d < 3; ++d) {
    EXPECT_GE(poller.statistics(d).channels[0].rate_Hz(), 0.97 * 10.0 / ten_cycles_s);
    EXPECT_NEAR(poller.statistics(d).channels[4].rate_Hz(), 1.0 / ten_cycles_s, 0.03 / ten_cycles_s);
  }
}

TEST(ModbusMaster, ADeviceThatDiesIsNamedWithinItsStaleLimitOf100ms) {
  constexpr std::int64_t kDies_ns = 1'003'000'000;
  Bench b(eight_registers(), {7}, kDies_ns);
  b.devices[0].stale_ns = 100'000'000;
  Poller poller(b.bus, b.devices, {});
  std::vector<Stale> stale;
  poller.on_stale = [&](const Stale& s) { stale.push_back(s); };
  poller.run_until(5'000'000'000);
  ASSERT_EQ(stale.size(), 4u) << "each channel once";
  for (const Stale& s : stale) {
    EXPECT_EQ(poller.devices()[s.device].name, "cell7");
    EXPECT_GT(s.now_ns, kDies_ns);
    EXPECT_LE(s.now_ns - kDies_ns, 100'000'000) << "although an exchange with it waits for 150 ms";
  }
  EXPECT_TRUE(poller.lost(0));
}

TEST(ModbusMaster, ADeviceThatNeverAnswersIsNamedToo) {
  Bench b(eight_registers(), {9}, 0);
  b.devices[0].stale_ns = 400'000'000;
  Poller poller(b.bus, b.devices, {});
  std::int64_t named_ns = 0;
  poller.on_stale = [&](const Stale& s) { named_ns = s.now_ns; };
  poller.run_until(1'000'000'000);
  EXPECT_EQ(named_ns, 400'000'000);
}

TEST(ModbusMaster, OneDeadSlaveCostsTheOthersThreeWaitsAndThenOneASecond) {
  Bench b(eight_registers(), {1, 2}, 2'000'000'000);
  Poller poller(b.bus, b.devices, {.failures_until_lost = 3, .retry_ns = 1'000'000'000});
  poller.run_until(12'000'000'000);
  EXPECT_TRUE(poller.lost(1));
  EXPECT_FALSE(poller.lost(0));
  const auto& alive = poller.statistics(0);
  EXPECT_EQ(alive.failed(), 0u) << "the silence of the dead one never costs the other an answer";
  // 2 s shared, then ten seconds of its own, less 0.15 s for each of 3 + 9 tries at most
  EXPECT_GT(static_cast<double>(alive.channels[0].good), (1.0 + 10.0 - 12 * 0.152) / kIdeal_s * 0.97);
  EXPECT_LE(alive.channels[0].greatest_interval_ns, 170'000'000);
}

TEST(ModbusMaster, AnAbsentSlaveThatWouldBeAskedForItsModelFirstDoesNotHoldUpTheOthers) {
  const Profile p = eight_registers("[[channel]]\nname = \"model\"\nquantity = \"setting\"\naddr = 300\ntype = \"u16\"\nrate = \"once\"\n");
  Bench b(p, {1});
  b.devices.push_back({"absent", p, 8, {}, rtu_timing(p, serial_format(p))});
  Poller poller(b.bus, b.devices, {.failures_until_lost = 1'000'000, .retry_ns = 0});
  for (int i = 0; i < 101; ++i) poller.step();
  EXPECT_EQ(poller.statistics(0).channels[0].good, 50u) << "every other exchange is its own, after one for the model";
}

TEST(ModbusMaster, ADeviceThatComesBackIsReadAgainAndItsChannelsAreFresh) {
  const Profile p = eight_registers();
  SerialHub hub(serial_format(p), {});
  Exchanger bus(hub, Exchanger::Framing::rtu);
  // first nobody is at address 4, later a device is connected there
  Poller poller(bus, {{"cell", p, 4, {}, rtu_timing(p, serial_format(p)), 200'000'000}}, {});
  int stale = 0;
  poller.on_stale = [&](const Stale&) { ++stale; };
  poller.run_until(3'000'000'000);
  EXPECT_EQ(stale, 4);
  hub.add({4, std::make_shared<SlaveDevice>(p), 2'000'000, 0});
  poller.run_until(3'400'000'000);
  EXPECT_GT(poller.statistics(0).channels[0].good, 10u) << "with no neighbour that waits for it, it is tried several times a second";
  poller.run_until(6'000'000'000);
  EXPECT_FALSE(poller.lost(0));
  EXPECT_GT(poller.statistics(0).channels[0].good, 100u);
  EXPECT_EQ(stale, 4);
}

TEST(ModbusMaster, TheTimeOfAValueIsTheMiddleOfItsExchangeWithHalfTheRoundTrip) {
  const Profile p = eight_registers();
  SerialHub hub(serial_format(p), {});
  auto device = std::make_shared<SlaveDevice>(p);
  std::int64_t truth_ns = -1;
  device->on_sample = [&](SlaveDevice&, std::int64_t now) { truth_ns = now; };
  hub.add({1, device, 2'000'000, 3'000'000});
  Exchanger bus(hub, Exchanger::Framing::rtu);
  Poller poller(bus, {{"cell", p, 1, {}, rtu_timing(p, serial_format(p))}}, {});
  int samples = 0;
  poller.on_sample = [&](const Sample& s) {
    ++samples;
    EXPECT_LE(std::abs(truth_ns - s.sampled_ns), s.uncertainty_ns);
    EXPECT_LT(s.uncertainty_ns, 4'000'000);  // half of 2.5 ms of bytes and up to 5 ms of turnaround
  };
  poller.run_until(1'000'000'000);
  EXPECT_GT(samples, 400);
}

TEST(ModbusMaster, SignsAndScalesFromOtherRegistersArriveOverTheWire) {
  for (const auto& [file, channel, value] : std::vector<std::tuple<std::string, std::string, double>>{{"laumas_tlb", "net", -12.0},
                                                                                                      {"dini_argeo_dgt4x", "gross", -250.0},
                                                                                                      {"hanmatek_hm310p", "current", 2.0},
                                                                                                      {"riden_rd60xx", "current", 1.5}}) {
    const Profile p = read_profile(std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "devices" / (file + ".toml"));
    SerialHub hub(serial_format(p), {});
    auto device = std::make_shared<SlaveDevice>(p);
    device->set(channel, value);
    hub.add({1, device, 2'000'000, 0});
    Exchanger bus(hub, Exchanger::Framing::rtu);
    Poller poller(bus, {{"d", p, 1, {}, rtu_timing(p, serial_format(p))}}, {});
    std::map<std::string, double> seen;
    poller.on_sample = [&](const Sample& s) {
      if (s.value.quality == Quality::good) seen[p.channels[s.channel].name] = s.value.value;
    };
    poller.run_until(3'000'000'000);
    EXPECT_DOUBLE_EQ(seen[channel], value) << file;
    EXPECT_EQ(poller.statistics(0).failed(), 0u) << file << ": a read of registers that are not there";
  }
}

// A line that answers a request with bytes given beforehand, in virtual time; `echo`: the request itself comes back first.
class ScriptedLine : public ByteLink {
 public:
  bool echo = false;
  std::vector<std::uint8_t> before;  // of every answer
  std::function<std::vector<std::uint8_t>(std::span<const std::uint8_t> request)> answer_of;
  std::int64_t now_ns() override { return now_ns_; }
  bool send(std::span<const std::uint8_t> bytes) override {
    const auto answer = answer_of(bytes);
    if (echo) coming_.insert(coming_.end(), bytes.begin(), bytes.end());
    coming_.insert(coming_.end(), before.begin(), before.end());
    coming_.insert(coming_.end(), answer.begin(), answer.end());
    return true;
  }
  int receive(std::span<std::uint8_t> into, std::int64_t deadline_ns) override {
    if (coming_.empty()) {
      now_ns_ = std::max(now_ns_, deadline_ns);
      return 0;
    }
    const std::size_t n = std::min(into.size(), coming_.size());
    std::copy_n(coming_.begin(), n, into.begin());
    coming_.erase(coming_.begin(), coming_.begin() + static_cast<std::ptrdiff_t>(n));
    now_ns_ += 100'000;
    return static_cast<int>(n);
  }

 private:
  std::int64_t now_ns_ = 0;
  std::vector<std::uint8_t> coming_;
};

constexpr ExchangeTiming kScriptedTiming{100'000, 2'000'000, 50'000'000, 20'000'000, 100'000'000};

std::vector<std::uint8_t> two_registers(std::span<const std::uint8_t> request) {
  return rtu_frame(request[0], std::vector<std::uint8_t>{3, 4, 0x41, 0x48, 0x00, 0x00});  // 12.5 as f32
}

TEST(ModbusMaster, AnAdapterThatHearsItsOwnRequestsAndLineBytesOfZerosOrOnesLeaveTheAnswer) {
  ScriptedLine line;
  line.answer_of = two_registers;
  Exchanger bus(line, Exchanger::Framing::rtu);
  for (const bool echo : {false, true})
    for (const std::vector<std::uint8_t>& before : {std::vector<std::uint8_t>{}, {0x00}, {0xFF, 0x00}}) {
      line.echo = echo;
      line.before = before;
      const Exchanged x = bus.exchange({1, 3, 0, 2, {}}, kScriptedTiming);
      EXPECT_EQ(x.reply.failure, Failure::none) << name(x.reply.failure);
      EXPECT_EQ(x.reply.registers, (std::vector<std::uint16_t>{0x4148, 0x0000}));
      EXPECT_EQ(bus.hears_itself(), echo);
    }
}

TEST(ModbusMaster, OnALineThatEchoesTheEchoAloneIsNoAnswerNeitherToAReadNorToAWriteThatIsAnsweredByItself) {
  ScriptedLine line;
  line.echo = true;
  line.answer_of = [](std::span<const std::uint8_t>) { return std::vector<std::uint8_t>{}; };
  Exchanger bus(line, Exchanger::Framing::rtu);
  EXPECT_EQ(bus.exchange({1, 3, 0, 2, {}}, kScriptedTiming).reply.failure, Failure::timeout);
  EXPECT_TRUE(bus.hears_itself());
  EXPECT_EQ(bus.exchange({1, 6, 5, 1, {7}}, kScriptedTiming).reply.failure, Failure::timeout);
  line.answer_of = [](std::span<const std::uint8_t> request) { return std::vector<std::uint8_t>(request.begin(), request.end()); };
  EXPECT_EQ(bus.exchange({1, 6, 5, 1, {7}}, kScriptedTiming).reply.failure, Failure::none);
}

TEST(ModbusMaster, AnAnswerOfOneRegisterThatBeginsAsItsRequestDidIsNotTakenForTheEcho) {
  ScriptedLine line;
  line.answer_of = [](std::span<const std::uint8_t> request) {
    return rtu_frame(request[0], std::vector<std::uint8_t>{3, 2, 0x10, 0x00});  // register 0x0210, one of them, holds 0x1000
  };
  Exchanger bus(line, Exchanger::Framing::rtu);
  const Exchanged x = bus.exchange({1, 3, 0x0210, 1, {}}, kScriptedTiming);
  EXPECT_EQ(x.reply.failure, Failure::none);
  EXPECT_EQ(x.reply.registers, std::vector<std::uint16_t>{0x1000});
}

TEST(ModbusMaster, ARefusalIsKeptWithItsCodeBehindAnEcho) {
  ScriptedLine line;
  line.echo = true;
  line.answer_of = [](std::span<const std::uint8_t> request) { return rtu_frame(request[0], std::vector<std::uint8_t>{0x83, 2}); };
  Exchanger bus(line, Exchanger::Framing::rtu);
  const Exchanged x = bus.exchange({1, 3, 0, 2, {}}, kScriptedTiming);
  EXPECT_EQ(x.reply.failure, Failure::exception);
  EXPECT_EQ(x.reply.exception, 2);
}

}  // namespace
}  // namespace rotorloop::modbus
