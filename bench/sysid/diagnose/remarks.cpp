#include "bench/sysid/diagnose/remarks.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "bench/render/digits.hpp"
#include "bench/sysid/diagnose/vehicle_priors.hpp"
#include "host/base/constants.hpp"
#include "host/vehicle/effect_catalogue.hpp"

namespace rotorloop::diagnose {
namespace {

// "front left": where a rotor sits.
std::string place_of_rotor(const Eigen::Vector3d& p) {
  constexpr double kOnAxis_m = 1e-3;
  const std::string along = p.x() > kOnAxis_m ? "front" : p.x() < -kOnAxis_m ? "rear" : "";
  const std::string across = p.y() > kOnAxis_m ? "left" : p.y() < -kOnAxis_m ? "right" : "";
  return along + (along.empty() || across.empty() ? "" : " ") + across;
}

constexpr std::string_view kRate = "rate";  // a share that changes with time, 1/s

// In the unit of a mechanic: degrees, per cent, milliseconds, millimetres, grams.
std::string everyday(const NamedValue& v) {
  const struct {
    const char *unit, *everyday;
    double factor;
  } kUnits[] = {
      {"1/s", "% a minute", 6e3}, {"rad", "deg", kDeg_per_rad}, {"1", "%", 100.0}, {"s", "ms", 1e3}, {"m", "mm", 1e3}, {"kg", "g", 1e3}};
  for (const auto& u : kUnits) {
    if (u.unit == std::string_view("1/s") && !v.name.starts_with(kRate)) continue;
    if (v.unit == u.unit && std::fabs(u.factor * v.value) < 1e3) return fmt::format("{:+.2g} {}", u.factor * v.value, u.everyday);
  }
  return fmt::format("{:+.3g}{}{}", v.value, v.unit == "1" ? "" : " ", v.unit == "1" ? "" : v.unit);
}

// Of one number for each rotor the rotor stands in its place; else "pitch -3.0 deg": the name without its unit.
std::string in_words(const NamedValue& v, const host::LoadGeometry& geometry, const std::array<std::string, 4>& rotor_columns) {
  const std::size_t end = v.name.size() - 1;
  if (v.name.size() > 2 && v.name[end - 1] == '_' && v.name[end] >= '1' && v.name[end] <= '4') {
    const auto rotor = static_cast<std::size_t>(v.name[end] - '1');
    const std::string& column = rotor_columns[rotor];
    return fmt::format("rotor {} ({}{}) {}", rotor + 1, place_of_rotor(geometry.rotors[rotor].position_m),
                       column.empty() ? "" : ", " + column + " in this log", everyday(v));
  }
  std::string name = v.name;
  for (const char* unit : {"_rad", "_1_s", "_m_s", "_s", "_m", "_kg"}) {  // the longer of two that both fit first
    const std::string_view u = unit;
    if (name.size() > u.size() && name.ends_with(u)) {
      name.resize(name.size() - u.size());
      break;
    }
  }
  std::replace(name.begin(), name.end(), '_', ' ');
  return name + " " + everyday(v);
}

}  // namespace

void add_words(const estimate::ModelValues& vehicle, const std::array<std::string, 4>& rotor_columns, const Criteria& criteria,
               Diagnosis& d) {
  const host::EffectCatalogue& catalogue = host::builtin_effect_catalogue();
  for (AddedEffect& a : d.added) {
    const host::CatalogueEffect* row = catalogue.find(a.id);
    if (!row) continue;
    a.next = row->next;
    std::vector<std::string> words;
    for (const NamedValue& v : a.parameters) {
      const auto p = std::find_if(row->model.begin(), row->model.end(), [&](const auto& one) { return one.name == v.name; });
      const double neutral = p == row->model.end() ? row->parameter.neutral : p->neutral;
      if (std::fabs(v.value - neutral) > criteria.fewest_u * v.u) words.push_back(in_words(v, vehicle.geometry, rotor_columns));
    }
    a.in_words = fmt::format("{}", fmt::join(words, ", "));
  }
}

void note_unfinished(const std::vector<RefitCandidate>& ranked, Diagnosis& d) {
  for (const RefitCandidate& c : ranked) {
    const std::string& id = c.tested->candidate->id;
    if (c.failure.id != Rejection::out_of_iterations || std::find(d.not_judged.begin(), d.not_judged.end(), id) != d.not_judged.end())
      continue;
    d.not_judged.push_back(id);
    d.remarks.push_back(fmt::format(
        "{} was not judged: its refit was not done after {:.0f} iterations. With --refit-iterations it gets more; until then it may be "
        "what is missing.",
        id, c.failure.figures.front().value));
  }
}

void note_contradictions(const identify::Identification& model, Diagnosis& d) {
  constexpr std::size_t kMostReported = 5;
  const std::vector<Contradiction> all = contradictions(model.problem, model.fit);
  for (std::size_t i = 0; i < std::min(kMostReported, all.size()); ++i) {
    const Contradiction& c = all[i];
    const estimate::ParameterInfo info = estimate::parameter_info(c.parameter, model.problem.start.terms);
    d.remarks.push_back(fmt::format(
        "The flights contradict what the file knows of {}: {} {} there, {} with them ({:.1f} "
        "standard deviations).",
        info.name, render::measured_text(c.prior, c.prior_u), info.unit, render::measured_text(c.found, c.found_u), std::fabs(c.z)));
  }
}

void note_placebos(const Criteria& criteria, Diagnosis& d) {
  const double level = 1.0 - criteria.chance;
  const PlaceboLimit& first = d.rounds.front().placebos;
  if (first.placebos == 0) {
    d.remarks.push_back("No placebos: the only test against chance is the scatter between blocks of the flights (p after Holm).");
  } else if (first.level < level) {
    d.remarks.push_back(fmt::format("{} placebos are too few for a level of {:.0f} %: their largest is one of {:.1f} %.", first.placebos,
                                    100.0 * level, 100.0 * first.level));
  }
}

std::string measurements_used(const identify::Identification& r) {
  const auto any = [&](auto estimate::GridFlight::*list) {
    return std::any_of(r.flights.begin(), r.flights.end(), [&](const estimate::GridFlight& g) { return !(g.*list).empty(); });
  };
  std::vector<std::string_view> used;
  if (any(&estimate::GridFlight::pose)) used.push_back("poses");
  if (any(&estimate::GridFlight::position)) used.push_back("positions");
  if (any(&estimate::GridFlight::velocity)) used.push_back("velocities");
  if (any(&estimate::GridFlight::gyro)) used.push_back("gyro");
  if (any(&estimate::GridFlight::accel)) used.push_back("accelerometer");
  if (any(&estimate::GridFlight::load_W_m)) used.push_back("place of the load");
  return fmt::format("Measurements used: {}.", fmt::join(used, ", "));
}

std::string mass_beside_body(const std::string& id, double load_kg, double body_kg) {
  const double share = body_kg / (body_kg + load_kg);
  return fmt::format(
      "{}: {:.3g} g beside the mass of the vehicle file. If {:.4g} g was weighed with the load, the load is {:.3g} g, and all forces, "
      "torques "
      "and inertias are {:.4g} times those here: flights alone do not determine which.",
      id, 1e3 * load_kg, 1e3 * body_kg, 1e3 * share * load_kg, share);
}

void report_checks(const FlightsToDiagnose& flights, Diagnosis& d) {
  for (std::size_t f = 0; f < flights.findings.size(); ++f) {
    for (const log::LogFinding& finding : flights.findings[f]) {
      if (finding.action == log::FindingAction::note) continue;
      auto& list = finding.fault ? d.faults : d.left_out;
      list.push_back({flights.fitted[f].record.name, finding.stream, finding.what, finding.from_s, finding.to_s});
    }
  }
  for (const log::CheckedFlight& refused : flights.refused) {
    d.faults.push_back({refused.flight.name, "", refused.refusal->what, 0.0, 0.0});
    d.remarks.push_back(fmt::format("{} is left out: the checks refuse it ({}).", refused.flight.name, refused.refusal->what));
  }
}

}  // namespace rotorloop::diagnose
