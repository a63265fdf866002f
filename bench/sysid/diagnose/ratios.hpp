// Ratios that flights determine where the figures themselves are unobservable together. Yaw, say, determines the inertia of rotors over
// that of the vehicle: with both larger by a tenth, and the drag torque of rotors too, it turns just the same.
#pragma once
#include <string>
#include <vector>

#include "bench/sysid/diagnose/verdict.hpp"
#include "bench/sysid/estimate/estimator.hpp"

namespace rotorloop::diagnose {

// Of a free shared parameter to the scales of the vehicle (mass, inertia, coefficients of torque and thrust) that the same fit left free,
// by the joint covariance: those known at least twice as well, relative to their size, as the parameter. The best known first.
std::vector<NamedValue> well_determined_ratios(const estimate::Fit& fit, int parameter, const host::TermList& terms);

// "J_r_kg_m2 / I_zz = 0.0011 ± 3e-05, …"; empty for none.
std::string ratios_text(const std::vector<NamedValue>& ratios);

}  // namespace rotorloop::diagnose
