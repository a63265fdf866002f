// The time for which neither switch of a leg conducts takes voltage against each phase's current. A board's data say 500 to 1100 ns;
// at low speed the difference outweighs the back-EMF, so it is measured at each alignment, from its two currents (start_up.hpp).
#pragma once

namespace rotorloop::firmware {

// Of what is measured: compensating too much near zero current feeds back on itself, compensating too little only damps. Flights of 60
// drawn 3- and 5-inch motors: 1.0 54 and 60 without a trip, 0.95 56 and 60, 0.9 56 and 59, 0.8 57 and 56.
constexpr float kDeadTimeTrust = 0.95f;

struct DeadTimeConfig {
  float least_share = 0.0f, most_share = 0.0f;  // of the PWM period: what is accepted
  // While a turning rotor is looked for, and while it is measured: little, as too much compensation makes a current out of nothing and
  // lets the damping of the swing feed itself.
  float align_share = 0.0f;
  float unknown_share = 0.0f;  // for a rotor caught before any alignment
};

// A driver's own delays add to the timer's dead time, charge of the switches takes from it: what is accepted, as shares of what the board
// says. All four tuned on the simulated drive, 2026-11-23.
constexpr float kDeadTimeLeast = 0.4f, kDeadTimeMost = 1.6f, kDeadTimeAlign = 0.55f, kDeadTimeUnknown = 0.8f;

constexpr DeadTimeConfig configure_dead_time(float board_share) {
  return {kDeadTimeLeast * board_share, kDeadTimeMost * board_share, kDeadTimeAlign * board_share, kDeadTimeUnknown * board_share};
}

}  // namespace rotorloop::firmware
