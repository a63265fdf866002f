// All that a commissioning remembers from one interrupt to the next.
#pragma once
#include "firmware/core/commission/injection.hpp"
#include "firmware/core/commission/plausible.hpp"
#include "firmware/core/motor/config.hpp"
#include "firmware/core/motor/mailbox.hpp"

namespace rotorloop::firmware {

struct CommissioningVariables {
  SenseState sense{};
  SampleCheckState check{};
  SteadyValue bus{}, temperature{};
  ProtectionState protection{};
  CurrentLoopState current{};
  ObserverState observer{};

  CommissioningOrder order{};
  std::uint32_t order_sequence = 0, order_age = 0;
  bool armed = true;  // an order `off` was seen since the last end

  // Command pipeline as in the motor control; nothing compensated by the modulator, so that what was told is bus times duty.
  Modulated pending{}, active{}, ended{};
  bool pending_driven = false, active_driven = false, ended_driven = false;

  CommissioningPhase phase = CommissioningPhase::idle;
  CommissioningPhase after_zero = CommissioningPhase::idle;
  std::uint32_t samples = 0;  // in this phase
  std::uint32_t slot = 0;
  float bus_V = 0.0f, temperature_K = 0.0f;
  Stator current_A{}, last_A{}, duty_V{}, command_V{};
  Rotor wanted_A{}, seen_A{};  // in the frame of the control
  Angle angle{};
  float omega_e_rad_s = 0.0f;
  bool on_observer = false;
  float across_V = 0.0f, across_slow_V = 0.0f;
  float heat_A2_s = 0.0f;

  bool wants_configuration = false;

  // Standstill.
  bool rehearsed = false;
  std::uint32_t pass = 0, direction = 0, level = 0;
  float largest_A = 0.0f;
  Angle glide_from{};
  float glide_rad = 0.0f;
  float sum_V = 0.0f, sum_A = 0.0f, sum_count = 0.0f;
  float largest_V = 0.0f, largest_mean_A = 0.0f, direction_ohm = 0.0f,
        direction_lost_V = 0.0f;  // of the direction's largest current; from it and the least
  DirectFit direct{};
  InjectionConfig inject{};
  InjectionState injection{};
  LeastSquares<4> fit_guess{}, fit_d{}, fit_q{};
  std::array<PassResult, kPasses> passes{};

  // Spin.
  float flux_Wb = 0.0f;  // as entered, then as found so far
  Rotor emf{};           // back-EMF in the turned frame, smoothed
  float turn_rad_s2 = 0.0f, held_e_rad_s = 0.0f;
  Rotor from_A{};
  std::uint32_t run = 0, cycle = 0;
  float block_s = 0.0f, block_rad = 0.0f, block_rad_s = 0.0f;  // electrical angle turned; mechanical speed of the last block
  Angle block_angle{};
  float mean_rad_s2 = 0.0f, best_rad_s2 = 0.0f;            // acceleration, mechanical: smoothed; its largest
  float accelerate_A = 0.0f, idle_A = 0.0f, top_V = 0.0f;  // top: back-EMF when the coasting began
  bool with_magnet = false;                                // the current of the coasting
  SpinFit spin{};
  std::array<SpinResult, 2> spins{};
};

}  // namespace rotorloop::firmware
