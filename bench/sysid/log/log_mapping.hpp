// How a foreign log's columns become this house's streams: which column, in which unit and axes, which rotor is which. A mapping is
// data (TOML, docs/files.md "Mapping file"), so that a new kind of log needs no code. One vocabulary serves CSV and ULog.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bench/sysid/log/log_units.hpp"

namespace rotorloop::log {

enum class LogKind : std::uint8_t { csv, ulog, dataflash };
std::string_view name(LogKind kind);  // for messages: "CSV", "ULog", "DataFlash"
enum class LogQuantity : std::uint8_t { pose, position, velocity, gyro, accel, rotor_speed, motor_command, battery, extra, attitude };
std::string_view name(LogQuantity quantity);

struct MappedTime {
  std::string column;
  std::string nanoseconds;  // a second column that is added ("nsecs" of ROS beside "secs"); empty without one
  double s_per_unit = 1.0;
  std::string where;  // "file:line" in the mapping, for messages
};

// One table of numbers: the log itself, a CSV file beside it, a ULog topic, or a DataFlash message.
struct MappedSource {
  std::string name;    // as [[stream]] says in `from`; "" is the log itself
  std::string suffix;  // CSV: file whose name is the log's stem and this
  std::string topic;   // ULog; the message of a DataFlash log
  int multi_id = 0;    // its instance
  MappedTime time;
  std::string where;
};

// A column, or a constant in its place ("= 0.5").
struct MappedColumn {
  std::string name;
  std::optional<double> constant;
};

struct MappedCondition {
  std::string column;
  double value = 0.0;
};

// Of the world and of the body: ours (x as it comes, z up), half a turn about x from them (NED, FRD), or y up and z where our -y is, as
// Motive, Unity and computer graphics have both.
enum class LogAxes : std::uint8_t { z_up, z_down, y_up };

enum class BlankPolicy : std::uint8_t { skip, refuse };

struct MappedStream {
  LogQuantity quantity = LogQuantity::extra;
  std::string extra_name;               // "payload_x[m]"
  std::size_t source = 0;               // index into LogMapping::sources
  std::vector<MappedColumn> columns;    // 1, 3 (x y z) or 4 (our rotors 1 to 4); none of an attitude as quaternion
  std::vector<double> to_si;            // for each column, of an attitude w x y z: sign, unit, scale, pole pairs
  double zero = 0.0;                    // motor commands: the value that stands for 0 …
  double full_scale = 1.0;              // … and for 1
  std::vector<std::string> quaternion;  // w x y z; empty when not given
  std::string euler;           // "zyx": intrinsic order of the turns about the axes, by the angles in `columns`; "vector"; else empty
  bool world_to_body = false;  // what the attitude turns
  LogAxes world = LogAxes::z_up, body = LogAxes::z_up;
  bool in_world_axes = false;    // the vector's axes; else the body's
  bool gravity_removed = false;  // accel is acceleration, not specific force
  bool drop_held = false;
  BlankPolicy blank = BlankPolicy::skip;
  std::optional<double> missing_value;
  std::optional<MappedCondition> only_if;
  double time_offset_s = 0.0;  // added to the stamps
  bool optional = false;
  std::string where;          // "file:line" of the entry
  std::string label() const;  // "rotor_speed", "extra payload_x[m]"
};

struct LogMapping {
  std::filesystem::path path;
  std::string name;
  LogKind kind = LogKind::csv;
  char separator = ',';
  bool start_at_zero = false;
  std::vector<MappedSource> sources;
  std::vector<MappedStream> streams;  // several of one quantity are alternatives, the best first
};

// Both throw Error (ExitCode::usage) with file, line, value, range and remedy.
LogMapping read_log_mapping(const std::filesystem::path& path);
LogMapping parse_log_mapping(std::string_view text, const std::filesystem::path& name_for_errors);

}  // namespace rotorloop::log
