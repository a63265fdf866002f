// The motor side of an ESC on a board of plain registers. The same text is the program of an emulated core and its counterpart on the
// host, so that both can be compared bit for bit.
#pragma once
#include <array>
#include <bit>
#include <cstdint>

#include "firmware/app/esc_control.hpp"
#include "firmware/board/fake/fake_board.hpp"

namespace rotorloop::plain_board {

// At the start of the RAM of the emulated core.
struct Registers {
  // Written before a sample interrupt.
  std::array<std::uint16_t, 3> phase{}, unloaded{};
  std::uint16_t bus = 0, temperature = 0;
  std::uint32_t now_us = 0;
  std::uint32_t mode = 0, task = 0;  // orders: the main loop takes them after this interrupt
  float value = 0.0f;
  std::uint32_t stop_mode = 0;  // read once, at the start
  // Written by the program: what the bridge does, and what it reports of the motor, floating point as its bits.
  std::array<std::uint16_t, 3> compare{};
  std::uint16_t bridge = 0, gates = 0, state = 0;
  std::array<std::uint32_t, 14> report{};
  std::uint32_t polls = 0;
  bool operator==(const Registers&) const = default;
};

// What the main loop's part for commissioning needs of a node.
struct Orders {
  firmware::Parameters entered;
  firmware::CommissioningOrder order;
  firmware::CommissioningResult found;
  firmware::CommissioningOrder commissioning_order() const { return order; }
  bool commissioning() const { return order.task != firmware::CommissioningTask::off; }
  const firmware::Parameters& parameters() const { return entered; }
  void on_commissioning(const firmware::CommissioningResult& r, float) { found = r; }
  template <class Turned>
  void on_hand(const Turned&) {}
  bool feels_for_hand() const { return false; }
};

inline firmware::Parameters parameters(const Registers& r) {
  firmware::Parameters p;
  p.bidirectional = true;
  p.stop_mode = static_cast<firmware::StopMode>(r.stop_mode);
  return p;
}

class PlainEsc {
 public:
  explicit PlainEsc(const Registers& r) : control_(parameters(r)) { orders_.entered = parameters(r); }

  // The sample interrupt.
  void on_sample(Registers& r) {
    board_.counts = {r.phase, r.bus, r.temperature};
    board_.unloaded = r.unloaded;
    board_.now_us = r.now_us;
    control_.on_sample(board_);
    r.compare = board_.compare.phase;
    r.bridge = board_.bridge ? 1 : 0;
    r.gates = board_.gates;
  }

  // One turn of the main loop.
  void poll(Registers& r) {
    control_.set_setpoint({static_cast<firmware::Mode>(r.mode), r.value});
    orders_.order.task = static_cast<firmware::CommissioningTask>(r.task);
    control_.serve(orders_);
    report(r);
    ++r.polls;
  }

 private:
  void report(Registers& r) const {
    const firmware::Telemetry t = control_.telemetry();
    const firmware::CommissioningResult& c = orders_.found;
    const auto bits = [](float v) { return std::bit_cast<std::uint32_t>(v); };
    const auto byte = [](auto v) { return static_cast<std::uint32_t>(v); };
    r.state = static_cast<std::uint16_t>(t.state);
    r.report = {
        byte(t.fault) | byte(t.limiter) << 8 | byte(t.blocked) << 16 | byte(t.self_test.result) << 24 | byte(t.self_test.broken) << 28,
        t.trips | t.error_count << 16,
        bits(t.speed_rad_s),
        bits(t.current_q_A),
        bits(t.bus_mean_A),
        bits(t.energy_J),
        bits(t.winding_K),
        bits(t.load_N_m),
        bits(t.duty_q),
        byte(c.phase) | byte(c.end) << 8 | c.number << 16,
        bits(c.resistance_ohm),
        bits(c.inductance_q_H),
        bits(c.flux_linkage_Wb),
        bits(c.inertia_kg_m2)};
  }

  firmware::FakeBoard board_;
  firmware::EscControl<firmware::FakeBoard> control_;
  Orders orders_;
};

}  // namespace rotorloop::plain_board
