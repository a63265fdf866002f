// A rotor made ready for the solve: quadrature nodes over radius and azimuth, section tables, and the kernel's copy of them.
#pragma once
#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "sim/rotor/blade.hpp"
#include "sim/rotor/kernel.hpp"
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

}  // namespace rotorloop::sim
