#include "bench/propeller/motor_bench_file.hpp"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "host/base/constants.hpp"
#include "host/base/error.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::propeller {
namespace {
using Json = nlohmann::json;

constexpr double kGramForce_N = kGravity_m_s2 * 1e-3;
// Means of voltage, current and power over the same seconds; ripple makes the mean of the product differ a little.
constexpr double kPowerTolerance = 0.03, kPowerFloor_W = 0.1;

class Reader {
 public:
  explicit Reader(std::filesystem::path name) : name_(std::move(name)) {}

  [[noreturn]] void fail(const std::string& what, const std::string& likely, const std::string& remedy,
                         ExitCode code = ExitCode::usage) const {
    throw Error({name_.generic_string(), what, likely, remedy}, code);
  }

  const Json& member(const Json& in, const char* key, const std::string& place) const {
    const auto found = in.is_object() ? in.find(key) : in.end();
    if (!in.is_object() || found == in.end())
      fail(fmt::format("{}{} is missing", place, key), "not a file of steady points, or another version of it",
           "give a file with metrics.steady_points");
    return *found;
  }

  double number(const Json& in, const char* key, const std::string& place, Range range) const {
    const Json& value = member(in, key, place);
    if (!value.is_number()) fail(fmt::format("{}{} = {} is not a number", place, key, value.dump()), "", "correct or remove the row");
    const double x = value.get<double>();
    if (!(x >= range.min && x <= range.max))
      fail(fmt::format("{}{} = {} is outside {} to {} {}", place, key, number_text(x), number_text(range.min), number_text(range.max),
                       range.unit),
           "another unit", fmt::format("give {} in {}", key, range.unit));
    return x;
  }

  std::string text(const Json& in, const char* key, const std::string& place) const {
    const Json& value = member(in, key, place);
    if (!value.is_string()) fail(fmt::format("{}{} = {} is not a text", place, key, value.dump()), "", "give it in quotes");
    return value.get<std::string>();
  }

 private:
  std::filesystem::path name_;
};
}  // namespace

MotorBenchFile read_motor_bench(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw Error({path.generic_string(), "cannot be read", "no such file", "check the path and the data folder"});
  return parse_motor_bench(std::string{std::istreambuf_iterator<char>(in), {}}, path);
}

MotorBenchFile parse_motor_bench(std::string_view text, const std::filesystem::path& name_for_errors) {
  const Reader reader(name_for_errors);
  const Json root = Json::parse(text, nullptr, false);
  if (root.is_discarded()) reader.fail("is not JSON", "cut off, or another kind of file", "get the file again");
  MotorBenchFile file;
  file.name = name_for_errors;
  const Json& meta = reader.member(root, "meta", "");
  file.motor = reader.text(meta, "motor", "meta.");
  file.propeller = reader.text(meta, "prop", "meta.");
  const Json& profile = reader.member(meta, "profile_def", "meta.");
  file.pole_pairs = static_cast<int>(reader.number(profile, "pole_pairs", "meta.profile_def.", {1, 30, "pole pairs"}));
  const Json& points = reader.member(reader.member(root, "metrics", ""), "steady_points", "metrics.");
  if (!points.is_array() || points.size() < kMinBenchRows)
    reader.fail(
        fmt::format("metrics.steady_points has {} rows, expected at least {}", points.is_array() ? points.size() : 0, kMinBenchRows),
        "an aborted test", "give a file of a whole throttle staircase");
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::string place = fmt::format("metrics.steady_points[{}].", i);
    const auto number = [&](const char* key, Range range) { return reader.number(points[i], key, place, range); };
    const MotorBenchRow row{.throttle = number("throttle", {0.01, 1.0, "of full throttle"}),
                            .bus_V = number("voltage_v", {3.0, 100.0, "V"}),
                            .bus_A = number("current_a", {0.0, 300.0, "A"}),
                            .omega_rad_s = kRad_s_per_rpm * number("rpm", {100.0, 100e3, "rpm"}),
                            .thrust_N = kGramForce_N * number("thrust_gf", {-200.0, 20e3, "gf"})};
    const double power_W = number("elec_power_w", {0.0, 3e4, "W"});
    if (std::fabs(power_W - row.bus_V * row.bus_A) > kPowerTolerance * power_W + kPowerFloor_W)
      reader.fail(fmt::format("{}elec_power_w = {} W, but voltage_v times current_a is {:.2f} W", place, number_text(power_W),
                              row.bus_V * row.bus_A),
                  "values of different seconds or sensors", "correct or remove the row", ExitCode::data_quality);
    if (!file.rows.empty() && row.throttle <= file.rows.back().throttle)
      reader.fail(fmt::format("{}throttle = {} does not exceed that of the row before, {}", place, number_text(row.throttle),
                              number_text(file.rows.back().throttle)),
                  "rows shuffled, or a staircase up and down", "order the rows by rising throttle; give each step once",
                  ExitCode::data_quality);
    file.rows.push_back(row);
  }
  return file;
}

}  // namespace rotorloop::propeller
