// Loads of one rotor as the dimensionless numbers of propeller data sheets and wind tunnel reports, so that curves of different
// sizes, speeds and densities can be laid over each other. n = omega / 2 pi (revolutions per second), D diameter.
// Definitions as in W. D. Deters, G. K. Ananda, M. S. Selig, AIAA 2014-2151 (C_T, C_P, J, eta); the in-plane force and the
// moments are made dimensionless alike. Mind helicopter books, which use rho A (omega R)^2: their C_T is 4 / pi^3 = 0.129 of this.
#pragma once
#include "sim/rotor/rotor_loads.hpp"

namespace rotorloop::propeller {

struct RotorCoefficients {
  double c_t = 0.0;      // T / (rho n^2 D^4)
  double c_p = 0.0;      // P / (rho n^3 D^5), P = shaft torque * omega
  double c_h = 0.0;      // in-plane force against the edgewise velocity / (rho n^2 D^4): a drag when > 0
  double c_pitch = 0.0;  // moment that lowers the upstream edge of the disk / (rho n^2 D^5)
  double c_roll = 0.0;   // moment that raises the edge to the left of the edgewise velocity / (rho n^2 D^5)
  double eta = 0.0;      // propulsive efficiency J C_T / C_P; not-a-number unless it climbs with thrust and power above 0
};

// The edgewise direction is that of the hub's in-plane velocity relative to the air, +x where there is none. omega, density > 0.
RotorCoefficients rotor_coefficients(const sim::RotorLoads& loads, const sim::RotorCondition& condition, double radius_m);

double advance_ratio(const sim::RotorCondition& condition, double radius_m);           // J = climb speed / (n D)
double edgewise_advance_ratio(const sim::RotorCondition& condition, double radius_m);  // mu = edgewise speed / (omega R)

// Share of the shaft power that a hovering rotor with even, loss-free inflow would need for this thrust; disk area pi R^2.
double figure_of_merit(const sim::RotorLoads& hover_loads, const sim::RotorCondition& condition, double radius_m);

}  // namespace rotorloop::propeller
