// The blade-element-momentum (BEM) solve: each annulus of the disk balances the thrust of its blade elements, averaged over
// azimuth, with the momentum of the air through it. Start here; inflow.hpp has the momentum side, section_table.hpp the blades',
// kernel_lanes.inc the search for the balance.
// Sources: Leishman, Principles of Helicopter Aerodynamics (2006), ch. 3; Glauert's edgewise flow; Prandtl loss; Pitt-Peters skew.
#pragma once
#include <array>
#include <memory>
#include <span>
#include <vector>

#include "sim/rotor/blade.hpp"
#include "sim/rotor/kernel.hpp"
#include "sim/rotor/rotor.hpp"
#include "sim/rotor/section_table.hpp"

namespace rotorloop::sim {

constexpr int kMaxRadial = kernel::kMaxAnnuli;
constexpr int kMaxAzimuth = 2 * kernel::kMaxHalfAzimuth;

struct RotorResolution {
  int radial = 22;          // nodes from hub to tip, Gauss-Legendre in a bent radius, 4..64
  int azimuth = 16;         // uniform nodes (spectral for a periodic integrand), multiple of 4, 8..128
  int max_iterations = 80;  // per annulus; bisection alone needs about 50
};

// One annulus of a prepared rotor.
struct Annulus {
  double r_m, chord_m, weight_m;  // weight: integral over r of f is the sum of weight_m * f(r_m)
  double cos_twist, sin_twist;
  double solidity;                       // blades * chord / (2 pi r)
  double sqrt_tip_loss, sqrt_root_loss;  // square roots of (B/2)(R-r)/r and (B/2)(r-Rh)/Rh, Prandtl's f times sin(phi)
  int table;                             // index into Rotor::tables
};

// Immutable after construction; may be shared by the four rotors of a vehicle and by threads.
class Rotor {
 public:
  explicit Rotor(const Blade& blade, RotorResolution resolution = {});  // throws Error for a resolution out of range

  double radius_m() const { return radius_m_; }
  double hub_radius_m() const { return hub_radius_m_; }
  double disk_area_m2() const { return area_m2_; }
  double blade_inertia_kg_m2() const { return blade_inertia_kg_m2_; }
  int blades() const { return blades_; }
  const RotorResolution& resolution() const { return resolution_; }
  const std::vector<Annulus>& annuli() const { return annuli_; }
  const SectionTable& table(int index) const { return (*tables_)[static_cast<std::size_t>(index)]; }
  const kernel::Annuli& lanes() const { return lanes_; }
  const double* cos_psi() const { return cos_psi_.data(); }
  const double* sin_psi() const { return sin_psi_.data(); }

 private:
  void fill_lanes();

  RotorResolution resolution_;
  double radius_m_, hub_radius_m_, area_m2_, blade_inertia_kg_m2_;
  int blades_;
  std::vector<Annulus> annuli_;
  std::shared_ptr<const std::vector<SectionTable>> tables_;  // shared by copies of the rotor, whose lanes_ point into it
  kernel::Annuli lanes_{};
  std::array<double, kMaxAzimuth> cos_psi_{}, sin_psi_{};
};

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
