// Momentum side of the solve: the speed U of the air that carries an annulus's momentum, so that its thrust is
// dT = 2 rho dA F v U (v induced velocity, positive along -z; F Prandtl's loss). U is an explicit function of v, climb speed and
// edgewise speed, in every state of the rotor:
//   climb, hover, edgewise   U^2 = mu^2 + (Vz + v)^2                      Glauert
//   descent, 0.18 < b < 2.5  U^2 = mu^2 + v^2 kappa(b)^2, b = -Vz / v     vortex ring and turbulent wake, empirical
//   windmill, b > 2.5        U^2 = mu^2 + (Vz + v)^2                      momentum theory again
// kappa is the quartic vi/vh = 1 - 1.125 x - 1.372 x^2 - 1.718 x^3 - 0.655 x^4, x = Vz/vh in [-2, 0] (Leishman 2006, eq. 2.96;
// a fit of measurements by Castles & Gray and others), read as kappa = (vh/vi)^2 over b = -x vh/vi, and joined to momentum theory
// on either side by cubics that keep value and slope. The upper join ends at b = 2.5 (axial factor a = 0.4, where Glauert's
// windmill data leave momentum theory). In edgewise flow the ring is blown away: the difference fades out until mu = 0.95 vh
// (Johnson, NASA TP-2005-213477), which is mu = 0.7 v in the middle of the ring.
// Axial thrust v^2 kappa(b) rises with v throughout, so that the balance with the blades stays single-valued.
#pragma once
#include <array>
#include <cmath>

namespace rotorloop::sim {

constexpr double kRingBegin = 0.18, kRingQuarticBegin = 0.45;  // b: descent at 0.2 and 0.56 of vh
constexpr double kRingQuarticEnd = 1.326, kRingEnd = 2.5;      // b: the quartic is left at x = -1.9
constexpr double kRingFadeEnd = 0.7;                           // mu / v
constexpr int kRingCells = 256;

// kappa on a uniform grid of b over [kRingBegin, kRingEnd].
extern const std::array<double, kRingCells + 1> kRingTable;

struct Through {
  double speed_m_s;  // U
  double ring;       // 0: momentum theory; 1: fully empirical
};

inline Through mass_flow(double induced_m_s, double climb_m_s, double edgewise2_m2_s2) {
  const double v = induced_m_s, w = climb_m_s + v;
  double axial2 = w * w, ring = 0.0;
  const double b = climb_m_s * v < 0.0 ? -climb_m_s / v : 0.0;
  if (b > kRingBegin && b < kRingEnd) {
    const double m = edgewise2_m2_s2 / (kRingFadeEnd * kRingFadeEnd * v * v);
    if (m < 1.0) {
      ring = (1.0 - m) * (1.0 - m) * (1.0 + 2.0 * m);
      const double q = (b - kRingBegin) * (kRingCells / (kRingEnd - kRingBegin));
      const int i = static_cast<int>(q);
      const double low = kRingTable[static_cast<std::size_t>(i)], high = kRingTable[static_cast<std::size_t>(i) + 1];
      const double kappa_v = (low + (q - i) * (high - low)) * v;
      axial2 += ring * (kappa_v * kappa_v - w * w);
    }
  }
  return {std::sqrt(edgewise2_m2_s2 + axial2), ring};
}

}  // namespace rotorloop::sim
