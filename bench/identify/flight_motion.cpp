#include "bench/identify/flight_motion.hpp"

#include <algorithm>
#include <memory>

#include "bench/identify/estimator.hpp"
#include "bench/identify/rotations.hpp"

namespace rotorloop::bench {
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

}  // namespace

Motion motion_of(const GridFlight& g, const std::vector<BodyState>& states) {
  Motion out{g.start_s, g.step_s, states, {}};
  std::size_t last = g.knots;  // the last knot that the model ties
  for (std::size_t k = 0; k < g.knots; ++k) {
    if (!g.tied(k)) continue;
    const std::size_t from = last == g.knots ? 0 : last + 1;
    for (std::size_t j = from; j < k; ++j) {
      out.states[j] =
          last == g.knots ? states[k] : between(states[last], states[k], static_cast<double>(j - last) / static_cast<double>(k - last));
    }
    last = k;
  }
  for (std::size_t j = last == g.knots ? g.knots : last + 1; j < g.knots; ++j) out.states[j] = states[last];
  return out;
}

std::vector<BodyState> states_by_readings(const GridFlight& g, const ModelValues& values, const NoiseModel& noise) {
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

}  // namespace rotorloop::bench
