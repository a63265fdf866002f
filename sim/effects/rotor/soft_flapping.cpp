// Soft or folding propellers flap freely: the disk leans back in the wind by a_1 and lags behind a turning body, and the hub
// passes on no moment. `share` blends from the rigid rotor (0) to the freely hinged one (1), an upper bound for propellers.
//   a_1 = (8/3 theta_75 + 2 lambda) mu / (1 - mu^2/2), against the motion through the air; lag of the disk 16 / (gamma omega)
// theta_75: pitch at 0.75 R; lambda: inflow ratio, positive upwards (NACA); gamma: Lock number. The closed form of a hinged rotor,
// free of the solver's hub moments, so it also checks blade_flapping. Source: NASA TP-1285, 1978; Amer, NACA TN 2136, 1950.
#include <algorithm>

#include "host/base/elementary.hpp"
#include "sim/effects/rotor/blade_motion.hpp"
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

constexpr double kSlowTip_m_s = 5.0;       // below, the advance ratio of any wind is out of the formula's range and thrust is nothing
constexpr double kMostAdvanceRatio = 0.5;  // the formula's series is cut at mu^2

double pitch_at_three_quarters_rad(const Rotor& rotor) {
  const auto& all = rotor.annuli();
  const auto closer = [&](const Annulus& a, const Annulus& b) {
    return std::fabs(a.r_m - 0.75 * rotor.radius_m()) < std::fabs(b.r_m - 0.75 * rotor.radius_m());
  };
  const Annulus& a = *std::min_element(all.begin(), all.end(), closer);
  return atan2_exact(a.sin_twist, a.cos_twist);
}

class SoftFlapping final : public Effect {
 public:
  explicit SoftFlapping(const EffectValues& v) : share_(v[0]) {}

  void rotor_loads(const RotorSite& s, RotorLoads& loads) override {
    const RotorCondition& c = s.condition;
    const double tip_m_s = c.omega_rad_s * s.rotor->radius_m();
    if (tip_m_s < kSlowTip_m_s) return;
    const Eigen::Vector2d v_xy_m_s = c.v_R_m_s.head<2>();
    const double speed_m_s = v_xy_m_s.norm();
    const double mu = std::min(speed_m_s / tip_m_s, kMostAdvanceRatio);
    const double lambda = -(c.v_R_m_s.z() + loads.induced_m_s) / tip_m_s;
    const double a_1_rad = (8.0 / 3.0 * pitch_at_three_quarters_rad(*s.rotor) + 2.0 * lambda) * mu / (1.0 - 0.5 * mu * mu);
    const double lag_s = flapping_blade(*s.rotor, c.omega_rad_s, c.density_kg_m3).lag_s();
    Eigen::Vector2d lean = lag_s * Eigen::Vector2d(-c.w_R_rad_s.y(), c.w_R_rad_s.x());
    if (speed_m_s > 0.0) lean -= (a_1_rad / speed_m_s) * v_xy_m_s;
    lean_thrust(loads, share_ * lean);
    // The hub carries no moment of the blades, gyroscopic or not; the shaft torque stays.
    loads.moment_R_N_m.head<2>() *= 1.0 - share_;
    loads.moment_R_N_m.head<2>() -= share_ * blade_gyroscopic_moment_R_N_m(s);
  }

 private:
  double share_;
};

}  // namespace

const EffectInfo kSoftFlapping{
    .id = "soft_flapping", .parameter = {"share", "1", 0.0, 1.0, 0.0}, .options = {}, .make = make_effect<SoftFlapping>};

}  // namespace rotorloop::sim
