#include "bench/sysid/identify/report/parameter_history.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "bench/render/svg_pieces.hpp"
#include "bench/sysid/estimate/model/rotations.hpp"
#include "bench/sysid/identify/report/report_figures.hpp"
#include "host/base/error.hpp"

namespace rotorloop::identify {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRotationNames[] = {"q_BS,x", "q_BS,y", "q_BS,z"};

fs::path file_of(const fs::path& given) { return fs::absolute(fs::is_directory(given) ? given / "result.json" : given).lexically_normal(); }

void drop(HistoryPoint& p, std::size_t i) {
  const auto at = static_cast<std::ptrdiff_t>(i);
  p.names.erase(p.names.begin() + at);
  p.units.erase(p.units.begin() + at);
  p.value.erase(p.value.begin() + at);
  p.u.erase(p.u.begin() + at);
}

}  // namespace

HistoryPoint read_history_point(const fs::path& given) {
  const auto path = fs::is_directory(given) ? given / "result.json" : given;
  const auto fail = [&](const std::string& what) {
    throw Error({path.generic_string(), what, "", "name folders that `rotorloop identify --report` wrote"});
  };
  std::ifstream in(path);
  if (!in) fail("cannot be read");
  const auto j = nlohmann::json::parse(in, nullptr, false);
  if (j.is_discarded() || !j.is_object()) fail("is no JSON document");
  if (j.value("command", "") != "identify") fail("is no result of `rotorloop identify`");
  if (j.value("format", 0) != 1) fail("has a format that this program does not know");
  HistoryPoint out;
  out.label = file_of(given).parent_path().filename().generic_string();
  const auto take = [&](const nlohmann::json& e, const std::string& kind) {
    for (const char* key : {"symbol", "unit", "value", "u", "u_robust"}) {
      if (!e.is_object() || !e.contains(key)) fail("holds " + kind + " without " + key);
    }
    if (!e.at("value").is_number() || !e.at("u").is_number()) return;
    out.names.push_back(e.at("symbol").get<std::string>());
    out.units.push_back(e.at("unit").get<std::string>());
    out.value.push_back(e.at("value").get<double>());
    out.u.push_back(std::max(e.at("u").get<double>(), e.at("u_robust").is_number() ? e.at("u_robust").get<double>() : 0.0));
  };
  if (!j.contains("estimates") || !j.at("estimates").is_array()) fail("holds no estimates");
  for (const auto& e : j.at("estimates")) {
    if (!e.is_object() || !e.contains("flight")) fail("holds an estimate without flight");
    if (e.at("flight").is_null()) take(e, "an estimate");
  }
  if (j.contains("derived") && j.at("derived").is_array()) {
    for (const auto& d : j.at("derived")) take(d, "a derived quantity");
  }
  if (const auto q = j.find("q_BS_wxyz"); q != j.end() && q->is_array()) {
    if (q->size() != 4 || !std::all_of(q->begin(), q->end(), [](const auto& v) { return v.is_number(); }))
      fail("holds a q_BS_wxyz that is not four numbers");
    out.q_BS = Eigen::Quaterniond(q->at(0).get<double>(), q->at(1).get<double>(), q->at(2).get<double>(), q->at(3).get<double>());
  }
  return out;
}

std::vector<HistoryPoint> read_history(const std::vector<fs::path>& paths) {
  std::vector<HistoryPoint> out;
  std::vector<fs::path> above;  // of each, the folder next to be named
  for (const fs::path& p : paths) {
    out.push_back(read_history_point(p));
    above.push_back(file_of(p).parent_path().parent_path());
  }
  // As many folders as it takes, of those that share a name: "run1/report", "run2/report".
  for (bool again = true; again;) {
    again = false;
    std::map<std::string, std::set<fs::path>> places;
    for (std::size_t i = 0; i < out.size(); ++i) places[out[i].label].insert(above[i] / out[i].label);
    for (std::size_t i = 0; i < out.size(); ++i) {
      const bool shared = places.at(out[i].label).size() > 1;
      if (!shared || !above[i].has_filename()) continue;
      out[i].label = above[i].filename().generic_string() + "/" + out[i].label;
      above[i] = above[i].parent_path();
      again = true;
    }
  }
  return out;
}

std::string count_rotations_from_one(std::vector<HistoryPoint>& history, const std::vector<HistoryReference>& references) {
  std::string from;
  Eigen::Quaterniond origin = Eigen::Quaterniond::Identity();
  if (!references.empty()) {
    from = references.front().label;
    origin = references.front().q_BS;
  } else {
    const auto first = std::find_if(history.begin(), history.end(), [](const HistoryPoint& p) { return p.q_BS.has_value(); });
    if (first != history.end()) {
      from = first->label;
      origin = *first->q_BS;
    }
  }
  bool any = false;
  for (HistoryPoint& p : history) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto found = std::find(p.names.begin(), p.names.end(), kRotationNames[axis]);
      if (found == p.names.end()) continue;
      const auto i = static_cast<std::size_t>(found - p.names.begin());
      if (!p.q_BS) {
        drop(p, i);
        continue;
      }
      p.value[i] = estimate::log_q(origin.conjugate() * *p.q_BS)[axis];
      any = true;
    }
  }
  return any ? from : "";
}

std::string history_html(std::vector<HistoryPoint> history, std::vector<HistoryReference> references) {
  if (history.size() < 2) return "";
  const std::string from = count_rotations_from_one(history, references);
  for (HistoryReference& r : references) {
    const Eigen::Vector3d turn = estimate::log_q(references.front().q_BS.conjugate() * r.q_BS);
    for (int axis = 0; axis < 3; ++axis) r.value[kRotationNames[axis]] = turn[axis];
  }
  std::string out =
      "<h2 id=\"trail\">Parameter history over trials</h2>\n<p>Each estimate with ± 2 u, in the order of the trials; the last is this fit.";
  out += references.empty() ? " No reference is drawn; --compare gives one." : " Dashed: the vehicle files of --compare.";
  if (!from.empty()) out += " q_BS is the rotation from that of " + render::xml_escaped(from) + ", whatever each fit started from.";
  std::string without;
  for (const HistoryPoint& p : history) {
    if (!p.q_BS) without += (without.empty() ? "" : ", ") + p.label;
  }
  if (!without.empty()) out += " Left out for q_BS, as their results do not say the rotation: " + render::xml_escaped(without) + ".";
  out += "</p>\n<div class=\"two\">\n";
  for (std::size_t i = 0; i < history.back().names.size(); ++i)
    out += history_figure(history, references, history.back().names[i], history.back().units[i]);
  return out + "</div>\n";
}

}  // namespace rotorloop::identify
