// Climb adds to the flow through the disk, lowers the blades' angle of attack and costs thrust: T falls by 10 % at 3.1 m/s here,
// at the same rotor speed. The blade-element solve has it; share scales the axial velocity that the rotor meets.
// Source: Glauert's momentum theory with blade elements; Svacha, Mohta, Kumar 2017 measure it as k_z omega v_z.
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

class AxialInflow final : public Effect {
 public:
  explicit AxialInflow(const EffectValues& v) : share_(v[0]) {}
  void rotor_condition(const RotorSite&, RotorCondition& c) const override { c.v_R_m_s.z() *= share_; }

 private:
  double share_;
};

}  // namespace

const EffectInfo kAxialInflow{
    .id = "axial_inflow", .parameter = {"share", "1", 0.0, 1.3, 1.0}, .options = {}, .make = make_effect<AxialInflow>};

}  // namespace rotorloop::sim
