#include "sim/mcu/board/esc_board.hpp"

#include <algorithm>
#include <cmath>

namespace rotorloop::mcu {
namespace {

constexpr uint64_t kNoiseStream = 0x4D435501;
// Of a code, the volts in its middle: what a converter makes of them is the same code.
double volts(uint16_t counts) { return (counts + 0.5) * (3.3 / 4096.0); }
constexpr double kAmplifierGain = 16.0;

}  // namespace

EscBoard::EscBoard(const BoardPins& pins, const sim::DriveParameters& drive, g431::Chip& chip, uint64_t seed)
    : pins_(pins), seed_(seed), drive_(drive, {seed, kNoiseStream}), chip_(chip), dead_time_s_(drive.inverter.dead_time_s) {
  crest_ = accounted_ = chip.cycle();
  chip.pins = this;
  if (pins_.button != kNoPin) press(false);
}

void EscBoard::press(bool down) { chip_.set_pin(pins_.button, down ? g431::Level::low : g431::Level::high); }

bool EscBoard::heard(g431::Signal signal) const { return signal == g431::timer_signal(1, g431::TimerWire::crest); }

// What the gates had since the last change. Signed: a period that was stepped ahead of its end is corrected by what still happens in it.
void EscBoard::account(uint64_t cycle) {
  const auto passed = static_cast<int64_t>(cycle - accounted_);
  for (size_t k = 0; k < 3; ++k) {
    if (high_[k] && !low_[k]) high_cycles_[k] += passed;
    if (low_[k] && !high_[k]) low_cycles_[k] += passed;
  }
  accounted_ = cycle;
}

void EscBoard::on_pin(uint32_t pin, bool driven, bool high) {
  const bool on = driven && high;
  for (size_t k = 0; k < 3; ++k) {
    if (pin != pins_.high[k] && pin != pins_.low[k]) continue;
    account(chip_.now());
    (pin == pins_.high[k] ? high_[k] : low_[k]) = on;
    if (high_[k] && low_[k]) ++both_on_;
    return;
  }
  if (pin == pins_.led) led_ = on;
  if (pin == pins_.can_shutdown) can_shut_down_ = on;
  if (pin == pins_.can_termination) terminated_ = on;
}

// The share of a phase's high side, with the dead times given back: half of what neither gate had belongs to each.
sim::PwmCommand EscBoard::command(int64_t period) {
  sim::PwmCommand pwm;
  int shift = 0;
  while ((2 * period >> shift) > 0xFFFF) ++shift;
  pwm.top = static_cast<uint16_t>(std::max<int64_t>(1, 2 * period >> shift));
  pwm.gates = 0;
  for (size_t k = 0; k < 3; ++k) {
    const int64_t h = std::clamp<int64_t>(high_cycles_[k], 0, period), l = std::clamp<int64_t>(low_cycles_[k], 0, period - h);
    const bool both = (h != 0 && l != 0) || h == period || l == period;
    const int64_t share = both ? period + h - l : h != 0 ? 2 * h : 2 * (period - l);
    pwm.compare[k] = static_cast<uint16_t>(std::clamp<int64_t>(share, 0, 2 * period) >> shift);
    const unsigned high_bit = 1u << k, low_bit = 8u << k;
    pwm.gates = static_cast<uint8_t>(pwm.gates | (h != 0 || both ? high_bit : 0) | (l != 0 || both ? low_bit : 0));
    if (h != 0 && l != 0) dead_time_s_ = 0.5 * static_cast<double>(period - h - l) / chip_.clocks().hclk_Hz + dead_time_added_s_;
  }
  pwm.enabled = pwm.gates != 0;
  return pwm;
}

// A drive has one period for its life: the program's choice is a new drive that goes on where the old one was. Its temperatures begin anew.
void EscBoard::retime(double pwm_Hz) {
  sim::DriveParameters p = drive_.parameters();
  p.inverter.pwm_Hz = pwm_Hz;
  p.inverter.dead_time_s = dead_time_s_;
  sim::Drive next(p, {seed_, kNoiseStream + ++retimed_});
  next.motor().state() = drive_.motor().state();
  next.set_bus_V(drive_.bus_V());
  next.set_load(drive_.load());
  energy_before_J_ += drive_.bus_energy_J();
  drive_ = next;
}

void EscBoard::step_to(uint64_t crest) {
  account(crest);
  const auto period = static_cast<int64_t>(crest - crest_);
  if (period <= 0) return;
  const sim::PwmCommand pwm = command(period);
  const double pwm_Hz = static_cast<double>(chip_.clocks().hclk_Hz) / static_cast<double>(period);
  const sim::InverterParameters& inverter = drive_.parameters().inverter;
  if (pwm_Hz != inverter.pwm_Hz || dead_time_s_ != inverter.dead_time_s) retime(pwm_Hz);
  drive_.step(pwm);
  last_ = {crest, pwm, dead_time_s_};
  high_cycles_ = low_cycles_ = {};
  period_ = static_cast<uint64_t>(period);
  crest_ = crest;
  loaded_valid_ = unloaded_valid_ = false;
  fastest_rad_s_ = std::max(fastest_rad_s_, std::fabs(drive_.omega_rad_s()));
  chip_.pulse(g431::Signal::analogue_moved);
}

void EscBoard::on_signal(g431::Signal, bool high) {
  if (!high) return;
  const uint64_t now = chip_.now();
  if (stepped_ahead_ && now < crest_ + period_ / 4) {  // this crest was foreseen
    stepped_ahead_ = false;
    return;
  }
  stepped_ahead_ = false;
  step_to(now);
}

// The longest period that still is one of a counter; beyond it the drive coasts in steps of the board's own.
void EscBoard::advance() {
  const uint64_t hclk_Hz = chip_.clocks().hclk_Hz, longest = hclk_Hz / 2000, own = std::max<uint64_t>(1, hclk_Hz / 24000);
  const uint64_t now = chip_.cycle();
  if (now < crest_ + longest) return;
  stepped_ahead_ = false;
  while (crest_ + own <= now) {
    // Levels stood as they are: each step has its share of what was accounted.
    account(crest_ + own);
    step_to(crest_ + own);
  }
}

const sim::AdcReading& EscBoard::reading() {
  if (!loaded_valid_) {
    loaded_ = drive_.sample();
    loaded_valid_ = true;
  }
  return loaded_;
}

double EscBoard::pin_V(uint32_t pin) {
  for (size_t k = 0; k < 3; ++k) {
    if (pin != pins_.shunt_plus[k] && pin != pins_.amplified[k]) continue;
    const uint64_t now = chip_.now(), since = now > crest_ ? now - crest_ : 0;
    const bool pulsing = period_ != 0 && since < 2 * period_ && last_.pwm.enabled;
    // Shortly before a crest all edges of the period are over: the gates stay as they are until then, and the sample is that of the crest.
    if (pulsing && !stepped_ahead_ && since > period_ - period_ / 4) {
      step_to(crest_ + period_);
      stepped_ahead_ = true;
    }
    const bool at_trough = pulsing && since > period_ / 4 && since <= period_ - period_ / 4;
    if (at_trough && !unloaded_valid_) {
      unloaded_ = drive_.sample_unloaded();
      unloaded_valid_ = true;
    }
    const double amplified_V = volts(at_trough ? unloaded_[k] : reading().phase[k]);
    return pin == pins_.amplified[k] ? amplified_V : amplified_V / kAmplifierGain;
  }
  if (pin == pins_.bus) return volts(reading().bus);
  if (pin == pins_.temperature) return volts(reading().temperature);
  if (pin == pins_.potentiometer) return 3.3 * potentiometer_;
  return 0.0;
}

}  // namespace rotorloop::mcu
