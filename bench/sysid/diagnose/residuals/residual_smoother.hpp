// The smoother of a fitted flight as a linear machine: whatever is put in as residuals of steps and measurements comes out as the states'
// own fit leaves it. With the flight's residuals it gives the wrench that the model lacks; with a known wrench, what the measurements
// would show of it; with noise drawn from the fitted figures, how large each figure is when nothing is missing. One factorisation
// serves all of them, as the elimination of bench/sysid/identify serves its columns (same sums, states kept instead of parameters).
#pragma once
#include <Eigen/Core>
#include <vector>

#include "bench/sysid/estimate/residuals.hpp"

namespace rotorloop::diagnose {

// Residuals of a flight and their derivatives by the states, whitened by the fit's noise, at the fitted states.
struct LinearFlight {
  struct Step {
    estimate::StateJacobian from, to;
    estimate::StateError r;
  };
  enum class Kind { pose, position, velocity, gyro, accel };
  struct Measurement {
    Kind kind = Kind::pose;
    std::size_t node = 0;
    double t_s = 0.0;
    int rows = 6;  // of those below; the rest is zero
    Eigen::Matrix<double, 6, 12> state;
    Eigen::Matrix<double, 6, 1> r;
    Eigen::Matrix<double, 6, 1> by_stamp = Eigen::Matrix<double, 6, 1>::Zero();  // poses: per second that the stamp is too early
  };
  std::size_t nodes = 0;
  std::vector<std::uint8_t> linked;
  std::vector<Step> steps;                // between nodes k and k + 1; zero where not linked
  std::vector<Measurement> measurements;  // in order of nodes
  estimate::StateJacobian whitening;      // of a step's error (dp, dv in W; dφ, dΩ in B)
  estimate::StateError anchor;            // standard deviations that hold the start of each piece; 0: free
};
LinearFlight linearised(const estimate::GridFlight& flight, const estimate::ModelValues& values, const estimate::NoiseModel& noise,
                        const std::vector<estimate::BodyState>& states);

// Residuals of all steps (12 rows each) and measurements (6 rows each), one column for each thing put in.
struct ResidualColumns {
  Eigen::MatrixXd steps, measurements;

  static ResidualColumns zero(const LinearFlight& flight, Eigen::Index columns);
  auto step(std::size_t k) { return steps.middleRows<12>(12 * static_cast<Eigen::Index>(k)); }
  auto step(std::size_t k) const { return steps.middleRows<12>(12 * static_cast<Eigen::Index>(k)); }
  auto measurement(std::size_t i) { return measurements.middleRows<6>(6 * static_cast<Eigen::Index>(i)); }
  auto measurement(std::size_t i) const { return measurements.middleRows<6>(6 * static_cast<Eigen::Index>(i)); }
};

class ResidualSmoother {
 public:
  // `process_scale`: factor on the variances of the process noise. 1: the fit's own; large: the measurements alone decide.
  ResidualSmoother(const LinearFlight& flight, double process_scale);

  // Each column after the states have moved to their best places for it; whitened by the fit's noise, as before.
  ResidualColumns smoothed(const ResidualColumns& in) const;

  // Covariance of the smoothed step errors (whitened by the fit's noise) about the truth: visit(k, C), from the last step backwards.
  template <class Visit>
  void covariances(Visit&& visit) const;

 private:
  estimate::StateJacobian marginal(std::size_t k, const estimate::StateJacobian& next) const;
  estimate::StateJacobian joint(std::size_t k, const estimate::StateJacobian& next) const;  // of states k and k + 1

  const LinearFlight& flight_;
  double scale_;
  std::vector<estimate::StateJacobian> l_, y_;  // L (lower triangle) and Y of each node
};

template <class Visit>
void ResidualSmoother::covariances(Visit&& visit) const {
  estimate::StateJacobian p = estimate::StateJacobian::Zero();
  for (std::size_t k = flight_.nodes; k-- > 0;) {
    const estimate::StateJacobian next = p;
    p = marginal(k, next);
    if (k + 1 >= flight_.nodes || !flight_.linked[k]) continue;
    const LinearFlight::Step& s = flight_.steps[k];
    const estimate::StateJacobian cross = s.from * joint(k, next) * s.to.transpose();
    visit(k, estimate::StateJacobian(s.from * p * s.from.transpose() + s.to * next * s.to.transpose() + cross + cross.transpose()));
  }
}

}  // namespace rotorloop::diagnose
