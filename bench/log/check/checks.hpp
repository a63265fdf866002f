// What is wrong with a log, told before any fit: a parameter fitted through a dead speed sensor or a wrong unit looks like physics.
// check_flight judges a flight by physics that needs no fitted parameter (a hovering vehicle carries its weight, attitude and gyro
// show one rotation, position and tilt one acceleration), names each fault with its time range, takes out what can be taken out,
// and refuses what cannot. Trusted of the vehicle: mass, hubs, reaction signs, rotor radius, density. Never its thrust, drag or inertia.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "bench/log/flight_record.hpp"
#include "bench/log/check/signal.hpp"
#include "host/base/error.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::log {

// `stream` shows at its stamp what `against` showed `late_s` earlier: positive means that its stamps are late.
struct StreamOffset {
  std::string stream, against;
  double late_s = 0.0;
  double u_s = 0.0;          // standard uncertainty, from leaving out one tenth of the flight at a time
  double correlation = 0.0;  // of the two, at this offset
};

struct StreamOffsets {
  std::vector<StreamOffset> pairs;
  const StreamOffset* find(const std::string& stream, const std::string& against) const;
  // Through at most one stream between, u added in squares; empty when the flight does not tell.
  std::optional<StreamOffset> between(const std::string& stream, const std::string& against) const;
};

struct CheckedFlight {
  FlightRecord flight;              // only what may be fitted: samples in `segments`, without those of `exclude` findings
  std::vector<TimeRange> segments;  // in time order; no step of a fit may cross from one to the next
  StreamOffsets offsets;
  std::vector<LogFinding> findings;
  std::optional<ErrorText> refusal;  // then `flight` and `segments` are of no use

  void throw_if_refused() const;  // Error with ExitCode::data_quality
};

struct CheckLimits {
  double shortest_segment_s = 1.0;
  double longest_rotor_gap_s = 0.06;  // rotor speeds are not interpolated across more: two time constants of a small motor
  double longest_lag_s = 0.15;        // searched for offsets, either way
};

CheckedFlight check_flight(const FlightRecord& record, const host::VehicleModel& vehicle, const CheckLimits& limits = {});

// One line per finding under a heading; the refusal, if any, last.
std::string findings_table(const CheckedFlight& checked);
// {"flight", "segments": [[from_s, to_s]], "offsets": [...], "findings": [...], "refusal": null or {...}}
std::string findings_json(const CheckedFlight& checked);

// Names of streams in findings and offsets.
namespace stream_name {
inline constexpr const char* pose = "pose";
inline constexpr const char* position = "position";
inline constexpr const char* velocity = "velocity";
inline constexpr const char* gyro = "gyro";
inline constexpr const char* accel = "accelerometer";
inline constexpr const char* rotors = "rotor speeds";
inline constexpr const char* command = "motor command";
inline constexpr const char* battery = "battery";
inline constexpr const char* flight = "flight";  // of all streams: on the ground, nothing left
}  // namespace stream_name

}  // namespace rotorloop::log
