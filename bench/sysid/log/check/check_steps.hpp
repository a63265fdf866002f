// The steps of check_flight, each in a file of its own, and what they hand on. Private to the checks.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "bench/sysid/log/check/checked_flight.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::log {

struct CheckState {
  FlightRecord record;  // as far as cleaned
  const host::VehicleModel& vehicle;
  const CheckLimits& limits;
  CheckedFlight result;
  std::vector<TimeRange> unusable = {};  // see lose and split
  std::vector<TimeRange> set_back = {};  // of `unusable`: where the clock was set back; what jumps across is no fault of its stream

  void note(std::string stream, std::string what, TimeRange range);
  void exclude(std::string stream, std::string what, TimeRange range);    // a fault of this stream
  void leave_out(std::string stream, std::string what, TimeRange range);  // excluded too, and nobody's fault
  // No fit may use this time, its end points included, or may step across it.
  void lose(TimeRange range) { unusable.push_back({range.from_s - 1e-6, range.to_s + 1e-6}); }
  // The end points are good, but no step of a fit may join them.
  void split(TimeRange range) { unusable.push_back({range.from_s + 1e-6, range.to_s - 1e-6}); }
  // The first refusal is the one that is reported; later ones are findings only.
  void refuse(std::string stream, std::string what, TimeRange range, std::string likely, std::string remedy);
  bool clock_set_back(double from_s, double to_s) const;  // within this time, or around it
  bool refused() const { return result.refusal.has_value(); }
  TimeRange span() const;  // of all streams
};

// Everything that is compared with something else, on one grid.
struct FlightGrid {
  Grid grid;
  bool has_attitude = false, has_position = false, has_velocity = false, has_gyro = false, has_accel = false, has_rotors = false;
  std::vector<Eigen::Quaterniond> q_WB;
  std::vector<Eigen::Vector3d> pose_rate_B_rad_s;    // from the attitude alone
  std::vector<Eigen::Vector3d> position_acc_W_m_s2;  // of the centre of mass when there is attitude
  std::vector<Eigen::Vector3d> position_rate_W_m_s;
  std::vector<Eigen::Vector3d> velocity_W_m_s, gyro_B_rad_s, accel_B_m_s2;
  std::vector<RotorValues> omega_rad_s;
  std::vector<char> valid;  // all streams that are there have samples around, and nothing said so far makes the time unusable
};

// Grid of 400 Hz, everything low-passed with the same zero-phase filter. `corner_hz` well below half the slowest stream's rate.
FlightGrid make_grid(const CheckState& s, double corner_hz);
// Rotor speeds and what shows the vehicle's rates, alone: gaps of other streams must not take away from what these two show.
FlightRecord turning_streams(const FlightRecord& r);

void check_stamps(CheckState& s);       // order, duplicates, gaps, values that are no numbers
void check_clock(CheckState& s);        // stamps far from all others, unit of time; a step of check_stamps
void check_inputs(CheckState& s);       // motors that ran, and a rate that a fit can use
void check_bounds(CheckState& s);       // values that no flight shows, negative speeds
void check_values(CheckState& s);       // spikes, frozen channels, saturation, within one stream
void check_bursts(CheckState& s);       // poses that leave the gyro's turning and come back; a step of check_values
void check_inertial(CheckState& s);     // accelerometer's unit and sign, gyro's unit, axes and handedness, quaternion order
void check_motion(CheckState& s);       // position, velocity and tilt agree on one acceleration
void check_rotors(CheckState& s);       // units by hover, dead or scaled rotors, on the ground
void check_offsets(CheckState& s);      // stream against stream
void check_calibration(CheckState& s);  // scales and turn of gyro and accelerometer against the poses, at the offsets found

}  // namespace rotorloop::log
