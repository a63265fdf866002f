#include "bench/stand/evaluate/estimate/known_headers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "bench/stand/run_folder.hpp"
#include "bench/sysid/log/log_units.hpp"
#include "host/base/error.hpp"

namespace rotorloop::stand {
namespace {

// RCbenchmark's columns are NAME (UNIT); the name alone decides, as the unit's micro sign and middle dot come in several encodings.
struct KnownColumn {
  std::string_view name;
  StandQuantity quantity;
};
// Of two columns for one quantity the first that holds anything is taken: an optical probe that is not connected reads 0.
constexpr std::array kStandColumns{
    KnownColumn{"Motor Optical Speed", StandQuantity::rotor_speed},
    KnownColumn{"Motor Electrical Speed", StandQuantity::rotor_speed},
    KnownColumn{"Thrust", StandQuantity::thrust},
    KnownColumn{"Torque", StandQuantity::torque},
    KnownColumn{"Voltage", StandQuantity::voltage},
    KnownColumn{"Current", StandQuantity::current},
    KnownColumn{"ESC signal", StandQuantity::command},
};
// Behind those of a session: what other programs give of the wind along the axis and of the voltage, as its amplitude over that of the bus.
constexpr std::array kRunColumns{KnownColumn{kSampleColumns[kOmegaColumn].name, StandQuantity::rotor_speed},
                                 KnownColumn{kSampleColumns[kThrustColumn].name, StandQuantity::thrust},
                                 KnownColumn{kSampleColumns[kTorqueColumn].name, StandQuantity::torque},
                                 KnownColumn{kSampleColumns[kVoltageColumn].name, StandQuantity::voltage},
                                 KnownColumn{kSampleColumns[kCurrentColumn].name, StandQuantity::current},
                                 KnownColumn{kSampleColumns[kDutyColumn].name, StandQuantity::command},
                                 KnownColumn{"duty", StandQuantity::command},
                                 KnownColumn{"airspeed_m_s", StandQuantity::airspeed}};
constexpr double kMeanOver_s = 0.5, kRests_rad_s2 = 40.0;  // as the shipped mappings of such files have it
constexpr double kRecord_s = 0.4;                          // rows closer than this are a record, not one row for each step

std::vector<std::string> cells(std::string_view line, char separator) {
  std::vector<std::string> out;
  for (;;) {
    const auto end = line.find(separator);
    std::string_view cell = line.substr(0, end);
    while (!cell.empty() && (cell.front() == ' ' || cell.front() == '"')) cell.remove_prefix(1);
    while (!cell.empty() && (cell.back() == ' ' || cell.back() == '"' || cell.back() == '\r')) cell.remove_suffix(1);
    out.emplace_back(cell);
    if (end == std::string_view::npos) return out;
    line.remove_prefix(end + 1);
  }
}

// Factor from a column's unit to SI; 0 for a unit that the quantity does not have.
double factor_of(StandQuantity q, std::string_view unit) {
  if (q == StandQuantity::rotor_speed) return unit == "RPM" || unit == "rpm" ? log::find_log_unit("rpm")->factor : 0.0;
  const double gf = log::find_log_unit("gf")->factor;
  if (q == StandQuantity::thrust)
    return unit == "N"                     ? 1.0
           : unit == "gf" || unit == "g"   ? gf
           : unit == "kgf" || unit == "kg" ? 1e3 * gf
           : unit == "lbf"                 ? 4.4482216152605
                                           : 0.0;
  if (q == StandQuantity::torque) {
    if (unit.starts_with("N") && unit.ends_with("mm")) return 1e-3;
    if (unit.starts_with("N") && unit.ends_with("m")) return 1.0;  // N·m with any kind of dot, N.m, Nm
    if (unit.starts_with("lbf") && unit.ends_with("in")) return 0.1129848290276167;
    if (unit.starts_with("ozf") && unit.ends_with("in")) return 7.0615518333333e-3;
    return 0.0;
  }
  return 1.0;  // V, A, and a command in whatever it is sent in
}

double first_number(const std::string& cell) {
  try {
    return std::stod(cell);
  } catch (const std::exception&) {
    return 0.0;
  }
}

struct Rows {
  std::vector<std::string> names;
  std::vector<std::vector<std::string>> some;  // at most the first 2000
};
Rows first_rows(std::string_view text) {
  Rows r;
  while (!text.empty() && r.some.size() < 2000) {
    const auto end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (line.empty() || line == "\r" || line.front() == '#') continue;
    if (r.names.empty())
      r.names = cells(line, ',');
    else
      r.some.push_back(cells(line, ','));
  }
  return r;
}

bool holds_anything(const Rows& r, std::size_t column) {
  return std::any_of(r.some.begin(), r.some.end(),
                     [&](const auto& row) { return column < row.size() && std::abs(first_number(row[column])) > 0.0; });
}

// Time between most rows, s.
double usual_step_s(const Rows& r, std::size_t column) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < r.some.size(); ++i)
    if (column < r.some[i].size() && column < r.some[i - 1].size())
      steps.push_back(first_number(r.some[i][column]) - first_number(r.some[i - 1][column]));
  if (steps.empty()) return 1e9;
  std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2), steps.end());
  return steps[steps.size() / 2];
}

void take_stand_column(KnownCsv& out, const Rows& rows, std::size_t i, const std::filesystem::path& path) {
  const std::string& header = rows.names[i];
  const auto open = header.rfind('('), close = header.rfind(')');
  const std::string name = header.substr(0, open == std::string::npos ? header.size() : header.find_last_not_of(' ', open - 1) + 1);
  const std::string unit = open == std::string::npos || close == std::string::npos ? "" : header.substr(open + 1, close - open - 1);
  for (const KnownColumn& k : kStandColumns) {
    if (k.name != name) continue;
    const double factor = factor_of(k.quantity, unit);
    if (factor == 0.0)
      throw Error({path.generic_string() + ":1", fmt::format("the column \"{}\" has an unknown unit", header), "another program's export",
                   "give -m MAPPING.toml that names the unit (docs/files.md, Stand mapping)"});
    if (k.quantity == StandQuantity::rotor_speed && !holds_anything(rows, i)) continue;
    out.mapping.channels.push_back({k.quantity, false, {header}, factor, path.generic_string() + ":1"});
  }
}

}  // namespace

KnownCsv recognise_csv(std::string bytes, const std::filesystem::path& path) {
  KnownCsv out;
  out.mapping.path = path;
  if (std::all_of(bytes.begin(), bytes.end(), [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; }))
    throw Error({path.generic_string(), "is empty", "a program that was ended before it wrote, or another file",
                 "measure again, or name the file with the samples"});
  if (bytes.starts_with("\xEF\xBB\xBF")) bytes.erase(0, 3), out.remarks.push_back("byte order mark at the start of the file skipped");
  const std::string first_line = bytes.substr(0, bytes.find('\n'));
  if (std::count(first_line.begin(), first_line.end(), ';') > std::count(first_line.begin(), first_line.end(), ',')) {
    const auto commas = std::count(bytes.begin(), bytes.end(), ',');
    std::replace(bytes.begin(), bytes.end(), ',', '.');
    std::replace(bytes.begin(), bytes.end(), ';', ',');
    out.remarks.push_back(fmt::format("columns are parted by \";\"{}", commas > 0 ? ", decimals by \",\"" : ""));
  }
  const Rows rows = first_rows(bytes);
  const auto at = [&](std::string_view name) {
    const auto found = std::find_if(rows.names.begin(), rows.names.end(),
                                    [&](const std::string& n) { return n == name || n.starts_with(std::string(name) + " ("); });
    return static_cast<std::size_t>(found - rows.names.begin());
  };
  const auto has = [&](std::string_view name) { return at(name) < rows.names.size(); };
  const bool run = has(kRunColumns[0].name) && (has(kRunColumns[1].name) || has(kRunColumns[2].name));
  const bool stand = !run && has("Thrust") && has("Motor Electrical Speed");
  if (!run && !stand)
    throw Error({path.generic_string() + ":1", "no header that is known: neither an RCbenchmark (Tyto) export nor samples of a run",
                 "another program's file", "give -m MAPPING.toml (docs/files.md, Stand mapping; examples in vehicles/measured/stands)"});
  out.mapping.name = run ? "samples of a run" : "RCbenchmark export";
  for (std::size_t i = 0; i < rows.names.size(); ++i) {
    if (stand) take_stand_column(out, rows, i, path);
    for (const KnownColumn& k : kRunColumns)
      if (run && k.name == rows.names[i])
        out.mapping.channels.push_back({k.quantity, false, {rows.names[i]}, 1.0, path.generic_string() + ":1"});
  }
  // Nothing turned, or no sensor: the electrical speed stays, for the checks to find.
  const auto speeds = std::count_if(out.mapping.channels.begin(), out.mapping.channels.end(),
                                    [](const StandChannel& c) { return c.quantity == StandQuantity::rotor_speed; });
  if (stand && speeds == 0)
    out.mapping.channels.push_back({StandQuantity::rotor_speed,
                                    false,
                                    {rows.names[at("Motor Electrical Speed")]},
                                    factor_of(StandQuantity::rotor_speed, "RPM"),
                                    path.generic_string() + ":1"});
  const std::size_t time = at(stand ? "Time" : kTime);
  if (time < rows.names.size()) {
    out.mapping.time_column = rows.names[time];
    if (stand && usual_step_s(rows, time) < kRecord_s) out.mapping.average_s = kMeanOver_s, out.mapping.slope_max_rad_s2 = kRests_rad_s2;
  }
  if (!rows.names.empty() && rows.names.back().empty())
    out.remarks.push_back("the header ends with a separator: a column without name, left out");
  if (stand) out.remarks.push_back("recognised as an RCbenchmark (Tyto) export by its header");
  out.text = std::move(bytes);
  return out;
}

}  // namespace rotorloop::stand
