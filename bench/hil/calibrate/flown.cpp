#include "bench/hil/calibrate/flown.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "bench/sysid/log/log_reader.hpp"
#include "host/base/error.hpp"

namespace rotorloop::calibrate {
namespace {

// The launch stand holds the vehicle without any motion; what lies below this is on the stand, a thousandth of the slowest flight.
constexpr double kHeld_m_s = 1e-3;

}  // namespace

std::vector<FlownState> flown_states(const std::filesystem::path& truth_csv, double period_s) {
  const log::LogTable log = log::read_log(truth_csv);
  std::array<const std::vector<double>*, 3> v{};
  std::array<const std::vector<double>*, 4> q{}, omega{};
  for (std::size_t i = 0; i < 3; ++i) v[i] = &log.column(fmt::format("true_v_{}[m/s]", "xyz"[i]));
  for (std::size_t i = 0; i < 4; ++i) q[i] = &log.column(fmt::format("true_q_{}[1]", "wxyz"[i]));
  for (std::size_t i = 0; i < 4; ++i) omega[i] = &log.column(fmt::format("true_omega_{}[rad/s]", i + 1));
  const std::vector<double>& t = log.column("t[s]");

  std::vector<FlownState> states;
  bool flying = false;
  double next_s = 0.0;
  for (std::size_t k = 0; k < log.rows; ++k) {
    const Eigen::Vector3d v_W((*v[0])[k], (*v[1])[k], (*v[2])[k]);
    if (!flying && v_W.norm() > kHeld_m_s) {
      flying = true;
      next_s = t[k];
    }
    if (!flying || t[k] < next_s) continue;
    next_s += period_s;
    const Eigen::Quaterniond q_WB = Eigen::Quaterniond((*q[0])[k], (*q[1])[k], (*q[2])[k], (*q[3])[k]).normalized();
    states.push_back({q_WB.inverse() * v_W, {(*omega[0])[k], (*omega[1])[k], (*omega[2])[k], (*omega[3])[k]}});
  }
  if (states.empty())
    throw Error({truth_csv.generic_string(), fmt::format("the vehicle never moves faster than {} m/s", kHeld_m_s),
                 "a run that ended on the stand", "give the logs of a completed flight"},
                ExitCode::data_quality);
  return states;
}

std::vector<std::filesystem::path> truth_logs(const std::filesystem::path& folder, const std::string& variant) {
  std::vector<std::filesystem::path> found;
  if (std::filesystem::is_directory(folder))
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
      const auto& path = entry.path();  // …/FLIGHT/VARIANT/SEED/truth.csv
      if (path.filename() == "truth.csv" && (variant.empty() || path.parent_path().parent_path().filename() == variant))
        found.push_back(path);
    }
  if (found.empty())
    throw Error({folder.generic_string(), variant.empty() ? "holds no truth.csv" : fmt::format("holds no truth.csv of variant {}", variant),
                 "not the run folder of a simulated flight", "give a folder that rotorloop hil has written"});
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace rotorloop::calibrate
