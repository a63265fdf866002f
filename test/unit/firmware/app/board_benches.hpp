// The boards of the suite, each with its interrupt, its clock and its bus: plain memory, the simulator's ESC, and that of `rotorloop
// esc-sim`.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "bench/hil/live/esc_process.hpp"
#include "firmware/app/esc_application.hpp"
#include "firmware/board/fake/fake_esc_board.hpp"
#include "sim/esc/native_esc.hpp"
#include "sim/esc/noded_esc.hpp"
#include "sim/world/lockstep_bus.hpp"
#include "sim/world/virtual_bus.hpp"

namespace rotorloop::firmware {

inline Parameters suite_parameters(std::uint8_t node_id) {
  Parameters p;
  p.node_id = node_id;
  p.esc_index = 0;
  return p;
}
inline NodeIdentity suite_identity() {
  NodeIdentity id;
  id.unique_id = live::default_unique_id(0);
  return id;
}

// Memory alone. No motor hangs on it, so its self-test, which would find none, is switched off.
class FakeBench {
 public:
  FakeBench(std::uint8_t node_id, std::uint64_t fail_at_us) : fail_at_us_(fail_at_us) {
    Parameters p = suite_parameters(node_id);
    p.self_test = false;
    ParameterStore(board_).save(p);
    board_.counts.phase.fill(static_cast<std::uint16_t>(FakeEscBoard::kCurrentZero_counts));
    board_.unloaded = board_.counts.phase;
    board_.counts.bus = static_cast<std::uint16_t>(16.0f / FakeEscBoard::kBus_V_per_count);
    board_.counts.temperature =
        static_cast<std::uint16_t>((298.15f - FakeEscBoard::kTemperatureZero_K) / FakeEscBoard::kTemperature_K_per_count);
    esc_.emplace(board_, suite_identity());
  }
  void advance_us(std::uint64_t us) {
    for (const std::uint64_t end_us = now_us_ + us; now_us_ < end_us;) {
      now_us_ = ++periods_ * 125 / 3;
      board_.advance_to(now_us_);
      if (now_us_ >= fail_at_us_) {
        board_.can().fail();
        fail_at_us_ = ~std::uint64_t{0};
      }
      if (interrupt_) esc_->on_sample(board_);
      if (periods_ % 6 != 0) continue;
      esc_->poll(board_);
      while (const auto frame = board_.can().take_sent()) sent_.push_back(*frame);
      if (board_.restart_wanted) restart();
    }
  }
  bool deliver(const CanFrame& frame) { return board_.can().deliver(frame); }
  std::vector<CanFrame> take_sent() { return std::exchange(sent_, {}); }
  bool bridge() const { return board_.bridge; }
  std::uint64_t kicks() const { return board_.kicks; }
  ResetCause cause() const { return board_.reset_cause(); }
  BusState bus() { return board_.can().state(); }
  bool update_waits() { return UpdateRecord(board_, FakeEscBoard::kUpdateRecordPage).job().has_value(); }
  void stop_interrupt() { interrupt_ = false; }
  FakeEscBoard& board() { return board_; }

 private:
  void restart() {
    board_.restart_wanted = false;
    board_.cause = ResetCause::software;
    board_.bridge_off();
    esc_.emplace(board_, suite_identity());
  }
  FakeEscBoard board_;
  std::optional<EscFirmware<FakeEscBoard>> esc_;
  std::vector<CanFrame> sent_;
  std::uint64_t fail_at_us_, now_us_ = 0, periods_ = 0;
  bool interrupt_ = true;
};

// A virtual bus whose port 0 is the ESC's and whose port 1 is the tool's. 32 errors in a row are bus off.
struct SuiteBus {
  explicit SuiteBus(std::uint64_t fail_at_us)
      : bus({.faults = {{.kind = sim::BusFaultKind::corrupt,
                         .port = 0,
                         .at_ns = static_cast<std::int64_t>(fail_at_us) * 1000,
                         .max_count = 32}}}) {}
  std::vector<CanFrame> take_sent() {
    std::vector<CanFrame> frames;
    while (const auto received = tool.receive()) frames.push_back(received->frame);
    return frames;
  }
  sim::VirtualBus bus;
  CanBus& esc = bus.attach({.name = "esc", .tx_depth = 256, .rx_depth = 256});
  CanBus& tool = bus.attach({.name = "tool", .tx_depth = 256, .rx_depth = 4096});
};

// The ESC of the simulator with its drive and a propeller's load.
class SimulatedBench {
 public:
  SimulatedBench(std::uint8_t node_id, std::uint64_t fail_at_us) : bus_(fail_at_us) {
    sim::NativeEscConfig e;
    e.bus_V = 15.2;
    e.firmware = suite_parameters(node_id);
    esc_ = std::make_unique<Esc>(sim::NativeEsc(e), EscNode(e.firmware, suite_identity()), bus_.esc);
    ParameterStore(esc_->board()).save(e.firmware);
    esc_->esc().couple_quadratic(2.9e-8, 15.2);
  }
  void advance_us(std::uint64_t us) {
    for (const std::uint64_t end_us = now_us_ + us; now_us_ < end_us;) {
      now_us_ = ++periods_ * 125 / 3;
      bus_.bus.advance_to(static_cast<std::int64_t>(now_us_) * 1000);
      esc_->step_current_loop();
      if (esc_->board().restart_wanted()) restart();
    }
  }
  bool deliver(const CanFrame& frame) { return bus_.tool.send(frame) == SendStatus::queued; }
  std::vector<CanFrame> take_sent() { return bus_.take_sent(); }
  bool bridge() { return esc_->esc().board().bridge && esc_->esc().motor().variables().blocked != Blocked::self_test; }
  std::uint64_t kicks() const { return esc_->board().kicks(); }
  ResetCause cause() const { return esc_->board().reset_cause(); }
  BusState bus() const { return bus_.esc.state(); }
  void stop_interrupt() {
    esc_->esc().set_interrupt([](sim::NativeEsc::Board&) { return true; });
  }
  bool update_waits() { return UpdateRecord(esc_->board(), sim::SimulatedBoard<>::kUpdateRecordPage).job().has_value(); }

 private:
  using Esc = sim::NodedEsc<sim::NativeEsc, EscNode>;
  void restart() {
    const EscNode node = make_node(ParameterStore(esc_->board()), suite_identity());
    esc_->esc().control() = EscControl<sim::NativeEsc::Board>(node.parameters());
    esc_->esc().board().bridge_off();
    esc_->esc().set_setpoint({});
    esc_->start(node, ResetCause::software);
  }
  SuiteBus bus_;
  std::unique_ptr<Esc> esc_;
  std::uint64_t now_us_ = 0, periods_ = 0;
};

// The ESC of `rotorloop esc-sim`, on the virtual bus.
class LiveBench {
 public:
  LiveBench(std::uint8_t node_id, std::uint64_t fail_at_us) : bus_(fail_at_us), port_(bus_.bus, bus_.esc, 250'000, [](std::int64_t) {}) {
    live::EscProcessConfig config;
    config.plant = std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "vehicles/reference_plant.toml";
    config.node_id = node_id;
    config.unique_id = live::default_unique_id(0);
    esc_ = std::make_unique<live::EscProcess>(config, port_);
    esc_->on_bridge = [this](const live::BridgeChange& change) { bridge_ = change.on; };
  }
  void advance_us(std::uint64_t us) {
    for (std::uint64_t k = 0; k < us; k += 250) {
      bus_.bus.advance_to(bus_.bus.now_ns() + 250'000);
      esc_->advance();
    }
  }
  bool deliver(const CanFrame& frame) { return bus_.tool.send(frame) == SendStatus::queued; }
  std::vector<CanFrame> take_sent() { return bus_.take_sent(); }
  bool bridge() const { return bridge_; }
  std::uint64_t kicks() const { return esc_->board().kicks(); }
  ResetCause cause() const { return esc_->board().reset_cause(); }
  BusState bus() const { return bus_.esc.state(); }
  bool update_waits() const { return esc_->updating(); }

 private:
  SuiteBus bus_;
  sim::LockstepBus port_;
  std::unique_ptr<live::EscProcess> esc_;
  bool bridge_ = false;
};

}  // namespace rotorloop::firmware
