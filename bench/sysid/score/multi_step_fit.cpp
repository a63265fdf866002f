#include "bench/sysid/score/multi_step_fit.hpp"

#include <algorithm>
#include <cmath>

#include "bench/sysid/estimate/model/rotations.hpp"
#include "host/base/least_squares.hpp"

namespace rotorloop::score {
namespace {

// Cost and influence weight of a scaled error: quadratic near zero, linear beyond c.
double pseudo_huber(double e2, double c, double& weight) {
  if (c <= 0.0) {
    weight = 1.0;
    return 0.5 * e2;
  }
  const double root = std::sqrt(1.0 + e2 / (c * c));
  weight = 1.0 / root;
  return c * c * (root - 1.0);
}

class Windows {
 public:
  Windows(const std::vector<StateTrack>& tracks, const MultiStepOptions& o) : tracks_(tracks), o_(o) {
    for (const StateTrack& t : tracks) {
      starts_.push_back(prediction_starts(t, o.horizon, o.stride));
      count_ += starts_.back().size() * o.horizon;
    }
  }

  // With derivatives when `normal` is given.
  double cost(const estimate::ModelValues& values, const estimate::Columns& free, NormalEquations* normal) const {
    const estimate::Model model(values, normal ? free : estimate::Columns{});
    const auto parameters = static_cast<Eigen::Index>(free.size());
    if (normal) *normal = {Eigen::MatrixXd::Zero(parameters, parameters), Eigen::VectorXd::Zero(parameters)};
    double sum = 0.0;
    estimate::StateJacobian by_state;
    estimate::ParameterJacobian by_columns, sensitivity;
    for (std::size_t f = 0; f < tracks_.size(); ++f) {
      const StateTrack& track = tracks_[f];
      for (const std::size_t start : starts_[f]) {
        estimate::BodyState x = track.state[start];
        std::size_t hint = start;
        sensitivity.setZero(12, parameters);
        for (std::size_t k = start; k < start + o_.horizon; ++k) {
          const double from = track.time_s(k), to = track.time_s(k + 1);
          if (normal) {
            x = model.step(x, track.input, hint, from, to, o_.substeps, by_state, by_columns);
            sensitivity = (by_state * sensitivity + by_columns).eval();
          } else {
            x = model.step(x, track.input, hint, from, to, o_.substeps);
          }
          sum += add(estimate::difference(track.state[k + 1], x), sensitivity, normal);
        }
      }
    }
    return sum / static_cast<double>(std::max<std::size_t>(1, count_));
  }

 private:
  double add(const estimate::StateError& error, const estimate::ParameterJacobian& sensitivity, NormalEquations* normal) const {
    double sum = 0.0;
    for (std::size_t q = 0; q < kPredictedQuantities; ++q) {
      if (o_.scale[q] <= 0.0) continue;
      const auto row = static_cast<Eigen::Index>(3 * q);
      const Eigen::Vector3d e = error.segment<3>(row) / o_.scale[q];
      double weight = 1.0;
      sum += pseudo_huber(e.squaredNorm(), o_.robust_scale, weight);
      if (!normal) continue;
      Eigen::Matrix<double, 3, Eigen::Dynamic> j = sensitivity.middleRows<3>(row) / o_.scale[q];
      if (q == kPredictedAttitude) j = (estimate::inverse_right_jacobian(error.segment<3>(row)) * j).eval();
      normal->information.noalias() += weight * j.transpose() * j;
      normal->slope.noalias() += weight * j.transpose() * e;
    }
    return sum;
  }

  const std::vector<StateTrack>& tracks_;
  MultiStepOptions o_;
  std::vector<std::vector<std::size_t>> starts_;
  std::size_t count_ = 0;
};

}  // namespace

MultiStepFit fit_multi_step(const estimate::ModelValues& start, const estimate::Columns& free, const std::vector<StateTrack>& tracks,
                            const MultiStepOptions& options) {
  const Windows windows(tracks, options);
  const auto n = static_cast<Eigen::Index>(free.size());
  Eigen::VectorXd first(n), min(n), max(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const int parameter = free[static_cast<std::size_t>(i)];
    const estimate::ParameterInfo info = estimate::parameter_info(parameter, start.terms);
    first[i] = start[parameter];
    min[i] = info.min;
    max[i] = info.max;
  }
  const auto values_at = [&](const Eigen::VectorXd& x) {
    estimate::ModelValues values = start;
    for (Eigen::Index i = 0; i < n; ++i) values[free[static_cast<std::size_t>(i)]] = x[i];
    return values;
  };
  const Descent d =
      descend(first, min, max, [&](const Eigen::VectorXd& x, NormalEquations* normal) { return windows.cost(values_at(x), free, normal); },
              {.max_iterations = options.max_iterations, .tolerance = options.tolerance, .damping = 1e-4});
  return {values_at(d.x), d.cost, d.iterations, d.converged};
}

}  // namespace rotorloop::score
