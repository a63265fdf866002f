// An ESC with its firmware, drive and flash, a tool, and a third member, on one bus of any backend. Waiting of the tool moves the ESC on,
// so that one thread is enough. On the virtual bus time is the bus's own and is judged; on the others it is the machine's and is recorded.
#pragma once
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "bench/hil/live/esc_process.hpp"
#include "host/tools/tool_node.hpp"
#include "sim/world/virtual_bus.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::live {

enum class Backend { virtual_bus, multicast, slcan, socketcan, gs_usb };
// SocketCAN joins where ROTORLOOP_TEST_CAN names interfaces: one for both ends, or two that are joined ("vxcan0,vxcan1"; test/vm). gs_usb
// joins where ROTORLOOP_TEST_GSUSB is set: adapters TOOL, of two channels, and ESC.
std::vector<Backend> backends();
std::string backend_name(const ::testing::TestParamInfo<Backend>& info);
void PrintTo(Backend backend, std::ostream* out);

inline constexpr std::int64_t kMs_ns = 1'000'000, kSecond_ns = 1'000'000'000;
inline constexpr std::uint8_t kEscNode = 21, kToolNode = 126;

class EscBench {
 public:
  // `bus`: faults of the virtual bus; the live ones have none.
  explicit EscBench(Backend backend, const sim::BusConfig& bus = {});
  ~EscBench();

  EscProcessConfig config;  // of the next start; the plant is the reference one, node 21, index 0
  // The power comes on; it goes off without warning, as a killed process does.
  void power_on();
  void power_off() { esc_.reset(); }
  EscProcess& esc() { return *esc_; }
  bool powered() const { return esc_ != nullptr; }

  tools::ToolNode& tool();
  // What a third member sends. On SLCAN, a line between two, it leaves through the tool's adapter.
  void send_foreign(const BusFrame& frame);
  // Time passes, and the tool does nothing, as if it had been killed.
  void let_pass(std::int64_t duration_ns);
  // Called between two steps of the ESC, at most a millisecond apart.
  std::function<void(std::int64_t now_ns)> on_tick;

  bool judges_time() const { return backend_ == Backend::virtual_bus; }
  // Judged where it can be, recorded in any case.
  void expect_within(const std::string& what, double measured_ms, double limit_ms) const;

  // Until the tool knows who the ESC is; fails the test when it does not within ten seconds.
  void discover(double limit_ms = 2000.0);
  // Sends `command` every 10 ms for so long, with the arming status every 100 ms when one is given.
  void command_for(double seconds, const std::function<void()>& command, std::optional<std::uint8_t> arming = std::nullopt);
  void rpm_for(double seconds, int rpm, std::optional<std::uint8_t> arming = std::nullopt);

 private:
  struct Wires;
  void tick(std::int64_t now_ns);
  Backend backend_;
  std::unique_ptr<Wires> wires_;
  std::unique_ptr<EscProcess> esc_;
  std::unique_ptr<tools::ToolNode> tool_;
};

class EscOnABus : public ::testing::TestWithParam<Backend> {
 protected:
  void SetUp() override;  // skips multicast where network namespaces are refused
  test::TempFolder folder_;
};

}  // namespace rotorloop::live
