#include "bench/sysid/score/prediction.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "bench/sysid/estimate/model/rotations.hpp"
#include "host/base/constants.hpp"
#include "host/base/error.hpp"
#include "host/base/random.hpp"
#include "host/base/statistics.hpp"

namespace rotorloop::score {
namespace {

constexpr std::uint64_t kBootstrapModule = 0x5052444Cu, kProcessModule = 0x50524F43u;

// Position, velocity and attitude with constant body rates: Runge-Kutta of fourth order in position and velocity; the attitude is exact.
estimate::BodyState step_with_rates_held(const estimate::Model& model, const StateTrack& track, const estimate::BodyState& x, double t_s,
                                         double h, std::size_t& hint) {
  const estimate::ModelValues& values = model.values();
  const Eigen::Vector3d gravity = kGravity_m_s2 * Eigen::Vector3d(values[estimate::kTiltX], values[estimate::kTiltY], -1.0);
  const auto turned = [&](double ahead) { return (x.q_WB * estimate::exp_q(ahead * x.w_B_rad_s)).normalized(); };
  const auto acceleration = [&](const estimate::BodyState& y, double ahead) -> Eigen::Vector3d {
    const estimate::RotorInputSample u = track.input.at(t_s + ahead, hint, false);
    const Eigen::Vector3d f = y.q_WB * model.instant(y, u, t_s + ahead).specific_force_B_m_s2;
    return f + gravity;
  };
  const auto moved_by = [&](double ahead, const Eigen::Vector3d& v, const Eigen::Vector3d& a) {
    estimate::BodyState y = x;
    y.p_W_m += ahead * v;
    y.v_W_m_s += ahead * a;
    y.q_WB = turned(ahead);
    return y;
  };
  const Eigen::Vector3d a1 = acceleration(x, 0.0), v1 = x.v_W_m_s;
  const estimate::BodyState x2 = moved_by(0.5 * h, v1, a1);
  const Eigen::Vector3d a2 = acceleration(x2, 0.5 * h), v2 = x2.v_W_m_s;
  const estimate::BodyState x3 = moved_by(0.5 * h, v2, a2);
  const Eigen::Vector3d a3 = acceleration(x3, 0.5 * h), v3 = x3.v_W_m_s;
  const estimate::BodyState x4 = moved_by(h, v3, a3);
  const Eigen::Vector3d a4 = acceleration(x4, h), v4 = x4.v_W_m_s;
  return moved_by(h, (v1 + 2.0 * v2 + 2.0 * v3 + v4) / 6.0, (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0);
}

// One step of a model with stateful terms: their state runs along the step that it would give if it stood still, then the step is taken
// again along the memory.
estimate::BodyState step_with_term_states(const estimate::Model& model, const StateTrack& track, const estimate::BodyState& x,
                                          double from_s, double to_s, int substeps, std::size_t& hint, estimate::MemoryNumbers& memory) {
  estimate::TermStateEnds ends{memory, memory};
  const estimate::BodyState first = model.step(x, track.input, hint, from_s, to_s, substeps, &ends);
  const estimate::RotorInputSample from = track.input.at(from_s, hint, false), to = track.input.at(to_s, hint, false);
  estimate::advance_term_states(model.values(), x, from, from_s, first, to, to_s, ends.to);
  memory = ends.to;
  return model.step(x, track.input, hint, from_s, to_s, substeps, &ends);
}

// Starts of one flight that are drawn together, with the summed errors of each of the predictions compared.
using Block = std::array<double, 3>;
using Predictions = std::span<const std::span<const PredictionErrors>>;
std::vector<std::vector<Block>> blocks_of(Predictions all, PredictedQuantity q, std::size_t from, std::size_t to, double block_s) {
  const std::span<const PredictionErrors> a = all.front();
  std::vector<std::vector<Block>> flights;
  for (std::size_t f = 0; f < a.size(); ++f) {
    for (const auto& b : all) {
      if (f < b.size() && a[f].starts == b[f].starts && a[f].horizon == b[f].horizon && to <= a[f].horizon && from >= 1 && from <= to)
        continue;
      throw Error({.where = "paired comparison of predictions",
                   .what = "the predictions differ in starts or horizon, or the horizons asked for are not among them",
                   .likely = "",
                   .remedy = "predict the same flights from the same starts"});
    }
    std::vector<Block> blocks;
    std::size_t current = 0;
    for (std::size_t s = 0; s < a[f].starts.size(); ++s) {
      const auto block = static_cast<std::size_t>(static_cast<double>(a[f].starts[s]) * a[f].step_s / block_s);
      if (blocks.empty() || block != current) blocks.emplace_back();
      current = block;
      for (std::size_t h = from; h <= to; ++h) {
        for (std::size_t i = 0; i < all.size(); ++i) blocks.back()[i] += all[i][f].at(q, s, h);
      }
    }
    if (!blocks.empty()) flights.push_back(std::move(blocks));
  }
  return flights;
}

// A figure of summed errors, with its interval when blocks are drawn anew.
template <class Figure>
ErrorRatio drawn_anew(const std::vector<std::vector<Block>>& flights, const Bootstrap& options, Figure&& figure) {
  ErrorRatio out;
  if (flights.empty()) return out;
  const auto add = [](Block& sum, const Block& x) {
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += x[i];
  };
  Block whole{};
  for (const auto& blocks : flights) {
    for (const Block& x : blocks) add(whole, x);
  }
  out.value = figure(whole);
  const RandomStream random(options.seed, kBootstrapModule);
  std::uint64_t draw = 0;
  const auto pick = [&](std::size_t count) { return static_cast<std::size_t>(random.uniform(draw++) * static_cast<double>(count)); };
  std::vector<double> figures;
  for (int i = 0; i < options.resamples; ++i) {
    Block sum{};
    for (std::size_t f = 0; f < flights.size(); ++f) {
      const auto& blocks = flights[flights.size() > 1 ? pick(flights.size()) : 0];
      for (std::size_t k = 0; k < blocks.size(); ++k) add(sum, blocks[pick(blocks.size())]);
    }
    figures.push_back(figure(sum));
  }
  out.low = quantile(figures, 0.5 * (1.0 - options.level));
  out.high = quantile(figures, 0.5 * (1.0 + options.level));
  return out;
}

}  // namespace

Predictor state_held() {
  return [](const StateTrack& track, std::size_t start, std::span<estimate::BodyState> out) {
    std::fill(out.begin(), out.end(), track.state[start]);
  };
}

Predictor rates_held(const estimate::ModelValues& values) {
  const auto model = std::make_shared<const estimate::Model>(values);
  return [model](const StateTrack& track, std::size_t start, std::span<estimate::BodyState> out) {
    estimate::BodyState x = track.state[start];
    std::size_t hint = start;
    for (std::size_t k = 0; k < out.size(); ++k) {
      x = step_with_rates_held(*model, track, x, track.time_s(start + k), track.step_s, hint);
      out[k] = x;
    }
  };
}

Predictor whole_model(const estimate::ModelValues& values, int substeps) {
  const auto model = std::make_shared<const estimate::Model>(values);
  return [model, substeps](const StateTrack& track, std::size_t start, std::span<estimate::BodyState> out) {
    estimate::BodyState x = track.state[start];
    std::size_t hint = start;
    if (model->values().terms.memory() > 0) {
      estimate::MemoryNumbers memory = track.input.at(track.time_s(start), hint, false).memory;
      for (std::size_t k = 0; k < out.size(); ++k) {
        x = step_with_term_states(*model, track, x, track.time_s(start + k), track.time_s(start + k + 1), substeps, hint, memory);
        out[k] = x;
      }
      return;
    }
    for (std::size_t k = 0; k < out.size(); ++k) {
      x = model->step(x, track.input, hint, track.time_s(start + k), track.time_s(start + k + 1), substeps);
      out[k] = x;
    }
  };
}

Predictor noisy_model(const estimate::ModelValues& values, int substeps, const estimate::NoiseModel& noise, std::uint64_t seed) {
  const auto model = std::make_shared<const estimate::Model>(values);
  return [model, substeps, noise, random = RandomStream(seed, kProcessModule)](const StateTrack& track, std::size_t start,
                                                                               std::span<estimate::BodyState> out) {
    estimate::BodyState x = track.state[start];
    std::size_t hint = start;
    const bool stateful = model->values().terms.memory() > 0;
    estimate::MemoryNumbers memory = track.input.at(track.time_s(start), hint, false).memory;
    const double h = track.step_s, rate = std::sqrt(h), rest = std::sqrt(h * h * h / 12.0);
    std::uint64_t draw = static_cast<std::uint64_t>(start) << 20;
    const auto normal = [&] {
      const double a = random.gaussian(draw), b = random.gaussian(draw + 1), c = random.gaussian(draw + 2);
      draw += 3;
      return Eigen::Vector3d(a, b, c);
    };
    for (std::size_t k = 0; k < out.size(); ++k) {
      const double from = track.time_s(start + k), to = track.time_s(start + k + 1);
      x = stateful ? step_with_term_states(*model, track, x, from, to, substeps, hint, memory)
                   : model->step(x, track.input, hint, from, to, substeps);
      // White acceleration of density q over a step: covariance q² [h³/3, h²/2; h²/2, h], as the fit takes it.
      estimate::StateError kick;
      const auto push = [&](Eigen::Index place, const Eigen::Vector3d& q) {
        const Eigen::Vector3d velocity = rate * q.cwiseProduct(normal());
        kick.segment<3>(place) = 0.5 * h * velocity + rest * q.cwiseProduct(normal());
        kick.segment<3>(place + 3) = velocity;
      };
      push(0, noise.force_m_s2_rtHz);
      push(6, noise.angular_rad_s2_rtHz);
      x = estimate::moved(x, kick);
      out[k] = x;
    }
  };
}

std::vector<std::size_t> prediction_starts(const StateTrack& track, std::size_t horizon, std::size_t stride) {
  std::vector<std::size_t> starts;
  for (std::size_t k = 0; k + horizon < track.state.size(); k += stride) starts.push_back(k);
  return starts;
}

PredictionErrors predict(const StateTrack& track, const Predictor& predictor, std::span<const std::size_t> starts, std::size_t horizon) {
  PredictionErrors out{track.name, track.step_s, horizon, {starts.begin(), starts.end()}, {}};
  for (auto& e : out.error) e.reserve(starts.size() * horizon);
  std::vector<estimate::BodyState> ahead(horizon);
  for (const std::size_t start : starts) {
    predictor(track, start, ahead);
    for (std::size_t h = 0; h < horizon; ++h) {
      const estimate::BodyState& truth = track.state.at(start + h + 1);
      const estimate::StateError d = estimate::difference(truth, ahead[h]);
      for (std::size_t q = 0; q < kPredictedQuantities; ++q) out.error[q].push_back(d.segment<3>(static_cast<Eigen::Index>(3 * q)).norm());
    }
  }
  return out;
}

PredictionSummary summary(std::span<const PredictionErrors> flights) {
  PredictionSummary s;
  if (flights.empty()) return s;
  s.step_s = flights.front().step_s;
  s.horizon = flights.front().horizon;
  for (auto& m : s.mean) m.assign(s.horizon, 0.0);
  for (const PredictionErrors& f : flights) {
    s.starts += f.starts.size();
    for (std::size_t q = 0; q < kPredictedQuantities; ++q) {
      for (std::size_t i = 0; i < f.error[q].size(); ++i) s.mean[q][i % s.horizon] += f.error[q][i];
    }
  }
  for (std::size_t q = 0; q < kPredictedQuantities; ++q) {
    for (double& m : s.mean[q]) {
      m /= static_cast<double>(std::max<std::size_t>(1, s.starts));
      s.sim_error[q] += m;
    }
  }
  return s;
}

ErrorRatio error_ratio(std::span<const PredictionErrors> a, std::span<const PredictionErrors> b, PredictedQuantity q, std::size_t from,
                       std::size_t to, const Bootstrap& options) {
  const std::array<std::span<const PredictionErrors>, 2> both{a, b};
  return drawn_anew(blocks_of(both, q, from, to, options.block_s), options, [](const Block& sum) { return sum[0] / sum[1]; });
}

ErrorRatio share_closed(std::span<const PredictionErrors> before, std::span<const PredictionErrors> after,
                        std::span<const PredictionErrors> floor, PredictedQuantity q, std::size_t from, std::size_t to,
                        const Bootstrap& options) {
  constexpr double kAvoidable = 0.02;
  const std::array<std::span<const PredictionErrors>, 3> three{before, after, floor};
  const auto flights = blocks_of(three, q, from, to, options.block_s);
  Block whole{};
  for (const auto& blocks : flights) {
    for (const Block& x : blocks) {
      for (std::size_t i = 0; i < x.size(); ++i) whole[i] += x[i];
    }
  }
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (whole[0] - whole[2] <= kAvoidable * whole[0]) return {kNone, kNone, kNone};
  // A draw of blocks in which nothing could be avoided says nothing either way: any share may be.
  return drawn_anew(flights, options, [](const Block& sum) {
    const double gap = sum[0] - sum[2], closed = sum[0] - sum[1];
    return gap > 0.0 ? closed / gap : std::copysign(std::numeric_limits<double>::infinity(), closed);
  });
}

ErrorRatio mean_difference(std::span<const PredictionErrors> a, std::span<const PredictionErrors> b, PredictedQuantity q, std::size_t steps,
                           const Bootstrap& options) {
  std::vector<PredictionErrors> ones(a.begin(), a.end());  // blocks hold unequal numbers of starts
  for (PredictionErrors& f : ones) f.error[q].assign(f.error[q].size(), 1.0);
  const std::array<std::span<const PredictionErrors>, 3> three{a, b, ones};
  return drawn_anew(blocks_of(three, q, steps, steps, options.block_s), options,
                    [](const Block& sum) { return (sum[0] - sum[1]) / sum[2]; });
}

HelpfulRange helpful_range(const PredictionSummary& a, const PredictionSummary& b, PredictedQuantity q) {
  const std::size_t steps = std::min(a.mean[q].size(), b.mean[q].size());
  std::size_t first = 0, run = 0, best_first = 0, best_run = 0;
  for (std::size_t k = 0; k < steps; ++k) {
    if (!(a.mean[q][k] < b.mean[q][k])) {
      run = 0;
      continue;
    }
    if (run++ == 0) first = k;
    if (run > best_run) {
      best_first = first;
      best_run = run;
    }
  }
  if (best_run == 0) return {};
  return {static_cast<double>(best_first + 1) * a.step_s, static_cast<double>(best_first + best_run) * a.step_s};
}

}  // namespace rotorloop::score
