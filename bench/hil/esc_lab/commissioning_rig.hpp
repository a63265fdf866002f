// The commissioning in the place of the sample interrupt, on a true drive: what a motor's terminals and an ESC's converter see, no more.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "firmware/board/fake/fake_board.hpp"
#include "firmware/core/commission/commissioning.hpp"
#include "sim/drive/drive.hpp"

namespace rotorloop::esc_lab {

template <class Board>
class CommissioningRig {
 public:
  CommissioningRig(const sim::DriveParameters& drive, const firmware::Parameters& entered, double bus_V, double load_N_m_s2,
                   std::uint64_t seed)
      : drive_(drive, RandomStream(seed, 0x434F4D4D), 0.7 + 2.1 * static_cast<double>(seed % 17)), commissioning_(entered) {
    drive_.set_bus_V(bus_V);
    drive_.set_load({load_N_m_s2, 0.0});
  }

  // One sample period: converter, main loop (when it renews the order), interrupt, bridge.
  void step(bool renew = true) {
    const sim::AdcReading r = drive_.sample();
    board_.counts = {r.phase, r.bus, r.temperature};
    board_.unloaded = drive_.sample_unloaded();
    board_.now_us = static_cast<std::uint64_t>(1e6 * drive_.time_s());
    const firmware::PwmCompare active = board_.compare;  // written in the interrupt before
    if (renew) commissioning_.set_order(order);
    if (commissioning_.active()) commissioning_.on_sample(board_);  // otherwise the motor control's turn
    for (std::uint32_t k = 0; k < Board::kPwmPeriodsPerSample; ++k)
      drive_.step({active.phase, static_cast<std::uint16_t>(Board::kPwmTop), board_.bridge});
    const sim::MotorState& s = drive_.motor().state();
    peak_A = std::max(peak_A, std::hypot(s.i_d_A, s.i_q_A));
    peak_rad_s = std::max(peak_rad_s, std::fabs(s.omega_rad_s));
  }
  void run_s(double seconds, bool renew = true) {
    for (const double end_s = drive_.time_s() + seconds; drive_.time_s() < end_s;) step(renew);
  }
  // Until it has ended, or `phase` is reached, at most for 60 s.
  firmware::CommissioningResult run_until(firmware::CommissioningPhase phase = firmware::CommissioningPhase::finished) {
    for (const double end_s = drive_.time_s() + 60.0;
         drive_.time_s() < end_s && result().phase != phase && result().end == firmware::CommissioningEnd::none;)
      step();
    return result();
  }

  firmware::CommissioningResult result() const { return commissioning_.result(); }
  firmware::Commissioning<Board>& commissioning() { return commissioning_; }
  sim::Drive& drive() { return drive_; }
  Board& board() { return board_; }

  firmware::CommissioningOrder order{};
  double peak_A = 0.0, peak_rad_s = 0.0;

 private:
  sim::Drive drive_;
  Board board_{};
  firmware::Commissioning<Board> commissioning_;
};

}  // namespace rotorloop::esc_lab
