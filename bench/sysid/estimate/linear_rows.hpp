// What a sweep leaves of one flight: its residuals and their derivatives by the states, whitened. With the parameters kept, a smoother on
// these rows alone shows how large each noise figure would have to be, and again with that figure, without another look at the model.
#pragma once
#include <vector>

#include "bench/sysid/estimate/grid_flight.hpp"
#include "bench/sysid/estimate/model/model.hpp"
#include "bench/sysid/estimate/noise_model.hpp"

namespace rotorloop::estimate {

struct LinearRows {
  struct Step {
    StateJacobian from = StateJacobian::Zero(), to = StateJacobian::Zero();  // by the errors at its two nodes
    StateError r = StateError::Zero();
  };
  template <int N>
  struct Measurement {
    Eigen::Matrix<double, N, 12> state;
    Eigen::Matrix<double, N, 1> r;
    double weight = 1.0;  // of a robust loss, already in the rows
  };
  struct Anchor {
    StateJacobian state;
    StateError r;
  };
  std::vector<Step> steps;      // from each node to the next
  std::vector<Anchor> anchors;  // of the pieces, where the flight has any
  // In the order of the flight's lists.
  std::vector<Measurement<6>> pose;
  std::vector<Measurement<3>> position, velocity, gyro, accel;
};

// Squares of what one noise figure has to explain, whitened, with the uncertainty of the states in them. Over their count they are the
// factor by which the variance assumed would have to be multiplied (the EM step).
struct NoiseMoment {
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  double count = 0.0;
};
struct NoiseMoments {
  NoiseMoment force, angular, position, attitude, velocity, gyro, accel;
};

// The states of a flight on its linear rows, parameters kept.
class RowSmoother {
 public:
  // All kept by reference. `whitened`: the noise that the rows were whitened with.
  RowSmoother(const GridFlight& flight, const LinearRows& rows, const NoiseModel& whitened)
      : flight_(flight), rows_(rows), whitened_(whitened) {}

  // With another noise: moves the states to their best, and returns the moments there. Throws std::domain_error where nothing ties a state.
  NoiseMoments smooth(const NoiseModel& noise);
  // How far the last smoothing moved each state.
  const std::vector<StateError>& moves() const { return moves_; }

 private:
  struct Factor {
    StateJacobian l, y;
    StateError pull;
  };
  struct Scales;
  void eliminate(const Scales& scales);
  NoiseMoments walk_back(const Scales& scales);

  const GridFlight& flight_;
  const LinearRows& rows_;
  const NoiseModel& whitened_;
  std::vector<Factor> factors_;
  std::vector<StateError> moves_;
};

}  // namespace rotorloop::estimate
