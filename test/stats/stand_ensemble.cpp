#include "test/stats/stand_ensemble.hpp"

#include <fmt/format.h>

#include <cmath>

#include "host/base/constants.hpp"
#include "host/base/random.hpp"

namespace rotorloop::stats {

void EnsembleScores::add(const stand::StandEstimate& e, const test::StandTruth& truth) {
  const auto score = [](Sums& s, const std::optional<stand::CoefficientEstimate>& c, double reduced, double wanted) {
    if (!c) return s.add(1.0, false, 0.0);
    const double scale = reduced / c->value;
    s.add(reduced / wanted - 1.0, c->low * scale <= wanted && wanted <= c->high * scale, c->u / c->value);
  };
  score(c_t_, e.thrust, e.reduced_c_t, truth.c_t_N_s2);
  score(c_q_, e.torque, e.reduced_c_q, truth.c_q_N_m_s2);
  const auto judge = [&](std::size_t k, double got, double wanted) {
    if (wanted == 0.0) return;
    const double miss = got / wanted - 1.0;
    values_[k].sums.add(miss, std::abs(miss) <= values_[k].tolerance, 0.0);
  };
  judge(0, e.motor ? e.motor->speed_constant_rpm_V.value : 0.0, truth.speed_constant_rpm_V);
  judge(1, e.motor ? e.motor->resistance_ohm.value : 0.0, truth.resistance_ohm);
  judge(2, e.dynamics ? e.dynamics->inertia_kg_m2.value_or(0.0) : 0.0, truth.inertia_kg_m2);
  judge(3, e.dynamics && e.dynamics->up ? e.dynamics->up->value_s : 0.0, truth.up_s);
  judge(4, e.dynamics && e.dynamics->down ? e.dynamics->down->value_s : 0.0, truth.down_s);
}

StandEnsemble EnsembleScores::result() const {
  StandEnsemble out;
  out.runs = static_cast<std::size_t>(c_t_.n);
  for (const auto& [name, s] : {std::pair{"c_t", &c_t_}, std::pair{"c_q", &c_q_}})
    out.coefficients.push_back({name, s->error / s->n, std::sqrt(s->squares / s->n), s->inside / s->n, s->u / s->n});
  for (const Value& v : values_)
    if (v.sums.n > 0.0) out.values.push_back({v.name, v.sums.inside / v.sums.n, v.tolerance, std::sqrt(v.sums.squares / v.sums.n)});
  return out;
}

sim::Blade drawn_blade(const sim::Blade& blade, std::uint64_t seed) {
  const RandomStream random(seed, 0x424C414445ull);
  constexpr double kPitch_deg = 2.0;  // by which two measurements of one propeller differ (sim/rotor/blade.hpp)
  constexpr double kChord = 0.15;     // Reynolds number and solidity go with it
  sim::Blade out = blade;
  out.pitch_offset_deg += kPitch_deg * random.gaussian(0);
  const double chord = std::exp(kChord * random.gaussian(1));
  for (sim::BladeStation& s : out.stations) s.chord_m *= chord;
  out.drag_scale *= 0.8 + 0.6 * random.uniform(2);
  return out;
}

StandEnsemble stand_ensemble(const sim::Blade& blade, const std::filesystem::path& scratch, std::uint64_t first, std::size_t runs,
                             int draws, bool drawn) {
  test::SimulatedStand simulated(blade);
  const test::SimulatedStandOptions options;
  test::StandTruth truth = simulated.truth(options);
  EnsembleScores scores;
  for (std::size_t i = 0; i < runs; ++i) {
    const std::uint64_t seed = first + i;
    if (drawn) {
      simulated = test::SimulatedStand(drawn_blade(blade, seed));
      truth = simulated.truth(options);
    }
    const auto folder = scratch / fmt::format("run{}", seed);
    simulated.write_run(folder, options, seed);
    stand::EstimateOptions o;
    o.window_rad_s = {{7000.0 * kRad_s_per_rpm, 11000.0 * kRad_s_per_rpm}};
    o.reference_density_kg_m3 = test::kSimulatedDensity_kg_m3;
    o.draws = draws;
    o.seed = seed;
    o.inductance_H = 15e-6;
    scores.add(stand::estimate_stand(stand::read_stand_run(folder, {}), o), truth);
    std::filesystem::remove_all(folder);
  }
  return scores.result();
}

}  // namespace rotorloop::stats
