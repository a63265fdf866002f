// How much larger a rotor's in-plane force is on a vehicle than alone (effect rotor_body_interference, factor k_H), fixed on one
// vehicle and tested on another.
// Fixed on: Parrot Bebop in free flight in a wind tunnel, 0 to 14 m/s (Sun, de Visser, Chu, Quadrotor Gray-box Model Identification
// from High-Speed Flight Data, TU Delft): F_x = rho N pi R^2 (R W)^2 C_x(mu_x, mu_z), a polynomial with axes forward and down. The
// rotor alone is the blade-element model of a three-blade rotor of that radius; its blades are not published, so the shipped plan
// form stands for them, its pitch set so that hover comes out at the speed that the paper names.
// Tested on: the reference quadrotor at 8.5 m/s, which the Bebop's k_H has never seen.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "bench/propeller/text_file.hpp"
#include "sim/rotor/blade.hpp"

namespace rotorloop::propeller {

// C_x(mu_x, mu_z) for small sideslip. mu: speed through the air over tip speed; x forward, z down.
struct CxPolynomial {
  struct Term {
    double theta;
    int power_x, power_z;
  };
  std::vector<Term> terms;
  double operator()(double mu_x, double mu_z) const;
};
// Rows "Cx,range,term,theta,nrms" of a comma-separated file; rows of other coefficients are passed over. Throws Error.
CxPolynomial read_cx_polynomial(const TextFile& file);

// A vehicle's rotor in hover.
struct HoverRotor {
  double thrust_N, omega_rad_s, density_kg_m3;
};
// Bebop: 0.389 kg; rotor speed 7000 rpm, as the paper explains its vibration peak near 120 Hz.
inline constexpr double kBebopMass_kg = 0.389, kBebopRadius_m = 0.064, kBebopHover_rpm = 7000.0;
inline constexpr double kMostAdvance = 0.2;  // slopes are least squares through zero over mu = 0.02, 0.04 … this

// Slopes -dC/dmu per vehicle, F = rho N pi R^2 (R W)^2 C: of the polynomial, and of isolated rotors. mu_z = tilt * mu_x.
double measured_slope(const CxPolynomial& c, double tilt = 0.0, double most_advance = kMostAdvance);
double isolated_slope(const sim::Blade& blade, const HoverRotor& hover, double tilt = 0.0, double most_advance = kMostAdvance);

struct Variation {
  std::string what;
  double k_H;
};
struct InPlaneForce {
  double bebop_pitch_ratio = 0.0;                     // of the shipped blade's local pitch, scaled
  double bebop_figure_of_merit = 0.0;                 // of that rotor in hover: whether it is credible
  double bebop_measured = 0.0, bebop_isolated = 0.0;  // slopes
  double k_H = 0.0, k_H_u = 0.0;                      // u: root sum of squares of the largest shift of each kind of variation
  std::vector<Variation> variations;
  std::vector<std::string> impossible;  // variations whose rotor cannot carry the Bebop at its hover speed
  // Four rotors of the reference quadrotor in hover, level at 8.5 m/s.
  double reference_isolated_N = 0.0;
  double paper_N = 0.0;         // c_dh T v of the paper's Table I, an independent measurement
  double bebop_scaled_N = 0.0;  // the Bebop's slope at this radius and tip speed; not independent of k_H
};
// Throws Error. `blade_file`: vehicles/blades/triblade_5in.toml.
InPlaneForce validate_in_plane_force(const std::filesystem::path& data_folder, const std::filesystem::path& blade_file);
constexpr double kInPlaneLimit = 0.15;  // of paper_N, with the Bebop's k_H
bool within_limits(const InPlaneForce& result);
std::vector<std::string> report_lines(const InPlaneForce& result);

}  // namespace rotorloop::propeller
