#include "bench/stand/run/run_summary.hpp"

#include <nlohmann/json.hpp>

namespace rotorloop::stand_run {

RunSummary summary_of(const Session& session) {
  RunSummary out;
  out.end = session.end();
  out.trip = session.trip();
  out.steps = session.steps().size();
  std::vector<PairedStep> thrust, torque;
  for (const StepMeans& s : session.steps()) {
    out.unsettled += !s.settled;
    thrust.push_back({s.configuration, s.wanted_rad_s, s.t_s, s.omega_rad_s, s.thrust_N});
    torque.push_back({s.configuration, s.wanted_rad_s, s.t_s, s.omega_rad_s, s.torque_N_m});
  }
  out.thrust = paired_difference(thrust);
  out.torque = paired_difference(torque);
  return out;
}

nlohmann::ordered_json summary_json(const std::filesystem::path& folder, const RunSummary& s) {
  nlohmann::ordered_json j{{"run", folder.generic_string()}, {"end", name(s.end)}, {"steps", s.steps}, {"unsettled", s.unsettled}};
  if (s.trip) j["trip"] = text(*s.trip);
  for (const auto& [key, d] : {std::pair{"B_takes_of_thrust", &s.thrust}, std::pair{"B_takes_of_torque", &s.torque}})
    if (*d) j[key] = {{"share", (*d)->share}, {"u", (*d)->u}, {"low", (*d)->low}, {"high", (*d)->high}, {"pairs", (*d)->pairs}};
  return j;
}

}  // namespace rotorloop::stand_run
