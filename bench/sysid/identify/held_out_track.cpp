#include "bench/sysid/identify/held_out_track.hpp"

#include <array>

#include "bench/sysid/estimate/flight_motion.hpp"

namespace rotorloop::identify {

estimate::ModelValues with_starts(const estimate::GridFlight& g, const estimate::ModelValues& values, const estimate::NoiseModel& noise) {
  const host::TermList& terms = values.terms;
  estimate::FitProblem p{.start = values, .free = {}, .flights = {&g}, .noise = noise, .flight_noise = {}, .flight_start = {}};
  for (std::size_t k = 0; k < terms.parameters(); ++k) {
    if (!terms.is_start(k) || terms.start_u(k) <= 0.0) continue;
    const int start = estimate::kCoreParameters + static_cast<int>(k);
    p.start[start] = 0.0;
    p.free.push_back({start, false, terms.start_u(k)});
  }
  return p.free.empty() ? values : estimate::fit(p).values.front();
}

score::StateTrack held_out_track(estimate::GridFlight& g, const Identification& r) {
  const std::vector<estimate::BodyState> states = estimate::states_by_measurements(g, r.fit.values.front(), r.fit.noise.front());
  estimate::follow_states({&g, 1}, std::array{states});
  return score::fitted_track(g, states, with_starts(g, r.fit.values.front(), r.fit.noise.front()));
}

}  // namespace rotorloop::identify
