// The noise at the maximum of the marginal likelihood, parameters kept: EM on the linear rows of the flights, its steps lengthened.
#pragma once
#include <functional>

#include "bench/sysid/estimate/linear_rows.hpp"

namespace rotorloop::estimate {

// Which noise figures the fit may change, and what flights share.
struct NoiseFit {
  int rounds = 0;           // of the fit in which the noise is looked for, at most; 0: the noise given is kept
  double tolerance = 0.01;  // relative change of every standard deviation that ends it
  bool process = true, measurements = true;
  bool per_flight = false;  // else one noise model for all
  bool per_axis = true;     // else one figure for the three axes
};

struct FlightRows {
  const GridFlight& flight;
  const LinearRows& rows;
  const NoiseModel& limits;  // no figure of its measurements above it; where flights share the noise, that of all
};

// Runs `act` for each flight, perhaps at once.
using ForEachFlight = std::function<void(const std::function<void(std::size_t)>&)>;

struct SettledNoise {
  std::vector<NoiseModel> noise;               // of each flight
  std::vector<std::vector<StateError>> moves;  // of its states, to where they are best with that noise
  double change = 0.0;                         // largest of any figure, relative
};

// Sum of the logarithms of all standard deviations that a flight's residuals are whitened with: the part of the likelihood that keeps the
// noise from growing.
double log_standard_deviations(const GridFlight& flight, const NoiseModel& noise);

// From `noise`, which whitened the rows. Throws std::domain_error where nothing ties a state.
SettledNoise settle_noise(const std::vector<FlightRows>& flights, const std::vector<NoiseModel>& noise, const NoiseFit& options,
                          const ForEachFlight& for_each);

}  // namespace rotorloop::estimate
