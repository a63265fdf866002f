#include "bench/studies/nanodrone_benchmark.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bench/sysid/log/read_flight.hpp"
#include "bench/sysid/score/multi_step_fit.hpp"
#include "bench/sysid/score/prediction_terms.hpp"
#include "host/base/error.hpp"
#include "host/vehicle/thrust.hpp"

namespace rotorloop::studies {
namespace {

constexpr std::size_t kHorizon = 50;       // steps of 10 ms, as published
constexpr std::size_t kLongHorizon = 200;  // how far the rotation model helps is looked for up to 2 s, from every fifth start
// Sum of the mean errors over all horizons, the best published for each quantity (results notebook of the benchmark).
constexpr std::array<double, score::kPredictedQuantities> kPublishedBest{2.32, 10.40, 5.10, 28.99};
constexpr std::array<double, score::kPredictedQuantities> kShare{0.90, 0.90, 1.00, 1.00};
// Translation is fitted to the velocity 0.1 s ahead, before errors of attitude grow; rotation to everything up to 0.5 s. The scales are
// typical errors of the published physics over the horizon, with position and velocity at a third of the weight: they follow attitude.
constexpr std::array<double, score::kPredictedQuantities> kTranslationScale{0.0, 0.05, 0.0, 0.0};
constexpr std::array<double, score::kPredictedQuantities> kRotationScale{0.17, 0.67, 0.1, 0.55};

struct Flights {
  std::vector<score::StateTrack> training, test;
};

Flights read_flights(const NanodroneInputs& in) {
  const log::LogMapping mapping = log::read_log_mapping(in.mapping);
  std::vector<std::filesystem::path> files;
  if (std::filesystem::is_directory(in.flights)) {
    for (const auto& f : std::filesystem::directory_iterator(in.flights)) {
      if (f.path().extension() == ".csv") files.push_back(f.path());
    }
  }
  std::sort(files.begin(), files.end());
  Flights flights;
  for (const auto& f : files) {
    const bool test = f.stem().string().starts_with("melon");
    (test ? flights.test : flights.training).push_back(score::filtered_track(log::read_flight(f, &mapping)));
  }
  if (flights.training.empty() || flights.test.empty()) {
    throw Error({.where = in.flights.generic_string(),
                 .what = fmt::format("{} training flights and {} melon flights; at least one of each is needed", flights.training.size(),
                                     flights.test.size()),
                 .likely = "the folder is another one, or holds the files under other names",
                 .remedy = "name the folder of the IDSIA nano-drone logs"},
                ExitCode::data_quality);
  }
  return flights;
}

std::vector<score::PredictionErrors> score(const std::vector<score::StateTrack>& flights, const score::Predictor& predictor) {
  std::vector<score::PredictionErrors> errors;
  for (const score::StateTrack& t : flights)
    errors.push_back(score::predict(t, predictor, score::prediction_starts(t, kHorizon), kHorizon));
  return errors;
}

score::PredictionSummary score_far(const std::vector<score::StateTrack>& flights, const score::Predictor& predictor) {
  std::vector<score::PredictionErrors> errors;
  for (const score::StateTrack& t : flights)
    errors.push_back(score::predict(t, predictor, score::prediction_starts(t, kLongHorizon, 5), kLongHorizon));
  return score::summary(errors);
}

int named(const host::TermList& terms, const std::string& name) {
  const int p = estimate::find_parameter(name, terms);
  if (p < 0) throw Error({.where = "nano-drone benchmark", .what = "no parameter " + name, .likely = "", .remedy = ""});
  return p;
}

// Thrust k_F Σω², nothing else: the benchmark's physics model, which holds the rates.
estimate::ModelValues published_physics(const host::VehicleModel& vehicle) {
  estimate::ModelValues v = estimate::model_values(vehicle);
  v[estimate::kK1] = kNanodronePublishedK_F_N_s2;
  v[estimate::kK2] = v[estimate::kCdh] = v[estimate::kCdxy] = v[estimate::kCdz] = 0.0;
  return v;
}

// Start of every fit here: no body drag, which rotor drag leaves nothing to.
estimate::ModelValues start_values(const host::VehicleModel& vehicle, const host::TermList& terms) {
  estimate::ModelValues v = estimate::model_values(vehicle, terms);
  v[estimate::kCdxy] = v[estimate::kCdz] = 0.0;
  return v;
}

estimate::ModelValues fit_translation(const NanodroneInputs& in, const std::vector<score::StateTrack>& training) {
  host::TermList terms;
  terms.add(score::kTorqueShare);
  estimate::ModelValues v = start_values(in.vehicle, terms);
  for (const std::string axis : {"roll", "pitch", "yaw"})
    v[named(terms, "prediction.torque_share." + axis)] = 0.0;  // rates held: translation alone
  score::MultiStepOptions o;
  o.horizon = 10;
  o.scale = kTranslationScale;
  return score::fit_multi_step(v, {estimate::kK1, estimate::kK2, estimate::kCdh}, training, o).values;
}

void fit_rotation(const NanodroneInputs& in, const std::vector<score::StateTrack>& training, const estimate::ModelValues& translation,
                  NanodroneResult& out) {
  host::TermList terms;
  for (const host::Term* t :
       {&score::kTorqueShare, host::find_term("rotor_inertia_reaction"), &score::kInPlaneVelocityMoment, &score::kRateReturn})
    terms.add(*t);
  estimate::ModelValues v = start_values(in.vehicle, terms);
  for (const int p : {estimate::kK1, estimate::kK2, estimate::kCdh}) v[p] = translation[p];
  estimate::Columns free{estimate::kComX, estimate::kComY};
  const auto add = [&](const char* name, double start) {
    free.push_back(named(terms, name));
    v[free.back()] = start;
  };
  add("effect.rotor_inertia_reaction.J_r_kg_m2", 2e-8);
  add("effect.prediction.torque_share.roll", 0.3);
  add("effect.prediction.torque_share.pitch", 0.3);
  add("effect.prediction.torque_share.yaw", 0.3);
  add("effect.prediction.in_plane_velocity_moment.roll", 3e-8);
  add("effect.prediction.in_plane_velocity_moment.pitch", 3e-8);
  add("effect.prediction.rate_return.roll", 1e-4);
  add("effect.prediction.rate_return.pitch", 1e-4);
  add("effect.prediction.rate_return.yaw", 3e-5);
  score::MultiStepOptions o;
  o.horizon = kHorizon;
  o.stride = 60;
  o.scale = kRotationScale;
  out.predicting = score::fit_multi_step(v, free, training, o).values;
  out.predicting_free = free;
}

// The filtered track as readings, for the estimator.
log::FlightRecord as_record(const score::StateTrack& t) {
  log::FlightRecord r;
  r.name = t.name;
  std::size_t hint = 0;
  for (std::size_t k = 0; k < t.state.size(); ++k) {
    r.pose.add(t.time_s(k), {t.state[k].p_W_m, t.state[k].q_WB});
    r.velocity_W_m_s.add(t.time_s(k), t.state[k].v_W_m_s);
    r.gyro_B_rad_s.add(t.time_s(k), t.state[k].w_B_rad_s);
    r.rotor_omega_rad_s.add(t.time_s(k), t.input.at(t.time_s(k), hint, false).omega_rad_s);
  }
  return r;
}

// Physical parameters by maximum likelihood on the first flight of each kind: the vehicle's, with process noise for what is not modelled.
estimate::ModelValues fit_likelihood(const NanodroneInputs& in, const std::vector<score::StateTrack>& training,
                                     const estimate::ModelValues& translation, NanodroneResult& out) {
  host::TermList terms;
  for (const host::Term* t :
       {host::find_term("rotor_local_inflow"), host::find_term("rotor_inertia_reaction"), &score::kInPlaneVelocityMoment})
    terms.add(*t);
  estimate::FitProblem problem;
  problem.start = start_values(in.vehicle, terms);
  for (const int p : {estimate::kK1, estimate::kK2, estimate::kCdh}) problem.start[p] = translation[p];
  const int velocity_roll = named(terms, "effect.prediction.in_plane_velocity_moment.roll");
  const int velocity_pitch = named(terms, "effect.prediction.in_plane_velocity_moment.pitch");
  const int rotor_inertia = named(terms, "effect.rotor_inertia_reaction.J_r_kg_m2");
  problem.start[named(terms, "effect.rotor_local_inflow.share")] = 1.0;
  problem.start[rotor_inertia] = 3e-8;
  problem.start[velocity_roll] = problem.start[velocity_pitch] = 1e-7;
  for (const int p : {int{estimate::kIxx}, int{estimate::kIyy}, int{estimate::kIzz}, int{estimate::kCq}, int{estimate::kK1},
                      int{estimate::kK2}, int{estimate::kCdh}, rotor_inertia, velocity_roll, velocity_pitch})
    problem.free.push_back({p});
  for (const int p : {estimate::kComX, estimate::kComY, estimate::kRotorDelay}) problem.free.push_back({p, true});

  std::vector<estimate::GridFlight> grids;
  estimate::GridOptions grid;
  grid.rate_Hz = 100.0;
  grid.longest_substep_s = 5.1e-3;
  grid.use_velocity = grid.use_gyro = true;
  std::string kind;
  for (const score::StateTrack& t : training) {
    const std::string this_kind = t.name.substr(0, t.name.find('_'));
    if (this_kind == kind) continue;
    kind = this_kind;
    grid.from_s = t.start_s + 3.0;  // without take-off and landing
    grid.to_s = t.time_s(t.state.size() - 1) - 3.0;
    grids.push_back(make_grid(as_record(t), grid));
  }
  for (const estimate::GridFlight& g : grids) problem.flights.push_back(&g);
  // Of the low-passed signals; the moments that the model does not know are worth about 5 rad/s² below 2 Hz.
  problem.noise.force_m_s2_rtHz.setConstant(0.15);
  problem.noise.angular_rad_s2_rtHz.setConstant(2.0);
  problem.noise.position_m.setConstant(3e-3);
  problem.noise.attitude_rad.setConstant(3e-3);
  problem.noise.velocity_m_s.setConstant(0.03);
  problem.noise.gyro_rad_s.setConstant(0.05);
  estimate::FitOptions options;
  options.tolerance = 1.0;
  options.max_iterations = 15;
  estimate::Fit fitted = estimate::fit(problem, options);
  estimate::ModelValues v = fitted.values.front();
  for (const int p : {estimate::kComX, estimate::kComY}) {
    v[p] = 0.0;
    for (const estimate::ModelValues& f : fitted.values) v[p] += f[p] / static_cast<double>(fitted.values.size());
  }
  v[estimate::kRotorDelay] = 0.0;
  for (const estimate::Estimate& e : fitted.estimates)
    out.likelihood_names.push_back(e.parameter < estimate::kCoreParameters ? estimate::estimate_name(e, problem)
                                                                           : estimate::parameter_info(e.parameter, terms).name);
  out.likelihood = std::move(fitted);
  return v;
}

void set_limits(const score::PredictionSummary& base, const score::PredictionSummary& own, std::span<const score::PredictionErrors> ours,
                std::span<const score::PredictionErrors> baseline, const score::Bootstrap& bootstrap, NanodroneResult& out) {
  for (std::size_t q = 0; q < score::kPredictedQuantities; ++q) {
    NanodroneLimit& l = out.limits[q];
    l.quantity = static_cast<score::PredictedQuantity>(q);
    l.published_best = kPublishedBest[q];
    l.baseline = base.sim_error[q];
    l.share = kShare[q];
    l.limit = l.share * std::min(l.published_best, l.baseline);
    l.measured = own.sim_error[q];
    l.to_baseline = score::error_ratio(ours, baseline, l.quantity, 1, kHorizon, bootstrap);
    l.met = l.measured <= l.limit;
  }
}

}  // namespace

bool NanodroneResult::met() const {
  const bool thrust = std::abs(k_F_N_s2 / kNanodronePublishedK_F_N_s2 - 1.0) <= kNanodroneK_F_tolerance;
  return thrust && std::all_of(limits.begin(), limits.end(), [](const NanodroneLimit& l) { return l.met; });
}

NanodroneResult run_nanodrone(const NanodroneInputs& in, const std::function<void(const std::string&)>& progress) {
  const auto say = [&](const std::string& what) {
    if (progress) progress(what);
  };
  NanodroneResult out;
  const Flights flights = read_flights(in);
  for (const score::StateTrack& t : flights.training) out.training.push_back(t.name);
  say(fmt::format("{} training flights, {} test flight(s)", flights.training.size(), flights.test.size()));

  const auto scored = [&](const std::string& model, const score::Predictor& predictor) {
    auto errors = score(flights.test, predictor);
    out.scores.push_back({model, score::summary(errors)});
    return errors;
  };
  scored("state held", score::state_held());
  const auto baseline = scored("published physics, rates held", score::rates_held(published_physics(in.vehicle)));

  const estimate::ModelValues translation = fit_translation(in, flights.training);
  out.k_F_N_s2 = host::static_c_t(
      {translation[estimate::kK1], translation[estimate::kK2], translation.geometry.radius_m, translation.geometry.air_density_kg_m3});
  say(fmt::format("translation fitted: k_F {:.3e} N s²", out.k_F_N_s2));
  const auto held = scored("eq. 1-5, rates held", score::rates_held(translation));

  std::optional<estimate::ModelValues> physical;
  if (in.maximum_likelihood) {
    physical = fit_likelihood(in, flights.training, translation, out);
    say("physical parameters fitted by maximum likelihood");
    scored("maximum likelihood, rates held", score::rates_held(*physical));
    scored("maximum likelihood, whole", score::whole_model(*physical));
  }

  fit_rotation(in, flights.training, translation, out);
  say("rotation fitted to 0.5 s ahead");
  const auto ours = scored("fitted to 0.5 s ahead", score::whole_model(out.predicting));

  const score::PredictionSummary our_score = score::summary(ours);
  set_limits(out.scores[1].score, our_score, ours, baseline, in.bootstrap, out);
  for (const std::size_t h : {1u, 2u, 5u, 10u, 20u, 50u}) {
    out.horizons.push_back({static_cast<double>(h) * our_score.step_s,
                            score::error_ratio(ours, held, score::kPredictedAttitude, h, h, in.bootstrap),
                            score::error_ratio(ours, held, score::kPredictedRates, h, h, in.bootstrap)});
  }
  const score::PredictionSummary far = score_far(flights.test, score::whole_model(out.predicting)),
                                 far_held = score_far(flights.test, score::rates_held(translation));
  out.attitude_helps = score::helpful_range(far, far_held, score::kPredictedAttitude);
  out.rates_help = score::helpful_range(far, far_held, score::kPredictedRates);
  if (physical)
    out.likelihood_rates_help =
        score::helpful_range(score_far(flights.test, score::whole_model(*physical)), far_held, score::kPredictedRates);
  return out;
}

}  // namespace rotorloop::studies
