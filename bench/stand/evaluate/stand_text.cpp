#include "bench/stand/evaluate/stand_text.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace rotorloop::stand {
namespace {

std::string channel_text(const StandChannelFit& c) {
  std::string s =
      fmt::format("  {}: {} = {:.4g} ± {:.2g} {} (u), rms {:.3g} of {:.3g} {}, R² {:.4f}, {} points\n", c.channel, c.coefficient.name,
                  c.coefficient.value, c.coefficient.u, c.coefficient.unit, c.rms, c.largest, c.unit, c.r2, c.points);
  if (c.best) {
    const StandCandidate& n = c.candidates[*c.best];
    s += fmt::format("    {} {}: {}\n      {} = {:.4g} ± {:.2g} {}", name(c.verdict),
                     c.aliases.empty() ? n.id : fmt::format("{} or {}", n.id, fmt::join(c.aliases, " or ")), n.law, c.coefficient.name,
                     c.with_best.c(0), c.with_best.u(0), c.coefficient.unit);
    for (const auto& p : n.parameters) s += fmt::format(", {} = {:.4g} ± {:.2g} {}", p.name, p.value, p.u, p.unit);
    s += fmt::format("\n      rms {:.3g} -> {:.3g} {}, R² {:.4f} -> {:.4f}\n", c.rms, n.rms, c.unit, c.r2, c.with_best.r2);
  }
  for (const auto& k : c.candidates)
    s += fmt::format("    {:<22} held-out rms {:.3g} -> {:.3g} {} ({:+.0f} %, 95 %: {:+.0f} to {:+.0f}), z {:.1f}{}\n", k.id,
                     k.held_out_rms_before, k.held_out_rms, c.unit, -100.0 * k.held_out_fall.value, -100.0 * k.held_out_fall.high,
                     -100.0 * k.held_out_fall.low, k.z, k.ruled_out_by.empty() ? "" : "; " + k.ruled_out_by);
  return s;
}

nlohmann::ordered_json values_json(const std::vector<diagnose::NamedValue>& values) {
  auto out = nlohmann::ordered_json::array();
  for (const auto& v : values) out.push_back({{"name", v.name}, {"value", v.value}, {"u", v.u}, {"unit", v.unit}});
  return out;
}

nlohmann::ordered_json channel_json(const StandChannelFit& c) {
  nlohmann::ordered_json j{{"channel", c.channel}, {"coefficient", values_json({c.coefficient})[0]},
                           {"rms", c.rms},         {"r2", c.r2},
                           {"largest", c.largest}, {"unit", c.unit},
                           {"points", c.points},   {"runs", c.runs}};
  j["candidates"] = nlohmann::ordered_json::array();
  for (const auto& k : c.candidates)
    j["candidates"].push_back({{"id", k.id},
                               {"law", k.law},
                               {"parameters", values_json(k.parameters)},
                               {"z", k.z},
                               {"rms", k.rms},
                               {"held_out_rms_before", k.held_out_rms_before},
                               {"held_out_rms", k.held_out_rms},
                               {"held_out_fall", {k.held_out_fall.value, k.held_out_fall.low, k.held_out_fall.high}},
                               {"ruled_out_by", k.ruled_out_by}});
  j["verdict"] = std::string(name(c.verdict));
  j["best"] = c.best ? nlohmann::ordered_json(c.candidates[*c.best].id) : nlohmann::ordered_json(nullptr);
  j["twins"] = c.aliases;
  return j;
}

}  // namespace

std::string stand_text(const StandDiagnosis& d) {
  std::string s;
  for (const auto& f : d.files) {
    s += fmt::format("{}: {}\n", f.name, name(f.verdict));
    for (const auto& x : f.faults)
      s += fmt::format("  fault, {}: {}{}\n", x.channel, x.what, x.likely.empty() ? "" : "; likely: " + x.likely);
    for (const auto& n : f.notes) s += fmt::format("  note: {}\n", n);
    for (const auto& c : f.channels) s += channel_text(c);
  }
  for (const auto& r : d.remarks) s += r + "\n";
  return s;
}

std::string stand_json(const StandDiagnosis& d) {
  nlohmann::ordered_json j;
  j["files"] = nlohmann::ordered_json::array();
  for (const auto& f : d.files) {
    nlohmann::ordered_json one{{"file", f.name}, {"motor", f.motor}, {"propeller", f.propeller}, {"verdict", std::string(name(f.verdict))}};
    one["faults"] = nlohmann::ordered_json::array();
    for (const auto& x : f.faults) one["faults"].push_back({{"channel", x.channel}, {"what", x.what}, {"likely", x.likely}});
    one["notes"] = f.notes;
    one["channels"] = nlohmann::ordered_json::array();
    for (const auto& c : f.channels) one["channels"].push_back(channel_json(c));
    j["files"].push_back(std::move(one));
  }
  j["remarks"] = d.remarks;
  return j.dump(2) + "\n";
}

}  // namespace rotorloop::stand
