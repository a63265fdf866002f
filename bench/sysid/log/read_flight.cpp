#include "bench/sysid/log/read_flight.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <fstream>

#include "bench/sysid/log/column_table.hpp"
#include "bench/sysid/log/dataflash.hpp"
#include "bench/sysid/log/mapped_flight.hpp"
#include "bench/sysid/log/own_log.hpp"
#include "bench/sysid/log/ulog.hpp"
#include "bench/sysid/log/ulog_write.hpp"
#include "host/base/error.hpp"

namespace rotorloop::log {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPx4Mapping = "vehicles/measured/px4_ulog.mapping.toml",
                           kArduPilotMapping = "vehicles/measured/ardupilot_bin.mapping.toml";

enum class Format { own, ulog, dataflash, csv };

Format format_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string head(16, '\0');
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(in.gcount()));
  if (head.starts_with("\xEF\xBB\xBF")) head.erase(0, 3);
  if (head.starts_with("# rotorloop")) return Format::own;
  if (head.starts_with(kDataFlashHead)) return Format::dataflash;
  return head.starts_with(kULogMagic) || path.extension() == ".ulg" ? Format::ulog : Format::csv;
}

// "eckart00"; a run folder's flight.csv goes by its folders: "horizontal/pd_ff/1".
std::string flight_name(const fs::path& path) {
  const auto stem = path.stem().generic_string();
  if (stem != "flight") return stem;
  std::string name;
  int levels = 0;
  for (auto folder = fs::absolute(path).parent_path(); levels < 3 && folder.has_filename() && folder != folder.root_path(); ++levels) {
    name = folder.filename().generic_string() + (name.empty() ? "" : "/" + name);
    folder = folder.parent_path();
  }
  return name.empty() ? stem : name;
}

std::string topic_list(const ULog& log) {
  std::vector<std::string> names;
  for (const auto& t : log.topics()) names.push_back(t.multi_id == 0 ? t.name : fmt::format("{} {}", t.name, t.multi_id));
  return name_list(names);
}

std::string message_list(const DataFlash& log) {
  std::vector<std::string> names;
  for (const auto& m : log.messages()) {
    const std::size_t n = log.instances(m).size();
    names.push_back(n > 1 ? fmt::format("{} (instances 0 to {})", m.name, n - 1) : m.name);
  }
  return name_list(names);
}

[[noreturn]] void needs_mapping(const fs::path& path, Format format) {
  std::string has, remedy = "give --mapping FILE (docs/files.md, \"Mapping file\"; examples in vehicles/measured)";
  if (format == Format::ulog)
    has = "topics " + topic_list(ULog::parse(read_log_bytes(path), path));
  else if (format == Format::dataflash)
    has = "messages " + message_list(DataFlash::parse(read_log_bytes(path), path));
  else
    has = "columns " + name_list(read_csv_table(path, {}, {}).names);
  if (format == Format::ulog) remedy = fmt::format("give --mapping; {} is that of PX4", kPx4Mapping);
  if (format == Format::dataflash) remedy = fmt::format("give --mapping; {} is that of ArduPilot", kArduPilotMapping);
  throw Error({path.generic_string(), "is a log of another tool, and no mapping says what its " + has + " mean", "", remedy});
}

LogKind kind_of(Format format) {
  return format == Format::ulog ? LogKind::ulog : format == Format::dataflash ? LogKind::dataflash : LogKind::csv;
}

void read_mapped_csv(const fs::path& path, const LogMapping& mapping, FlightRecord& f, std::vector<LogFinding>& findings) {
  const TableReader tables = [&](const MappedSource& s, const std::set<std::string>& wanted) -> std::optional<ColumnTable> {
    fs::path file = path;
    if (!s.suffix.empty()) file.replace_filename(path.stem().generic_string() + s.suffix);
    if (!s.suffix.empty() && !fs::exists(file)) return std::nullopt;
    return read_csv_table(file, wanted, {.separator = mapping.separator});
  };
  map_flight(mapping, tables, f, findings);
}

// What ulog_bytes() wrote beside PX4's topics.
void read_own_topics(const ULog& log, FlightRecord& f) {
  for (int id = 0; const auto* topic = log.topic(kULogExtraTopic, id); ++id) {
    const auto name = log.info().find(ulog_extra_key(id));
    const auto t = log.column(*topic, "timestamp");
    const auto value = log.column(*topic, "value");
    if (name == log.info().end() || !t || !value) continue;
    auto& stream = f.extra[name->second];
    for (std::size_t i = 0; i < t->size(); ++i) stream.add((*t)[i] * 1e-6, (*value)[i]);
  }
}

void shift_all(FlightRecord& f, double shift_s) {
  const auto shift = [&](std::vector<double>& t) {
    for (double& x : t) x += shift_s;
  };
  for (auto* t : {&f.pose.t_s, &f.position_W_m.t_s, &f.attitude_WS.t_s, &f.velocity_W_m_s.t_s, &f.gyro_B_rad_s.t_s, &f.accel_B_m_s2.t_s,
                  &f.rotor_omega_rad_s.t_s, &f.motor_command.t_s, &f.battery_V.t_s})
    shift(*t);
  for (auto& [name, stream] : f.extra) shift(stream.t_s);
}

void read_mapped_ulog(const fs::path& path, const LogMapping& mapping, FlightRecord& f, std::vector<LogFinding>& findings) {
  const ULog log = ULog::parse(read_log_bytes(path), path);
  for (const auto& note : log.notes()) findings.push_back({"log", note, 0.0, 0.0, FindingAction::note});
  const TableReader tables = [&](const MappedSource& s, const std::set<std::string>& wanted) -> std::optional<ColumnTable> {
    const ULogTopic* topic = log.topic(s.topic, s.multi_id);
    if (!topic || topic->messages.empty()) return std::nullopt;
    ColumnTable table;
    table.label = fmt::format("topic {} {} of {}", s.topic, s.multi_id, path.filename().generic_string());
    table.rows = topic->messages.size();
    table.names = log.fields(topic->name);
    for (const auto& name : wanted) {
      auto values = log.column(*topic, name);
      if (!values) continue;
      if (std::find(table.names.begin(), table.names.end(), name) == table.names.end()) table.names.push_back(name);
      table.columns[name] = std::move(*values);
    }
    return table;
  };
  map_flight(mapping, tables, f, findings);
  read_own_topics(log, f);
  if (const auto shift = log.info().find(kULogTimeShiftKey); shift != log.info().end()) {
    double s = 0.0;
    const auto& text = shift->second;
    if (std::from_chars(text.data(), text.data() + text.size(), s).ec == std::errc{}) shift_all(f, -s);
  }
}

void read_mapped_dataflash(const fs::path& path, const LogMapping& mapping, FlightRecord& f, std::vector<LogFinding>& findings) {
  const DataFlash log = DataFlash::parse(read_log_bytes(path), path);
  for (const auto& note : log.notes()) findings.push_back({"log", note, 0.0, 0.0, FindingAction::note});
  const TableReader tables = [&](const MappedSource& s, const std::set<std::string>& wanted) {
    auto table = log.table(s.topic, s.multi_id, wanted);
    if (table) table->label = fmt::format("message {} {} of {}", s.topic, s.multi_id, path.filename().generic_string());
    return table;
  };
  map_flight(mapping, tables, f, findings);
}

}  // namespace

std::string_view shipped_mapping_of(const fs::path& path) {
  if (!fs::is_regular_file(path)) return {};
  const Format format = format_of(path);
  if (format == Format::dataflash) return kArduPilotMapping;
  if (format != Format::ulog) return {};
  const ULog log = ULog::parse(read_log_bytes(path), path);
  const auto system = log.info().find("sys_name");
  if (system == log.info().end()) return {};
  return system->second == "PX4" || system->second == kULogSystem ? kPx4Mapping : std::string_view();
}

FlightRecord read_flight(const fs::path& given, const LogMapping* mapping, std::vector<LogFinding>* findings) {
  const fs::path path = fs::is_directory(given) ? given / "flight.csv" : given;
  if (!fs::is_regular_file(path))
    throw Error({path.generic_string(), "no such file", fs::is_directory(given) ? "a folder of several flights" : "a misspelt path",
                 "give a log, or a folder that contains flight.csv"});
  std::vector<LogFinding> notes;
  FlightRecord f;
  const Format format = format_of(path);
  if (format == Format::own) {
    if (mapping)
      throw Error({path.generic_string(), "is a log of rotorloop, which needs no mapping", "a mapping for other logs was given with it",
                   "leave the mapping out"});
    f = read_own_log(path, &notes);
  } else {
    if (!mapping) needs_mapping(path, format);
    if (mapping->kind != kind_of(format))
      throw Error({path.generic_string(),
                   fmt::format("is {}, and {} maps {}", name(kind_of(format)), mapping->path.generic_string(), name(mapping->kind)),
                   "the mapping of another log", "give the mapping of this log"});
    if (format == Format::ulog)
      read_mapped_ulog(path, *mapping, f, notes);
    else if (format == Format::dataflash)
      read_mapped_dataflash(path, *mapping, f, notes);
    else
      read_mapped_csv(path, *mapping, f, notes);
  }
  f.name = flight_name(path);
  f.source = given.generic_string();
  if (findings) findings->insert(findings->end(), notes.begin(), notes.end());
  return f;
}

}  // namespace rotorloop::log
