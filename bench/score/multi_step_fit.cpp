#include "bench/score/multi_step_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "bench/estimate/model/rotations.hpp"

namespace rotorloop::score {
namespace {

struct Normal {
  Eigen::MatrixXd h;
  Eigen::VectorXd g;
  double cost = 0.0;
};

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
  double cost(const estimate::ModelValues& values, const estimate::Columns& free, Normal* normal) const {
    const estimate::Model model(values, normal ? free : estimate::Columns{});
    const auto parameters = static_cast<Eigen::Index>(free.size());
    if (normal) *normal = {Eigen::MatrixXd::Zero(parameters, parameters), Eigen::VectorXd::Zero(parameters), 0.0};
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
    if (normal) normal->cost = sum;
    return sum / static_cast<double>(std::max<std::size_t>(1, count_));
  }

 private:
  double add(const estimate::StateError& error, const estimate::ParameterJacobian& sensitivity, Normal* normal) const {
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
      normal->h.noalias() += weight * j.transpose() * j;
      normal->g.noalias() += weight * j.transpose() * e;
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
  MultiStepFit fit{start, 0.0, 0, false};
  double damping = 1e-4;
  Normal normal;
  for (; fit.iterations < options.max_iterations && !fit.converged; ++fit.iterations) {
    fit.cost = windows.cost(fit.values, free, &normal);
    bool better = false;
    while (!better && damping < 1e6) {
      Eigen::MatrixXd h = normal.h;
      h.diagonal() *= 1.0 + damping;
      h.diagonal().array() += 1e-300;
      const Eigen::VectorXd step = h.ldlt().solve(-normal.g);
      estimate::ModelValues tried = fit.values;
      for (std::size_t i = 0; i < free.size(); ++i) {
        const estimate::ParameterInfo info = estimate::parameter_info(free[i], tried.terms);
        tried[free[i]] = std::clamp(tried[free[i]] + step[static_cast<Eigen::Index>(i)], info.min, info.max);
      }
      const double cost = windows.cost(tried, free, nullptr);
      better = std::isfinite(cost) && cost < fit.cost;
      if (better) {
        fit.converged = fit.cost - cost < options.tolerance * fit.cost;
        fit.values = tried;
        fit.cost = cost;
        damping = std::max(0.1 * damping, 1e-9);
      } else {
        damping *= 10.0;
      }
    }
    if (!better) fit.converged = true;  // no step falls any further
  }
  return fit;
}

}  // namespace rotorloop::score
