#include "bench/stand/evaluate/stand_comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "host/base/statistics.hpp"

namespace rotorloop::stand {
namespace {

constexpr std::size_t kLeastFiles = 5;
constexpr double kRobustSds = 5.0;
constexpr double kLeastDistance = 0.1;  // propellers of one mould differ by a few per cent

const StandChannelFit* thrust_of(const StandFileDiagnosis& f) {
  for (const auto& c : f.channels)
    if (c.channel == "thrust") return &c;
  return nullptr;
}

// What the motor's other files make of this file's speed at full command: ω/V = K (1 - R I/V), a line through them.
struct SpeedByVoltage {
  double deviation = 0.0;  // relative: read speed over expected, less 1
  double scatter = 0.0;    // of the other files
  std::size_t files = 0;
};
std::optional<SpeedByVoltage> speed_by_voltage(const StandDiagnosis& all, const StandFileDiagnosis& odd, const std::vector<bool>& suspect) {
  if (odd.motor.empty() || !odd.full_speed_per_volt) return std::nullopt;
  double n = 0.0, sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0;
  std::vector<std::pair<double, double>> others;
  for (std::size_t i = 0; i < all.files.size(); ++i) {
    const auto& f = all.files[i];
    if (suspect[i] || f.motor != odd.motor || !f.full_speed_per_volt) continue;
    const double x = *f.full_current_per_volt, y = *f.full_speed_per_volt;
    n += 1.0;
    sx += x;
    sy += y;
    sxx += x * x;
    sxy += x * y;
    others.emplace_back(x, y);
  }
  if (others.size() < 4) return std::nullopt;
  const double slope = (n * sxy - sx * sy) / (n * sxx - sx * sx), level = (sy - slope * sx) / n;
  double squares = 0.0;
  for (const auto& [x, y] : others) squares += std::pow(y / (level + slope * x) - 1.0, 2);
  return SpeedByVoltage{*odd.full_speed_per_volt / (level + slope * *odd.full_current_per_volt) - 1.0, std::sqrt(squares / (n - 2.0)),
                        others.size()};
}

}  // namespace

void compare_stands(StandDiagnosis& all) {
  std::map<std::string, std::vector<std::size_t>> by_propeller;
  for (std::size_t i = 0; i < all.files.size(); ++i)
    if (thrust_of(all.files[i])) by_propeller[all.files[i].propeller].push_back(i);
  std::map<std::string, double> typical;
  std::vector<double> distance(all.files.size(), 0.0), of_all;  // log of c_t from its propeller's median
  for (const auto& [propeller, files] : by_propeller) {
    if (files.size() < kLeastFiles) continue;
    std::vector<double> log_c;
    for (const auto i : files) log_c.push_back(std::log(thrust_of(all.files[i])->coefficient.value));
    const double middle = median(log_c);
    typical[propeller] = std::exp(middle);
    for (std::size_t k = 0; k < files.size(); ++k) of_all.push_back(distance[files[k]] = log_c[k] - middle);
  }
  // One scatter for all propellers of a stand: two odd files of one propeller must not make their own excuse.
  const double sd = robust_deviation(of_all);
  std::vector<bool> suspect(all.files.size(), false);
  for (std::size_t i = 0; i < suspect.size(); ++i) suspect[i] = std::abs(distance[i]) > std::max(kRobustSds * sd, kLeastDistance);
  for (const auto& [propeller, c] : typical) {
    const auto& files = by_propeller[propeller];
    const auto odd = std::count_if(files.begin(), files.end(), [&](std::size_t i) { return suspect[i]; });
    all.remarks.push_back(
        fmt::format("propeller {}: c_t {:.4g} N s^2, the median of {} files; {} far from it (scatter of all files {:.1f} %)",
                    propeller.empty() ? "of all files" : propeller, c, files.size(), odd, 100.0 * sd));
  }
  for (std::size_t i = 0; i < all.files.size(); ++i) {
    if (!suspect[i]) continue;
    StandFileDiagnosis& f = all.files[i];
    const double ratio = thrust_of(f)->coefficient.value / typical[f.propeller];
    const double speed_factor = 1.0 / std::sqrt(ratio);  // by which speed would have to be read too high
    StandFault fault{"thrust", fmt::format("c_t is {:.2f} of that of the other files of propeller {}", ratio, f.propeller), ""};
    const auto by_voltage = speed_by_voltage(all, f, suspect);
    if (!by_voltage) {
      fault.channel = "thrust or rotor speed";
      fault.likely = fmt::format("speed read {:.2f} times too high, a wrong gain of thrust, or another propeller", speed_factor);
    } else if (std::abs(by_voltage->deviation - (speed_factor - 1.0)) < std::abs(by_voltage->deviation)) {
      fault.channel = "rotor speed";
      fault.what +=
          fmt::format("; speed at full command is {:.2f} of what voltage and current make of it ({} files of motor {}, scatter {:.1f} %)",
                      1.0 + by_voltage->deviation, by_voltage->files, f.motor, 100.0 * by_voltage->scatter);
      fault.likely = "speed misread by a factor: pole pairs or blades";
    } else {
      fault.what += fmt::format(
          "; speed is not to blame: it would have to be read {:.2f} times too high, and at full command it is {:.3f} of what voltage "
          "and current make of it ({} files of motor {}, scatter {:.1f} %)",
          speed_factor, 1.0 + by_voltage->deviation, by_voltage->files, f.motor, 100.0 * by_voltage->scatter);
      fault.likely = "another propeller than the name says, or one mounted upside down; else a wrong gain of thrust";
    }
    f.faults.push_back(std::move(fault));
    f.verdict = diagnose::DiagnosisVerdict::faulty;
  }
}

}  // namespace rotorloop::stand
