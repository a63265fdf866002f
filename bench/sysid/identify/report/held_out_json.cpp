// Scores of flights held out, for result.json. Axes of wrenches: force x, y, z in N, torque x, y, z in N m; the last score is that of all
// flights.
#include "bench/sysid/identify/held_out.hpp"
#include "bench/sysid/identify/report/tree_values.hpp"

namespace rotorloop::identify {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kQuantityIds[] = {"position", "velocity", "attitude", "body_rates"};

Json axes_json(const WrenchAxes& v) {
  Json out = Json::array();
  for (const double x : v) out.push_back(number(x));
  return out;
}

Json scores_json(const std::vector<WrenchScore>& all) {
  return array_of(all, [](const WrenchScore& s) {
    return Json{{"flight", s.flight},
                {"samples", s.samples},
                {"delay_s", number(s.delay_s)},
                {"rms", axes_json(s.rms)},
                {"explained", axes_json(s.explained)}};
  });
}

Json one_step_json(const score::OneStepComparison& s) {
  if (s.poses == 0) return nullptr;
  return {{"poses", s.poses},
          {"step_s", s.step_s},
          {"rows", array_of(s.rows,
                            [](const score::OneStepComparison::Row& r) {
                              return Json{{"quantity", kQuantityIds[r.quantity]}, {"unit", score::kPredictedUnits[r.quantity]},
                                          {"before", number(r.before)},           {"after", number(r.after)},
                                          {"expected", number(r.expected)},       {"ratio", number(r.ratio.value)},
                                          {"low", number(r.ratio.low)},           {"high", number(r.ratio.high)}};
                            })},
          {"size", {{"before", number(s.size_before)}, {"after", number(s.size_after)}}},
          {"log_likelihood",
           {{"before", number(s.log_density_before)},
            {"after", number(s.log_density_after)},
            {"gain", number(s.gain.value)},
            {"low", number(s.gain.low)},
            {"high", number(s.gain.high)}}}};
}

}  // namespace

Json wrench_json(const WrenchComparison& c) {
  return {{"from_Hz", c.band.from_Hz},
          {"to_Hz", c.band.to_Hz},
          {"force", c.force},
          {"torque", c.torque},
          {"before", scores_json(c.before)},
          {"after", scores_json(c.after)},
          {"before_aligned", scores_json(c.before_aligned)},
          {"after_aligned", scores_json(c.after_aligned)}};
}

Json held_out_json(const HeldOutScores& s) {
  Json out{{"flights", s.flights},
           {"starts", s.starts},
           {"rows", array_of(s.rows,
                             [](const HeldOutRow& r) {
                               return Json{{"horizon_s", r.horizon_s},
                                           {"quantity", kQuantityIds[r.quantity]},
                                           {"unit", score::kPredictedUnits[r.quantity]},
                                           {"before", number(r.before)},
                                           {"after", number(r.after)},
                                           {"floor", number(r.floor)},
                                           {"closed", number(r.closed.value)},
                                           {"closed_low", number(r.closed.low)},
                                           {"closed_high", number(r.closed.high)},
                                           {"ratio", number(r.ratio.value)},
                                           {"low", number(r.ratio.low)},
                                           {"high", number(r.ratio.high)}};
                             })},
           {"one_step", one_step_json(s.one_step)},
           {"remarks", s.remarks},
           {"rotation_helps", {{"from_s", s.rotation_helps.from_s}, {"to_s", s.rotation_helps.to_s}}}};
  if (!s.wrench.after.empty()) out["wrench"] = wrench_json(s.wrench);
  return out;
}

}  // namespace rotorloop::identify
