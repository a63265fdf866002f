// The blade-element-momentum (BEM) solve: each annulus of the disk balances the thrust of its blade elements, averaged over
// azimuth, with the momentum of the air through it. Start here; inflow.hpp has the momentum side, section_table.hpp the blades',
// kernel_lanes.inc the search for the balance.
// Sources: Leishman, Principles of Helicopter Aerodynamics (2006), ch. 3; Glauert's edgewise flow; Prandtl loss; Pitt-Peters skew.
#pragma once
#include <array>
#include <span>

#include "sim/rotor/rotor.hpp"
#include "sim/rotor/rotor_loads.hpp"

namespace rotorloop::sim {

// What one solve leaves for the next of the same rotor: only a first guess. In the flight envelope the converged loads differ from
// those of a cold start by at most 1e-12 of the thrust, or of 5 % of the hover thrust if that is more (moments: times the radius).
// A default-constructed one is a cold start.
struct RotorWarmStart {
  bool valid = false;
  int solves = 0;
  double omega_rad_s = 0.0;
  double climb_m_s = 0.0;
  alignas(64) std::array<double, kMaxRadial> induced_m_s{};  // per annulus, at the blade
  alignas(64) std::array<double, kMaxRadial> missed_m_s{};   // how far the last guess was off, carried into the next
  alignas(64) std::array<double, kMaxRadial> last_missed_m_s{};
  alignas(64) std::array<double, kMaxRadial> slope_m_s{};    // derivative of the residual
  alignas(64) std::array<double, kMaxRadial> through_m_s{};  // mass flow speed
};

// Code for three classes of CPU with the same results, bit for bit.
enum class RotorKernel {
  baseline,  // any CPU
  v3,        // x86-64-v3: AVX2
  v4,        // x86-64-v4: AVX-512
};
bool runs_here(RotorKernel kernel);
RotorKernel fastest_rotor_kernel();  // of this CPU

// One rotor in one condition. No two of a batch may share a warm start.
struct RotorJob {
  const Rotor* rotor = nullptr;
  RotorCondition condition;
  RotorWarmStart* warm_start = nullptr;
  RotorLoads loads;  // result
};

// Loads of rotors in a steady state, averaged over a revolution; the result of a job does not depend on the others, on the kernel or
// on the thread. Needs no heap, throws nothing. Status for every input; a condition that is not finite gives zero loads and
// not_converged. `iterations` counts evaluations of the annulus that took most. The kernel must run here.
void solve_rotors(std::span<RotorJob> jobs, RotorKernel kernel = fastest_rotor_kernel());

// A batch of one.
RotorLoads solve_rotor(const Rotor& rotor, const RotorCondition& condition, RotorWarmStart& warm_start,
                       RotorKernel kernel = fastest_rotor_kernel());

}  // namespace rotorloop::sim
