#include "bench/calibrate/load_point.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <fstream>
#include <string>

#include "host/base/error.hpp"

namespace rotorloop::calibrate {
namespace {
constexpr std::string_view kHeader =
    "v_x[m/s],v_y[m/s],v_z[m/s],omega_1[rad/s],omega_2[rad/s],omega_3[rad/s],omega_4[rad/s],"
    "f_x[N],f_y[N],f_z[N],tau_x[N m],tau_y[N m],tau_z[N m]";
}

void write_load_points(const std::filesystem::path& path, const std::vector<LoadPoint>& points) {
  std::ofstream out(path, std::ios::binary);
  out << kHeader << '\n';
  for (const auto& p : points)
    out << fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{}\n", p.v_B_m_s.x(), p.v_B_m_s.y(), p.v_B_m_s.z(), p.omega_rad_s[0],
                       p.omega_rad_s[1], p.omega_rad_s[2], p.omega_rad_s[3], p.force_B_N.x(), p.force_B_N.y(), p.force_B_N.z(),
                       p.torque_B_N_m.x(), p.torque_B_N_m.y(), p.torque_B_N_m.z());
  if (!out) throw Error({path.generic_string(), "cannot be written", "", "check the folder and its permissions"}, ExitCode::device);
}

std::vector<LoadPoint> read_load_points(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string line;
  if (!in || !std::getline(in, line)) throw Error({path.generic_string(), "cannot be read or is empty", "", "check the path"});
  if (line != kHeader)
    throw Error({path.generic_string() + ":1", "header is not that of a load table", "another kind of CSV file",
                 "the header has to be: " + std::string(kHeader)});
  std::vector<LoadPoint> points;
  for (int number = 2; std::getline(in, line); ++number) {
    std::array<double, 13> v{};
    const char* at = line.data();
    const char* end = at + line.size();
    for (std::size_t i = 0; i < v.size(); ++i) {
      const auto r = std::from_chars(at, end, v[i]);
      const bool last = i + 1 == v.size();
      if (r.ec != std::errc{} || !std::isfinite(v[i]) || (last ? r.ptr != end : r.ptr == end || *r.ptr != ','))
        throw Error({fmt::format("{}:{}", path.generic_string(), number), fmt::format("column {} is not a finite number", i + 1), "a cut or edited row",
                     "write the table again"});
      at = r.ptr + 1;
    }
    points.push_back({.v_B_m_s = {v[0], v[1], v[2]},
                      .omega_rad_s = {v[3], v[4], v[5], v[6]},
                      .force_B_N = {v[7], v[8], v[9]},
                      .torque_B_N_m = {v[10], v[11], v[12]}});
  }
  return points;
}

}  // namespace rotorloop::calibrate
