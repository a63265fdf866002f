#include "cli/flight_inputs.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <optional>

#include "bench/sysid/log/read_flight.hpp"
#include "cli/ending/refusal.hpp"
#include "host/base/error.hpp"
#include "host/base/sha256.hpp"

namespace rotorloop::cli {

namespace fs = std::filesystem;

FlightInputs read_flights(const FlightPaths& o, const host::VehicleModel& vehicle) {
  std::optional<log::LogMapping> mapping;
  FlightInputs out;
  if (!o.mapping.empty()) {
    mapping = log::read_log_mapping(o.mapping);
    out.inputs.push_back({o.mapping.generic_string(), sha256_file(o.mapping)});
  }
  const auto read = [&](const std::vector<fs::path>& paths, identify::FlightRole role) {
    for (const fs::path& path : paths) {
      std::vector<log::LogFinding> notes;
      identify::FlightToFit f{log::read_flight(path, mapping ? &*mapping : nullptr, &notes), role, {}, {}};
      const fs::path file = fs::is_directory(path) ? path / "flight.csv" : path;
      out.inputs.push_back({file.generic_string(), sha256_file(file)});
      if (o.checks) {
        log::CheckedFlight checked = log::check_flight(f.record, vehicle);
        checked.findings.insert(checked.findings.begin(), notes.begin(), notes.end());
        if (!o.quiet && !checked.findings.empty()) fmt::print(stderr, "{}", log::findings_table(checked));
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
  read(o.vertical, identify::FlightRole::vertical);
  read(o.horizontal, identify::FlightRole::horizontal);
  read(o.rotation, identify::FlightRole::rotation);
  read(o.flights, identify::FlightRole::any);
  out.fitted = out.flights.size();
  if (out.fitted == 0 && !out.refused.empty()) out.refused.front().throw_if_refused();
  const std::size_t fitted_inputs = out.inputs.size();
  read(o.held_out, identify::FlightRole::any);
  for (std::size_t h = fitted_inputs; h < out.inputs.size(); ++h) {
    out.inputs[h].held_out = true;
    for (std::size_t f = 0; f < fitted_inputs; ++f) {
      if (out.inputs[h].sha256 != out.inputs[f].sha256) continue;
      throw Error(
          {out.inputs[h].path, "is held out and also fitted: " + out.inputs[f].path, "", "hold out a flight that has no part in the fit"});
    }
  }
  for (const log::CheckedFlight& r : out.refused)
    fmt::print(stderr, "warning: {} is left out, refused by the checks: {}\n", r.flight.name, r.refusal->what);
  if (out.fitted == 0) throw Error({"", "no flight is named", "", "name logs with --flight (or --vertical, --horizontal, --rotation)"});
  return out;
}

std::vector<identify::FlightToFit> FlightInputs::to_fit() const {
  return {flights.begin(), flights.begin() + static_cast<std::ptrdiff_t>(fitted)};
}
std::vector<identify::FlightToFit> FlightInputs::held_out() const {
  return {flights.begin() + static_cast<std::ptrdiff_t>(fitted), flights.end()};
}

std::vector<log::CheckedFlight> FlightInputs::all_checked() const {
  std::vector<log::CheckedFlight> out = checked;
  out.insert(out.end(), refused.begin(), refused.end());
  return out;
}

std::vector<std::string> FlightInputs::fitted_hashes() const {
  std::vector<std::string> out;
  for (const identify::InputHash& i : inputs) {
    if (!i.held_out) out.push_back("sha256:" + i.sha256);
  }
  return out;
}

host::TermList term_list(const std::vector<std::string>& ids) {
  host::TermList list;
  for (const std::string& id : ids) {
    const host::Term* term = host::find_term(id);
    if (!term) {
      std::vector<std::string> known;
      for (const host::Term& t : host::all_terms()) known.emplace_back(t.info.id);
      throw Error({"--term " + id, "is no term that can be fitted", "", use_one_of(id, known)});
    }
    if (!list.add(*term)) throw Error({"--term " + id, "is given twice", "", "give it once"});
  }
  return list;
}

}  // namespace rotorloop::cli
