// Steady points of a motor, ESC and propeller on a thrust stand, as ARK's hardware tests write them (JSON, "metrics" /
// "steady_points", one object per throttle step: rpm, thrust_gf, voltage_v, current_a, elec_power_w). SI from here on.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace rotorloop::propeller {

struct MotorBenchRow {
  double throttle = 0.0;  // 0..1, as commanded to the ESC
  double bus_V = 0.0;
  double bus_A = 0.0;
  double omega_rad_s = 0.0;
  double thrust_N = 0.0;  // without a propeller: what the thrust channel shows at zero
};

struct MotorBenchFile {
  std::filesystem::path name;
  std::string motor, propeller;  // as the file names them; "none": the motor alone
  int pole_pairs = 0;
  std::vector<MotorBenchRow> rows;  // rising throttle
};

constexpr std::size_t kMinBenchRows = 4;

// Throw Error: file, field with its place, value, unit, allowed range, remedy. Exit code 2 for what is no such file, 5 for rows
// that contradict themselves (power against voltage times current, throttle that does not rise).
MotorBenchFile read_motor_bench(const std::filesystem::path& path);
MotorBenchFile parse_motor_bench(std::string_view text, const std::filesystem::path& name_for_errors);

}  // namespace rotorloop::propeller
