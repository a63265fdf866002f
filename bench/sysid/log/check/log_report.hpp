// What `rotorloop log check` says of a few logs: findings, what each flight shows, and what all of them can determine.
#pragma once
#include <string>
#include <vector>

#include "bench/sysid/log/check/checked_flight.hpp"
#include "bench/sysid/log/check/flight_content.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::log {

struct LogReport {
  FlightRecord record;  // as read
  CheckedFlight checked;
  FlightContent content;
  std::vector<ParameterOutlook> parameters;
};

// `vehicle`: nullptr where there is none.
LogReport report_log(FlightRecord record, std::vector<LogFinding> notes, const host::VehicleModel* vehicle);

std::string log_report_text(const std::vector<LogReport>& logs, bool with_vehicle);
// {"format", "with_vehicle", "flights": [{…findings_json, "content"}], "parameters": [{"parameter", "outlook", "because"}]}
std::string log_report_json(const std::vector<LogReport>& logs, bool with_vehicle);

}  // namespace rotorloop::log
