// Force and torque on the body after the paper's eq. (1)-(5), open to added terms; load_state.hpp has the quantities and scalars.
#pragma once
#include "host/effects/load_state.hpp"

namespace rotorloop::host {

LoadGeometry load_geometry(const VehicleModel& model);
LoadParameters<double> load_parameters(const VehicleModel& model);

template <class S>
class TermSet;  // term.hpp: the added terms of a model, with their parameters as S

// Solves eq. (1)-(2) for one rotor in S: the value by host/vehicle's solver, its derivatives by the implicit function theorem.
// `through_m_s` becomes the flow through the disk, v_z + v_i.
template <class S>
S rotor_thrust(const LoadParameters<S>& p, const LoadGeometry& g, const S& omega_rad_s, const Vec3<S>& v_air_B_m_s, S& through_m_s);

// The whole load. `terms` may be nullptr: the paper's model alone.
template <class S>
void loads(LoadState<S>& state, const TermSet<S>* terms);

// The parts of a reading that terms add. For double, PlaceDual, ExtraDual.
template <class S>
void readings(ReadingState<S>& state, const TermSet<S>& terms);

}  // namespace rotorloop::host
