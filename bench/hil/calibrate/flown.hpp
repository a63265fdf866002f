// What a flight really met: velocity through the air and rotor speeds, from the truth of a simulated run. Held in the tunnel one by one,
// they give the loads of the flown envelope without noise: the yardstick that identification from flight logs is compared with.
// Only the tunnel's side uses it; identification never reads a truth.csv.
#pragma once
#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <vector>

namespace rotorloop::calibrate {

struct FlownState {
  Eigen::Vector3d v_B_m_s = Eigen::Vector3d::Zero();
  std::array<double, 4> omega_rad_s{};
};

// States every `period_s` from lift-off to the end. Still air is taken, as in every shipped scenario.
// Throws Error (data quality) for a file that is no truth log, and when the vehicle never leaves its stand.
std::vector<FlownState> flown_states(const std::filesystem::path& truth_csv, double period_s);

// All truth.csv below a run folder (or in a single flight's), in order of their paths; with `variant`, only those of that controller.
// Throws Error when there is none.
std::vector<std::filesystem::path> truth_logs(const std::filesystem::path& folder, const std::string& variant);

}  // namespace rotorloop::calibrate
