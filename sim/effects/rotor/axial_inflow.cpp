// Climb adds to the flow through the disk, lowers the blades' angle of attack and costs thrust: T falls by 10 % at 3.1 m/s here,
// at the same rotor speed. The blade-element model has it; share scales the axial velocity that the rotor meets.
// Source: Glauert's momentum theory with blade elements; Svacha, Mohta, Kumar 2017 measure it as k_z omega v_z.
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

void axial_inflow(const EffectValues& v, const RotorSite&, RotorCondition& c) {
  const double share = v[0];
  c.v_R_m_s.z() *= share;
}

}  // namespace

const EffectInfo kAxialInflow{
    .id = "axial_inflow", .parameter = {"share", "1", 0.0, 1.3, 1.0}, .options = {}, .make = effect_of<axial_inflow>};

}  // namespace rotorloop::sim
