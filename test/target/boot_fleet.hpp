// Several chips with the linked bootloader on one virtual bus with a tool, and ports for what others send. Chips and bus go in step, from
// one event of the bus to the next.
#pragma once
#include <functional>
#include <memory>

#include "protocols/fast_channel.hpp"
#include "test/target/boot_chip.hpp"

namespace rotorloop::boot_chip {

class BootFleet final : public ToolBus {
 public:
  // Nodes kNode, kNode + 1, …
  BootFleet(const std::string& program, int chips) : ToolBus({.seed = 1}) {
    for (int i = 0; i < chips; ++i) {
      units_.push_back(std::make_unique<Unit>(bus, i));
      load_program(units_.back()->chip, program);
      store_node_id(units_.back()->chip, static_cast<std::uint8_t>(kNode + i));
    }
  }
  Chip& chip(int i) { return units_[static_cast<std::size_t>(i)]->chip; }
  void power_up() {
    for (const auto& u : units_) {
      u->chip.power_up(0xA5);
      u->board.press(false);
    }
  }
  bool holds(int i, const std::vector<std::uint8_t>& image) { return std::equal(image.begin(), image.end(), chip(i).memory(kArea, 1)); }
  bool in_application(int i) { return chip(i).core().state.r[kPc] >= kArea && chip(i).core().state.r[kPc] < kArea + 48 * kPage; }
  bool refused() const {
    return std::any_of(units_.begin(), units_.end(), [](const auto& u) { return u->end != End::at_cycle; });
  }

  // TimedBus
  std::int64_t now_ns() const override { return bus.now_ns(); }
  void wait_until(std::int64_t deadline_ns) override {
    while (!take() && bus.now_ns() < deadline_ns) step(std::min(deadline_ns, next_tick_ns_));
  }

  std::function<void(std::int64_t now_ns)> each_ms;

 private:
  struct Unit {
    Unit(sim::VirtualBus& bus, int i)
        : chip(0x4E45'3339'3233'5001u + static_cast<std::uint64_t>(i)),
          medium(bus, chip.blocks().fdcan, false),
          board(read_board(TomlFile::read(ROTORLOOP_SOURCE_DIR "/vehicles/boards/b_g431b_esc1.toml")), {}, chip, 1) {
      board.press(false);
      board.drive().set_bus_V(14.8);
    }
    Chip chip;
    VirtualBusMedium medium;
    EscBoard board;
    End end = End::at_cycle;
  };

  void step(std::int64_t until_ns) {
    for (const auto& u : units_) u->chip.reschedule(u->chip.blocks().fdcan);
    const std::int64_t slot_ns = std::min(until_ns, std::max(bus.next_event_ns(), bus.now_ns() + 1));
    for (const auto& u : units_) {
      if (u->end == End::at_cycle) u->end = u->chip.run_until(u->chip.cycle_at(static_cast<double>(slot_ns) * 1e-9));
      u->board.advance();
    }
    bus.advance_to(slot_ns);
    if (slot_ns < next_tick_ns_) return;
    next_tick_ns_ += 1'000'000;
    if (each_ms) each_ms(slot_ns);
  }

  std::vector<std::unique_ptr<Unit>> units_;
  std::int64_t next_tick_ns_ = 1'000'000;
};

// A flight of three other ESCs on the same bus: set-points 1000 times a second, feedback of each as often. Counts what arrives where.
class OtherFlight {
 public:
  explicit OtherFlight(sim::VirtualBus& bus) : host_(&bus.attach({.name = "flight computer"})) {
    for (auto& esc : escs_) esc = &bus.attach({.name = "flying esc"});
  }
  // Receives what the last millisecond brought, then sends the next.
  void each_ms(std::int64_t now_ns) {
    using namespace protocols;
    while (const auto r = host_->receive())
      if (fast::decode_feedback(r->frame)) note(feedback, r->time_ns);
    for (CanBus* esc : escs_)
      while (const auto r = esc->receive())
        if (fast::decode_setpoint(r->frame)) note(set_points, r->time_ns);
    sent_ns_ = now_ns;
    ++sent;
    fast::Setpoint s;
    s.set(0, 500.0f);
    host_->send(fast::encode(s));
    for (std::size_t i = 0; i < escs_.size(); ++i) {
      fast::Feedback f;
      f.esc_index = static_cast<std::uint8_t>(i);
      f.set_speed_rad_s(500.0f);
      escs_[i]->send(fast::encode(f));
    }
  }
  std::uint64_t sent = 0, set_points = 0, feedback = 0;  // milliseconds, and frames received: three of each kind a millisecond
  std::int64_t latest_ns = 0;                            // from a millisecond's sending to the last receipt of it

 private:
  void note(std::uint64_t& count, std::int64_t time_ns) {
    ++count;
    latest_ns = std::max(latest_ns, time_ns - sent_ns_);
  }
  CanBus* host_;
  std::array<CanBus*, 3> escs_{};
  std::int64_t sent_ns_ = 0;
};

}  // namespace rotorloop::boot_chip
