// An ESC around the chip: its gates move sim/drive, the drive's samples are the volts at its pins.
#pragma once
#include <array>

#include "sim/drive/drive.hpp"
#include "sim/mcu/board/board_file.hpp"
#include "sim/mcu/g431/chip.hpp"

namespace rotorloop::mcu {

// One PWM period as it was applied, for tests and traces.
struct AppliedPeriod {
  uint64_t end_cycle = 0;
  sim::PwmCommand pwm;
  double dead_time_s = 0.0;
};

class EscBoard : public g431::Pins {
 public:
  // The chip is to outlive the board, and gets it as its pins. The drive's parameters hold but for period and dead time, which the
  // program chooses.
  EscBoard(const BoardPins& pins, const sim::DriveParameters& drive, g431::Chip& chip, uint64_t seed);

  // While no counter turns, the drive goes on in periods of its own: to be called at least every millisecond.
  void advance();
  void press(bool down);
  void set_pwm_input(bool high) { chip_.set_pin(pins_.pwm_input, high ? g431::Level::high : g431::Level::low); }
  void set_potentiometer(double share) { potentiometer_ = share; }
  // What drivers and FETs of this board add to the dead time that the program sets; may be negative.
  void set_dead_time_added_s(double added_s) { dead_time_added_s_ = added_s; }

  sim::Drive& drive() { return drive_; }
  const sim::Drive& drive() const { return drive_; }
  double bus_energy_J() const { return energy_before_J_ + drive_.bus_energy_J(); }  // taken since the start
  const AppliedPeriod& last() const { return last_; }
  bool switching() const { return last_.pwm.enabled; }
  uint64_t both_on() const { return both_on_; }  // times that both gates of a leg were asked for: the drivers hold them off
  bool led() const { return led_; }
  bool can_awake() const { return !can_shut_down_; }
  bool terminated() const { return terminated_; }
  double fastest_rad_s() const { return fastest_rad_s_; }

  // Pins
  void on_pin(uint32_t pin, bool driven, bool high) override;
  void on_signal(g431::Signal, bool high) override;
  bool heard(g431::Signal signal) const override;
  double pin_V(uint32_t pin) override;

 private:
  void account(uint64_t cycle);
  void retime(double pwm_Hz);
  void step_to(uint64_t crest);
  sim::PwmCommand command(int64_t period_cycles);
  const sim::AdcReading& reading();

  const BoardPins pins_;
  const uint64_t seed_;
  uint64_t retimed_ = 0;
  sim::Drive drive_;
  g431::Chip& chip_;
  std::array<bool, 3> high_{}, low_{};
  std::array<int64_t, 3> high_cycles_{}, low_cycles_{};  // since the last crest
  uint64_t crest_ = 0, accounted_ = 0, period_ = 0;      // cycles
  bool stepped_ahead_ = false;
  double dead_time_s_, dead_time_added_s_ = 0.0, energy_before_J_ = 0.0;
  AppliedPeriod last_;
  sim::AdcReading loaded_{};
  std::array<uint16_t, 3> unloaded_{};
  bool loaded_valid_ = false, unloaded_valid_ = false;
  bool led_ = false, can_shut_down_ = false, terminated_ = false;
  double potentiometer_ = 0.0, fastest_rad_s_ = 0.0;
  uint64_t both_on_ = 0;
};

}  // namespace rotorloop::mcu
