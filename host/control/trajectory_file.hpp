// trajectory.toml: piecewise polynomials that any planner can write. Hosts only; what the loop evaluates is Trajectory.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>

#include "host/control/trajectory.hpp"

namespace rotorloop::host {

struct TrajectoryFile {
  std::string name;
  Trajectory trajectory;
};

// A jump larger than this between segments is an error; smaller ones are decimals rounded by the planner.
inline constexpr double kJumpPosition_m = 1e-4, kJumpVelocity_m_s = 1e-3, kJumpAcceleration_m_s2 = 1e-2;  // rad for yaw

// Throw Error for: unknown keys, order above 7, more than kMaxSegments, a jump in position, velocity or acceleration (of x, y,
// z or yaw) between segments, and a start or an end that is not at rest (time is clamped there, so motion would jump).
TrajectoryFile read_trajectory(const std::filesystem::path& path);
TrajectoryFile parse_trajectory(std::string_view text, const std::filesystem::path& name_for_errors);

std::string trajectory_text(const TrajectoryFile& file);

}  // namespace rotorloop::host
