// A wind that fluctuates answers to nothing that the vehicle does, so it has no column among the candidates. It shows as a force residual
// that is like itself for about a second. Two passes: the fit's smoother leaves the residual acceleration of each step; its means over
// short blocks are then taken as
//   y_j = a_j + n_j,   a: first-order process of standard deviation σ_a and correlation time τ (wind_dryden),   n: white,
// and scored by the marginal likelihood of this against white noise alone. The states of the fit are not extended: at 0.2 s a block
// mean is known far better from the poses than it scatters, so what the white process noise of the fit took from it is small.
#pragma once
#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "bench/sysid/diagnose/decision_rules.hpp"
#include "bench/sysid/diagnose/ranking/shortlist.hpp"
#include "bench/sysid/identify/identify.hpp"
#include "host/vehicle/effect_catalogue.hpp"

namespace rotorloop::diagnose {

struct ColouredNoise {
  double sigma = 0.0, time_s = 0.0;  // of the part that lasts: standard deviation and correlation time
  double white = 0.0;                // standard deviation of the rest, of one value
  double gain = 0.0;                 // Δ log-likelihood over white noise alone; two parameters more
};
// Values at equal distances, each list by itself (flights). Their mean counts as known: a constant is no gust.
ColouredNoise coloured_noise(std::span<const std::vector<double>> series, double step_s);

struct GustScore {
  std::array<ColouredNoise, 3> axis;     // accelerations in the world, m/s²
  double drag_slope_1_s = 0.0;           // horizontal acceleration for each m/s of wind, mean over the flights
  double sigma_m_s = 0.0, time_s = 0.0;  // of the horizontal wind; 0 when there is none
  double gain = 0.0;                     // of both horizontal axes
};
GustScore score_gust(const identify::Identification& fitted);

const host::CatalogueEffect& gusts();  // the effect of the catalogue whose law this is
// Gusts that last and matter. What is shorter than two blocks of the screening is in its scatter already, and any model of a real flight
// leaves it.
bool gusts_matter(const GustScore& gust, const Criteria& criteria);

// In flights of twenty seconds gusts have a mean, and many a constant looks like it. Where it blows, what raises the likelihood less than
// gusts do is taken for one; so is a wind that is no more than their mean may be, and with it whatever else explains that wind.
void reject_explained_by_gusts(const GustScore& gust, std::vector<RefitCandidate>& ranked, const Criteria& criteria);

}  // namespace rotorloop::diagnose
