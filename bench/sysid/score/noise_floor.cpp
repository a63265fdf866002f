#include "bench/sysid/score/noise_floor.hpp"

#include "bench/sysid/estimate/flight_motion.hpp"
#include "bench/sysid/estimate/model/rotations.hpp"
#include "host/base/random.hpp"

namespace rotorloop::score {
namespace {

constexpr std::uint64_t kReadingModule = 0x464C4F52u;

// The same flight, read once more by sensors of the same noise.
estimate::GridFlight read_again(const estimate::GridFlight& flight, const estimate::NoiseModel& noise, std::uint64_t seed) {
  estimate::GridFlight out = flight;
  const RandomStream random(seed, kReadingModule);
  std::uint64_t draw = 0;
  const auto normal = [&](const Eigen::Vector3d& size) {
    const double a = random.gaussian(draw), b = random.gaussian(draw + 1), c = random.gaussian(draw + 2);
    draw += 3;
    return Eigen::Vector3d(size.cwiseProduct(Eigen::Vector3d(a, b, c)));
  };
  for (estimate::PoseFix& f : out.pose) {
    f.value.p_W_m += normal(noise.position_m);
    f.value.q_WS = (f.value.q_WS * estimate::exp_q(normal(noise.attitude_rad))).normalized();
  }
  const auto shake = [&](std::vector<estimate::VectorFix>& list, const Eigen::Vector3d& size) {
    for (estimate::VectorFix& f : list) f.value += normal(size);
  };
  shake(out.position, noise.position_m);
  shake(out.velocity, noise.velocity_m_s);
  shake(out.gyro, noise.gyro_rad_s);
  shake(out.accel, noise.accel_m_s2);
  return out;
}

}  // namespace

PredictionErrors noise_floor(const estimate::GridFlight& flight, const StateTrack& track, const estimate::ModelValues& values,
                             const estimate::NoiseModel& smoothed_with, const estimate::NoiseModel& noise,
                             std::span<const std::size_t> starts, std::size_t horizon, std::uint64_t seed) {
  StateTrack again = track;
  again.state = estimate::states_by_measurements(read_again(flight, noise, seed), values, smoothed_with);
  const Predictor quiet = whole_model(values, flight.substeps), noisy = noisy_model(values, flight.substeps, noise, seed);
  PredictionErrors out{track.name, track.step_s, horizon, {starts.begin(), starts.end()}, {}};
  std::vector<estimate::BodyState> ahead(horizon), shaken(horizon);
  for (const std::size_t start : starts) {
    quiet(track, start, ahead);
    noisy(again, start, shaken);
    for (std::size_t h = 0; h < horizon; ++h) {
      const std::size_t at = start + h + 1;
      const estimate::StateError d =
          estimate::difference(estimate::moved(ahead[h], estimate::difference(track.state.at(at), again.state.at(at))), shaken[h]);
      for (std::size_t q = 0; q < kPredictedQuantities; ++q) out.error[q].push_back(d.segment<3>(static_cast<Eigen::Index>(3 * q)).norm());
    }
  }
  return out;
}

}  // namespace rotorloop::score
