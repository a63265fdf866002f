#include "bench/hil/closed_loop/isolation_record.hpp"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

namespace rotorloop::closed_loop {
using Json = nlohmann::ordered_json;

std::string isolation_record(const std::vector<IsolationProbeResult>& tried) {
  Json j{{"format", 1}, {"tried", Json::array()}};
  for (const IsolationProbeResult& p : tried) {
    Json attempts = Json::array();
    for (const Attempt& a : p.attempts) attempts.push_back({{"way", a.way}, {"what", a.what}, {"opened", a.opened}});
    j["tried"].push_back(
        {{"layers", name(p.layers)}, {"enforced_by", p.enforced_by}, {"holds", p.holds()}, {"failed", p.failed}, {"attempts", attempts}});
  }
  return j.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

IsolationSummary read_isolation_record(const std::filesystem::path& file) {
  IsolationSummary s;
  std::ifstream in(file, std::ios::binary);
  const Json j = Json::parse(in, nullptr, false);
  if (j.is_discarded() || !j.contains("tried") || j["tried"].empty()) return s;
  const Json& last = j["tried"].back();
  s.holds = last.value("holds", false);
  s.layers = last.value("layers", s.layers);
  s.enforced_by = last.value("enforced_by", "");
  for (const Json& a : last.at("attempts")) {
    ++s.attempts;
    const auto way = a.value("way", "");
    if (std::find(s.ways.begin(), s.ways.end(), way) == s.ways.end()) s.ways.push_back(way);
    if (a.value("opened", false)) s.opened.push_back(way + ": " + a.value("what", ""));
  }
  for (std::size_t i = 0; i + 1 < j["tried"].size(); ++i) {
    const Json& t = j["tried"][i];
    const auto failed = t.value("failed", "");
    const auto opened =
        std::count_if(t.at("attempts").begin(), t.at("attempts").end(), [](const Json& a) { return a.value("opened", false); });
    s.gave_up.push_back(t.value("layers", "") + ": " + (failed.empty() ? std::to_string(opened) + " ways open" : failed));
  }
  return s;
}

}  // namespace rotorloop::closed_loop
