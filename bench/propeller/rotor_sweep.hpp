// Runs of a rotor through climb, descent and edgewise flow at constant speed: the points behind every curve of the rotor's page.
#pragma once
#include <vector>

#include "bench/propeller/rotor_coefficients.hpp"
#include "sim/rotor/bem.hpp"

namespace rotorloop::propeller {

struct SweepPoint {
  sim::RotorCondition condition;
  sim::RotorLoads loads;
  RotorCoefficients coefficients;
};

SweepPoint rotor_point(const sim::Rotor& rotor, const sim::RotorCondition& condition);  // from a cold start

// Rotor speed, spin, density of `base` are kept; its velocities are replaced.

// Cold starts: climb from hover in equal steps of J up to and including the first point without thrust, at most J = kMostAdvance.
constexpr double kMostAdvance = 3.0;
std::vector<SweepPoint> advance_sweep(const sim::Rotor& rotor, const sim::RotorCondition& base, double step = 0.02);

// Cold starts: flow along +x at mu from 0 to mu_most; the velocity relative to the air points `climb_angle_rad` above the disk plane.
std::vector<SweepPoint> edgewise_sweep(const sim::Rotor& rotor, const sim::RotorCondition& base, double climb_angle_rad, double mu_most,
                                       int points = 41);

// Axial flow, walked from the first climb speed to the second (descent < 0): each point starts from the one before, as in flight. In
// fast descent stalled annuli have more than one balance (decision 0021), so that the two directions may end in different loads.
std::vector<SweepPoint> climb_sweep(const sim::Rotor& rotor, const sim::RotorCondition& base, double from_m_s, double to_m_s,
                                    int points = 241);

// Mean induced velocity of momentum theory for a thrust: in hover and climb, and in the windmill state below twice hover's induced
// velocity downwards. Not-a-number between, where the theory has no answer or one without meaning, and for thrust <= 0.
double momentum_theory_induced_m_s(double thrust_N, double climb_m_s, double density_kg_m3, double disk_area_m2);

}  // namespace rotorloop::propeller
