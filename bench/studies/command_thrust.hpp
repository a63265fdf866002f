// Thrust from motor command and battery voltage, where no rotor speed was logged: one map for several flights, and what makes flights
// of one vehicle differ. A battery, a motor that is warm, a heavier load all move the whole flight by one factor.
#pragma once
#include <string>
#include <vector>

#include "bench/sysid/diagnose/verdict.hpp"
#include "bench/sysid/log/flight_record.hpp"
#include "host/base/block_fit.hpp"

namespace rotorloop::studies {

// Samples in flight: Σ u and Σ u² over the rotors of u = command times battery voltage, after the motors' lag, beside specific force
// along body z. Frames and units as in FlightRecord.
struct CommandThrust {
  std::string flight;
  std::vector<double> t_s, u_V, u2_V2, force_m_s2, battery_V;
};

struct CommandThrustOptions {
  double lag_s = 0.05;        // motors and propellers of a 27 g quadrotor, first order
  double airborne_m = 0.4;    // height above the lowest of the flight
  double largest_m_s2 = 6.0;  // distance of specific force from gravity: beyond it the accelerometer hit something
  std::uint64_t seed = 1;
};

CommandThrust command_thrust(const log::FlightRecord& flight, const CommandThrustOptions& options = {});

// What differs from flight to flight, as one number per flight.
struct FlightDifference {
  std::string id;  // "battery_gain": a factor, be it of battery, wiring or a warm motor; "force_offset": of the accelerometer; "none"
  std::string meaning;
  std::vector<double> per_flight, u;  // each flight's number
  double rms_m_s2 = 0.0, r2 = 0.0;    // of all samples
  double held_out_rms_m_s2 = 0.0;     // second halves, with the flight's number from its first half and the map from the other flights
  RmsReduction fall;                  // of that rms against "none", 95 % over stretches of 5 s
  std::string ruled_out_by;           // empty: it explains why flights differ
};

struct CommandThrustDiagnosis {
  std::vector<std::string> flights;
  std::vector<double> own_r2;  // of a map of its own for each flight
  FlightDifference none;
  std::vector<FlightDifference> differences;  // best first
  diagnose::DiagnosisVerdict verdict = diagnose::DiagnosisVerdict::clean;
  std::vector<std::string> named;  // one, or a class
};

// Throws Error (data_quality) for fewer than three flights with command, battery, accelerometer and height.
CommandThrustDiagnosis diagnose_command_thrust(const std::vector<log::FlightRecord>& flights, const CommandThrustOptions& options = {});
std::string command_thrust_text(const CommandThrustDiagnosis& d);

}  // namespace rotorloop::studies
