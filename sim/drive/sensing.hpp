// What the ESC's analogue front end makes of the truth: three low-side shunts through their amplifiers, bus voltage and
// temperature, as 12-bit counts. Scales of the ST B-G431B-ESC1 (UM2516 and the derived scale sheet: 27.43 mV/A, sign
// inverted, zero at 2.057 V; bus divider 18k/(169k+18k); temperature 1.4 V at 25 degC, 19 mV/K).
#pragma once
#include <array>
#include <cstdint>

#include "host/base/random.hpp"
#include "sim/drive/inverter.hpp"

namespace rotorloop::sim {

struct SensingParameters {
  double current_V_per_A = -27.43e-3;
  double current_zero_V = 2.057;
  double reference_V = 3.3;
  double bus_ratio = 0.09626;
  double temperature_zero_V = 1.4, temperature_V_per_K = 19e-3, temperature_zero_K = 298.15;
  std::array<double, 3> gain = {1.0, 1.0, 1.0};  // shunt and amplifier tolerance
  std::array<double, 3> offset_counts = {0.0, 0.0, 0.0};
  double noise_counts = 2.0;  // rms per current sample, amplifier and converter
  double bus_noise_counts = 1.0;
  // The amplifier follows the shunt voltage only while the low side conducts: no signal before `dead`, all of it after `full`.
  double settle_dead_s = 0.3e-6, settle_full_s = 1.0e-6;
  // Offsets that wander as the board warms up: a ramp from 0 to this, then at rest.
  std::array<double, 3> drift_counts = {0.0, 0.0, 0.0};
  double drift_s = 5.0;
  double bad_sample_every = 0.0;  // conversions of any of the five channels that are nonsense: mean number of samples between; 0: none
};

// An amplifier or divider that shows nothing of the truth any more.
enum class ChannelFault : std::uint8_t { none, low_rail, high_rail, no_current };

struct AdcReading {
  std::array<std::uint16_t, 3> phase{};
  std::uint16_t bus = 0;
  std::uint16_t temperature = 0;
};

// Draws `spread` of one board: gain 1 % and offset 12 counts standard deviation per channel (shunt 1 %, amplifier offset mV).
SensingParameters typical_board(const RandomStream& random);

class Sensing {
 public:
  Sensing(const SensingParameters& parameters, RandomStream noise) : p_(parameters), noise_(noise) {}
  // low_window_s: time since the low side of each phase turned on, at the sampling instant; negative when it never did.
  AdcReading sample(const PhaseCurrents& i, const std::array<double, 3>& low_window_s, double bus_V, double temperature_K);
  // The amplifiers while no low side conducts. low_off_s: time since that of each phase turned off.
  std::array<std::uint16_t, 3> sample_unloaded(const PhaseCurrents& i, const std::array<double, 3>& low_off_s);
  void set_drift_share(double share) { drift_share_ = share; }  // 0 at power-up, 1 once warm
  std::array<ChannelFault, 4> faults{};                         // U, V, W, temperature
  const SensingParameters& parameters() const { return p_; }
  SensingParameters& parameters() { return p_; }  // faults during a run: a channel that sticks or drifts

 private:
  void spoil(AdcReading& reading);
  void break_channels(AdcReading& reading) const;

  SensingParameters p_;
  RandomStream noise_;
  std::uint64_t drawn_ = 0, unloaded_drawn_ = 0;
  double drift_share_ = 0.0;
  double until_bad_ = -1.0;  // samples; below 0: not drawn yet
  std::uint64_t bad_ = 0;
};

}  // namespace rotorloop::sim
