// A virtual wind tunnel for the whole vehicle: holds the plant in a steady stream, sets its rotor speeds, and reads the
// balance. Knows the plant and no model; the table it fills is all that calibration gets.
#pragma once
#include <array>
#include <vector>

#include "bench/hil/calibrate/load_point.hpp"
#include "sim/plant/assemble.hpp"

namespace rotorloop::calibrate {

class Tunnel {
 public:
  Tunnel(const sim::PlantFile& plant, const sim::SharedRotors& rotors) : plant_(plant), rotors_(rotors) {}

  // Loads at one setting.
  LoadPoint measure(const Eigen::Vector3d& v_B_m_s, const std::array<double, 4>& omega_rad_s) const;
  // The airframe alone, propellers taken off: stopped blades would add drag that spinning ones do not have.
  LoadPoint measure_bare(const Eigen::Vector3d& v_B_m_s) const;
  // The same with four equal speeds, turned up until the balance shows `force_z_N` (as an operator would).
  // Throws Error (data quality) when no speed up to `max_omega_rad_s` gives it.
  LoadPoint measure_at_force(const Eigen::Vector3d& v_B_m_s, double force_z_N, double max_omega_rad_s) const;

  // Tip speed of 159 m/s (Mach 0.47), where the smallest rotors that fly still lift several times their share.
  double highest_omega_rad_s() const;

 private:
  LoadPoint balance(const Eigen::Vector3d& v_B_m_s, const std::array<double, 4>& omega_rad_s, bool propellers) const;

  const sim::PlantFile& plant_;
  const sim::SharedRotors& rotors_;
};

// What a planned flight would meet: body-frame velocity and force along z at one instant.
struct FlightState {
  Eigen::Vector3d v_B_m_s = Eigen::Vector3d::Zero();
  double force_z_N = 0.0;
};

// The test programme: airframe drag without propellers along each axis, static thrust and torque, unequal pairs for c_q,
// and the states of the planned flights.
std::vector<LoadPoint> run_programme(const Tunnel& tunnel, const std::vector<FlightState>& planned, double weight_N);

}  // namespace rotorloop::calibrate
