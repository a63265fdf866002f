// One commissioning: a drawn motor on a drawn board measures itself, and is compared with the truth.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "bench/hil/esc_lab/motor_classes.hpp"
#include "firmware/core/commission/result.hpp"

namespace rotorloop::esc_lab {

enum class Quantity : std::uint8_t { resistance, inductance_d, inductance_q, ratio, flux, inertia, bridge };
constexpr std::size_t kQuantities = 7;

struct QuantityLimit {
  std::string_view name, unit;
  double limit;
};
// Limits of docs/acceptance/esc_commissioning.md: relative ones in percent; the bridge's in units of 50 ns · U · f_PWM.
constexpr std::array<QuantityLimit, kQuantities> kQuantityLimits = {{{"R, phase and switches", "%", 5.0},
                                                                     {"L_d at 0 A", "%", 5.0},
                                                                     {"L_q at 0 A", "%", 5.0},
                                                                     {"L_q/L_d", "", 0.10},
                                                                     {"flux linkage", "%", 5.0},
                                                                     {"J, rotor and propeller", "%", 8.0},
                                                                     {"bridge voltage, 1 to 20 A", "x 50 ns U f", 1.0}}};

struct CommissionTrial {
  std::uint64_t seed = 0;
  std::string motor_class;
  firmware::CommissioningResult result{};
  double took_s = 0.0, peak_A = 0.0, peak_rad_s = 0.0, heated_K = 0.0;
  std::array<double, kQuantities> error{};   // in the units of the limits; 1e9: not measured
  std::array<double, kQuantities> scales{};  // what the drawn gains of the board's converters alone would make of it
  double load_percent = 0.0, friction_percent = 0.0;
};

inline constexpr double kMostBeyondShare = 2.0 / 60.0;  // of the draws, for each quantity

CommissionTrial run_commission_trial(const EscDraw& draw);
CommissionTrial run_commission_trial(const MotorClass& c, std::uint64_t seed);

}  // namespace rotorloop::esc_lab
