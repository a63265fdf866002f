// All that the motor control remembers from one interrupt to the next.
#pragma once
#include "firmware/core/motor/config.hpp"
#include "firmware/core/motor/counters.hpp"

namespace rotorloop::firmware {

struct MotorVariables {
  SenseState sense{};
  SampleCheckState check{};
  SteadyValue bus{}, temperature{};
  ObserverState observer{};
  CurrentLoopState current{};
  SpeedLoopState speed{};
  StartState start{};
  ProtectionState protection{};
  HealthState health{};
  Counters counters{};

  // The order that is followed, and for how many supervision ticks it has not been renewed.
  Setpoint order{};
  std::uint32_t order_sequence = 0, order_age = 0;

  // Command pipeline: computed in one interrupt, active in the next period, measured at its end.
  Modulated pending{}, active{}, ended{};
  bool pending_driven = false, active_driven = false;

  MotorState state = MotorState::off;
  bool own_frame = false;  // current control in a turned frame instead of the observer's
  Angle own_angle{};
  float own_omega_e_rad_s = 0.0f;
  Rotation turn{};     // of the frame in one period
  Stator current_A{};  // as measured or replaced
  Rotor wanted_A{};
  Rotor measured_A{};
  Rotor given_V{};
  float across_V = 0.0f;        // q voltage beyond what the resistance takes, smoothed
  float resistance_ohm = 0.0f;  // phase and switch, measured at the last start and followed since
  ResistanceState learning{};
  bool resistance_measured = false;                  // at rest, since power-up
  float dead_share = 0.0f, known_dead_share = 0.0f;  // dead time / PWM period: compensated now; measured at the last alignment
  std::uint32_t limited_samples = 0;                 // of the last kSlots
  float bus_V = 0.0f, temperature_K = 0.0f;
  float residual_A = 0.0f;
  float bus_A = 0.0f;
  float emf_mismatch = 0.0f;
  float hold_A = 0.0f;     // current along the magnet at low speed
  float weaken_A = 0.0f;   // <= 0
  float direction = 1.0f;  // sense of rotation while running
  float phase_s = 0.0f;    // time in handover, braking, stopping or tone
  CurrentRange range{};
  Limiter limiter = Limiter::none;
  Blocked blocked = Blocked::calibrating;
  std::uint32_t slot = 0;
  std::uint64_t round_us = 0;  // when the last round of slots began
  FinderState finder{};        // last: offsets of what runs stay small
};

}  // namespace rotorloop::firmware
