// What a result must keep to be used. Each check names what is wrong.
#pragma once
#include "firmware/core/commission/result.hpp"
#include "firmware/core/commission/spin_fit.hpp"
#include "firmware/core/commission/standstill.hpp"

namespace rotorloop::firmware {

// Ends of what motors from whoops to 40-inch propellers and gimbals have; those of the parameters (node/parameters.hpp) where they are.
struct PlausibleRange {
  float least, most;
  constexpr bool holds(float x) const { return x >= least && x <= most; }
};
constexpr PlausibleRange kPlausibleResistance{1e-3f, 10.0f}, kPlausibleInductance{1e-7f, 1e-2f}, kPlausibleFlux{1e-5f, 0.1f},
    kPlausibleInertia{1e-8f, 0.1f}, kPlausibleLoad{-1e-5f, 1e-3f};  // without a propeller about zero, either sign
constexpr PlausibleRange kPlausibleRatio{0.8f, 2.0f};               // surface magnets 1.0 to 1.4, buried ones up to 2
constexpr PlausibleRange kPlausibleDeadTime{0.25f, 2.0f};           // of the board's own
constexpr float kRunsApart = 0.05f, kSpeedConstantApart = 0.15f, kPoleCountApart = 0.05f;

constexpr bool apart(float a, float b, float share) {
  const float most = a > b ? a : b;
  return !(magnitude(a - b) <= share * most);
}

constexpr CommissioningEnd judge_standstill(const PassResult& one, const PassResult& two, float board_dead_V) {
  using enum CommissioningEnd;
  const PassResult* const runs[] = {&one, &two};
  for (const PassResult* r : runs) {
    if (!r->direct.valid || !kPlausibleResistance.holds(r->direct.resistance_ohm)) return resistance_range;
    if (!kPlausibleInductance.holds(r->inductance_d_H) || !kPlausibleInductance.holds(r->inductance_q_H)) return inductance_range;
    if (!kPlausibleRatio.holds(r->inductance_q_H / r->inductance_d_H)) return inductance_ratio_range;
    if (!kPlausibleDeadTime.holds(r->direct.lost_V / board_dead_V)) return dead_time_range;
  }
  if (apart(one.direct.resistance_ohm, two.direct.resistance_ohm, kRunsApart)) return runs_differ_resistance;
  if (apart(one.inductance_d_H, two.inductance_d_H, kRunsApart) || apart(one.inductance_q_H, two.inductance_q_H, kRunsApart))
    return runs_differ_inductance;
  return none;
}

// pole_pairs: measured, or as entered.
constexpr CommissioningEnd judge_spin(const SpinResult& one, const SpinResult& two, const CommissioningOrder& order, float pole_pairs) {
  using enum CommissioningEnd;
  const SpinResult* const runs[] = {&one, &two};
  for (const SpinResult* r : runs) {
    if (!kPlausibleFlux.holds(r->flux_linkage_Wb)) return flux_range;
    if (!r->valid || !kPlausibleInertia.holds(r->inertia_kg_m2)) return inertia_range;
    if (!kPlausibleLoad.holds(r->load_N_m_s2)) return load_range;
  }
  if (apart(one.flux_linkage_Wb, two.flux_linkage_Wb, kRunsApart)) return runs_differ_flux;
  if (apart(one.inertia_kg_m2, two.inertia_kg_m2, kRunsApart)) return runs_differ_inertia;
  const float flux = 0.5f * (one.flux_linkage_Wb + two.flux_linkage_Wb), inertia = 0.5f * (one.inertia_kg_m2 + two.inertia_kg_m2);
  // rpm/V of the line's peak: K_v = 60 / (2 pi sqrt(3) flux pole_pairs)
  constexpr float kRpmVolts = 60.0f / (2.0f * kPi * kRoot3);
  if (order.speed_constant_rpm_V > 0.0f &&
      magnitude(order.speed_constant_rpm_V * flux * pole_pairs / kRpmVolts - 1.0f) > kSpeedConstantApart)
    return speed_constant_differs;
  if (order.bell_inertia_kg_m2 > 0.0f) {
    // 8 %: the measurement's own error.
    if (inertia < 0.92f * order.bell_inertia_kg_m2) return inertia_below_bell;
    if (inertia > 10.0f * order.bell_inertia_kg_m2) return inertia_far_above_bell;
  }
  return none;
}

// Pole pairs from a counted speed: a whole number, or 0.
constexpr std::uint8_t pole_pairs_of(float electrical_rad_s, float counted_rad_s) {
  if (!(counted_rad_s > 0.0f)) return 0;
  const float n = magnitude(electrical_rad_s) / counted_rad_s;
  const float whole = static_cast<float>(static_cast<std::int32_t>(n < 100.0f ? n + 0.5f : 100.0f));
  return whole >= 1.0f && whole <= 32.0f && magnitude(n - whole) <= kPoleCountApart * whole ? static_cast<std::uint8_t>(whole)
                                                                                            : std::uint8_t{0};
}

}  // namespace rotorloop::firmware
