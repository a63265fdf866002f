// What is wrong with a log, reported before any fit: a parameter fitted through a dead speed sensor or a wrong unit looks like physics.
// check_flight judges a flight by physics that needs no fitted parameter (a hovering vehicle carries its weight, attitude and gyro
// show one rotation, position and tilt one acceleration), names each fault with its time range, takes out what can be taken out,
// and refuses what cannot. Trusted of the vehicle: mass, hubs, reaction signs, rotor radius, density. Never its thrust, drag or inertia.
#pragma once
#include <string>

#include "bench/sysid/log/check/checked_flight.hpp"
#include "bench/sysid/log/flight_record.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::log {

CheckedFlight check_flight(const FlightRecord& record, const host::VehicleModel& vehicle, const CheckLimits& limits = {});

// Of a vehicle that nobody has described: four rotors in the order of FlightRecord. Two checks are left out, for they need sizes:
// the unit of the rotor speeds (mass and rotor radius) and a rotor whose reading fails for a while (arms).
CheckedFlight check_flight(const FlightRecord& record, const CheckLimits& limits = {});

// One line per finding under a heading; the refusal, if any, last.
std::string findings_table(const CheckedFlight& checked);
// {"flight", "segments": [[from_s, to_s]], "offsets": [...], "findings": [...], "refusal": null or {...}}
std::string findings_json(const CheckedFlight& checked);

}  // namespace rotorloop::log
