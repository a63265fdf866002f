// Between the rotor and the registers of the instruments: mount, load cells, indicators. What is wrong with it is drawn or given, and known
// to nobody who estimates.
#pragma once
#include <array>
#include <cstdint>

#include "host/base/random.hpp"

namespace rotorloop::virtual_stand {

// Of one stand and one run; all zero: a stand without errors.
struct ChainErrors {
  double thrust_gain = 0.0, torque_gain = 0.0;  // relative, of weights and arms
  double zero_N = 0.0, zero_N_m = 0.0;          // that nobody has tared
  double drift_N = 0.0, drift_N_m = 0.0;        // over drift_s
  double drift_s = 180.0;
  double hysteresis_N = 0.0;  // in the sense in which the thrust last changed
  double running_N_m = 0.0;   // as soon as the rotor turns
  double alignment_rad = 0.0;
  double speed = 0.0, voltage = 0.0, current = 0.0, pressure = 0.0;  // relative, of what is shown
  // Readings per load before calibration, and readings without load.
  std::array<std::array<double, 2>, 2> sensitivity{{{1.0, 0.0}, {0.0, 1.0}}};
  std::array<double, 2> reading_zero{};
};

// The usual size of all of them, as standard deviations (docs/acceptance/thrust_stand.md); `full_scale`: N, N m.
ChainErrors drawn_errors(std::uint64_t seed, const std::array<double, 2>& full_scale);

struct ChainProperties {
  std::array<double, 2> ring_Hz{45.0, 60.0};  // structural, thrust and torque
  double ring_damping = 0.06;
  double creep_share = 5e-4, creep_s = 40.0;   // of the thrust, slowly more
  double filter_s = 0.004;                     // of the indicators
  std::array<double, 2> noise{0.02, 8e-4};     // N, N m; standard deviation behind the filter
  std::array<double, 2> division{5e-3, 1e-4};  // that readings are rounded to
};

class SignalChain {
 public:
  SignalChain(const ChainErrors& errors, const ChainProperties& properties, std::uint64_t seed, double dt_s);
  // One step of dt with the rotor's true loads on the mount; speed in rad/s.
  void step(double thrust_N, double torque_N_m, double omega_rad_s);
  const std::array<double, 2>& reading() const { return shown_; }  // not rounded
  double rounded(std::size_t axis, double reading) const;
  const ChainErrors& errors() const { return errors_; }

 private:
  ChainErrors errors_;
  ChainProperties properties_;
  RandomStream noise_;
  double dt_s_, t_s_ = 0.0;
  std::uint64_t steps_ = 0;
  std::array<double, 2> position_{}, rate_{}, shown_{};
  double creep_ = 0.0, sense_ = 1.0, turned_at_N_ = 0.0;
};

}  // namespace rotorloop::virtual_stand
