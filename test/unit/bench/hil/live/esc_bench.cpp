#include "test/unit/bench/hil/live/esc_bench.hpp"

#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <future>

#include "host/base/random.hpp"
#include "host/bus/live/multicast_bus.hpp"
#include "host/bus/live/open_bus.hpp"
#include "host/bus/live/slcan_port.hpp"
#include "host/bus/live/slcan_server.hpp"
#include "sim/world/lockstep_bus.hpp"

namespace rotorloop::live {
namespace {

constexpr int kGroup = 7;
constexpr const char* kInterfaces = "ROTORLOOP_TEST_CAN";
constexpr const char* kAdapters = "ROTORLOOP_TEST_GSUSB";

// A network of its own with loopback alone, for the rest of this process: nothing leaves the machine, nothing else is on it.
bool enter_own_network() {
  static const bool entered = [] {
    const auto write = [](const char* path, const std::string& text) { std::ofstream(path) << text; };
    const uid_t user = ::geteuid();
    const gid_t group = ::getegid();
    if (::unshare(user == 0 ? CLONE_NEWNET : CLONE_NEWUSER | CLONE_NEWNET) != 0) return false;
    if (user != 0) {
      write("/proc/self/setgroups", "deny");
      write("/proc/self/uid_map", "0 " + std::to_string(user) + " 1");
      write("/proc/self/gid_map", "0 " + std::to_string(group) + " 1");
    }
    return std::system("ip link set lo up && ip route add 239.65.82.0/24 dev lo") == 0;
  }();
  return entered;
}

// A live bus whose waiting moves the ESC on.
class SteppedBus final : public TimedBus {
 public:
  SteppedBus(TimedBus& inner, std::function<void(std::int64_t)> tick) : inner_(inner), tick_(std::move(tick)) {}
  SendStatus send_any(const BusFrame& frame) override { return inner_.send_any(frame); }
  std::optional<StampedBusFrame> receive_any() override { return inner_.receive_any(); }
  std::int64_t now_ns() const override { return inner_.now_ns(); }
  void wait_until(std::int64_t deadline_ns) override {
    tick_(inner_.now_ns());
    inner_.wait_until(std::min(deadline_ns, inner_.now_ns() + kMs_ns / 2));
  }
  BusState state() const override { return inner_.state(); }
  PortCounters counters() const override { return inner_.counters(); }
  std::string name() const override { return inner_.name(); }
  void flush() override { inner_.flush(); }

 private:
  TimedBus& inner_;
  std::function<void(std::int64_t)> tick_;
};

// A live bus at which received frames get lost. Which ones follows from the seed and from their number at this end, not from time.
class LossyBus final : public TimedBus {
 public:
  LossyBus(std::unique_ptr<TimedBus> inner, double probability, const RandomStream& random)
      : inner_(std::move(inner)), probability_(probability), random_(random) {}
  SendStatus send_any(const BusFrame& frame) override { return inner_->send_any(frame); }
  std::optional<StampedBusFrame> receive_any() override {
    while (auto received = inner_->receive_any()) {
      if (random_.uniform(number_++) >= probability_) return received;
    }
    return std::nullopt;
  }
  std::int64_t now_ns() const override { return inner_->now_ns(); }
  void wait_until(std::int64_t deadline_ns) override { inner_->wait_until(deadline_ns); }
  BusState state() const override { return inner_->state(); }
  PortCounters counters() const override { return inner_->counters(); }
  std::string name() const override { return inner_->name(); }
  void flush() override { inner_->flush(); }

 private:
  std::unique_ptr<TimedBus> inner_;
  double probability_;
  RandomStream random_;
  std::uint64_t number_ = 0;
};

constexpr std::int64_t kTick_ns = 250'000;

// The one fault that a live bus can be given: frames lost at each receiver.
void lose_received(std::unique_ptr<TimedBus>& end, const sim::BusConfig& bus, std::uint64_t which) {
  for (const sim::BusFault& fault : bus.faults) {
    ASSERT_EQ(fault.kind, sim::BusFaultKind::lose_received);
    end = std::make_unique<LossyBus>(std::move(end), fault.probability, RandomStream(bus.seed, which));
  }
}

}  // namespace

void PrintTo(Backend backend, std::ostream* out) {
  static constexpr std::array<const char*, 5> kNames{"virtual bus", "multicast", "SLCAN", "SocketCAN", "gs_usb"};
  *out << kNames[static_cast<std::size_t>(backend)];
}

std::vector<Backend> backends() {
  std::vector<Backend> all{Backend::virtual_bus, Backend::multicast, Backend::slcan};
  if (std::getenv(kInterfaces) != nullptr) all.push_back(Backend::socketcan);
  if (std::getenv(kAdapters) != nullptr) all.push_back(Backend::gs_usb);
  return all;
}

std::string backend_name(const ::testing::TestParamInfo<Backend>& info) {
  static constexpr std::array<const char*, 5> kNames{"Virtual", "Multicast", "Slcan", "SocketCan", "GsUsb"};
  return kNames[static_cast<std::size_t>(info.param)];
}

struct EscBench::Wires {
  std::optional<sim::VirtualBus> bus;
  std::unique_ptr<TimedBus> tool_end, esc_end, third_end;  // live ends, or lockstep ports
  std::unique_ptr<SteppedBus> stepped;
  TimedBus* for_tool = nullptr;
  CanBus* third = nullptr;
};

EscBench::EscBench(Backend backend, const sim::BusConfig& bus) : backend_(backend), wires_(std::make_unique<Wires>()) {
  config.plant = std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "vehicles/reference_plant.toml";
  config.node_id = kEscNode;
  config.unique_id = default_unique_id(0);
  const auto step = [this](std::int64_t now_ns) { tick(now_ns); };
  Wires& w = *wires_;
  if (backend == Backend::virtual_bus) {
    w.bus.emplace(bus);
    const auto attach = [&](const char* name) -> CanBus& { return w.bus->attach({.name = name, .tx_depth = 4096, .rx_depth = 4096}); };
    CanBus &tool = attach("tool"), &esc = attach("esc");
    w.third = &attach("third");
    w.tool_end = std::make_unique<sim::LockstepBus>(*w.bus, tool, kTick_ns, step);
    w.esc_end = std::make_unique<sim::LockstepBus>(*w.bus, esc, kTick_ns, [](std::int64_t) {});
    w.for_tool = w.tool_end.get();
    return;
  }
  if (backend == Backend::multicast) {
    w.tool_end = std::make_unique<MulticastBus>(kGroup);
    w.esc_end = std::make_unique<MulticastBus>(kGroup);
    w.third_end = std::make_unique<MulticastBus>(kGroup);
    w.third = w.third_end.get();
  } else if (backend == Backend::socketcan) {
    const std::string names = std::getenv(kInterfaces);
    const std::size_t comma = names.find(',');
    const std::string tool_side = "socketcan:" + names.substr(0, comma);
    w.tool_end = open_bus(tool_side, "test");
    w.esc_end = open_bus(comma == std::string::npos ? tool_side : "socketcan:" + names.substr(comma + 1), "test");
    w.third_end = open_bus(tool_side, "test");
    w.third = w.third_end.get();
  } else if (backend == Backend::gs_usb) {
    w.tool_end = open_bus("gsusb:TOOL/0", "test");
    w.third_end = open_bus("gsusb:TOOL/1", "test");
    w.esc_end = open_bus("gsusb:ESC", "test");
    w.third = w.third_end.get();
  } else {
    auto server = std::make_unique<SlcanServer>("");
    // The adapter answers while its program opens it.
    auto opened = std::async(std::launch::async,
                             [device = server->terminal()] { return std::make_unique<SlcanPort>(parse_slcan_settings(device, "test")); });
    while (opened.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
      server->receive_any();
      server->wait_until(server->now_ns() + kMs_ns);
    }
    w.tool_end = opened.get();
    w.esc_end = std::move(server);
    w.third = w.tool_end.get();
  }
  lose_received(w.tool_end, bus, 0);
  lose_received(w.esc_end, bus, 1);
  w.stepped = std::make_unique<SteppedBus>(*w.tool_end, step);
  w.for_tool = w.stepped.get();
}

EscBench::~EscBench() {
  tool_.reset();
  esc_.reset();
}

void EscBench::power_on() { esc_ = std::make_unique<EscProcess>(config, *wires_->esc_end); }

tools::ToolNode& EscBench::tool() {
  if (!tool_) tool_ = std::make_unique<tools::ToolNode>(*wires_->for_tool, tools::ToolNodeConfig{.node_id = kToolNode});
  return *tool_;
}

void EscBench::send_foreign(const BusFrame& frame) {
  if (const auto classic = frame.classic()) wires_->third->send(*classic);
}

void EscBench::tick(std::int64_t now_ns) {
  if (on_tick) on_tick(now_ns);
  if (esc_) {
    esc_->advance();
    wires_->esc_end->flush();
  }
  // What a live bus says to its third member is of no use to it, and must not fill its buffer.
  while (wires_->third_end && wires_->third_end->receive_any()) {
  }
}

void EscBench::expect_within(const std::string& what, double measured_ms, double limit_ms) const {
  ::testing::Test::RecordProperty(what + "_ms", std::to_string(measured_ms));
  if (!judges_time()) return;
  EXPECT_LE(measured_ms, limit_ms) << what << ", ms";
}

void EscBench::discover(double limit_ms) {
  const std::int64_t begun_ns = tool().now_ns();
  ASSERT_TRUE(tool().run_until(begun_ns + 10 * kSecond_ns, [&] {
    const auto n = tool().nodes().find(kEscNode);
    return n != tool().nodes().end() && n->second.info && n->second.status.mode == protocols::NodeMode::operational;
  }));
  expect_within("discovery", static_cast<double>(tool().now_ns() - begun_ns) * 1e-6, limit_ms);
}

void EscBench::let_pass(std::int64_t duration_ns) {
  TimedBus& bus = *wires_->for_tool;
  for (const std::int64_t end_ns = bus.now_ns() + duration_ns; bus.now_ns() < end_ns;) {
    bus.wait_until(end_ns);
    while (bus.receive_any()) {
    }
  }
}

void EscBench::command_for(double seconds, const std::function<void()>& command, std::optional<std::uint8_t> arming) {
  std::int64_t next_ns = tool().now_ns(), count = 0;
  const std::int64_t end_ns = next_ns + static_cast<std::int64_t>(seconds * 1e9);
  tool().run_until(end_ns, [&] {
    if (tool().now_ns() < next_ns) return false;
    next_ns = std::max(next_ns + 10 * kMs_ns, tool().now_ns() - 100 * kMs_ns);
    if (arming && count++ % 10 == 0) tool().broadcast(protocols::ArmingStatus{.status = *arming}, 8);
    command();
    return false;
  });
}

void EscBench::rpm_for(double seconds, int rpm, std::optional<std::uint8_t> arming) {
  protocols::RpmCommand c;
  c.count = 1;
  c.rpm[0] = rpm;
  command_for(
      seconds, [&] { tool().broadcast(c, 7); }, arming);
}

void EscOnABus::SetUp() {
  if (GetParam() == Backend::multicast && !enter_own_network()) GTEST_SKIP() << "network namespaces are refused here";
}

}  // namespace rotorloop::live
