#include "bench/hil/flight/unfinished_result.hpp"

#include <nlohmann/json.hpp>

#include "host/base/text_file.hpp"

namespace rotorloop::hil {

std::string unfinished_json(const UnfinishedResult& r) {
  using Json = nlohmann::ordered_json;
  Json j{{"format", 1}, {"command", r.command}, {"version", r.version}, {"git", r.git}, {"inputs", Json::array()}};
  for (const InputFile& i : r.inputs) j["inputs"].push_back({{"path", i.path}, {"sha256", i.sha256}});
  j["started_utc"] = r.started_utc;
  j["wall_s"] = r.wall_s;
  j["verdict"] = r.outcome.verdict;
  j["limits"] = Json::array();
  j["figures"] = Json::object();
  j["warnings"] = Json::array();
  j["errors"] = r.outcome.errors;
  j["next"] = r.outcome.next;
  return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

void write_unfinished(const std::filesystem::path& folder, const UnfinishedResult& r) {
  write_text_file(folder / "result.json", unfinished_json(r));
  write_text_file(folder / "report.html",
                  render::outcome_page_html(r.title, "rotorloop " + r.command, "rotorloop " + r.command, r.outcome));
}

}  // namespace rotorloop::hil
