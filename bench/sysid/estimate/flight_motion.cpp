#include "bench/sysid/estimate/flight_motion.hpp"

#include <algorithm>
#include <memory>

#include "bench/sysid/estimate/estimator.hpp"
#include "bench/sysid/estimate/model/rotations.hpp"
#include "host/effects/term.hpp"

namespace rotorloop::estimate {
namespace {

constexpr double kForceNoise_m_s2_rtHz = 1.0, kAngularNoise_rad_s2_rtHz = 10.0;

BodyState between(const BodyState& a, const BodyState& b, double share) {
  BodyState x;
  x.p_W_m = a.p_W_m + share * (b.p_W_m - a.p_W_m);
  x.v_W_m_s = a.v_W_m_s + share * (b.v_W_m_s - a.v_W_m_s);
  x.q_WB = (a.q_WB * exp_q(share * log_q(a.q_WB.conjugate() * b.q_WB))).normalized();
  x.w_B_rad_s = a.w_B_rad_s + share * (b.w_B_rad_s - a.w_B_rad_s);
  return x;
}

// Direction from the vehicle to its load and the rate of it: the memory of a term whose load swings, measured. The slope is taken over 60
// ms, against the noise of places read to a millimetre on half a metre.
std::vector<std::array<double, host::kMaxTermMemory>> swing_of(const GridFlight& g, const std::vector<BodyState>& states) {
  const auto half = static_cast<std::size_t>(std::max(1.0, std::round(0.03 / g.step_s)));
  const auto direction = [&](std::size_t k) { return (g.load_W_m[k] - states[k].p_W_m).normalized().eval(); };
  std::vector<std::array<double, host::kMaxTermMemory>> out(g.nodes);
  for (std::size_t k = 0; k < g.nodes; ++k) {
    const std::size_t a = k >= half ? k - half : 0, b = std::min(k + half, g.nodes - 1);
    const Eigen::Vector3d d = direction(k), rate = (direction(b) - direction(a)) / (static_cast<double>(b - a) * g.step_s);
    out[k] = {d.x(), d.y(), rate.x(), rate.y()};
  }
  return out;
}

}  // namespace

Motion motion_of(const GridFlight& g, const std::vector<BodyState>& states) {
  Motion out{g.start_s, g.step_s, states, {}};
  std::size_t last = g.nodes;  // the last node that the model ties
  for (std::size_t k = 0; k < g.nodes; ++k) {
    if (!g.tied(k)) continue;
    const std::size_t from = last == g.nodes ? 0 : last + 1;
    for (std::size_t j = from; j < k; ++j) {
      out.states[j] =
          last == g.nodes ? states[k] : between(states[last], states[k], static_cast<double>(j - last) / static_cast<double>(k - last));
    }
    last = k;
  }
  for (std::size_t j = last == g.nodes ? g.nodes : last + 1; j < g.nodes; ++j) out.states[j] = states[last];
  for (const host::Term& term : host::all_terms()) {
    if (term.info.traits.memory_is_swing && !g.load_W_m.empty())
      out.measured.push_back({std::string(term.info.id), swing_of(g, out.states)});
  }
  return out;
}

std::vector<BodyState> states_by_measurements(const GridFlight& g, const ModelValues& values, const NoiseModel& noise) {
  FitProblem p{.start = values, .free = {}, .flights = {&g}, .noise = noise, .flight_noise = {}, .flight_start = {}};
  p.noise.force_m_s2_rtHz.setConstant(kForceNoise_m_s2_rtHz);
  p.noise.angular_rad_s2_rtHz.setConstant(kAngularNoise_rad_s2_rtHz);
  p.free.push_back({kMass, false, 1e-9});  // nothing but the states is free
  return fit(p).states.front();
}

void follow_states(std::span<GridFlight> flights, std::span<const std::vector<BodyState>> states) {
  for (std::size_t f = 0; f < flights.size(); ++f)
    flights[f].input.follow(std::make_shared<const Motion>(motion_of(flights[f], states[f])));
}

}  // namespace rotorloop::estimate
