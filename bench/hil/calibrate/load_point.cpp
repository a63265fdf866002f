#include "bench/hil/calibrate/load_point.hpp"

#include <fmt/format.h>

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

}  // namespace rotorloop::calibrate
