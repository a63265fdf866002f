// What a flight can determine, whatever the vehicle: how much it turned, flew and climbed, and which parameters that could determine.
// No vehicle file is needed; judged are the streams and the excitation, not the fit.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "bench/sysid/log/check/checked_flight.hpp"
#include "bench/sysid/log/flight_record.hpp"

namespace rotorloop::log {

// Where rates follow the rotors and little else: below, drag and inflow turn the vehicle as much; above, vibration and noise do.
inline constexpr double kTurningLow_hz = 2.0, kTurningHigh_hz = 15.0;

struct FlightContent {
  double seconds = 0.0;                                 // of the segments that were judged
  std::optional<Eigen::Vector3d> turning_rad_s;         // rms of roll, pitch and yaw rate between kTurningLow_hz and kTurningHigh_hz
  std::optional<double> speed_rms_m_s, speed_most_m_s;  // horizontal; most: 99 % of the time below
  std::optional<TimeRange> climb_m_s;                   // 1 % of the time below, 1 % above
  std::optional<double> climb_rms_m_s;
  std::optional<TimeRange> thrust_m_s2;  // specific force along the thrust axis, likewise 1 % and 99 %
};

// `segments`: of the checks; empty: all of the flight.
FlightContent flight_content(const FlightRecord& flight, const std::vector<TimeRange>& segments = {});

enum class Outlook { none, little, enough };
struct ParameterOutlook {
  std::string parameter;  // "I_xx", "k_2", …
  Outlook outlook = Outlook::none;
  std::string because;  // with figures and units
};
// Which parameters of the vehicle file `identify` could find in this flight, always in the same order.
std::vector<ParameterOutlook> parameter_outlook(const FlightRecord& flight, const FlightContent& content);
// Of several flights together: for each parameter that of the flight that tells most.
std::vector<ParameterOutlook> best_of(const std::vector<std::vector<ParameterOutlook>>& flights);

}  // namespace rotorloop::log
