// A complete ESC inside the simulator: the firmware core compiled for the host, wired through the board concept to the true
// drive. It advances by exact 24 kHz current-loop periods; the airframe couples to it every half millisecond.
//
//   esc.set_setpoint(…); esc.couple(load_torque, bus_V);  for 12 periods: esc.step_current_loop();  read omega, means
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>

#include "firmware/app/esc_control.hpp"
#include "firmware/board/fake/fake_board.hpp"
#include "firmware/core/interface.hpp"
#include "host/base/random.hpp"
#include "sim/drive/boards.hpp"
#include "sim/drive/drive.hpp"

namespace rotorloop::sim {

constexpr double kCurrentLoop_Hz = 24000.0;

struct NativeEscConfig {
  DriveParameters drive{};
  firmware::Parameters firmware{};
  double bus_V = 16.0;
  std::uint64_t seed = 1;
  std::uint64_t module = 0;       // names the random streams of this ESC; one number per ESC
  bool draw_board_spread = true;  // current gains and offsets of this board drawn from the stream
  bool typical_board = false;     // everything of it drawn instead (sim/drive/typical.hpp)
  bool own_clock = false;         // with typical_board: its crystal and the phase of its PWM too; no tick in common with the others
};

// `Scales`: of the firmware's board (firmware/board/fake/board_scales.hpp). config.drive must stand on the same board.
template <class Scales>
class BasicNativeEsc {
 public:
  using Board = firmware::BasicFakeBoard<Scales>;

  explicit BasicNativeEsc(const NativeEscConfig& config);
  // The true power stage of that board.
  static const BoardStage& stage();

  void set_setpoint(const firmware::Setpoint& setpoint) { setpoint_ = setpoint; }
  // Tests: what takes the place of the firmware in the interrupt for as long as it returns true; empty: nothing.
  void set_interrupt(std::function<bool(Board&)> instead) { instead_of_firmware_ = std::move(instead); }
  // One 24 kHz period: sample, firmware interrupt, two PWM periods of the drive.
  void step_current_loop();
  // The same for several ESCs, whose drives then step side by side (Drive::step_together); each gets the bits of a step alone.
  static void step_current_loops(std::span<BasicNativeEsc* const> escs);
  // Once per airframe step: the propeller's resisting torque [N m, >= 0] at the present speed, scaled with speed² until the
  // next call, and the bus voltage. Restarts the means below.
  void couple(double load_torque_N_m, double bus_V);
  // The same with the torque coefficient itself (torque / speed²), for loads known in that form.
  void couple_quadratic(double load_N_m_s2, double bus_V);

  double omega_rad_s() const { return drive_.omega_rad_s(); }  // signed, mechanical, true
  double shaft_acceleration_rad_s2() const;                    // mean since the last couple()
  double bus_current_A() const;                                // mean since the last couple(); negative: feeding back
  firmware::Telemetry telemetry() const { return control_.telemetry(); }
  std::int64_t time_us() const { return static_cast<std::int64_t>(periods_ * 125 / 3); }  // 24 kHz period = 41.67 us
  std::uint64_t periods() const { return periods_; }
  double pwm_phase() const { return phase_; }  // turns of a PWM period, against the common tick; moves with its clock

  // For tests and fault injection: the true drive and the firmware under test.
  Drive& drive() { return drive_; }
  const Drive& drive() const { return drive_; }
  firmware::EscControl<Board>& control() { return control_; }
  const firmware::EscControl<Board>& control() const { return control_; }
  firmware::Motor<Board>& motor() { return control_.motor(); }
  Board& board() { return board_; }

 private:
  PwmCommand run_firmware();  // sample and interrupt; what the bridge does in the period that follows
  int periods_due();          // of its own clock in one common tick: 1, at times 0 or 2

  double rate_ = 1.0, phase_ = 0.0;  // of its clock over the common one
  Drive drive_;
  Board board_;
  firmware::EscControl<Board> control_;
  firmware::Setpoint setpoint_{};
  std::function<bool(Board&)> instead_of_firmware_;
  firmware::PwmCompare active_{};
  std::uint64_t periods_ = 0;
  double coupled_omega_rad_s_ = 0.0, coupled_energy_J_ = 0.0;
  std::uint64_t coupled_period_ = 0;
};

using NativeEsc = BasicNativeEsc<firmware::B_G431B_ESC1_Scales>;
using SmallNativeEsc = BasicNativeEsc<firmware::Small2s15aScales>;
using HighVoltageNativeEsc = BasicNativeEsc<firmware::HighVoltage14s120aScales>;
template <>
const BoardStage& NativeEsc::stage();
template <>
const BoardStage& SmallNativeEsc::stage();
template <>
const BoardStage& HighVoltageNativeEsc::stage();
extern template class BasicNativeEsc<firmware::B_G431B_ESC1_Scales>;
extern template class BasicNativeEsc<firmware::Small2s15aScales>;
extern template class BasicNativeEsc<firmware::HighVoltage14s120aScales>;

// A drive on a board: stage and sensing of the board, the rest as given.
DriveParameters on_stage(DriveParameters drive, const BoardStage& stage);

}  // namespace rotorloop::sim
