#include "bench/stand/evaluate/stand_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "bench/sysid/log/column_table.hpp"
#include "host/base/error.hpp"
#include "host/base/statistics.hpp"

namespace rotorloop::stand {
namespace {

constexpr double kBeforeIsRestart_s = 1.0;  // a row this much before the latest is of another start of the clock

using Chosen = std::map<StandQuantity, const StandChannel*>;

bool has_all(const log::ColumnTable& table, const std::vector<std::string>& columns) {
  return std::all_of(columns.begin(), columns.end(), [&](const std::string& c) { return table.has(c); });
}

// Of the alternatives for each quantity, the first that the tables have.
Chosen choose(const StandMapping& m, const log::ColumnTable& file, const log::ColumnTable* joined) {
  Chosen chosen;
  for (const auto& c : m.channels) {
    const log::ColumnTable* const table = c.joined ? joined : &file;
    if (table && has_all(*table, c.columns)) chosen.emplace(c.quantity, &c);
  }
  if (!chosen.contains(StandQuantity::rotor_speed))
    throw Error({m.path.generic_string(), fmt::format("no channel of rotor speed of this mapping is in {}", file.label),
                 "a mapping for another stand", fmt::format("its columns are: {}", log::name_list(file.names))});
  return chosen;
}

double& place(StandPoint& p, StandQuantity q) {
  switch (q) {
    case StandQuantity::thrust:
      return p.thrust_N;
    case StandQuantity::torque:
      return p.torque_N_m;
    case StandQuantity::voltage:
      return p.voltage_V;
    case StandQuantity::current:
      return p.current_A;
    case StandQuantity::airspeed:
      return p.airspeed_m_s;
    default:
      return p.command;
  }
}

std::vector<StandPoint> rows_of(const StandMapping& m, const Chosen& chosen, const log::ColumnTable& file) {
  std::vector<StandPoint> points(file.rows);
  for (std::size_t i = 0; i < points.size(); ++i) {
    StandPoint& p = points[i];
    p.row = i + 1;
    if (m.time_column) p.t_s = file.columns.at(*m.time_column)[i] * m.s_per_unit;
    for (const auto& [quantity, channel] : chosen) {
      if (channel->joined) continue;
      for (std::size_t k = 0; k < channel->columns.size(); ++k) {
        const double v = file.columns.at(channel->columns[k])[i] * channel->to_si;
        (quantity == StandQuantity::rotor_speed ? p.omega_rad_s[k] : place(p, quantity)) = v;
      }
    }
  }
  return points;
}

// A log that was begun anew in the same file starts its clock again: its rows come after those before, a second later.
void read_on_after_restarts(std::vector<StandPoint>& points, StandRecord& r) {
  double before = 0.0, latest = kNotMeasured;
  std::size_t restarts = 0, row = 0;
  for (StandPoint& p : points) {
    if (p.t_s != p.t_s) continue;
    if (p.t_s + before < latest - kBeforeIsRestart_s) {
      before = latest + 1.0 - p.t_s;
      ++restarts;
      row = p.row;
    }
    p.t_s += before;
    latest = std::max(p.t_s, latest == latest ? latest : p.t_s);
  }
  if (restarts > 0)
    r.notes.push_back(fmt::format("time starts again {} times, last in row {}: a log that was begun anew in this file; read on as one run",
                                  restarts, row));
}

// For each row of the joined table the mean of those of the file whose column `to` equals its key; speeds by their median, which a
// third of misread rows does not move.
std::vector<StandPoint> joined_rows(const StandMapping& m, const Chosen& chosen, const log::ColumnTable& file,
                                    const std::vector<StandPoint>& rows, const log::ColumnTable& joined, std::size_t rotors) {
  std::vector<StandPoint> out;
  const auto& to = file.columns.at(m.join->to);
  for (std::size_t j = 0; j < joined.rows; ++j) {
    StandPoint p;
    std::array<std::vector<double>, 4> speeds;
    double voltage = 0.0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (to[i] != joined.columns.at(m.join->key)[j]) continue;
      if (speeds[0].empty()) p.row = rows[i].row;
      for (std::size_t k = 0; k < rotors; ++k) speeds[k].push_back(rows[i].omega_rad_s[k]);
      voltage += rows[i].voltage_V;
    }
    if (speeds[0].empty()) continue;
    p.voltage_V = voltage / static_cast<double>(speeds[0].size());
    p.command = to[p.row - 1];
    for (std::size_t k = 0; k < rotors; ++k) p.omega_rad_s[k] = median(speeds[k]);
    for (const auto& [quantity, channel] : chosen)
      if (channel->joined) place(p, quantity) = joined.columns.at(channel->columns[0])[j] * channel->to_si;
    out.push_back(p);
  }
  return out;
}

// Means over `average_s`, channel by channel, as stands write some channels in some rows only; kept where speed rests.
std::vector<StandPoint> means_of(const StandMapping& m, const std::vector<StandPoint>& rows, std::size_t rotors) {
  constexpr std::array kAll{StandQuantity::thrust,  StandQuantity::torque,   StandQuantity::voltage,
                            StandQuantity::current, StandQuantity::airspeed, StandQuantity::command};
  std::vector<StandPoint> means;
  const double t0 = rows.empty() ? 0.0 : rows.front().t_s;
  for (std::size_t first = 0; first < rows.size();) {
    const double bin = std::floor((rows[first].t_s - t0) / m.average_s);
    std::size_t last = first;
    while (last < rows.size() && std::floor((rows[last].t_s - t0) / m.average_s) == bin) ++last;
    const auto mean = [&](const auto& value) {
      double sum = 0.0, n = 0.0;
      for (std::size_t i = first; i < last; ++i)
        if (const double v = value(rows[i]); v == v) {
          sum += v;
          n += 1.0;
        }
      return n > 0.0 ? sum / n : kNotMeasured;
    };
    StandPoint p;
    p.row = rows[first].row;
    p.t_s = mean([](const StandPoint& r) { return r.t_s; });
    for (std::size_t k = 0; k < rotors; ++k) p.omega_rad_s[k] = mean([k](const StandPoint& r) { return r.omega_rad_s[k]; });
    for (const StandQuantity q : kAll) place(p, q) = mean([q](StandPoint r) { return place(r, q); });
    means.push_back(p);
    first = std::max(last, first + 1);
  }
  // Slope across at least half a second: between neighbouring means of a fast record it would be noise.
  const std::size_t reach = static_cast<std::size_t>(std::max(1.0, std::ceil(0.25 / m.average_s)));
  std::vector<StandPoint> steady;
  for (std::size_t i = 0; i < means.size(); ++i) {
    // At both ends the slope to one side: there are the zeros of most logs.
    const StandPoint &a = means[i - std::min(i, reach)], &b = means[std::min(i + reach, means.size() - 1)];
    if (!(b.t_s > a.t_s)) continue;
    if (b.t_s - a.t_s > 1.5 * 2.0 * static_cast<double>(reach) * m.average_s) continue;  // a gap
    bool rests = true;
    for (std::size_t k = 0; k < rotors; ++k) rests &= std::abs(b.omega_rad_s[k] - a.omega_rad_s[k]) <= m.slope_max_rad_s2 * (b.t_s - a.t_s);
    if (rests) steady.push_back(means[i]);
  }
  return steady;
}

std::string part_of(const std::string& stem, const std::optional<std::array<std::size_t, 2>>& part) {
  return part && (*part)[0] < stem.size() ? stem.substr((*part)[0], (*part)[1]) : std::string();
}

StandRecord record_of(const log::ColumnTable& file, const log::ColumnTable* joined, const std::filesystem::path& path,
                      const StandMapping& m) {
  const Chosen chosen = choose(m, file, joined);
  StandRecord r;
  r.name = path.filename().generic_string();
  r.motor = part_of(path.stem().string(), m.motor_in_name);
  r.propeller = part_of(path.stem().string(), m.propeller_in_name);
  r.rotors = chosen.at(StandQuantity::rotor_speed)->columns.size();
  r.diameter_m = m.diameter_m.value_or(kNotMeasured);
  r.air_density_kg_m3 = m.air_density_kg_m3;
  r.density_given = m.density_given;
  r.rows = file.rows;
  r.notes = file.notes;
  r.points = rows_of(m, chosen, file);
  if (m.average_s > 0.0) read_on_after_restarts(r.points, r);
  if (joined) r.points = joined_rows(m, chosen, file, r.points, *joined, r.rotors);
  if (m.average_s > 0.0) {
    const std::size_t before = r.points.size();
    r.points = means_of(m, r.points, r.rotors);
    r.means = true;
    r.notes.push_back(fmt::format("{} rows made into {} means of {} s where speed changes by less than {} rad/s^2", before, r.points.size(),
                                  m.average_s, m.slope_max_rad_s2));
  }
  for (auto& p : r.points)
    if (m.efficiency > 0.0 && p.omega_rad_s[0] > 0.0) p.torque_N_m = m.efficiency * p.voltage_V * p.current_A / p.omega_rad_s[0];
  const std::size_t left_out = std::erase_if(r.points, [&](const StandPoint& p) {
    return p.omega_rad_s[0] > m.omega_max_rad_s || (m.shaft_power_min_W > 0.0 && !(p.torque_N_m * p.omega_rad_s[0] >= m.shaft_power_min_W));
  });
  if (left_out > 0) r.notes.push_back(fmt::format("{} points outside the mapping's limits (speed, shaft power) left out", left_out));
  return r;
}

}  // namespace

double sum_omega_squared(const StandRecord& r, const StandPoint& p) {
  double sum = 0.0;
  for (std::size_t k = 0; k < r.rotors; ++k) sum += p.omega_rad_s[k] * p.omega_rad_s[k];
  return sum;
}

StandRecord read_stand_file(const std::filesystem::path& path, const StandMapping& m) {
  std::set<std::string> wanted, wanted_joined;
  for (const auto& c : m.channels) (c.joined ? wanted_joined : wanted).insert(c.columns.begin(), c.columns.end());
  if (m.time_column) wanted.insert(*m.time_column);
  if (m.join) {
    wanted.insert(m.join->to);
    wanted_joined.insert(m.join->key);
  }
  const log::ColumnTable file = log::read_csv_table(path, wanted, {.separator = m.separator, .header = m.header});
  for (const auto& needed : {m.time_column, m.join ? std::optional(m.join->to) : std::nullopt})
    if (needed && !file.has(*needed))
      throw Error({m.path.generic_string(), fmt::format("the column \"{}\" is not in {}", *needed, file.label),
                   "a mapping for another stand", fmt::format("its columns are: {}", log::name_list(file.names))});
  std::optional<log::ColumnTable> joined;
  if (m.join) joined = log::read_csv_table(path.parent_path() / m.join->file, wanted_joined, {.separator = m.separator});

  return record_of(file, joined ? &*joined : nullptr, path, m);
}

StandRecord stand_record(const log::ColumnTable& file, const std::filesystem::path& path, const StandMapping& m) {
  if (m.join) throw Error({m.path.generic_string(), "[join] needs the file itself", "", "read it with read_stand_file"});
  return record_of(file, nullptr, path, m);
}

}  // namespace rotorloop::stand
