#include "bench/stand/evaluate/estimate/stand_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "bench/stand/evaluate/estimate/known_headers.hpp"
#include "bench/stand/evaluate/rest_points.hpp"
#include "bench/sysid/log/column_table.hpp"
#include "host/base/error.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::stand {
namespace {

constexpr double kSameLevel = 0.01;  // of the speed: neighbouring means within it are one step
constexpr double kSameLevel_rad_s = 8.0;
constexpr double kLongestStep_s = 5.0;  // longer rests count as several steps: they show drift
constexpr double kChange = 0.01;        // of the speed, from step to step, that counts as up or down
constexpr double kRestingCurrent_A = 0.02;
constexpr std::size_t kFewestZeros = 3;   // of files of single rows
constexpr std::size_t kMostBlocks = 120;  // of a bootstrap; files of single rows have thousands

struct Mean {
  double sum = 0.0, squares = 0.0, n = 0.0;
  void add(double v) {
    if (v == v) {
      sum += v;
      squares += v * v;
      n += 1.0;
    }
  }
  double value() const { return n > 0.0 ? sum / n : kNotMeasured; }
};

// Standard error of a mean of correlated samples: n_eff = n (1 - r1) / (1 + r1), r1 the correlation of neighbours.
double standard_error(const std::vector<double>& v) {
  const double n = static_cast<double>(v.size());
  if (n < 5.0) return kNotMeasured;
  double mean = 0.0, squares = 0.0, neighbours = 0.0;
  for (const double x : v) mean += x / n;
  for (std::size_t i = 0; i < v.size(); ++i) {
    squares += (v[i] - mean) * (v[i] - mean);
    if (i > 0) neighbours += (v[i] - mean) * (v[i - 1] - mean);
  }
  if (!(squares > 0.0)) return kNotMeasured;
  const double r1 = std::clamp(neighbours / squares, 0.0, 0.95), effective = std::max(2.0, n * (1.0 - r1) / (1.0 + r1));
  return std::sqrt(squares / (n - 1.0) / effective);
}

double speed_of(const StandRecord& r, const StandPoint& p) { return std::sqrt(sum_omega_squared(r, p) / static_cast<double>(r.rotors)); }

bool at_rest(const StandRecord& r, const StandPoint& p) {
  for (std::size_t k = 0; k < r.rotors; ++k)
    if (!(p.omega_rad_s[k] <= kAtRest_rad_s)) return false;
  return true;
}

StandStep step_of(const StandRecord& r, const StandPoint& p) {
  StandStep s;
  s.t_s = p.t_s;
  s.omega_rad_s = at_rest(r, p) ? 0.0 : speed_of(r, p);
  s.thrust_N = p.thrust_N / static_cast<double>(r.rotors);
  s.torque_N_m = p.torque_N_m / static_cast<double>(r.rotors);
  s.voltage_V = p.voltage_V;
  s.current_A = p.current_A / static_cast<double>(r.rotors);
  s.duty = p.command > 0.0 && p.command <= 1.0 ? p.command : kNotMeasured;
  s.airspeed_m_s = p.airspeed_m_s;
  return s;
}

// A stretch of means at one speed as one step.
StandStep merged(const StandRecord& r, const std::vector<StandPoint>& p, std::size_t from, std::size_t to) {
  Mean t, w, thrust, torque, voltage, current, duty, air;
  for (std::size_t i = from; i < to; ++i) {
    const StandStep one = step_of(r, p[i]);
    t.add(one.t_s);
    w.add(one.omega_rad_s);
    thrust.add(one.thrust_N);
    torque.add(one.torque_N_m);
    voltage.add(one.voltage_V);
    current.add(one.current_A);
    duty.add(one.duty);
    air.add(one.airspeed_m_s);
  }
  StandStep s;
  s.t_s = t.value();
  s.omega_rad_s = w.value();
  s.thrust_N = thrust.value();
  s.torque_N_m = torque.value();
  s.voltage_V = voltage.value();
  s.current_A = current.value();
  s.duty = duty.value();
  s.airspeed_m_s = air.value();
  return s;
}

std::vector<StandStep> segmented(const StandRecord& r, const std::vector<StandPoint>& p) {
  std::vector<StandStep> out;
  for (std::size_t first = 0; first < p.size();) {
    const double level = at_rest(r, p[first]) ? 0.0 : speed_of(r, p[first]);
    std::size_t last = first + 1;
    while (last < p.size() && p[last].t_s - p[first].t_s < kLongestStep_s && p[last].t_s - p[last - 1].t_s < 0.5 * kLongestStep_s &&
           std::abs((at_rest(r, p[last]) ? 0.0 : speed_of(r, p[last])) - level) < std::max(kSameLevel * level, kSameLevel_rad_s))
      ++last;
    out.push_back(merged(r, p, first, last));
    first = last;
  }
  return out;
}

void mark_directions(std::vector<StandStep>& steps) {
  double before = 0.0;
  int direction = 1;
  for (auto& s : steps) {
    if (s.omega_rad_s > before * (1.0 + kChange)) direction = 1;
    if (s.omega_rad_s < before * (1.0 - kChange)) direction = -1;
    s.direction = s.omega_rad_s > 0.0 ? direction : 0;
    before = s.omega_rad_s;
  }
}

void number_blocks(std::vector<StandStep>& steps) {
  const std::size_t length = (steps.size() + kMostBlocks - 1) / kMostBlocks;
  for (std::size_t i = 0; i < steps.size(); ++i) steps[i].block = static_cast<int>(i / std::max<std::size_t>(1, length));
}

// Of a density that nobody gave: from 1000 m and 25 °C to sea level in winter is 1.04 to 1.30 kg/m³.
constexpr double kGuessedDensityU = 0.05;

void take_options(StandRun& run, const RunOptions& o, bool density_given) {
  if (o.diameter_m) run.facts.diameter_m = *o.diameter_m;
  if (o.air_density_kg_m3) run.facts.air_density_kg_m3 = *o.air_density_kg_m3;
  if (o.known) run.known = *o.known;
  if (density_given || o.air_density_kg_m3 || run.known.air_density.source != "typical") return;
  run.known.air_density = {kGuessedDensityU, "guess"};
  run.remarks.push_back(
      fmt::format("the air's density is a guess, {:g} kg/m³ with u of {:g} %: nobody gave it (--density, or air_density_kg_m3)",
                  run.facts.air_density_kg_m3, 100.0 * kGuessedDensityU));
}

// Dry air less the share of vapour (ideal gases; the vapour pressure over water after Magnus, as Sonntag 1990 has it).
double moist_air_kg_m3(double temperature_K, double pressure_Pa, double humidity) {
  const double c = temperature_K - 273.15, vapour_Pa = humidity * 611.2 * std::exp(17.62 * c / (243.12 + c));
  return (pressure_Pa - 0.378 * vapour_Pa) / (287.05 * temperature_K);
}

// A current below zero at rest is a sensor's zero: nothing feeds the supply there.
void take_off_resting_current(StandRun& run) {
  Mean rest;
  for (const StandStep& s : run.steps)
    if (!(s.omega_rad_s > 0.0)) rest.add(s.current_A);
  if (!(rest.value() < -kRestingCurrent_A)) return;
  for (StandStep& s : run.steps) s.current_A -= rest.value();
  run.remarks.push_back(
      fmt::format("the current reads {:.3g} A at rest, which is taken off every step: its sensor was not tared", rest.value()));
}

void read_run_facts(const std::filesystem::path& file, StandRun& run, StandRecord& record) {
  const RunFacts& f = run.facts = read_run_toml(file);
  run.known = stand_uncertainty(f.uncertainty, "run");
  if (f.diameter_m == f.diameter_m) record.diameter_m = f.diameter_m;
  if (f.air_density_kg_m3 == f.air_density_kg_m3) {
    record.air_density_kg_m3 = f.air_density_kg_m3;
    record.density_given = true;
  } else if (f.air_temperature_degC == f.air_temperature_degC) {
    record.air_density_kg_m3 =
        moist_air_kg_m3(273.15 + f.air_temperature_degC, f.air_pressure_Pa, f.air_humidity == f.air_humidity ? f.air_humidity : 0.5);

    record.density_given = true;
  }
  if (f.airspeed_m_s == f.airspeed_m_s)
    for (StandPoint& p : record.points) p.airspeed_m_s = f.airspeed_m_s;
}

// Holds of a run's samples, numbered in the column `step`; samples between holds have no number.
std::vector<StandStep> holds(const log::ColumnTable& t, const StandRecord& r) {
  const auto& step = t.columns.find(kStep)->second;
  std::vector<StandStep> out;
  for (std::size_t first = 0; first < r.points.size();) {
    std::size_t last = first + 1;
    while (last < r.points.size() && step[last] == step[first]) ++last;
    if (step[first] == step[first]) {
      StandStep s = merged(r, r.points, first, last);
      std::vector<double> thrust, torque;
      for (std::size_t i = first; i < last; ++i) {
        thrust.push_back(r.points[i].thrust_N);
        torque.push_back(r.points[i].torque_N_m);
      }
      s.thrust_u_N = standard_error(thrust);
      s.torque_u_N_m = standard_error(torque);
      if (s.omega_rad_s < kAtRest_rad_s) s.omega_rad_s = 0.0;
      out.push_back(s);
    }
    first = last;
  }
  return out;
}

void take_series(StandRun& run, const log::ColumnTable& t, const StandRecord& r) {
  const auto target = t.columns.find(kTarget);
  const std::vector<double>* targets = target == t.columns.end() ? nullptr : &target->second;
  for (std::size_t i = 0; i < r.points.size(); ++i) {
    run.samples.t_s.push_back(r.points[i].t_s);
    run.samples.omega_rad_s.push_back(r.points[i].omega_rad_s[0]);
    run.samples.thrust_N.push_back(r.points[i].thrust_N);
    run.samples.torque_N_m.push_back(r.points[i].torque_N_m);
    run.samples.target_rad_s.push_back(targets ? (*targets)[i] : kNotMeasured);
  }
}

// Points for the checks: one for each hold.
StandRecord record_of_holds(StandRecord r, const std::vector<StandStep>& steps) {
  r.points.clear();
  r.means = true;
  for (const StandStep& s : steps) {
    StandPoint p;
    p.t_s = s.t_s;
    p.omega_rad_s[0] = s.omega_rad_s;
    p.thrust_N = s.thrust_N;
    p.torque_N_m = s.torque_N_m;
    p.voltage_V = s.voltage_V;
    p.current_A = s.current_A;
    p.airspeed_m_s = s.airspeed_m_s;
    p.command = s.duty;
    p.row = r.points.size() + 1;
    r.points.push_back(p);
  }
  return r;
}

// Holds that the checks took out for their speed are no steps either.
void drop_misread(StandRun& run) {
  if (run.checked.record.points.empty()) return;
  std::set<std::size_t> left;
  for (const StandPoint& p : run.checked.record.points) left.insert(p.row - 1);
  std::size_t k = 0;  // the number of the step, which is the row of its point less one
  std::erase_if(run.steps, [&](const StandStep& s) {
    const std::size_t step = k++;
    return s.omega_rad_s > 0.0 && !left.contains(step);
  });
}

StandRun read_samples(const std::filesystem::path& file, const std::filesystem::path& facts, const RunOptions& o) {
  const KnownCsv csv = recognise_csv(log::read_log_bytes(file), file);
  const log::ColumnTable& table = csv.table;
  StandRun run;
  StandRecord record = stand_record(table, file, csv.mapping);
  if (!facts.empty()) read_run_facts(facts, run, record);
  if (!table.has(kStep) || !table.has(kTime)) {
    RunOptions with = o;
    if (!with.known) with.known = run.known;
    StandRun out = stand_run(std::move(record), with);
    out.facts.motor = run.facts.motor;
    out.facts.propeller = run.facts.propeller;
    out.facts.mount = run.facts.mount;

    out.facts.pole_pairs = run.facts.pole_pairs;
    out.remarks.insert(out.remarks.begin(), csv.remarks.begin(), csv.remarks.end());
    return out;
  }
  take_series(run, table, record);
  run.facts.duty_along = table.has(kSampleColumns[kDutyColumn].name);
  run.name = facts.empty() ? record.name : facts.parent_path().filename().generic_string();
  run.steps = holds(table, record);
  // A run of chirps or steps alone has no steady point: there is nothing that a channel could be judged by.
  const bool steady = std::any_of(run.steps.begin(), run.steps.end(), [](const StandStep& s) { return s.omega_rad_s > 0.0; });
  if (steady) run.checked = check_stand(record_of_holds(record, run.steps));
  drop_misread(run);
  run.facts.diameter_m = record.diameter_m;
  run.facts.air_density_kg_m3 = record.air_density_kg_m3;
  run.remarks = csv.remarks;
  run.remarks.insert(run.remarks.end(), run.checked.notes.begin(), run.checked.notes.end());
  mark_directions(run.steps);
  number_blocks(run.steps);
  take_options(run, o, record.density_given);
  return run;
}

}  // namespace

StandRun stand_run(StandRecord record, const RunOptions& o) {
  StandRun run;
  run.name = record.name;
  run.facts.motor = record.motor;
  run.facts.propeller = record.propeller;
  run.facts.diameter_m = record.diameter_m;
  run.facts.air_density_kg_m3 = record.air_density_kg_m3;
  const RestPoints at_rest_in(record);
  std::vector<StandPoint> rest;
  std::copy_if(record.points.begin(), record.points.end(), std::back_inserter(rest),
               [&](const StandPoint& p) { return at_rest_in.at_rest(p); });
  if (!record.means && rest.size() < kFewestZeros && !rest.empty()) {
    run.remarks.push_back(fmt::format(
        "{} rows without a speed left out: too few for a zero, and the sensor may have missed a rotor that turned", rest.size()));
    rest.clear();
  }
  const bool timed = !record.points.empty() && record.points.front().t_s == record.points.front().t_s;
  run.checked = check_stand(std::move(record));
  const StandRecord& r = run.checked.record;
  for (StandPoint& p : rest) {
    p.thrust_N *= run.checked.thrust_sign;
    p.torque_N_m *= run.checked.torque_sign;
  }
  std::vector<StandPoint> all = r.points;
  all.insert(all.end(), rest.begin(), rest.end());
  std::stable_sort(all.begin(), all.end(), [&](const StandPoint& a, const StandPoint& b) { return timed ? a.t_s < b.t_s : a.row < b.row; });
  if (r.means)
    run.steps = segmented(r, all);
  else
    for (const auto& p : all) run.steps.push_back(step_of(r, p));
  take_off_resting_current(run);
  mark_directions(run.steps);
  number_blocks(run.steps);
  take_options(run, o, record.density_given);
  run.remarks.insert(run.remarks.begin(), r.notes.begin(), r.notes.end());
  run.remarks.insert(run.remarks.end(), run.checked.notes.begin(), run.checked.notes.end());
  return run;
}

StandRun read_stand_run(const std::filesystem::path& path, const RunOptions& o) {
  std::error_code ec;
  if (std::filesystem::is_directory(path, ec)) return read_samples(path / kSamplesFile, path / kFactsFile, o);
  if (o.mapping) return stand_run(read_stand_file(path, *o.mapping), o);
  return read_samples(path, {}, o);
}

}  // namespace rotorloop::stand
