#include "bench/sysid/diagnose/residuals/residual_series.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "bench/sysid/diagnose/residuals/flight_inputs.hpp"
#include "bench/sysid/diagnose/residuals/residual_smoother.hpp"
#include "bench/sysid/estimate/model/rotations.hpp"
#include "host/base/random.hpp"

namespace rotorloop::diagnose {
namespace {

constexpr std::uint64_t kNoiseModule = 0x52534E4Fu;

// Rows of a step's error that a wrench makes when it is constant over the step, and back: the wrench that an error stands for.
struct WrenchMap {
  Eigen::Matrix<double, 12, 6> error_by_wrench;  // unwhitened
  Eigen::Matrix<double, 6, 12> wrench_by_rows;   // of whitened rows
};
WrenchMap wrench_map(const estimate::BodyState& x, const estimate::ModelValues& values, const estimate::StateJacobian& unwhiten, double h) {
  const Eigen::Matrix3d body_to_world = x.q_WB.toRotationMatrix(), inertia = values.inertia_kg_m2();
  const Eigen::Matrix3d speed = h / values[estimate::kMass] * body_to_world, rate = h * inertia.inverse();
  WrenchMap m;
  m.error_by_wrench.setZero();
  m.error_by_wrench.block<3, 3>(0, 0) = 0.5 * h * speed;
  m.error_by_wrench.block<3, 3>(3, 0) = speed;
  m.error_by_wrench.block<3, 3>(6, 3) = 0.5 * h * rate;
  m.error_by_wrench.block<3, 3>(9, 3) = rate;
  m.wrench_by_rows.topRows<3>() = values[estimate::kMass] / h * body_to_world.transpose() * unwhiten.middleRows<3>(3);
  m.wrench_by_rows.bottomRows<3>() = 1.0 / h * inertia * unwhiten.middleRows<3>(9);
  return m;
}

// Column 0: the flight's residuals. 1: the model's wrench as if it were lacking. Then noise by the figures of the fit.
ResidualColumns put_in(const LinearFlight& linear, const std::vector<SampleState>& state, std::size_t first, const Axes& wrench,
                       int simulated, const RandomStream& random) {
  ResidualColumns c = ResidualColumns::zero(linear, 2 + simulated);
  std::uint64_t drawn = 0;
  std::size_t s = first;
  for (std::size_t k = 0; k < linear.steps.size(); ++k) {
    if (!linear.linked[k]) continue;
    c.step(k).col(0) = linear.steps[k].r;
    Eigen::Matrix<double, 6, 1> w;
    for (std::size_t a = 0; a < kAxes; ++a) w[static_cast<Eigen::Index>(a)] = wrench[a][s];
    c.step(k).col(1) = state[s].whitened_by_wrench * w;
    for (Eigen::Index n = 0; n < simulated; ++n) {
      for (Eigen::Index i = 0; i < 12; ++i) c.step(k)(i, 2 + n) = random.quick_gaussian(drawn++);
    }
    ++s;
  }
  for (std::size_t i = 0; i < linear.measurements.size(); ++i) {
    c.measurement(i).col(0) = linear.measurements[i].r;
    for (Eigen::Index n = 0; n < simulated; ++n) {
      for (Eigen::Index a = 0; a < linear.measurements[i].rows; ++a) c.measurement(i)(a, 2 + n) = random.quick_gaussian(drawn++);
    }
  }
  return c;
}

void resize(Axes& axes, std::size_t n) {
  for (auto& a : axes) a.resize(n);
}

// Pushes the smoothed wrench of every column into its series.
void add_wrenches(const LinearFlight& linear, const ResidualColumns& c, const std::vector<WrenchMap>& maps, std::size_t first,
                  bool simulated, Axes& actual, ResidualSeries& out) {
  std::size_t s = first;
  for (std::size_t k = 0; k < linear.steps.size(); ++k) {
    if (!linear.linked[k]) continue;
    const Eigen::Matrix<double, 6, Eigen::Dynamic> w = maps[s - first].wrench_by_rows * c.step(k);
    for (std::size_t a = 0; a < kAxes; ++a) {
      const auto row = static_cast<Eigen::Index>(a);
      actual[a][s] = w(row, 0);
      if (!simulated) continue;
      out.model[a][s] = w(row, 1);
      for (std::size_t n = 0; n < out.simulated.size(); ++n) out.simulated[n][a][s] = w(row, 2 + static_cast<Eigen::Index>(n));
    }
    ++s;
  }
}

void add_whitened(const LinearFlight& linear, const estimate::NoiseModel& noise, const ResidualColumns& c, std::size_t first,
                  WhitenedResiduals& out) {
  const Eigen::Index columns = c.steps.cols() - 1;  // the model's own is left out
  const auto kept = [&](const auto& rows, auto count) {
    Eigen::Matrix<float, decltype(count)::value, Eigen::Dynamic> m(decltype(count)::value, columns);
    m.col(0) = rows.col(0).template head<decltype(count)::value>().template cast<float>();
    m.rightCols(columns - 1) = rows.template topRows<decltype(count)::value>().rightCols(columns - 1).template cast<float>();
    return m;
  };
  std::vector<std::size_t> sample_of(linear.nodes, first);  // the step that follows a node, or else the one before it
  std::size_t s = first;
  for (std::size_t k = 0; k < linear.nodes; ++k) {
    const bool follows = k < linear.steps.size() && linear.linked[k];
    sample_of[k] = follows || s == first ? s : s - 1;
    if (!follows) continue;
    out.steps.push_back(kept(c.step(k), std::integral_constant<int, 12>()));
    ++s;
  }
  for (std::size_t i = 0; i < linear.measurements.size(); ++i) {
    const LinearFlight::Measurement& r = linear.measurements[i];
    if (r.kind == LinearFlight::Kind::pose) {
      out.poses.push_back(kept(c.measurement(i), std::integral_constant<int, 6>()));
      out.pose_sample.push_back(sample_of[r.node]);
      out.pose_by_stamp.push_back(r.by_stamp);
      out.pose_position_m.push_back(noise.position_m.mean());
    } else if (r.kind == LinearFlight::Kind::accel) {
      out.accels.push_back(kept(c.measurement(i), std::integral_constant<int, 3>()));
      out.accel_sample.push_back(sample_of[r.node]);
      out.accel_m_s2.push_back(noise.accel_m_s2);
    }
  }
}

// Standard uncertainties of the wrench about the truth.
void add_uncertainty(const LinearFlight& linear, const ResidualSmoother& smoother, const std::vector<WrenchMap>& maps, std::size_t first,
                     Axes& u) {
  std::size_t s = first + maps.size();
  smoother.covariances([&](std::size_t, const estimate::StateJacobian& c) {
    --s;
    const Eigen::Matrix<double, 6, 12>& m = maps[s - first].wrench_by_rows;
    for (std::size_t a = 0; a < kAxes; ++a) {
      const auto row = static_cast<Eigen::Index>(a);
      u[a][s] = std::sqrt(std::max(0.0, m.row(row).dot(m.row(row) * c)));
    }
  });
  (void)linear;
}

}  // namespace

const Channel* ResidualSeries::input(std::string_view id) const {
  for (const Channel& c : inputs) {
    if (c.id == id) return &c;
  }
  return nullptr;
}

ResidualSeries residual_series(const identify::Identification& r, const SeriesOptions& o) {
  ResidualSeries out;
  for (const estimate::GridFlight& g : r.flights) out.samples.flights.push_back(g.name);
  std::size_t total = 0;
  for (const estimate::GridFlight& g : r.flights) total += static_cast<std::size_t>(std::count(g.linked.begin(), g.linked.end(), 1));
  for (Axes* a : {&out.smoothed, &out.smoothed_u, &out.free, &out.free_u, &out.model}) resize(*a, total);
  out.simulated.resize(static_cast<std::size_t>(std::max(0, o.simulated)));
  for (Axes& a : out.simulated) resize(a, total);
  out.inputs = input_channels();
  Axes model_wrench;
  for (std::size_t f = 0; f < r.flights.size(); ++f) {
    const estimate::GridFlight& g = r.flights[f];
    const estimate::ModelValues& values = r.fit.values[f];
    const std::size_t first = out.samples.size;
    for (std::size_t k = 0; k + 1 < g.nodes;) {
      std::size_t end = k;
      while (end + 1 < g.nodes && g.linked[end]) ++end;
      if (end > k) out.samples.add(f, g.time_s(k) + 0.5 * g.step_s, g.step_s, end - k);
      k = end + 1;
    }
    add_flight_inputs(g, values, r.fit.states[f], out.state, out.inputs, model_wrench);
    const LinearFlight linear = linearised(g, values, r.fit.noise[f], r.fit.states[f]);
    const estimate::StateJacobian unwhiten = linear.whitening.inverse();
    std::vector<WrenchMap> maps;
    for (std::size_t s = first; s < out.samples.size; ++s) {
      maps.push_back(wrench_map(out.state[s].x, values, unwhiten, g.step_s));
      out.state[s].whitened_by_wrench = linear.whitening * maps.back().error_by_wrench;
    }
    const RandomStream random(o.seed, kNoiseModule + f);
    const ResidualColumns in = put_in(linear, out.state, first, model_wrench, o.simulated, random);
    {
      const ResidualSmoother own(linear, 1.0);
      const ResidualColumns c = own.smoothed(in);
      add_wrenches(linear, c, maps, first, false, out.smoothed, out);
      add_uncertainty(linear, own, maps, first, out.smoothed_u);
      add_whitened(linear, r.fit.noise[f], c, first, out.whitened);
    }
    const ResidualSmoother free(linear, o.free_scale);
    add_wrenches(linear, free.smoothed(in), maps, first, true, out.free, out);
    add_uncertainty(linear, free, maps, first, out.free_u);
    add_telemetry(g, values, r.fit.noise[f], r.fit.states[f], f < o.logs.size() ? &o.logs[f].record : nullptr, out.telemetry);
  }
  return out;
}

}  // namespace rotorloop::diagnose
