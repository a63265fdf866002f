#include "bench/diagnose/report/diagnosis_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "bench/diagnose/ratios.hpp"

namespace rotorloop::diagnose {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kShown = 12;  // candidates of a round, in the text

std::string value_text(const NamedValue& v) {
  return fmt::format("{} = {:.4g} ± {:.2g}{}", v.name, v.value, v.u, v.unit == "1" || v.unit.empty() ? "" : " " + v.unit);
}
std::string values_text(const std::vector<NamedValue>& all) {
  std::string out;
  for (const NamedValue& v : all) out += (out.empty() ? "" : ", ") + value_text(v);
  return out;
}

// Named or a class, and not all of it.
bool more_remains(const Diagnosis& d) { return !d.added.empty() && !d.remains.empty(); }

std::string verdict_words(const Diagnosis& d) {
  switch (d.verdict) {
    case DiagnosisVerdict::clean:
      return "clean: these flights show nothing that the model lacks";
    case DiagnosisVerdict::named:
      return "named: the model lacks what stands below";
    case DiagnosisVerdict::ambiguous:
      return "ambiguous: the model lacks what stands below; these flights cannot tell all of it from its twins";
    case DiagnosisVerdict::unexplained:
      return "unexplained: the residual is real, and no effect of the library explains it";
    case DiagnosisVerdict::faulty:
      return "faulty: a sensor or the log is at fault; no physics was fitted to it";
  }
  return "";
}

ordered_json remains_json(const std::vector<RemainingResidual>& all) {
  ordered_json out = ordered_json::array();
  for (const RemainingResidual& r : all)
    out.push_back({{"axis", r.axis},
                   {"unit", r.unit},
                   {"kind", r.bursts ? "bursts" : "systematic"},
                   {"share", r.share},
                   {"beyond_noise_rms", r.beyond},
                   {"limit_rms", r.matters}});
  return out;
}

ordered_json number(double v) { return std::isfinite(v) ? ordered_json(v) : ordered_json(nullptr); }

ordered_json values_json(const std::vector<NamedValue>& all) {
  ordered_json out = ordered_json::array();
  for (const NamedValue& v : all) out.push_back({{"name", v.name}, {"unit", v.unit}, {"value", number(v.value)}, {"u", number(v.u)}});
  return out;
}

ordered_json evidence_json(const CandidateEvidence& e) {
  return {{"id", e.id},
          {"one_step", values_json(e.one_step)},
          {"chi2", number(e.chi2)},
          {"wald", number(e.wald)},
          {"degrees", e.degrees},
          {"p", number(e.p)},
          {"p_holm", number(e.p_holm)},
          {"gain", number(e.gain)},
          {"gain_relative", number(e.gain_relative)},
          {"bic", number(e.bic)},
          {"cross_validated", number(e.cross_validated)},
          {"rise", number(e.rise)},
          {"variation", number(e.variation)},
          {"scatter", number(e.scatter)},
          {"inside_bounds", e.inside_bounds},
          {"detectable", number(e.detectable)},
          {"typical", number(e.typical)},
          {"ruled_out_by", e.ruled_out_by}};
}

ordered_json axes_json(const identify::WrenchAxes& v) {
  ordered_json out = ordered_json::array();
  for (Eigen::Index i = 0; i < 6; ++i) out.push_back(number(v[i]));
  return out;
}

// Axes: force x, y, z in N, torque x, y, z in N m; the last score is that of all flights.
ordered_json wrench_json(const identify::WrenchComparison& c) {
  const auto scores = [](const std::vector<identify::WrenchScore>& all) {
    ordered_json out = ordered_json::array();
    for (const identify::WrenchScore& s : all)
      out.push_back({{"flight", s.flight},
                     {"samples", s.samples},
                     {"delay_s", number(s.delay_s)},
                     {"rms", axes_json(s.rms)},
                     {"explained", axes_json(s.explained)}});
    return out;
  };
  return {{"from_Hz", c.band.from_Hz},
          {"to_Hz", c.band.to_Hz},
          {"before", scores(c.before)},
          {"after", scores(c.after)},
          {"before_aligned", scores(c.before_aligned)},
          {"after_aligned", scores(c.after_aligned)}};
}

ordered_json log_json(const std::vector<LogFault>& all) {
  ordered_json out = ordered_json::array();
  for (const LogFault& f : all)
    out.push_back({{"flight", f.flight}, {"stream", f.stream}, {"what", f.what}, {"from_s", f.from_s}, {"to_s", f.to_s}});
  return out;
}

ordered_json advice_json(const ManoeuvreAdvice& a) {
  ordered_json ranked = ordered_json::array();
  for (const ManoeuvreValue& v : a.ranked) {
    ordered_json from = ordered_json::object();
    for (std::size_t b = 0; b < a.twins.size(); ++b) from[a.twins[b]] = number(v.separation[b]);
    ranked.push_back({{"id", v.id}, {"words", v.words}, {"separation", from}, {"least", number(v.least)}});
  }
  return {{"seconds", a.seconds}, {"not_told", a.open}, {"impossible", a.impossible}, {"manoeuvres", ranked}};
}

ordered_json added_json(const std::vector<AddedEffect>& effects) {
  ordered_json added = ordered_json::array();
  for (const AddedEffect& a : effects) {
    ordered_json twins = ordered_json::array(), shifts = ordered_json::array();
    for (const ClassMember& m : a.twins)
      twins.push_back({{"id", m.id},
                       {"correlation", number(m.correlation)},
                       {"gain_share", number(m.gain_share)},
                       {"parameters", values_json(m.parameters)}});
    for (const auto& [name, change] : a.shifts) shifts.push_back({{"parameter", name}, {"relative", number(change)}});
    added.push_back({{"id", a.id},
                     {"parameters", values_json(a.parameters)},
                     {"twins", twins},
                     {"determined", ratios_text(a.ratios)},
                     {"ratios", values_json(a.ratios)},
                     {"manoeuvre", a.manoeuvre},
                     {"manoeuvre_search", advice_json(a.advice)},
                     {"evidence", evidence_json(a.evidence)},
                     {"shifts", shifts}});
  }
  return added;
}

}  // namespace

std::string verdict_name(const Diagnosis& d) { return std::string(name(d.verdict)) + (more_remains(d) ? ", and something remains" : ""); }

std::string remaining_text(const RemainingResidual& r) {
  return fmt::format("{:.0f} % of the power of the missing {} {}; {:.2g} {} rms beyond the noise, {:.2g} matter", 100.0 * r.share, r.axis,
                     r.bursts ? "comes in bursts" : "is predictable and no effect of the library explains it", r.beyond, r.unit, r.matters);
}

std::string diagnosis_text(const DiagnosisRun& run) {
  const Diagnosis& d = run.diagnosis;
  std::string out = "Verdict: " + verdict_words(d) + (more_remains(d) ? "; and something remains" : "") + "\n";
  for (const LogFault& f : d.faults)
    out += fmt::format("  fault  {}  {}: {} ({:.2f} to {:.2f} s)\n", f.flight, f.stream, f.what, f.from_s, f.to_s);
  for (const AddedEffect& a : d.added) {
    out += fmt::format("  {}: {}\n", a.id, values_text(a.parameters));
    out +=
        fmt::format("      W {:.1f}, gain {:.1f}, on other blocks {:.1f}\n", a.evidence.wald, a.evidence.gain, a.evidence.cross_validated);
    for (const ClassMember& m : a.twins)
      out += fmt::format("      or {}: {} (correlation {:.2f}, {:.0f} % of the gain)\n", m.id, values_text(m.parameters), m.correlation,
                         100.0 * m.gain_share);
    if (!a.ratios.empty()) out += "      determined: " + ratios_text(a.ratios) + "\n";
    if (!a.manoeuvre.empty()) out += "      fly: " + a.manoeuvre + "\n";
    std::string moved;
    for (const auto& [name, change] : a.shifts) moved += fmt::format("{}{} {:+.1f} %", moved.empty() ? "" : ", ", name, 100.0 * change);
    if (!moved.empty()) out += "      moved " + moved + "\n";
  }
  for (const RemainingResidual& r : d.remains) out += "  remains: " + remaining_text(r) + "\n";
  for (const std::string& r : d.remarks) out += "  " + r + "\n";
  for (std::size_t i = 0; i < d.rounds.size(); ++i) {
    const DiagnosisRound& r = d.rounds[i];
    out += fmt::format("\nScreening {}: {} candidates; {}; {}\n", i + 1, r.candidates.size(), words(r.placebos), r.decision);
    out += fmt::format("  {:<26} {:>8} {:>9} {:>9} {:>9}  {}\n", "effect", "W", "p (Holm)", "gain", "held",
                       "estimate; what speaks against it");
    for (std::size_t k = 0; k < std::min(kShown, r.candidates.size()); ++k) {
      const CandidateEvidence& e = r.candidates[k];
      out += fmt::format("  {:<26} {:>8.1f} {:>9.1e} {:>9.1f} {:>9.1f}  {}{}{}\n", e.id, e.wald, e.p_holm, e.gain, e.cross_validated,
                         e.one_step.empty() ? "" : value_text(e.one_step.front()), e.ruled_out_by.empty() ? "" : "; ", e.ruled_out_by);
    }
  }
  if (!d.rejected.empty()) {
    out += "\nTried and taken out again:\n";
    for (const CandidateEvidence& e : d.rejected) out += fmt::format("  {:<26} {}\n", e.id, e.ruled_out_by);
  }
  if (!d.not_observable.empty()) {
    out += "\nThese flights could not have shown:\n";
    for (const NotObservable& n : d.not_observable)
      out += fmt::format("  {:<26} {}{}{}\n", n.id, n.why, n.needs.empty() ? "" : "; ", n.needs);
  }
  if (!d.left_out.empty()) {
    out += "\nLeft out, as no fault of a sensor:\n";
    for (const LogFault& f : d.left_out)
      out += fmt::format("  {}  {}: {} ({:.2f} to {:.2f} s)\n", f.flight, f.stream, f.what, f.from_s, f.to_s);
  }
  return out;
}

std::string diagnosis_json(const DiagnosisRun& run, const identify::IdentifyProvenance& from) {
  const Diagnosis& d = run.diagnosis;
  ordered_json rounds = ordered_json::array(), rejected = ordered_json::array(),
               hidden = ordered_json::array(), inputs = ordered_json::array();
  for (const DiagnosisRound& r : d.rounds) {
    ordered_json candidates = ordered_json::array();
    for (const CandidateEvidence& e : r.candidates) candidates.push_back(evidence_json(e));
    rounds.push_back({{"placebos", r.placebos.placebos},
                      {"placebo_level", number(r.placebos.level)},
                      {"placebo_wald", number(r.placebos.wald)},
                      {"decision", r.decision},
                      {"candidates", candidates}});
  }
  for (const CandidateEvidence& e : d.rejected) rejected.push_back(evidence_json(e));
  for (const NotObservable& n : d.not_observable)
    hidden.push_back({{"id", n.id},
                      {"why", n.why},
                      {"needs", n.needs},
                      {"detectable", number(n.detectable)},
                      {"typical", number(n.typical)},
                      {"unit", n.unit}});
  for (const identify::InputHash& i : from.inputs) inputs.push_back(identify::input_json(i));
  ordered_json out{
      {"format", 1},
      {"made_by", "rotorloop diagnose"},
      {"verdict", std::string(name(d.verdict))},
      {"remains", remains_json(d.remains)},
      {"added", added_json(d.added)},
      {"rejected", rejected},
      {"not_observable", hidden},
      {"faults", log_json(d.faults)},
      {"left_out", log_json(d.left_out)},
      {"white", d.white},
      {"remarks", d.remarks},
      {"log_likelihood", {{"before", number(run.before.fit.log_likelihood)}, {"after", number(run.after.fit.log_likelihood)}}},
      {"rounds", rounds},
      {"provenance",
       {{"version", from.version}, {"git", from.git}, {"started_utc", from.started_utc}, {"wall_s", from.wall_s}, {"inputs", inputs}}}};
  if (run.held_out) {
    out["held_out"] = identify::held_out_json(*run.held_out);
    if (!run.held_out->wrench.after.empty()) out["held_out"]["wrench"] = wrench_json(run.held_out->wrench);
  }
  return out.dump(1) + "\n";
}

}  // namespace rotorloop::diagnose
