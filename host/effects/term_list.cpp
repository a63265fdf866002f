// Every term that a model may hold, one line each.
#include "host/effects/air.hpp"
#include "host/effects/body_drag.hpp"
#include "host/effects/body_moments.hpp"
#include "host/effects/flapping.hpp"
#include "host/effects/mass_geometry.hpp"
#include "host/effects/outside_forces.hpp"
#include "host/effects/rotor_drag.hpp"
#include "host/effects/rotor_groups.hpp"
#include "host/effects/rotor_inertia.hpp"
#include "host/effects/rotor_inflow.hpp"
#include "host/effects/rotor_thrust_terms.hpp"
#include "host/effects/rotor_torque_terms.hpp"
#include "host/effects/sensors.hpp"
#include "host/effects/slung_load.hpp"
#include "host/effects/surroundings.hpp"
#include "host/effects/term.hpp"

namespace rotorloop::host {
namespace {

constexpr Term kTerms[] = {
    // sensors.hpp
    make_term<RotorSpeedScale>(),
    make_term<RotorSpeedDelay>(),
    // air.hpp
    make_term<WindSteady>(),
    make_term<WindShear>(),
    make_term<AirDensity>(),
    // rotor_inflow.hpp
    make_term<RotorLocalInflow>(),
    make_term<AxialInflow>(),
    make_term<TranslationalLift>(),
    make_term<RotorWakeInterference>(),
    make_term<RotorWakeThrustLoss>(),
    make_term<RotorPairInteraction>(),
    make_term<HoverInterference>(),
    make_term<DescentInflow>(),
    make_term<VortexRingLoss>(),
    // surroundings.hpp
    make_term<GroundEffectRotor>(),
    make_term<GroundEffectVehicle>(),
    make_term<CeilingEffect>(),
    // rotor_thrust_terms.hpp
    make_term<ThrustScale>(),
    make_term<BlockageStrut>(),
    make_term<ThrustSpeedExponent>(),
    make_term<ThrustSpeedCubed>(),
    make_term<HighAdvanceThrust>(),
    make_term<WeakRotor>(),
    make_term<ThrustDrift>(),
    make_term<RotorThrustDrift>(),
    make_term<ThrustLag>(),
    make_term<DynamicInflow>(),
    // rotor_torque_terms.hpp
    make_term<TorqueAdvance>(),
    make_term<InflowTorque>(),
    make_term<TorqueSpeedExponent>(),
    make_term<RotorTorqueScale>(),
    // rotor_drag.hpp
    make_term<RotorDrag>(),
    make_term<RotorBodyInterference>(),
    make_term<RotorDragWithSpeed>(),
    make_term<RotorDragWithInflow>(),
    make_term<RotorDragAtHubs>(),
    make_term<RotorPlaneHeight>(),
    // flapping.hpp
    make_term<BladeFlapping>(),
    make_term<SoftFlapping>(),
    make_term<LateralFlapping>(),
    make_term<RotorRollingMoment>(),
    make_term<HubMoment>(),
    // rotor_inertia.hpp
    make_term<RotorInertiaReaction>(),
    make_term<Gyroscopic>(),
    // mass_geometry.hpp
    make_term<ComOffset>(),
    make_term<PayloadMass>(),
    make_term<RotorTilt>(),
    // body_drag.hpp
    make_term<ParasiticDrag>(),
    make_term<DragIsotropy>(),
    make_term<LinearDrag>(),
    make_term<DragCentreOffset>(),
    make_term<BodyLift>(),
    // body_moments.hpp
    make_term<BodyPitchMoment>(),
    make_term<InducedFlowMoment>(),
    make_term<SideslipYawMoment>(),
    make_term<RateDamping>(),
    make_term<QuadraticRateDamping>(),
    // outside_forces.hpp
    make_term<BodyForceBias>(),
    make_term<BodyTorqueBias>(),
    make_term<Tether>(),
    make_term<WorldForce>(),
    make_term<HeightPull>(),
    // mass_geometry.hpp: after all forces but weight
    make_term<MassDrift>(),
    // outside_forces.hpp
    make_term<GravityTilt>(),
    // slung_load.hpp: after every other force, for the string's tension follows from them
    make_term<SlungLoad>(),
    // sensors.hpp
    make_term<PoseScale>(),
    make_term<SensorMountCompliance>(),
    make_term<VibrationRectification>(),
    make_term<ImuRotation>(),
    make_term<GyroScale>(),
    make_term<AccelScale>(),
    make_term<ClockRate>(),
};

}  // namespace

std::span<const Term> all_terms() { return kTerms; }

const Term* find_term(std::string_view id) {
  for (const Term& t : kTerms) {
    if (t.info.id == id) return &t;
  }
  return nullptr;
}

std::string_view common_part(std::string_view id) {
  const Term* term = find_term(id);
  return term ? term->info.traits.common_part : std::string_view{};
}

bool TermList::add(const Term& term) {
  const std::size_t m = term.info.memory.size(), n = term.info.parameters.size() + m;
  if (size_ == kMaxTerms || parameters_ + n > kMaxTermParameters || memory_ + m > kMaxMemory) return false;
  for (std::size_t i = 0; i < size_; ++i) {
    if (terms_[i]->info.id == term.info.id) return false;
  }
  terms_[size_] = &term;
  first_[size_] = parameters_;
  first_memory_[size_] = memory_;
  ++size_;
  parameters_ += n;
  memory_ += m;
  return true;
}

std::size_t TermList::term_of(std::size_t flat) const {
  std::size_t i = size_;
  while (i > 0 && first_[i - 1] > flat) --i;
  return i - 1;
}

bool TermList::is_start(std::size_t flat) const { return flat >= first_start(term_of(flat)); }

double TermList::start_u(std::size_t flat) const {
  const std::size_t i = term_of(flat);
  return terms_[i]->info.memory[flat - first_start(i)].start_u;
}

const TermParameter& TermList::parameter(std::size_t flat) const {
  const std::size_t i = term_of(flat);
  const TermInfo& info = terms_[i]->info;
  return is_start(flat) ? info.memory[flat - first_start(i)].start : info.parameters[flat - first_[i]];
}

}  // namespace rotorloop::host
