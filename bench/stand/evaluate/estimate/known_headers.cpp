#include "bench/stand/evaluate/estimate/known_headers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <optional>

#include "bench/stand/run_folder.hpp"
#include "bench/sysid/log/foreign_csv.hpp"
#include "bench/sysid/log/log_units.hpp"
#include "host/base/constants.hpp"
#include "host/base/error.hpp"
#include "host/base/statistics.hpp"

namespace rotorloop::stand {
namespace {

// Columns of stands are NAME (UNIT). Names in small letters, as their case changed between versions of the programs.
struct KnownColumn {
  std::string_view name;
  StandQuantity quantity;
  std::string_view si;
};
// Of several columns for one quantity the first is preferred: an optical probe counts turns, an electrical speed needs the pole pairs.
constexpr std::array kStandColumns{
    KnownColumn{"motor optical speed", StandQuantity::rotor_speed, "rad/s"},
    KnownColumn{"optical speed", StandQuantity::rotor_speed, "rad/s"},
    KnownColumn{"rotation speed", StandQuantity::rotor_speed, "rad/s"},
    KnownColumn{"motor speed", StandQuantity::rotor_speed, "rad/s"},
    KnownColumn{"motor electrical speed", StandQuantity::rotor_speed, "rad/s"},
    KnownColumn{"electrical speed", StandQuantity::rotor_speed, "rad/s"},
    KnownColumn{"thrust", StandQuantity::thrust, "N"},
    KnownColumn{"torque", StandQuantity::torque, "N m"},
    KnownColumn{"voltage", StandQuantity::voltage, "V"},
    KnownColumn{"current", StandQuantity::current, "A"},
    KnownColumn{"airspeed", StandQuantity::airspeed, "m/s"},
    KnownColumn{"esc signal", StandQuantity::command, ""},
    KnownColumn{"esc", StandQuantity::command, ""},
    KnownColumn{"throttle", StandQuantity::command, ""},
};
// Behind those of a session: what other programs give of the wind along the axis and of the voltage, as its amplitude over that of the bus.
constexpr std::array kRunColumns{KnownColumn{kSampleColumns[kOmegaColumn].name, StandQuantity::rotor_speed, "rad/s"},
                                 KnownColumn{kSampleColumns[kThrustColumn].name, StandQuantity::thrust, "N"},
                                 KnownColumn{kSampleColumns[kTorqueColumn].name, StandQuantity::torque, "N m"},
                                 KnownColumn{kSampleColumns[kVoltageColumn].name, StandQuantity::voltage, "V"},
                                 KnownColumn{kSampleColumns[kCurrentColumn].name, StandQuantity::current, "A"},
                                 KnownColumn{kSampleColumns[kDutyColumn].name, StandQuantity::command, "1"},
                                 KnownColumn{"duty", StandQuantity::command, "1"},
                                 KnownColumn{"airspeed_m_s", StandQuantity::airspeed, "m/s"}};
constexpr double kMeanOver_s = 0.5, kRests_rad_s2 = 40.0;  // as the shipped mappings of such files have it
constexpr double kRecord_s = 0.4;                          // rows closer than this are a record, not one row for each step
constexpr double kTurns_rad_s = 20.0;                      // as in stand_checks.cpp
constexpr double kSensorsAgree = 0.02;                     // two sensors of one rotor differ by less
constexpr double kWind_m_s = 2.0;                          // a probe in a room shows less

struct HeaderCell {
  std::string name, unit;  // name in small letters
};
HeaderCell parts_of(const std::string& header) {
  const auto open = header.rfind('('), close = header.rfind(')');
  const bool has_unit = open != std::string::npos && close != std::string::npos && open > 0 && close > open;
  std::string name = has_unit ? header.substr(0, header.find_last_not_of(' ', open - 1) + 1) : header;
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return {name, has_unit ? header.substr(open + 1, close - open - 1) : std::string()};
}

bool is_time(const std::string& header) { return header == "t_s" || parts_of(header).name == "time"; }

// Share of rows in which the column holds more than `least`.
double share_above(const std::vector<double>& v, double least) {
  const auto n = std::count_if(v.begin(), v.end(), [&](double x) { return std::abs(x) > least; });
  return v.empty() ? 0.0 : static_cast<double>(n) / static_cast<double>(v.size());
}

double usual_step(const std::vector<double>& t) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < t.size(); ++i) steps.push_back(t[i] - t[i - 1]);
  return steps.empty() ? 1e9 : median(steps);
}

// A channel of a column with a known name; nothing for other names.
std::optional<StandChannel> stand_channel(const std::string& header, const KnownColumn& k, const std::filesystem::path& path,
                                          std::vector<std::string>& remarks) {
  const HeaderCell cell = parts_of(header);
  if (cell.name != k.name && !cell.name.ends_with(" - " + std::string(k.name))) return std::nullopt;
  const std::string where = path.generic_string() + ":1";
  if (k.si.empty()) return StandChannel{k.quantity, false, {header}, 1.0, where};
  const log::LogUnit* const unit = log::find_written_unit(cell.unit, k.si);
  if (unit && !unit->electrical) return StandChannel{k.quantity, false, {header}, unit->factor, where};
  const bool needed =
      k.quantity == StandQuantity::rotor_speed || k.quantity == StandQuantity::thrust || k.quantity == StandQuantity::torque;
  if (needed)
    throw Error(
        {where, fmt::format("the column \"{}\" has the unit \"{}\", which is no known unit of {}", header, cell.unit, name(k.quantity)), "",
         fmt::format("known are {}; else give -m MAPPING.toml with `unit` and `scale` (docs/files.md, Stand mapping)",
                     log::log_units_of(k.si))});
  remarks.push_back(fmt::format("the column \"{}\" is left out: its unit is none of {}", header, log::log_units_of(k.si)));
  return std::nullopt;
}

// "7 pole pairs set for a motor that has 6": what a ratio of electrical to optical speed most likely is.
std::string likely_pole_pairs(double ratio) {
  for (int set = 1; set <= 30; ++set)
    if (const double has = ratio * set; has > 0.5 && std::abs(has - std::round(has)) < 0.01 * has && std::lround(has) != set)
      return fmt::format("; likely: {} pole pairs set for a motor that has {}", set, std::lround(has));
  return "";
}

// Of the speeds in one file the one that is taken; what they say of each other becomes a remark.
StandChannel preferred_speed(const std::vector<StandChannel>& speeds, const log::ColumnTable& table, std::vector<std::string>& remarks) {
  const auto values = [&](const StandChannel& c) -> const std::vector<double>& { return table.columns.at(c.columns[0]); };
  std::vector<const StandChannel*> alive;
  for (const StandChannel& c : speeds)
    if (share_above(values(c), 0.0) > 0.0) alive.push_back(&c);
  if (alive.empty()) return speeds.back();  // nothing turned, or no sensor: for the checks to find
  const StandChannel* best = alive[0];
  for (std::size_t k = 1; k < alive.size(); ++k) {
    std::vector<double> ratio;
    std::size_t turning = 0;
    for (std::size_t i = 0; i < table.rows; ++i) {
      const double a = values(*best)[i] * best->to_si, b = values(*alive[k])[i] * alive[k]->to_si;
      turning += b > kTurns_rad_s;
      if (a > kTurns_rad_s && b > kTurns_rad_s) ratio.push_back(b / a);
    }
    if (ratio.size() < 5) {
      if (turning > 4 * ratio.size()) best = alive[k];
      continue;
    }
    const double middle = median(ratio), low = quantile(ratio, 0.25), high = quantile(ratio, 0.75);
    if (std::abs(middle - 1.0) < kSensorsAgree) {
      if (turning > 2 * ratio.size()) best = alive[k];  // the two agree, and the other one has lost the rotor in most rows
      continue;
    }
    remarks.push_back(fmt::format("\"{}\" is {:.3f} of \"{}\" (middle of {} rows, half of them {:.3f} to {:.3f}): \"{}\" is taken{}",
                                  alive[k]->columns[0], middle, best->columns[0], ratio.size(), low, high, best->columns[0],
                                  likely_pole_pairs(middle)));
  }
  return *best;
}

void take_stand_columns(KnownCsv& out, const std::filesystem::path& path) {
  std::vector<StandChannel> speeds;
  for (const KnownColumn& k : kStandColumns)
    for (const std::string& header : out.table.names) {
      if (!out.table.has(header)) continue;
      const auto c = stand_channel(header, k, path, out.remarks);
      if (!c) continue;
      if (k.quantity == StandQuantity::airspeed && share_above(out.table.columns.at(header), kWind_m_s / c->to_si) < 0.1) continue;
      (k.quantity == StandQuantity::rotor_speed ? speeds : out.mapping.channels).push_back(*c);
    }
  out.mapping.channels.insert(out.mapping.channels.begin(), preferred_speed(speeds, out.table, out.remarks));
  for (const std::string& header : out.table.names) {
    if (!out.table.has(header) || !is_time(header)) continue;
    const std::string unit = parts_of(header).unit;
    const log::LogUnit* const u = log::find_written_unit(unit.empty() ? "s" : unit, "s");
    if (!u) continue;
    out.mapping.time_column = header;
    out.mapping.s_per_unit = u->factor;
    if (u->factor * usual_step(out.table.columns.at(header)) < kRecord_s) {
      out.mapping.average_s = kMeanOver_s;
      out.mapping.slope_max_rad_s2 = kRests_rad_s2;
    }
    break;
  }
}

template <class Columns>
bool named(const std::string& header, const Columns& columns) {
  const std::string name = parts_of(header).name;
  return std::any_of(columns.begin(), columns.end(),
                     [&](const KnownColumn& k) { return name == k.name || name.ends_with(" - " + std::string(k.name)); });
}

bool has_of(const std::vector<std::string>& names, std::initializer_list<StandQuantity> wanted) {
  return std::any_of(kStandColumns.begin(), kStandColumns.end(), [&](const KnownColumn& k) {
    return std::find(wanted.begin(), wanted.end(), k.quantity) != wanted.end() &&
           std::any_of(names.begin(), names.end(),
                       [&](const std::string& n) { return !parts_of(n).unit.empty() && named(n, std::array{k}); });
  });
}

}  // namespace

KnownCsv recognise_csv(std::string bytes, const std::filesystem::path& path) {
  KnownCsv out;
  out.mapping.path = path;
  if (std::all_of(bytes.begin(), bytes.end(), [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; }))
    throw Error({path.generic_string(), "is empty", "a program that was ended before it wrote, or another file",
                 "measure again, or name the file with the samples"});
  if (bytes.starts_with("\xEF\xBB\xBF")) out.remarks.push_back("byte order mark at the start of the file skipped");
  const std::string text = log::as_utf8(std::move(bytes));
  const char separator = log::likely_separator(text);
  const std::vector<std::string> names = log::find_csv_head(text, separator, {}, "").names;
  const auto has = [&](const char* name) { return std::find(names.begin(), names.end(), name) != names.end(); };
  const bool run = has("omega_rad_s") && (has("thrust_N") || has("torque_N_m"));
  const bool stand = !run && has_of(names, {StandQuantity::rotor_speed}) && has_of(names, {StandQuantity::thrust, StandQuantity::torque});
  if (!run && !stand)
    throw Error({path.generic_string() + ":1", "no header that is known: neither an RCbenchmark (Tyto) export nor samples of a run",
                 "another program's file", "give -m MAPPING.toml (docs/files.md, Stand mapping; examples in vehicles/measured/stands)"});
  if (separator != ',')
    out.remarks.push_back(fmt::format("columns are separated by \"{}\"{}", separator == '\t' ? "tab" : ";",
                                      text.find(',') != std::string::npos ? ", decimals by \",\"" : ""));
  std::set<std::string> wanted{"t_s", "step", "target_rad_s"};
  for (const std::string& n : names)
    if (run ? std::any_of(kRunColumns.begin(), kRunColumns.end(), [&](const KnownColumn& k) { return k.name == n; })
            : is_time(n) || named(n, kStandColumns))
      wanted.insert(n);
  out.table = log::parse_csv(text, path, &wanted, {.separator = separator, .foreign = true});
  out.mapping.name = run ? "samples of a run" : "RCbenchmark export";
  if (stand) {
    take_stand_columns(out, path);
  } else {
    for (const KnownColumn& k : kRunColumns)
      if (out.table.has(k.name))
        out.mapping.channels.push_back({k.quantity, false, {std::string(k.name)}, 1.0, path.generic_string() + ":1"});
    if (out.table.has("t_s")) out.mapping.time_column = "t_s";
  }
  if (!names.empty() && names.back().empty()) out.remarks.push_back("the header ends with a separator: a column without name, left out");
  if (stand) out.remarks.push_back("recognised as an RCbenchmark (Tyto) export by its header");
  return out;
}

}  // namespace rotorloop::stand
