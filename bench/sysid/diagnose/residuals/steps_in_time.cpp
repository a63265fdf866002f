#include "bench/sysid/diagnose/residuals/steps_in_time.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "bench/sysid/identify/whiteness.hpp"
#include "host/base/random.hpp"
#include "host/base/statistics.hpp"
#include "host/vehicle/effect_catalogue.hpp"

namespace rotorloop::diagnose {
namespace {

constexpr std::uint64_t kOrderModule = 0x53544550u;
constexpr double kSameEvent_s = 1.0;

// Scores and information of one kind in one flight, summed over cells of the time grid.
struct Cells {
  std::vector<double> end_s, score, information;
};
Cells cells(const ResidualSeries& r, const StepKind& kind, std::size_t flight, double grid_s) {
  Cells out;
  const std::vector<double> t = times_s(r.samples);
  double from = -1e300;
  for (const Piece& p : r.samples.pieces) {
    if (p.flight != flight) continue;
    for (std::size_t i = p.first; i < p.first + p.count; ++i) {
      if (t[i] >= from + grid_s || from < -1e299) {
        from = t[i];
        out.end_s.push_back(from);
        out.score.push_back(0.0);
        out.information.push_back(0.0);
      }
      const Eigen::Matrix<double, 12, 1> g = r.state[i].whitened_by_wrench * kind.wrench[i];
      out.end_s.back() = t[i] + 0.5 * p.step_s;
      out.score.back() += g.dot(r.whitened.steps[i].col(0).cast<double>());
      out.information.back() += g.squaredNorm();
    }
  }
  return out;
}

// Blocks must be longer than the residual is correlated: four times its integrated correlation time (short series
// make that look shorter than it is), but six blocks at least are left.
std::size_t block_length(const std::vector<double>& score, std::size_t least) {
  const std::vector<double> r = identify::autocorrelation(score, score.size() / 4);
  double cells = 1.0;
  for (std::size_t k = 1; k < r.size() && r[k] > 0.0; ++k) cells += 2.0 * r[k];
  return std::clamp(static_cast<std::size_t>(std::ceil(4.0 * cells)), least, std::max(least, score.size() / 6));
}

struct Best {
  std::size_t at = 0;
  double chi2 = 0.0;
};
Best best_of(const std::vector<double>& chi2, std::size_t margin) {
  Best b;
  for (std::size_t i = margin; i + margin < chi2.size(); ++i) {
    if (chi2[i] > b.chi2) b = {i, chi2[i]};
  }
  return b;
}

// The cells of whole blocks in another order.
void shuffled(const Cells& c, std::size_t block, const RandomStream& random, std::uint64_t& drawn, Cells& out) {
  const std::size_t n = c.score.size(), blocks = (n + block - 1) / block;
  std::vector<std::size_t> order(blocks);
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t i = blocks; i > 1; --i)
    std::swap(order[i - 1], order[static_cast<std::size_t>(random.uniform(drawn++) * static_cast<double>(i))]);
  out.score.clear();
  out.information.clear();
  for (const std::size_t b : order) {
    for (std::size_t i = b * block; i < std::min(n, (b + 1) * block); ++i) {
      out.score.push_back(c.score[i]);
      out.information.push_back(c.information[i]);
    }
  }
}

}  // namespace

std::vector<StepKind> step_kinds(std::span<const SampleState> state) {
  std::vector<StepKind> out;
  const auto add = [&](const host::CatalogueEffect& e, const host::CatalogueParameter& p, auto&& wrench) {
    StepKind k{e.id, p.name, p.unit, {}};
    for (const SampleState& s : state) k.wrench.push_back(wrench(s));
    out.push_back(std::move(k));
  };
  using Wrench = Eigen::Matrix<double, 6, 1>;
  const host::CatalogueEffect &force = host::effect("body_force_bias"), &torque = host::effect("body_torque_bias");
  for (std::size_t a = 0; a < 6; ++a) {
    add(a < 3 ? force : torque, a < 3 ? force.model[a] : torque.model[a - 3],
        [&](const SampleState&) -> Wrench { return Wrench::Unit(static_cast<Eigen::Index>(a)); });
  }
  const auto lift = [](const SampleState& s, std::size_t i) -> Wrench {
    Wrench w = Wrench::Zero();
    w[2] = s.thrust_N[i];
    w[3] = s.arm_B_m[i].y() * s.thrust_N[i];
    w[4] = -s.arm_B_m[i].x() * s.thrust_N[i];
    return w;
  };
  const host::CatalogueEffect &scale = host::effect("thrust_scale"), &weak = host::effect("weak_rotor"), &com = host::effect("com_offset");
  add(scale, scale.parameter, [&](const SampleState& s) -> Wrench {
    Wrench w = Wrench::Zero();
    for (std::size_t i = 0; i < 4; ++i) w += lift(s, i);
    return w;
  });
  for (std::size_t r = 0; r < 4; ++r) {
    host::CatalogueParameter own = weak.parameter;
    own.name += " of rotor " + std::to_string(r + 1);
    add(weak, own, [&](const SampleState& s) -> Wrench { return lift(s, r); });
  }
  // The centre of mass moves ahead by dx: all hubs move back.
  const auto total = [](const SampleState& s) { return s.thrust_N[0] + s.thrust_N[1] + s.thrust_N[2] + s.thrust_N[3]; };
  add(com, com.model[0], [&](const SampleState& s) -> Wrench { return total(s) * Wrench::Unit(4); });
  add(com, com.model[1], [&](const SampleState& s) -> Wrench { return -total(s) * Wrench::Unit(3); });
  return out;
}

// A step after a point, against a constant over the flight that the model's own parameters absorb: with the sums A, I up to the point and
// A_n, I_n over all, the score of the step is A - A_n I / I_n (a bridge), its information I (I_n - I) / I_n.
std::vector<double> step_statistic(std::span<const double> score, std::span<const double> information) {
  const double all = std::accumulate(score.begin(), score.end(), 0.0),
               weight = std::accumulate(information.begin(), information.end(), 0.0);
  std::vector<double> out;
  double a = 0.0, i = 0.0;
  for (std::size_t k = 0; k < score.size(); ++k) {
    a += score[k];
    i += information[k];
    const double left = weight - i, info = weight > 0.0 ? i * left / weight : 0.0, bridge = weight > 0.0 ? a - all * i / weight : 0.0;
    out.push_back(info > 1e-9 * weight ? bridge * bridge / info : 0.0);
  }
  return out;
}

namespace {

// One kind of step in one flight, with what the search over its moments needs.
struct Search {
  Cells cells, without;  // without: the step at the best moment taken out
  Best best;
  std::size_t margin = 0, block = 0;  // cells
};

// Size: mean score per information after less before. Its uncertainty: scatter of blocks about the two means.
void measure_size(Search& search, std::size_t least_block, TimeStep& s) {
  const Cells& c = search.cells;
  const std::size_t n = c.score.size(), at = search.best.at;
  double before = 0.0, before_i = 0.0, after = 0.0, after_i = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    (i <= at ? before : after) += c.score[i];
    (i <= at ? before_i : after_i) += c.information[i];
  }
  const double low = before_i > 0.0 ? before / before_i : 0.0, high = after_i > 0.0 ? after / after_i : 0.0;
  s.size = high - low;
  search.without = c;
  std::vector<double>& rest = search.without.score;
  for (std::size_t i = 0; i < n; ++i) rest[i] -= (i <= at ? low : high) * c.information[i];
  search.block = block_length(rest, least_block);
  double scatter_before = 0.0, scatter_after = 0.0;
  for (std::size_t from = 0; from < n; from += search.block) {
    double b = 0.0, a = 0.0;
    for (std::size_t i = from; i < std::min(n, from + search.block); ++i) (i <= at ? b : a) += rest[i];
    scatter_before += b * b;
    scatter_after += a * a;
  }
  s.u = std::sqrt((before_i > 0.0 ? scatter_before / (before_i * before_i) : 0.0) +
                  (after_i > 0.0 ? scatter_after / (after_i * after_i) : 0.0));
}

// Two searches in random order: with the step still in the flight, how often chance does as well; with it taken out, how far it
// stands above chance when none does. (The second alone would flatter: what is taken out was the best of all moments.)
void compare_with_chance(const Search& search, const RandomStream& random, int resamples, TimeStep& s) {
  std::uint64_t drawn = 0;
  Cells other;
  const auto best_of_shuffled = [&](const Cells& c) {
    shuffled(c, search.block, random, drawn, other);
    return best_of(step_statistic(other.score, other.information), search.margin).chi2;
  };
  std::vector<double> largest;
  int as_large = 0;
  for (int m = 0; m < resamples; ++m) {
    as_large += best_of_shuffled(search.cells) >= s.chi2;
    largest.push_back(best_of_shuffled(search.without));
  }
  // What was taken out took two of the blocks' degrees of freedom with it.
  const double blocks = std::floor(static_cast<double>(search.cells.score.size()) / static_cast<double>(search.block));
  s.limit = quantile(largest, 0.99) * blocks / std::max(1.0, blocks - 2.0);
  s.p = (1.0 + as_large) / (1.0 + resamples);
  // Beyond the draws: a largest squared bridge has an exponential tail, and Student's when its scatter is known from few blocks.
  constexpr double kLimit = 12.4;        // 1 % of white noise on the inner 84 % (Andrews 1993)
  constexpr double kLeastBlocks = 10.0;  // fewer show no tail: a gust or two look like a step
  if (as_large == 0 && blocks >= kLeastBlocks && s.limit > 0.0 && s.chi2 > s.limit)
    s.p = std::min(s.p, 0.01 * std::pow(1.0 + (s.chi2 / s.limit - 1.0) * kLimit / blocks, -0.5 * blocks));
}

// Whether a step behind `share` of a flight makes an rms that matters on one of the axes.
bool step_matters(const Samples& samples, const StepKind& kind, const TimeStep& s, double share, const std::array<double, 6>& matters) {
  Eigen::Matrix<double, 6, 1> square = Eigen::Matrix<double, 6, 1>::Zero();
  double count = 0.0;
  for (const Piece& p : samples.pieces) {
    if (p.flight != s.flight) continue;
    for (std::size_t i = p.first; i < p.first + p.count; ++i) square += kind.wrench[i].cwiseAbs2();
    count += static_cast<double>(p.count);
  }
  for (Eigen::Index a = 0; a < square.size(); ++a) {
    const double rms = std::fabs(s.size) * std::sqrt(square[a] / count * share * (1.0 - share));
    if (rms > 0.0 && rms >= matters[static_cast<std::size_t>(a)]) return true;
  }
  return false;
}

void gather_events(StepsResult& out) {
  for (std::size_t i = 0; i < out.steps.size(); ++i) {
    if (out.steps[i].p_holm >= 0.01) continue;
    auto& events = out.steps[i].matters ? out.events : out.too_small;
    const auto same = [&](const std::vector<std::size_t>& event) {
      const TimeStep& first = out.steps[event.front()];
      return first.flight == out.steps[i].flight && !(std::fabs(first.at_s - out.steps[i].at_s) > kSameEvent_s);
    };
    const auto event = std::find_if(events.begin(), events.end(), same);
    if (event != events.end()) {
      event->push_back(i);
    } else {
      events.push_back({i});
    }
  }
}

}  // namespace

StepsResult steps_in_time(const ResidualSeries& r, std::span<const StepKind> kinds, const StepOptions& o) {
  StepsResult out;
  out.matters = o.matters;
  for (std::size_t f = 0; f < r.samples.flights.size(); ++f) {
    for (std::size_t k = 0; k < kinds.size(); ++k) {
      Search search{.cells = cells(r, kinds[k], f, o.grid_s), .without = {}, .best = {}};
      const Cells& c = search.cells;
      const std::size_t n = c.score.size(), least = static_cast<std::size_t>(std::max(1.0, std::round(o.block_s / o.grid_s)));
      if (n < 6 * least) continue;
      search.margin = static_cast<std::size_t>(std::max(1.0, o.margin * static_cast<double>(n)));
      TimeStep s;
      s.flight = f;
      s.effect = kinds[k].effect;
      s.parameter = kinds[k].parameter;
      s.unit = kinds[k].unit;
      s.tried_s = c.end_s;
      s.chi2_at = step_statistic(c.score, c.information);
      search.best = best_of(s.chi2_at, search.margin);
      s.at_s = c.end_s[search.best.at];
      s.chi2 = search.best.chi2;
      measure_size(search, least, s);
      s.matters = step_matters(r.samples, kinds[k], s, static_cast<double>(search.best.at + 1) / static_cast<double>(n), o.matters);
      compare_with_chance(search, RandomStream(o.seed, kOrderModule + 64 * f + k), o.resamples, s);
      out.steps.push_back(std::move(s));
    }
  }
  std::vector<double> p;
  for (const TimeStep& s : out.steps) p.push_back(s.p);
  const std::vector<double> adjusted = holm(p);
  for (std::size_t i = 0; i < p.size(); ++i) out.steps[i].p_holm = adjusted[i];
  std::stable_sort(out.steps.begin(), out.steps.end(),
                   [](const TimeStep& a, const TimeStep& b) { return a.p != b.p ? a.p < b.p : a.chi2 * b.limit > b.chi2 * a.limit; });
  gather_events(out);
  return out;
}

}  // namespace rotorloop::diagnose
