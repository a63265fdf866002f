// What the checks of a log leave: what may be fitted, what was found, and how far streams are off against each other.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "bench/sysid/log/check/signal.hpp"
#include "bench/sysid/log/flight_record.hpp"
#include "host/base/error.hpp"

namespace rotorloop::log {

// `stream` shows at its stamp what `against` showed `late_s` earlier: positive means that its stamps are late.
struct StreamOffset {
  std::string stream, against;
  double late_s = 0.0;
  double u_s = 0.0;          // standard uncertainty; see check_offsets.cpp
  double correlation = 0.0;  // of the two, at this offset
};

struct StreamOffsets {
  std::vector<StreamOffset> pairs;
  const StreamOffset* find(const std::string& stream, const std::string& against) const;
  // Through at most one stream between, u added in squares; empty when the flight does not determine it.
  std::optional<StreamOffset> between(const std::string& stream, const std::string& against) const;
};

struct CheckedFlight {
  FlightRecord flight;              // only what may be fitted: samples in `segments`, without those of `exclude` findings
  std::vector<TimeRange> segments;  // in time order; no step of a fit may cross from one to the next
  StreamOffsets offsets;
  std::vector<LogFinding> findings;
  std::optional<ErrorText> refusal;  // then `flight` and `segments` are of no use

  void throw_if_refused() const {
    if (refusal) throw Error(*refusal, ExitCode::data_quality);
  }
};

// Rotor speeds (motor commands where there are none) are not interpolated across more: two time constants of a small motor. One limit for
// the checks and for the fit, so that what the checks pass the fit can use.
inline constexpr double kLongestInputGap_s = 0.05;

struct CheckLimits {
  double shortest_segment_s = 1.0;
  double longest_rotor_gap_s = kLongestInputGap_s;
  double longest_lag_s = 0.15;  // searched for offsets, either way
};

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
