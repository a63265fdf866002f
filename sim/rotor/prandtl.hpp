// Prandtl's tip and root loss F = (2/pi) acos(exp(-f)) by table: exp and acos would cost more than the rest of an annulus.
// The table is uniform in sqrt(f), where F is smooth (F ~ sqrt(f) at the edge); its error is below 2e-5.
#pragma once
#include <array>

namespace rotorloop::sim {

constexpr int kPrandtlCells = 512;
constexpr double kPrandtlEnd = 4.0;  // sqrt(f); F = 1 - 7e-8 there

extern const std::array<double, kPrandtlCells + 2> kPrandtlTable;

inline double prandtl_factor(double sqrt_f) {
  const double q = sqrt_f * (kPrandtlCells / kPrandtlEnd);
  const double limited = q < kPrandtlCells ? q : kPrandtlCells;
  const int i = static_cast<int>(limited);
  const double low = kPrandtlTable[static_cast<std::size_t>(i)];
  return low + (limited - i) * (kPrandtlTable[static_cast<std::size_t>(i) + 1] - low);
}

// Share of v^2 added to the squared speed that carries the vortex sheets away. In Prandtl's bare formula they pile up when descent
// cancels the induced flow, the loss vanishes there and F v loses its monotony, so that one annulus has several solutions; 1/8 is
// the least share for which F v still rises with v throughout, and turns hover's sin(phi) by 6 %.
constexpr double kSheetSpread = 0.125;

// inverse_sqrt_sine: 1 / sqrt(|sin phi|) of the inflow angle at the annulus; the other two are its geometry (bem.hpp).
inline double prandtl_loss(double inverse_sqrt_sine, double sqrt_tip, double sqrt_root) {
  return prandtl_factor(sqrt_tip * inverse_sqrt_sine) * prandtl_factor(sqrt_root * inverse_sqrt_sine);
}

}  // namespace rotorloop::sim
