// `rotorloop diagnose` for logs that hold motor commands and no rotor speeds: nothing there can be fitted as a wrench, but hover demand
// against reference flights tells a rotor, and thrust over voltage tells flights apart.
#pragma once
#include <vector>

#include "bench/identify/flight_record.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::cli {

// True for a flight that only this can judge: motor commands, no rotor speeds.
bool has_commands_only(const bench::FlightRecord& flight);

// Prints to stdout. `reference`: flights of the same vehicle without a defect; with fewer than two of them only the flights'
// differences are judged, for which three flights with accelerometer and battery are needed. Throws Error when neither can be done.
void diagnose_command_flights(const std::vector<bench::FlightRecord>& flights, const std::vector<bench::FlightRecord>& reference,
                              const host::VehicleModel& vehicle);

}  // namespace rotorloop::cli
