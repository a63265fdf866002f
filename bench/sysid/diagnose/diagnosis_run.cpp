#include "bench/sysid/diagnose/diagnosis_run.hpp"

#include <fmt/format.h>

#include "bench/sysid/identify/identified_vehicle.hpp"
#include "bench/sysid/log/log_mapping.hpp"
#include "host/base/nearest.hpp"
#include "host/base/sha256.hpp"
#include "rotorloop_version.hpp"

namespace rotorloop::diagnose {
namespace {

DiagnoseOptions diagnose_options(const DiagnosisRequest& r, const std::vector<identify::FlightToFit>& flights, const NominalModel& nominal,
                                 estimate::StopFit stop) {
  DiagnoseOptions d;
  identify::IdentifyOptions& i = d.identify;
  identify::FitRequest fit = r.fit;
  fit.use_what_all_have(flights);
  fit.free_place_of_accelerometer(nominal.vehicle);
  fit.apply(i);
  i.grid.longest_substep_s = 1e-2;  // rotor speeds change over 30 ms, the rest is slower
  i.grid.slopes_by_middle = true;
  for (const host::VehicleEffect& e : nominal.vehicle.effects) {
    if (const host::Term* term = host::find_term(e.id)) i.terms.add(*term);
  }
  d.library = r.own;
  for (std::size_t t = 0; nominal.own && t < nominal.own->size(); ++t) d.library.push_back(&(*nominal.own)[t]);
  for (const host::Term* term : d.library) {
    for (const host::VehicleEffect& e : nominal.vehicle.effects) {
      if (e.id == term->info.id) i.terms.add(*term);
    }
  }
  i.fit.noise.rounds = 16;
  i.fit.noise.tolerance = 0.05;
  i.fit.max_iterations = 80;
  i.fit.tolerance = 0.02;  // of the log likelihood: far below what any decision turns on
  i.fit.noise.per_flight = true;
  i.fit.stop = stop;
  d.without = r.without;
  d.priors = r.priors;
  d.max_effects = r.max_effects;
  d.refit_iterations = r.refit_iterations;
  d.placebos = r.placebos;
  d.seed = r.seed;
  d.wrench_band = r.wrench_band;
  return d;
}

void refuse_unknown_effects(const std::vector<std::string>& ids, const host::EffectCatalogue& catalogue) {
  std::vector<std::string> known;
  for (const host::CatalogueEffect& e : catalogue.effects) known.push_back(e.id);
  for (const std::string& id : ids)
    if (!catalogue.find(id))
      throw Error({"--without", fmt::format("\"{}\" is no effect of the catalogue", id), "",
                   did_you_mean(id, known) + "effects/catalogue.toml lists them"});
}

// What the mapping calls the speeds of our rotors 1 to 4.
std::array<std::string, 4> rotor_columns(const std::filesystem::path& mapping) {
  std::array<std::string, 4> out;
  if (mapping.empty()) return out;
  for (const log::MappedStream& s : log::read_log_mapping(mapping).streams) {
    if (s.quantity != log::LogQuantity::rotor_speed || s.columns.size() != out.size()) continue;
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = s.columns[i].name;
    return out;
  }
  return out;
}

}  // namespace

NominalModel read_nominal_model(const DiagnosisRequest& r) {
  NominalModel out{host::builtin_effect_catalogue(), std::nullopt, {}};
  if (!r.library.empty()) {
    out.own = host::UserTerms::read(r.library, out.catalogue);
    out.own->join(out.catalogue);
  }
  refuse_unknown_effects(r.without, out.catalogue);
  out.vehicle = host::read_vehicle(r.vehicle, out.catalogue);
  return out;
}

DiagnosedFlights run_diagnosis(const DiagnosisRequest& r, const DiagnosisWatch& watch) {
  DiagnosedFlights out{read_nominal_model(r), {}, {}};
  const host::VehicleFile& base = out.nominal.vehicle;
  log::FlightSet& read = out.flights;
  try {
    read = log::read_flight_set(r.flights, host::to_model(base), watch.reading);
  } catch (const Error& e) {
    if (e.exit_code() != ExitCode::data_quality) throw;
    // A verdict, not an error: the fault is what was to be found.
    out.fault = e;
    out.run.diagnosis.verdict = DiagnosisVerdict::faulty;
    out.run.diagnosis.faults.push_back({e.text().where, "", e.text().what, 0.0, 0.0});
    return out;
  }
  read.inputs.insert(read.inputs.begin(), {r.vehicle.generic_string(), sha256_file(r.vehicle)});
  if (out.nominal.own) read.inputs.insert(read.inputs.begin() + 1, {r.library.generic_string(), sha256_file(r.library)});
  FlightsToDiagnose flights{.fitted = read.to_fit(),
                            .held_out = read.held_out(),
                            .findings = {},
                            .refused = read.refused,
                            .rotor_columns = rotor_columns(r.flights.mapping)};
  for (std::size_t f = 0; f < read.checked.size() && f < read.fitted; ++f) flights.findings.push_back(read.checked[f].findings);
  out.run = diagnose(flights, base, diagnose_options(r, read.flights, out.nominal, watch.stop), watch.progress);
  if (out.run.diagnosis.verdict == DiagnosisVerdict::incomplete) return out;
  out.vehicle = identify::identified_vehicle(out.run.after.fit, base, identify::flown_rpm(out.run.after.flights),
                                             std::string("rotorloop diagnose ") + kVersion, read.fitted_hashes());
  out.problem = identify::not_credible(r.out, *out.vehicle, out.nominal.catalogue);
  return out;
}

}  // namespace rotorloop::diagnose
