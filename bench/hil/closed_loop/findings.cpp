#include "bench/hil/closed_loop/findings.hpp"

#include <fstream>
#include <nlohmann/json.hpp>

#include "host/base/error.hpp"

namespace rotorloop::closed_loop {
namespace {
using UnorderedJson = nlohmann::json;

double number(const UnorderedJson& j, const char* key, double fallback = 0.0) {
  const auto it = j.find(key);
  return it != j.end() && it->is_number() ? it->get<double>() : fallback;
}
std::string text(const UnorderedJson& j, const char* key) {
  const auto it = j.find(key);
  return it != j.end() && it->is_string() ? it->get<std::string>() : std::string();
}
const UnorderedJson& list(const UnorderedJson& j, const char* key) {
  static const UnorderedJson none = UnorderedJson::array();
  const auto it = j.find(key);
  return it != j.end() && it->is_array() ? *it : none;
}

std::vector<FoundValue> values(const UnorderedJson& j, const char* key) {
  std::vector<FoundValue> out;
  for (const UnorderedJson& v : list(j, key)) out.push_back({text(v, "name"), text(v, "unit"), number(v, "value"), number(v, "u")});
  return out;
}

std::string id_or_text(const UnorderedJson& j) { return j.is_string() ? j.get<std::string>() : text(j, "id"); }

}  // namespace

std::string alias_names(const FoundEffect& effect) {
  std::string out;
  for (const auto& t : effect.aliases) out += (out.empty() ? "" : ", ") + t.id;
  return out;
}

Findings read_findings(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  const UnorderedJson j = UnorderedJson::parse(in, nullptr, false);
  if (j.is_discarded() || !j.is_object() || text(j, "verdict").empty())
    throw Error({path.generic_string(), "is no result of a diagnosis", "the sandboxed program was stopped, or is another program",
                 "look at the messages beside it"},
                ExitCode::data_quality);
  Findings f;
  f.verdict = text(j, "verdict");
  for (const UnorderedJson& e : list(j, "added")) {
    FoundEffect out{text(e, "id"), text(e, "determined"), text(e, "manoeuvre"), values(e, "parameters"), {}};
    for (const UnorderedJson& t : list(e, "twins"))
      out.aliases.push_back({id_or_text(t), t.is_object() ? values(t, "parameters") : std::vector<FoundValue>{}});
    f.added.push_back(std::move(out));
  }
  for (const UnorderedJson& r : list(j, "rounds")) {
    FoundRound round;
    for (const UnorderedJson& c : list(r, "candidates"))
      round.candidates.push_back({text(c, "id"), text(c, "ruled_out_by"), number(c, "wald"), number(c, "gain_relative"),
                                  number(c, "cross_validated"), number(c, "p_holm", 1.0), values(c, "one_step")});
    round.placebo_wald = number(r, "placebo_wald");
    round.placebo_level = number(r, "placebo_level", 0.99);
    round.decision = text(r, "decision");
    f.rounds.push_back(std::move(round));
  }
  if (const auto h = j.find("held_out"); h != j.end() && h->is_object())
    for (const UnorderedJson& r : list(*h, "rows"))
      f.held_out.push_back({number(r, "horizon_s"), text(r, "quantity"), number(r, "before"), number(r, "after"), number(r, "ratio", 1.0),
                            number(r, "low", 1.0), number(r, "high", 1.0)});
  for (const UnorderedJson& n : list(j, "not_observable")) f.not_observable.push_back(id_or_text(n));
  for (const UnorderedJson& n : list(j, "faults"))
    f.faults.push_back(n.is_string() ? n.get<std::string>() : text(n, "flight") + ", " + text(n, "stream") + ": " + text(n, "what"));
  for (const UnorderedJson& n : list(j, "remarks"))
    if (n.is_string()) f.remarks.push_back(n.get<std::string>());
  return f;
}

}  // namespace rotorloop::closed_loop
