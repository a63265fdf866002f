#include "bench/sysid/log/own_log.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <functional>
#include <set>

#include "bench/sysid/log/flight_columns.hpp"
#include "bench/sysid/log/log_reader.hpp"
#include "bench/sysid/log/merged_rows.hpp"
#include "host/base/error.hpp"

namespace rotorloop::log {
namespace {

constexpr std::array kXyz{"_x", "_y", "_z"};
constexpr std::array kWxyz{"_w", "_x", "_y", "_z"};
constexpr std::array kRotorEnds{"_1", "_2", "_3", "_4"};

template <std::size_t N>
std::array<std::string, N> names(const std::string& stem, const std::array<const char*, N>& ends, const std::string& unit) {
  std::array<std::string, N> out;
  for (std::size_t i = 0; i < N; ++i) out[i] = stem + ends[i] + "[" + unit + "]";
  return out;
}

// Names of all columns that flight.csv may have in a run folder.
struct ColumnNames {
  std::set<std::string> all;
  void one(const char* n, const char* u, int, double) { all.insert(fmt::format("{}[{}]", n, u)); }
  template <class Ends>
  void many(const char* n, const char* u, const Ends& ends) {
    for (const auto* e : ends) all.insert(fmt::format("{}{}[{}]", n, e, u));
  }
  void xyz(const char* n, const char* u, int, const Cells3&) { many(n, u, kXyz); }
  void wxyz(const char* n, const char* u, int, const Cells4&) { many(n, u, kWxyz); }
  void rotors(const char* n, const char* u, int, const Cells4&) { many(n, u, kRotorEnds); }
};
std::set<std::string> flight_column_names() {
  ColumnNames names;
  const FlightRow row;
  visit_flight_columns(row, names);
  return names.all;
}

// N columns of the log, all or none of which it has.
template <std::size_t N>
struct Group {
  std::array<const std::vector<double>*, N> columns{};

  Group(const LogTable& log, const std::array<std::string, N>& wanted) {
    std::size_t found = 0;
    for (const auto& n : wanted) found += log.has(n) ? 1u : 0u;
    if (found == 0) return;
    for (std::size_t i = 0; i < N; ++i) columns[i] = &log.column(wanted[i]);  // names the one that is missing
  }
  explicit operator bool() const { return columns[0] != nullptr; }
  std::size_t readings(std::size_t row) const {
    std::size_t n = 0;
    for (const auto* c : columns) n += c && !std::isnan((*c)[row]) ? 1u : 0u;
    return n;
  }
  std::array<double, N> at(std::size_t row) const {
    std::array<double, N> v{};
    for (std::size_t i = 0; i < N; ++i) v[i] = (*columns[i])[row];
    return v;
  }
};

Eigen::Vector3d vector(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

void read_vectors(const LogTable& log, const char* stem, const char* unit, const std::vector<double>& t, Stream<Eigen::Vector3d>& out) {
  const Group<3> g(log, names(stem, kXyz, unit));
  for (std::size_t i = 0; g && i < log.rows; ++i)
    if (g.readings(i) == 3) out.add(t[i], vector(g.at(i)));
}

void read_rotors(const LogTable& log, const char* stem, const char* unit, const std::vector<double>& t, Stream<RotorValues>& out) {
  const Group<4> g(log, names(stem, kRotorEnds, unit));
  for (std::size_t i = 0; g && i < log.rows; ++i)
    if (g.readings(i) > 0) out.add(t[i], g.at(i));
}

void read_scalar(const LogTable& log, const std::string& column, const std::vector<double>& t, Stream<double>& out) {
  const auto& v = log.column(column);
  for (std::size_t i = 0; i < log.rows; ++i)
    if (!std::isnan(v[i])) out.add(t[i], v[i]);
}

void read_pose(const LogTable& log, const std::vector<double>& t, FlightRecord& f) {
  const Group<3> p(log, names("p", kXyz, "m"));
  const Group<4> q(log, names("q", kWxyz, "1"));
  for (std::size_t i = 0; p && i < log.rows; ++i) {
    if (p.readings(i) != 3) continue;
    const Eigen::Vector3d p_W = vector(p.at(i));
    if (!q || q.readings(i) != 4) {
      f.position_W_m.add(t[i], p_W);
      continue;
    }
    const auto w = q.at(i);
    const Eigen::Quaterniond q_WS(w[0], w[1], w[2], w[3]);
    if (!(q_WS.norm() > 0.9 && q_WS.norm() < 1.1))
      throw Error({log.path.generic_string(), fmt::format("q at t = {} s has norm {:.3g}, expected 1", t[i], q_WS.norm()),
                   "the file was edited", "fly the run again"},
                  ExitCode::data_quality);
    f.pose.add(t[i], {p_W, q_WS.normalized()});
  }
}

bool is_extra(const std::string& name, const std::set<std::string>& flight_columns) {
  if (name.starts_with("omega_cmd_") || name.starts_with("i_q_") || name == "bus[A]") return true;
  return !flight_columns.contains(name) && !name.starts_with("command_") && !name.starts_with("true_");
}

// Shortest text that reads back to the same number; nothing for not-a-number.
void put(std::string& out, double v) {
  if (std::isnan(v)) return;
  std::array<char, 32> text;
  out.append(text.data(), std::to_chars(text.data(), text.data() + text.size(), v).ptr);
}

}  // namespace

FlightRecord read_own_log(const std::filesystem::path& path, std::vector<LogFinding>* findings) {
  const LogTable log = read_log(path, {}, CutEnd::left_out);
  if (log.has("true_p_x[m]"))
    throw Error({path.generic_string(), "is a truth log", "", "give the flight.csv beside it: identification never reads truth"});
  if (findings)
    for (const std::string& note : log.notes) findings->push_back({"log", note, 0.0, 0.0, FindingAction::note});
  FlightRecord f;
  const auto& t = log.column("t[s]");
  for (std::size_t i = 0; i < log.rows; ++i)
    if (std::isnan(t[i]))
      throw Error({path.generic_string(), fmt::format("row {} has no t[s]", i + 1), "the file was edited", "fly the run again"},
                  ExitCode::data_quality);
  std::vector<double> pose_t = t;
  if (log.has("pose_t[s]"))
    for (std::size_t i = 0; i < log.rows; ++i)
      if (const double measured = log.column("pose_t[s]")[i]; !std::isnan(measured)) pose_t[i] = measured;
  read_pose(log, pose_t, f);
  read_vectors(log, "v", "m/s", pose_t, f.velocity_W_m_s);
  read_vectors(log, "gyro", "rad/s", t, f.gyro_B_rad_s);
  read_vectors(log, "accel", "m/s2", t, f.accel_B_m_s2);
  read_rotors(log, "omega", "rad/s", t, f.rotor_omega_rad_s);
  read_rotors(log, "command", "1", t, f.motor_command);
  if (log.has("bus[V]")) read_scalar(log, "bus[V]", t, f.battery_V);
  const auto known = flight_column_names();
  for (const auto& name : log.names)
    if (is_extra(name, known)) {
      Stream<double> s;
      read_scalar(log, name, t, s);
      if (!s.empty()) f.extra.emplace(name, std::move(s));
    }
  return f;
}

namespace {

// One group of columns for each stream: its names, its stamps, and what it writes (without the commas around it).
struct Column {
  std::vector<std::string> names;
  const std::vector<double>* t;
  std::function<std::vector<double>(std::size_t)> cells;
};

std::vector<Column> columns_of(const FlightRecord& f) {
  std::vector<Column> groups;
  const auto add = [&](const auto& stream, auto names, auto cells) {
    if (stream.empty()) return;
    groups.push_back(
        {{names.begin(), names.end()}, &stream.t_s, [&stream, cells](std::size_t i) { return cells(stream.value[i], stream.t_s[i]); }});
  };
  const auto xyz = [](const Eigen::Vector3d& v, double) { return std::vector<double>{v.x(), v.y(), v.z()}; };
  const auto four = [](const RotorValues& v, double) { return std::vector<double>(v.begin(), v.end()); };
  const auto one = [](double v, double) { return std::vector<double>{v}; };
  const auto p = names("p", kXyz, "m");
  const auto q = names("q", kWxyz, "1");
  const auto pose = [](const PoseReading& r, double t) {
    return std::vector<double>{t, r.p_W_m.x(), r.p_W_m.y(), r.p_W_m.z(), r.q_WS.w(), r.q_WS.x(), r.q_WS.y(), r.q_WS.z()};
  };
  std::vector<std::string> pose_names{"pose_t[s]"};
  pose_names.insert(pose_names.end(), p.begin(), p.end());
  pose_names.insert(pose_names.end(), q.begin(), q.end());
  add(f.pose, pose_names, pose);
  if (f.pose.empty()) add(f.position_W_m, p, xyz);
  add(f.velocity_W_m_s, names("v", kXyz, "m/s"), xyz);
  add(f.rotor_omega_rad_s, names("omega", kRotorEnds, "rad/s"), four);
  add(f.motor_command, names("command", kRotorEnds, "1"), four);
  add(f.battery_V, std::array<std::string, 1>{"bus[V]"}, one);
  add(f.gyro_B_rad_s, names("gyro", kXyz, "rad/s"), xyz);
  add(f.accel_B_m_s2, names("accel", kXyz, "m/s2"), xyz);
  const auto taken = flight_column_names();
  for (const auto& [name, stream] : f.extra) {
    if (!is_extra(name, taken))
      throw Error({f.source, fmt::format("extra \"{}\" has the name of a column of the flight log", name), "",
                   "give it another name in the mapping"});
    add(stream, std::array<std::string, 1>{name}, one);
  }
  return groups;
}

}  // namespace

std::string own_log_text(const FlightRecord& f) {
  const std::vector<Column> groups = columns_of(f);
  std::string text = "# rotorloop flight log 1\n# start_utc: 1970-01-01T00:00:00Z\n# source: converted\n# flight: " + f.name + "\nt[s]";
  std::vector<const std::vector<double>*> stamps;
  for (const auto& g : groups) {
    for (const auto& n : g.names) text += "," + n;
    stamps.push_back(g.t);
  }
  text += "\n";
  for (const auto& row : merged_rows(stamps)) {
    put(text, row.t_s);
    for (std::size_t k = 0; k < groups.size(); ++k) {
      if (row.index[k] == kNoRow) {
        text.append(groups[k].names.size(), ',');
        continue;
      }
      for (const double v : groups[k].cells(row.index[k])) {
        text += ',';
        put(text, v);
      }
    }
    text += "\n";
  }
  return text;
}

}  // namespace rotorloop::log
