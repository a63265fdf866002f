#include "bench/sysid/log/flight_set.hpp"

#include <cmath>

#include "bench/sysid/log/read_flight.hpp"
#include "host/base/error.hpp"
#include "host/base/sha256.hpp"

namespace rotorloop::log {

namespace fs = std::filesystem;

FlightSet read_flight_set(const FlightPaths& o, const host::VehicleModel& vehicle, const ReadingWatch& watch) {
  std::optional<LogMapping> mapping;
  FlightSet out;
  if (!o.mapping.empty()) {
    mapping = read_log_mapping(o.mapping);
    out.inputs.push_back({o.mapping.generic_string(), sha256_file(o.mapping)});
  }
  const auto read = [&](const std::vector<fs::path>& paths, FlightRole role) {
    for (const fs::path& path : paths) {
      std::vector<LogFinding> notes;
      FlightToFit f{read_flight(path, mapping ? &*mapping : nullptr, &notes), role, {}, {}};
      const fs::path file = fs::is_directory(path) ? path / "flight.csv" : path;
      out.inputs.push_back({file.generic_string(), sha256_file(file)});
      if (o.checks) {
        CheckedFlight checked = check_flight(f.record, vehicle);
        checked.findings.insert(checked.findings.begin(), notes.begin(), notes.end());
        if (watch.checked && !checked.findings.empty()) watch.checked(checked);
        if (checked.refusal) {
          out.inputs.pop_back();
          out.refused.push_back(std::move(checked));
          continue;
        }
        f.record = checked.flight;
        f.segments = checked.segments;
        // Below three of its standard uncertainties an offset is none.
        const auto late = checked.offsets.between("pose", "gyro");
        if (late && std::fabs(late->late_s) > 3.0 * late->u_s) f.pose_late_s = late->late_s;
        out.checked.push_back(std::move(checked));
      }
      out.flights.push_back(std::move(f));
    }
  };
  read(o.vertical, FlightRole::vertical);
  read(o.horizontal, FlightRole::horizontal);
  read(o.rotation, FlightRole::rotation);
  read(o.flights, FlightRole::any);
  out.fitted = out.flights.size();
  if (out.fitted == 0 && !out.refused.empty()) out.refused.front().throw_if_refused();
  const std::size_t fitted_inputs = out.inputs.size();
  read(o.held_out, FlightRole::any);
  for (std::size_t h = fitted_inputs; h < out.inputs.size(); ++h) {
    out.inputs[h].held_out = true;
    for (std::size_t f = 0; f < fitted_inputs; ++f) {
      if (out.inputs[h].sha256 != out.inputs[f].sha256) continue;
      throw Error(
          {out.inputs[h].path, "is held out and also fitted: " + out.inputs[f].path, "", "hold out a flight that has no part in the fit"});
    }
  }
  if (watch.read) watch.read(out);
  if (out.fitted == 0) throw Error({"", "no flight is named", "", "name logs with --flight (or --vertical, --horizontal, --rotation)"});
  return out;
}

std::vector<FlightToFit> FlightSet::to_fit() const { return {flights.begin(), flights.begin() + static_cast<std::ptrdiff_t>(fitted)}; }
std::vector<FlightToFit> FlightSet::held_out() const { return {flights.begin() + static_cast<std::ptrdiff_t>(fitted), flights.end()}; }

std::vector<CheckedFlight> FlightSet::all_checked() const {
  std::vector<CheckedFlight> out = checked;
  out.insert(out.end(), refused.begin(), refused.end());
  return out;
}

std::vector<std::string> FlightSet::fitted_hashes() const {
  std::vector<std::string> out;
  for (const InputHash& i : inputs) {
    if (!i.held_out) out.push_back("sha256:" + i.sha256);
  }
  return out;
}

}  // namespace rotorloop::log
