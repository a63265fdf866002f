#include "bench/sysid/log/mapped_flight.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <numeric>

#include "bench/sysid/log/stream_reader.hpp"
#include "bench/sysid/log/wrapped_clock.hpp"
#include "host/base/constants.hpp"
#include "host/base/error.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::log {
namespace {
constexpr std::string_view kAbsent = "not in this log: ";

constexpr double kNoReading = std::numeric_limits<double>::quiet_NaN();
// Logged unit quaternions are off by rounding, 1e-3 at most; what is this far off is something else.
constexpr double kQuaternionNormLow = 0.9, kQuaternionNormHigh = 1.1;

// One row of a stream as logged: its columns, and from the fifth on its quaternion.
using Reading = std::array<double, 8>;
using Sources = std::vector<std::optional<ColumnTable>>;  // as LogMapping has them

std::string source_label(const LogMapping& m, const MappedSource& s) {
  if (m.kind != LogKind::csv) return fmt::format("{} {} {}", m.kind == LogKind::ulog ? "topic" : "message", s.topic, s.multi_id);
  return s.suffix.empty() ? "the log" : "the file *" + s.suffix + " beside the log";
}

std::set<std::string> columns_of(const MappedStream& s) {
  std::set<std::string> names;
  for (const auto& c : s.columns)
    if (!c.constant) names.insert(c.name);
  names.insert(s.quaternion.begin(), s.quaternion.end());
  if (s.only_if) names.insert(s.only_if->column);
  return names;
}

// What a table that lacks a column most likely is: separated by another sign, or without a row of names.
std::optional<ErrorText> misread(const LogMapping& m, const ColumnTable& table) {
  if (m.kind != LogKind::csv || table.names.empty()) return std::nullopt;
  const auto words = [](char c) { return c == '\t' ? std::string("tab") : std::string(1, c); };
  if (table.names.size() == 1)
    for (const char other : {',', ';', '\t'})
      if (other != m.separator && table.names.front().find(other) != std::string::npos)
        return ErrorText{m.path.generic_string(),
                         fmt::format("{} has one column when separated by \"{}\": \"{}\"", table.label, words(m.separator),
                                     table.names.front().substr(0, 60)),
                         fmt::format("its columns are separated by \"{}\"", words(other)),
                         fmt::format("set separator = \"{}\" in the mapping, before its first [table]", words(other))};
  const auto is_number = [](const std::string& name) {
    double v = 0.0;
    return !name.empty() && std::from_chars(name.data(), name.data() + name.size(), v).ptr == name.data() + name.size();
  };
  if (std::all_of(table.names.begin(), table.names.end(), is_number))
    return ErrorText{table.label,
                     fmt::format("its first row holds numbers where names of columns are expected: {}", name_list(table.names, 4)),
                     "a log without a row of names", "write the names of its columns, as the mapping has them, into a first row"};
  return std::nullopt;
}

// First column that the log lacks, as a complete error; nothing when the stream can be filled.
std::optional<ErrorText> missing(const LogMapping& m, const MappedStream& s, const Sources& tables) {
  const MappedSource& source = m.sources[s.source];
  const auto& table = tables[s.source];
  if (!table)
    return ErrorText{s.where, fmt::format("{} is taken from {}, which is not there", s.label(), source_label(m, source)),
                     "a log of another kind than the mapping's", "give the mapping of this log, or mark the stream `optional = true`"};
  if (!table->has(source.time.column))
    if (auto whole = misread(m, *table)) return whole;
  if (!table->has(source.time.column))
    return ErrorText{source.time.where, fmt::format("no column {} (time) in {}", source.time.column, table->label),
                     "a log of another kind than the mapping's", fmt::format("it has: {}", name_list(table->names))};
  if (!source.time.nanoseconds.empty() && !table->has(source.time.nanoseconds))
    return ErrorText{source.time.where, fmt::format("no column {} (nanoseconds of the time) in {}", source.time.nanoseconds, table->label),
                     "a log of another kind than the mapping's", fmt::format("it has: {}", name_list(table->names))};
  for (const auto& c : columns_of(s))
    if (!table->has(c))
      return ErrorText{s.where, fmt::format("no column {} ({}) in {}", c, s.label(), table->label),
                       "a misspelt name, or a log of another kind", fmt::format("it has: {}", name_list(table->names))};
  return std::nullopt;
}

// Columns of one stream, picked from its table.
struct Picked {
  const MappedStream& s;
  const std::vector<double>* time = nullptr;
  std::vector<const std::vector<double>*> columns;  // nullptr: constant
  std::array<const std::vector<double>*, 4> quaternion{};
  const std::vector<double>* condition = nullptr;

  Picked(const MappedStream& stream, const MappedSource& source, const ColumnTable& table) : s(stream) {
    time = &table.columns.at(source.time.column);
    for (const auto& c : s.columns) columns.push_back(c.constant ? nullptr : &table.columns.at(c.name));
    for (std::size_t i = 0; i < s.quaternion.size(); ++i) quaternion[i] = &table.columns.at(s.quaternion[i]);
    if (s.only_if) condition = &table.columns.at(s.only_if->column);
  }

  // As logged; not-a-number where there is no reading.
  Reading raw(std::size_t row) const {
    Reading v{};
    for (std::size_t i = 0; i < columns.size(); ++i) {
      v[i] = columns[i] ? (*columns[i])[row] : *s.columns[i].constant;
      if (columns[i] && s.missing_value && v[i] == *s.missing_value) v[i] = kNoReading;
    }
    for (std::size_t i = 0; i < s.quaternion.size(); ++i) v[4 + i] = (s.columns.empty() ? s.to_si[i] : 1.0) * (*quaternion[i])[row];
    return v;
  }
};

bool same_reading(const Reading& a, const Reading& b) {
  for (std::size_t i = 0; i < a.size(); ++i)
    if (!(a[i] == b[i] || (std::isnan(a[i]) && std::isnan(b[i])))) return false;
  return true;
}

std::size_t blanks_of(const MappedStream& s, const Reading& raw) {
  std::size_t n = 0;
  for (std::size_t i = 0; i < s.columns.size(); ++i) n += std::isnan(raw[i]) ? 1u : 0u;
  for (std::size_t i = 0; i < s.quaternion.size(); ++i) n += std::isnan(raw[4 + i]) ? 1u : 0u;
  return n;
}

// Turns a vector's components in the log's axes to those in ours.
Eigen::Quaterniond to_ours(LogAxes axes) {
  const double half = std::sqrt(0.5);
  return axes == LogAxes::z_down ? Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0)
         : axes == LogAxes::y_up ? Eigen::Quaterniond(half, half, 0.0, 0.0)
                                 : Eigen::Quaterniond::Identity();
}

// The same without rounding: what a log holds as a number stays that number.
Eigen::Vector3d in_ours(LogAxes axes, const Eigen::Vector3d& v) {
  if (axes == LogAxes::z_down) return {v.x(), -v.y(), -v.z()};
  return axes == LogAxes::y_up ? Eigen::Vector3d(v.x(), -v.z(), v.y()) : v;
}

// Turns about the body's own axes, one after the other in the order given: "zyx" is yaw, then pitch, then roll.
Eigen::Quaterniond from_angles(const MappedStream& s, const Reading& raw) {
  if (s.euler == "vector") {
    const Eigen::Vector3d v(s.to_si[0] * raw[0], s.to_si[1] * raw[1], s.to_si[2] * raw[2]);
    const double angle = v.norm();
    return angle > 0.0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, v / angle)) : Eigen::Quaterniond::Identity();
  }
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  for (const char axis : s.euler) {
    const auto k = static_cast<std::size_t>(axis - 'x');
    q = q * Eigen::AngleAxisd(s.to_si[k] * raw[k], Eigen::Vector3d::Unit(static_cast<Eigen::Index>(k)));
  }
  return q;
}

// Body to world in our axes, from the logged angles or w x y z of whatever direction and axes.
Eigen::Quaterniond attitude_of(const MappedStream& s, const Reading& raw) {
  Eigen::Quaterniond q = s.euler.empty() ? Eigen::Quaterniond(raw[4], raw[5], raw[6], raw[7]) : from_angles(s, raw);
  q.normalize();
  if (s.world_to_body) q = q.conjugate();
  return (to_ours(s.world) * q * to_ours(s.body).conjugate()).normalized();
}

// A vector in the axes that the quantity has in a FlightRecord.
Eigen::Vector3d vector_of(const MappedStream& s, const Reading& raw) {
  Eigen::Vector3d v(s.to_si[0] * raw[0], s.to_si[1] * raw[1], s.to_si[2] * raw[2]);
  v = in_ours(s.in_world_axes ? s.world : s.body, v);
  const bool wanted_in_world = s.quantity != LogQuantity::gyro && s.quantity != LogQuantity::accel;
  if (s.in_world_axes == wanted_in_world && !s.gravity_removed) return v;
  const Eigen::Quaterniond q_WB = attitude_of(s, raw);
  if (s.gravity_removed) {
    const Eigen::Vector3d up = kGravity_m_s2 * Eigen::Vector3d::UnitZ();
    v += s.in_world_axes ? up : q_WB.conjugate() * up;
  }
  if (s.in_world_axes == wanted_in_world) return v;
  return wanted_in_world ? q_WB * v : q_WB.conjugate() * v;
}

void add_reading(const MappedStream& s, double t, const Reading& raw, FlightRecord& f) {
  switch (s.quantity) {
    case LogQuantity::pose:
      f.pose.add(t, {vector_of(s, raw), attitude_of(s, raw)});
      break;
    case LogQuantity::position:
      f.position_W_m.add(t, vector_of(s, raw));
      break;
    case LogQuantity::velocity:
      f.velocity_W_m_s.add(t, vector_of(s, raw));
      break;
    case LogQuantity::gyro:
      f.gyro_B_rad_s.add(t, vector_of(s, raw));
      break;
    case LogQuantity::accel:
      f.accel_B_m_s2.add(t, vector_of(s, raw));
      break;
    case LogQuantity::rotor_speed: {
      RotorValues omega{};
      for (std::size_t i = 0; i < 4; ++i) omega[i] = s.to_si[i] * raw[i];
      f.rotor_omega_rad_s.add(t, omega);
      break;
    }
    case LogQuantity::motor_command: {
      RotorValues u{};
      for (std::size_t i = 0; i < 4; ++i) u[i] = (s.to_si[i] * raw[i] - s.zero) / (s.full_scale - s.zero);
      f.motor_command.add(t, u);
      break;
    }
    case LogQuantity::battery:
      f.battery_V.add(t, s.to_si[0] * raw[0]);
      break;
    case LogQuantity::attitude:
      f.attitude_WS.add(t, attitude_of(s, raw));
      break;
    case LogQuantity::extra:
      f.extra[s.extra_name].add(t, s.to_si[0] * raw[0]);
      break;
  }
}

// What becomes of a row.
enum Fate : std::size_t { kept, no_time, blank, no_quaternion, held, fate_count };

double quaternion_norm(const Reading& raw) { return std::sqrt(raw[4] * raw[4] + raw[5] * raw[5] + raw[6] * raw[6] + raw[7] * raw[7]); }

Fate fate_of(const MappedStream& s, double t, const Reading& raw, const std::optional<Reading>& before) {
  if (!std::isfinite(t)) return no_time;
  const std::size_t blanks = blanks_of(s, raw);
  const bool by_rotor = s.quantity == LogQuantity::rotor_speed || s.quantity == LogQuantity::motor_command;
  if (blanks > 0 && (!by_rotor || blanks == s.columns.size())) return blank;
  if (!s.quaternion.empty()) {
    const double norm = quaternion_norm(raw);
    if (!(norm >= kQuaternionNormLow && norm <= kQuaternionNormHigh)) return no_quaternion;
  }
  return s.drop_held && before && same_reading(*before, raw) ? held : kept;
}

void note_fates(const MappedStream& s, const std::array<std::size_t, fate_count>& n, double from, double to,
                std::vector<LogFinding>& findings) {
  const std::size_t rows = std::accumulate(n.begin(), n.end(), std::size_t{0});
  const auto note = [&](Fate fate, std::string_view what) {
    if (n[fate] > 0) findings.push_back({s.label(), fmt::format("{} of {} rows {}", n[fate], rows, what), from, to, FindingAction::note});
  };
  note(no_time, "have no time and are left out");
  note(blank, "are blank and left out");
  note(held, fmt::format("repeat the reading before and are left out ({:.1f} Hz remain)",
                         n[kept] > 1 && to > from ? static_cast<double>(n[kept] - 1) / (to - from) : 0.0));
  note(no_quaternion,
       fmt::format("hold no unit quaternion (norm outside {} to {}) and are left out", kQuaternionNormLow, kQuaternionNormHigh));
}

void fill(const MappedSource& source, const MappedStream& s, const ColumnTable& table, double t_zero, FlightRecord& f,
          std::vector<LogFinding>& findings) {
  const Picked picked(s, source, table);
  std::array<std::size_t, fate_count> n{};
  std::optional<Reading> before;
  double from = 0.0, to = 0.0, odd_norm = 0.0;
  for (std::size_t row = 0; row < table.rows; ++row) {
    if (picked.condition && (*picked.condition)[row] != s.only_if->value) continue;
    const double t = (*picked.time)[row] * source.time.s_per_unit - t_zero + s.time_offset_s;
    const Reading raw = picked.raw(row);
    if (s.blank == BlankPolicy::refuse && blanks_of(s, raw) > 0)
      throw Error(
          {s.where, fmt::format("{} is blank in data row {} of {}, and the mapping refuses blanks", s.label(), row + 1, table.label),
           "a reading that was lost", "set blank = \"skip\", or repair the log"},
          ExitCode::data_quality);
    const Fate fate = fate_of(s, t, raw, before);
    if (fate == no_quaternion) odd_norm = quaternion_norm(raw);
    if (fate == kept) {
      before = raw;
      add_reading(s, t, raw, f);
      if (n[kept] == 0) from = t;
      to = t;
    }
    ++n[fate];
  }
  if (n[no_quaternion] > n[kept] + n[held])
    throw Error({s.where,
                 fmt::format("columns {} of {} are no unit quaternion: norm {} in {} of {} rows", name_list(s.quaternion), table.label,
                             number_text(odd_norm), n[no_quaternion], table.rows),
                 "Euler angles, or columns of something else", "give the columns of w, x, y, z of the attitude"},
                ExitCode::data_quality);
  note_fates(s, n, from, to, findings);
}

Sources sources_of(const LogMapping& m, const TableReader& read_table, std::vector<LogFinding>& findings) {
  std::vector<std::set<std::string>> wanted(m.sources.size());
  for (const auto& s : m.streams) wanted[s.source].merge(columns_of(s));
  Sources tables(m.sources.size());
  for (std::size_t i = 0; i < m.sources.size(); ++i) {
    if (wanted[i].empty()) continue;  // no stream is taken from it
    const MappedTime& clock = m.sources[i].time;
    wanted[i].insert(clock.column);
    if (!clock.nanoseconds.empty()) wanted[i].insert(clock.nanoseconds);
    tables[i] = read_table(m.sources[i], wanted[i]);
    if (!tables[i]) continue;
    if (tables[i]->rows == 0 && tables[i]->has(clock.column))
      throw Error({tables[i]->label, fmt::format("has names of {} columns and no row of numbers", tables[i]->names.size()),
                   "the logger was stopped before it wrote, or the file was cut behind its first row", "log again; the mapping fits"},
                  ExitCode::data_quality);
    for (const auto& note : tables[i]->notes) findings.push_back({"log", note, 0.0, 0.0, FindingAction::note});
    if (!clock.nanoseconds.empty() && tables[i]->has(clock.column) && tables[i]->has(clock.nanoseconds))
      for (std::size_t row = 0; row < tables[i]->rows; ++row)
        tables[i]->columns[clock.column][row] += 1e-9 / clock.s_per_unit * tables[i]->columns[clock.nanoseconds][row];
  }
  unwrap_clocks(m, tables, findings);
  return tables;
}

// The earliest stamp of all tables, as logged.
double earliest_s(const LogMapping& m, const Sources& tables) {
  double t_zero = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < tables.size(); ++i) {
    if (!tables[i] || !tables[i]->has(m.sources[i].time.column)) continue;
    for (const double t : tables[i]->columns.at(m.sources[i].time.column))
      if (t * m.sources[i].time.s_per_unit < t_zero) t_zero = t * m.sources[i].time.s_per_unit;
  }
  return std::isfinite(t_zero) ? t_zero : 0.0;
}

// Why none of a quantity's alternatives could be taken: an error unless all are optional, which leaves a note.
void explain_absence(const LogMapping& m, const std::string& label, const Sources& tables, std::vector<LogFinding>& findings) {
  const MappedStream *first = nullptr, *required = nullptr;
  for (const auto& s : m.streams) {
    if (s.label() != label) continue;
    if (!first) first = &s;
    if (!s.optional) required = &s;
  }
  if (required) throw Error(*missing(m, *required, tables));
  findings.push_back({label, std::string(kAbsent) + missing(m, *first, tables)->what, 0.0, 0.0, FindingAction::note});
}

// An attitude and positions of two tables: poses at the stamps of the positions, the attitude turned on between its neighbours.
void join_attitude(FlightRecord& f, std::vector<LogFinding>& findings) {
  constexpr double kLongest_s = 0.1;  // between two attitudes: a vehicle turns by less than a right angle meanwhile
  const auto& q = f.attitude_WS;
  if (!q.empty() && !f.pose.empty()) {  // two accounts of one thing: the pose is of one instant
    f.position_W_m = {};
    f.attitude_WS = {};
    return;
  }
  if (q.size() < 2 || f.position_W_m.empty()) return;
  Stream<PoseReading> turning;
  for (std::size_t i = 0; i < q.size(); ++i) turning.add(q.t_s[i], {Eigen::Vector3d::Zero(), q.value[i]});
  StreamReader<PoseReading> attitude(turning);
  for (std::size_t i = 0; i < f.position_W_m.size(); ++i) {
    const double t = f.position_W_m.t_s[i];
    const auto next = std::lower_bound(q.t_s.begin(), q.t_s.end(), t);
    const bool between = next != q.t_s.end() && next != q.t_s.begin() && *next != t;
    if (!attitude.covers(t) || (between && *next - *(next - 1) > kLongest_s)) continue;
    f.pose.add(t, {f.position_W_m.value[i], attitude.at(t).q_WS.normalized()});
  }
  if (f.pose.empty()) return;
  std::erase_if(findings, [](const LogFinding& n) { return n.stream == "pose" && n.what.starts_with(kAbsent); });
  findings.push_back(
      {"pose",
       fmt::format("made of {} positions and {} attitudes, each turned on to the position's stamp", f.position_W_m.size(), q.size()),
       f.pose.t_s.front(), f.pose.t_s.back(), FindingAction::note});
  f.position_W_m = {};
  f.attitude_WS = {};
}

}  // namespace

void map_flight(const LogMapping& m, const TableReader& read_table, FlightRecord& f, std::vector<LogFinding>& findings) {
  const Sources tables = sources_of(m, read_table, findings);
  const double t_zero = m.start_at_zero ? earliest_s(m, tables) : 0.0;
  // Streams with one label are alternatives; every extra has its own.
  std::set<std::string> filled, explained;
  for (const auto& s : m.streams) {
    if (filled.contains(s.label()) || missing(m, s, tables)) continue;
    fill(m.sources[s.source], s, *tables[s.source], t_zero, f, findings);
    filled.insert(s.label());
  }
  for (const auto& s : m.streams)
    if (!filled.contains(s.label()) && explained.insert(s.label()).second) explain_absence(m, s.label(), tables, findings);
  join_attitude(f, findings);
}

}  // namespace rotorloop::log
