#include "bench/sysid/diagnose/report/residual_tree.hpp"

#include <nlohmann/json.hpp>

#include "bench/sysid/identify/report/tree_values.hpp"

namespace rotorloop::diagnose {
namespace {

using Json = nlohmann::ordered_json;
using identify::array_of;

Json spectra_json(const ResidualFindings& f, std::size_t a) {
  Json bands = Json::array(), coherent = Json::array();
  for (const SpectrumBand& b : f.spectra.axis[a].bands)
    bands.push_back({{"from_Hz", b.from_Hz}, {"to_Hz", b.to_Hz}, {"rms", b.rms}, {"rms_expected", b.rms_expected}});
  for (const InputCoherence& c : f.spectra.axis[a].coherence)
    coherent.push_back({{"input", f.series.inputs[c.input].id},
                        {"name", f.series.inputs[c.input].name},
                        {"from_Hz", c.from_Hz},
                        {"to_Hz", c.to_Hz},
                        {"coherence", c.coherence},
                        {"chance", c.chance}});
  return {{"bands", bands}, {"coherent_with", coherent}};
}

Json axis_json(const ResidualFindings& f, std::size_t a) {
  const AxisUnexplained& x = f.unexplained.axis[a];
  Json j = spectra_json(f, a);
  j["axis"] = kAxisNames[a];
  j["unit"] = kAxisUnits[a];
  j["kind"] = name(f.unexplained.kind[a]);
  j["rms"] = x.rms;
  j["rms_expected"] = x.rms_expected;
  j["explainable_share"] = x.explainable.share;
  j["explainable_by_chance"] = x.explainable_by_chance;
  j["burst_share"] = x.burst_share;
  Json curves = Json::array();
  for (const PartialCurve& c : x.explainable.curves) {
    if (curves.size() >= 4) break;
    curves.push_back({{"input", f.series.inputs[c.input].id},
                      {"share", c.share},
                      {"lost_without", c.alone},
                      {"at", c.at},
                      {"value", c.value},
                      {"u", c.u}});
  }
  j["partial_dependence"] = curves;
  const AxisLag& l = f.lag.axis[a];
  j["lag"] = {{"known", l.known},   {"lag_s", l.lag_s}, {"low_s", l.low_s},
              {"high_s", l.high_s}, {"share", l.share}, {"share_at_zero", l.share_at_zero},
              {"slope", l.slope}};
  return j;
}

Json lag_json(const LagFinding& l) {
  Json axes = Json::array();
  for (const std::size_t a : l.axes) axes.push_back(kAxisNames[a]);
  return {{"leads", l.verdict == LagVerdict::leads}, {"axes", axes}, {"lag_s", l.lag_s}, {"effects", l.effects}, {"words", l.words}};
}

Json variance_json(const VarianceEffect& e) {
  Json v{{"id", e.id}, {"what", e.what}, {"parameter", e.parameter}, {"unit", e.unit}};
  if (!e.untested.empty()) {
    v["untested"] = e.untested;
    return v;
  }
  Json aliases = Json::array();
  for (const auto& [id, c] : e.aliases) aliases.push_back({{"id", id}, {"correlation", c}});
  v["t"] = e.t;
  v["p"] = e.p;
  v["p_holm"] = e.p_holm;
  v["size"] = e.size;
  v["u"] = e.u;
  v["found"] = e.found;
  v["twins"] = aliases;
  return v;
}

Json event_json(const ResidualFindings& f, const std::vector<std::size_t>& event) {
  Json all = Json::array();
  for (const std::size_t i : event) {
    const TimeStep& s = f.steps.steps[i];
    all.push_back({{"effect", s.effect},
                   {"parameter", s.parameter},
                   {"flight", f.series.samples.flights[s.flight]},
                   {"at_s", s.at_s},
                   {"size", s.size},
                   {"u", s.u},
                   {"unit", s.unit},
                   {"p_holm", s.p_holm},
                   {"matters", s.matters}});
  }
  return all;
}

Json telemetry_json(const TelemetryResidual& t) {
  const auto three = [](const Eigen::Vector3d& v) { return Json{v.x(), v.y(), v.z()}; };
  return {{"flight", t.flight},
          {"stream", t.stream},
          {"unit", t.unit},
          {"in_the_fit", t.fitted},
          {"mean", three(t.mean)},
          {"rms", three(t.rms)},
          {"assumed", t.fitted ? three(t.assumed) : Json(nullptr)}};
}

}  // namespace

Json residual_tree(const ResidualFindings& f) {
  Json j;
  j["words"] = f.words;
  j["axes"] = Json::array();
  for (std::size_t a = 0; a < kAxes; ++a) j["axes"].push_back(axis_json(f, a));
  const auto& ranking = f.dependence.ranking;
  j["dependence"] = array_of(std::span(ranking).first(std::min<std::size_t>(24, ranking.size())), [&](const Dependence& d) {
    return Json{{"input", f.series.inputs[d.input].id},
                {"name", f.series.inputs[d.input].name},
                {"axis", kAxisNames[d.axis]},
                {"share", d.share},
                {"chance", d.chance}};
  });
  j["lag_findings"] = array_of(f.lag.findings, lag_json);
  j["variance_effects"] = array_of(f.variance.effects, variance_json);
  const auto event = [&](const std::vector<std::size_t>& one) { return event_json(f, one); };
  j["steps_in_time"] = array_of(f.steps.events, event);
  for (const auto& one : f.steps.too_small) j["steps_in_time"].push_back(event(one));
  j["bursts"] = array_of(f.unexplained.bursts, [&](const Burst& b) {
    return Json{{"flight", f.series.samples.flights[b.flight]},
                {"axis", kAxisNames[b.axis]},
                {"from_s", b.from_s},
                {"to_s", b.to_s},
                {"mean", b.mean},
                {"peak", b.peak},
                {"ratio", b.ratio}};
  });
  j["telemetry"] = array_of(f.series.telemetry, telemetry_json);
  return j;
}

}  // namespace rotorloop::diagnose
