// Noise of three axes: three successive draws of one stream.
#pragma once
#include <Eigen/Core>
#include <cstdint>

#include "host/base/random.hpp"

namespace rotorloop::sim {

// Standard deviation 1 on each axis; uses up draws first, first + 1 and first + 2.
inline Eigen::Vector3d gaussian3(const RandomStream& stream, std::uint64_t first) {
  return {stream.gaussian(first), stream.gaussian(first + 1), stream.gaussian(first + 2)};
}

}  // namespace rotorloop::sim
