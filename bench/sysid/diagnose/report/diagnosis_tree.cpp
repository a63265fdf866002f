// result.json of a diagnosis: every figure that text and page show, as a tree.
#include "bench/sysid/diagnose/report/diagnosis_tree.hpp"

#include <nlohmann/json.hpp>

#include "bench/sysid/diagnose/ratios.hpp"
#include "bench/sysid/diagnose/report/diagnosis_outcome.hpp"
#include "bench/sysid/diagnose/report/rejection_text.hpp"
#include "bench/sysid/diagnose/report/residual_tree.hpp"
#include "bench/sysid/identify/report/identify_result.hpp"
#include "bench/sysid/identify/report/tree_values.hpp"

namespace rotorloop::diagnose {
namespace {

using identify::array_of;
using identify::number;
using nlohmann::ordered_json;

ordered_json text_or_null(const std::string& text) { return text.empty() ? ordered_json(nullptr) : ordered_json(text); }

ordered_json remains_json(const std::vector<RemainingResidual>& all) {
  ordered_json out = ordered_json::array();
  for (const RemainingResidual& r : all)
    out.push_back({{"axis", r.axis},
                   {"unit", r.unit},
                   {"kind", std::string(name(r.kind))},
                   {"flight", r.flight},
                   {"share", r.share},
                   {"beyond_noise_rms", r.beyond},
                   {"limit_rms", r.matters},
                   {"words", r.words}});
  return out;
}

ordered_json values_json(const std::vector<NamedValue>& all) {
  ordered_json out = ordered_json::array();
  for (const NamedValue& v : all) out.push_back({{"name", v.name}, {"unit", v.unit}, {"value", number(v.value)}, {"u", number(v.u)}});
  return out;
}

ordered_json reason_json(const Reason& r) {
  if (r.none()) return nullptr;
  return {{"id", name(r.id)},
          {"figures",
           array_of(r.figures,
                    [](const RejectionFigure& f) {
                      return ordered_json{{"name", f.name}, {"unit", f.unit}, {"value", number(f.value)}, {"limit", number(f.limit)}};
                    })},
          {"effect", text_or_null(r.effect)},
          {"detail", text_or_null(r.detail)},
          {"refitted_as", text_or_null(r.as)}};
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
          {"delta_log_likelihood", number(e.delta_log_likelihood)},
          {"refit_iterations", e.refit_iterations},
          {"optimism", number(e.optimism)},
          {"relative_size", number(e.relative_size)},
          {"variation", number(e.variation)},
          {"scatter", number(e.scatter)},
          {"inside_bounds", e.inside_bounds},
          {"detectable", number(e.detectable)},
          {"typical", number(e.typical)},
          {"ruled_out_by", words(e.ruled_out_by)},
          {"reason", reason_json(e.ruled_out_by)}};
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
    for (std::size_t b = 0; b < a.aliases.size(); ++b) from[a.aliases[b]] = number(v.separation[b]);
    ranked.push_back({{"id", v.id}, {"words", v.words}, {"separation", from}, {"least", number(v.least)}});
  }
  return {{"seconds", a.seconds}, {"not_told", a.open}, {"impossible", a.impossible}, {"manoeuvres", ranked}};
}

ordered_json added_json(const std::vector<AddedEffect>& effects) {
  ordered_json added = ordered_json::array();
  for (const AddedEffect& a : effects) {
    ordered_json aliases = ordered_json::array(), shifts = ordered_json::array();
    for (const ClassMember& m : a.aliases)
      aliases.push_back({{"id", m.id},
                         {"correlation", number(m.correlation)},
                         {"gain_share", number(m.gain_share)},
                         {"parameters", values_json(m.parameters)}});
    for (const auto& [name, change] : a.shifts) shifts.push_back({{"parameter", name}, {"relative", number(change)}});
    added.push_back({{"id", a.id},
                     {"parameters", values_json(a.parameters)},
                     {"twins", aliases},
                     {"determined", ratios_text(a.ratios)},
                     {"ratios", values_json(a.ratios)},
                     {"in_words", a.in_words},
                     {"next", a.next},
                     {"manoeuvre", a.manoeuvre},
                     {"manoeuvre_search", advice_json(a.advice)},
                     {"evidence", evidence_json(a.evidence)},
                     {"shifts", shifts}});
  }
  return added;
}

ordered_json round_json(const DiagnosisRound& r) {
  return {{"placebos", r.placebos.placebos},
          {"placebo_level", number(r.placebos.level)},
          {"placebo_wald", number(r.placebos.wald)},
          {"decision", r.decision},
          {"candidates", array_of(r.candidates, evidence_json)}};
}

ordered_json hidden_json(const NotObservable& n) {
  return {{"id", n.id},    {"why", n.why}, {"needs", n.needs}, {"detectable", number(n.detectable)}, {"typical", number(n.typical)},
          {"unit", n.unit}};
}

}  // namespace

ordered_json diagnosis_tree(const DiagnosisRun& run, const identify::IdentifyProvenance& from) {
  const Diagnosis& d = run.diagnosis;
  ordered_json out{{"format", 1},
                   {"made_by", "rotorloop diagnose"},
                   {"command", "diagnose"},
                   {"verdict", std::string(name(d.verdict))},
                   {"remains", remains_json(d.remains)},
                   {"added", added_json(d.added)},
                   {"rejected", array_of(d.rejected, evidence_json)},
                   {"not_judged", d.not_judged},
                   {"not_observable", array_of(d.not_observable, hidden_json)},
                   {"faults", log_json(d.faults)},
                   {"left_out", log_json(d.left_out)},
                   {"white", d.white},
                   {"remarks", d.remarks},
                   {"log_likelihood", {{"before", number(run.before.fit.log_likelihood)}, {"after", number(run.after.fit.log_likelihood)}}},
                   {"estimates", identify::estimates_json(run.after)},
                   {"rounds", array_of(d.rounds, round_json)},
                   {"flights", array_of(run.after.flights, [](const estimate::GridFlight& g) { return g.name; })},
                   {"provenance",
                    {{"version", from.version},
                     {"git", from.git},
                     {"started_utc", from.started_utc},
                     {"wall_s", from.wall_s},
                     {"inputs", array_of(from.inputs, identify::input_json)}}}};
  const render::Outcome outcome = diagnosis_outcome(d, from);
  out["errors"] = outcome.errors;
  out["next"] = outcome.next;
  if (run.held_out) out["held_out"] = identify::held_out_json(*run.held_out);
  if (run.residuals) out["residuals"] = residual_tree(*run.residuals);
  return out;
}

}  // namespace rotorloop::diagnose
