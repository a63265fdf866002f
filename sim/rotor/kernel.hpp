// What passes between the solve (bem.cpp) and its kernels: one rotor in one condition, as plain arrays over annuli and azimuth.
// A kernel solves the annuli in lanes of vector registers. No operation mixes two lanes, and every lane does the same operations in
// the same order whatever the width, so all kernels give the same bits (-ffp-contract=off: no fused multiply-add anywhere).
// The wide kernels are functions with a target attribute, in files compiled without -march: with it, an inline function of some
// header that is not inlined would exist in a wide copy too, and the linker may pick that one for the whole program.
#pragma once

namespace rotorloop::sim::kernel {

constexpr int kMaxAnnuli = 64;
constexpr int kMaxHalfAzimuth = 64;
constexpr int kWidest = 8;  // lanes; arrays over annuli are filled up to a multiple of it with copies of the last annulus

// Sums over azimuth of one annulus: forces per length over rho/2, and their first harmonics.
enum Sum { kUp, kDrag, kInPlaneX, kInPlaneY, kRoll, kPitch, kSums };

// Geometry, made once per rotor.
struct alignas(64) Annuli {
  double r_m[kMaxAnnuli], relative_r[kMaxAnnuli];
  double sqrt_tip_loss[kMaxAnnuli], sqrt_root_loss[kMaxAnnuli];  // square roots of (B/2)(R-r)/r and (B/2)(r-Rh)/Rh: Prandtl's f sin(phi)
  double thrust_scale[kMaxAnnuli];                               // solidity / 4 / azimuth nodes: from the sum of `up` to the momentum
  double rows_per_reynolds_m[kMaxAnnuli], row_zero[kMaxAnnuli];  // table row = speed * density / viscosity * rows_per... - row_zero
  const double* nodes[kMaxAnnuli];                               // of the section table
};

struct alignas(64) Problem {
  const Annuli* annuli;
  int count;         // annuli
  int half_azimuth;  // nodes of half a turn; the other half are their opposites
  int max_iterations;
  // The condition, for a rotor that turns counter-clockwise.
  double omega_rad_s, climb_m_s, edge_m_s, rate_rad_s, radius_m;
  double reynolds_per_m2_s;            // density / viscosity
  double tangential[kMaxHalfAzimuth];  // of the hub velocity, against the blade's motion, m/s
  double radial[kMaxHalfAzimuth];      // of the hub velocity, m/s
  double flap[kMaxHalfAzimuth];        // body rate: upward speed per metre of radius
  double skew[kMaxHalfAzimuth];        // -1 upstream, +1 downstream
  const double *cosine, *sine;
  double guess_m_s, slope_m_s;  // of a cold start
  bool warm, settled;
  double omega_ratio, climbed_m_s;  // since the solve that left the warm start
};

// In and out: the arrays of a RotorWarmStart.
struct Memory {
  double *induced_m_s, *missed_m_s, *last_missed_m_s, *slope_m_s, *through_m_s;
};

struct alignas(64) Solution {
  double sums[kSums][kMaxAnnuli];
  double ring[kMaxAnnuli];
  int evaluations;  // of the annulus that took most
  bool converged;
};

void solve_baseline(const Problem& problem, const Memory& memory, Solution& solution);
#if defined(__x86_64__)
void solve_v3(const Problem& problem, const Memory& memory, Solution& solution);
void solve_v4(const Problem& problem, const Memory& memory, Solution& solution);
#endif

}  // namespace rotorloop::sim::kernel
