// Reads a motor file and checks that its numbers belong together.
#include "sim/plant/motor_file.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace rotorloop::sim {

double speed_constant_rpm_V(const MotorFile& m) {
  return 60.0 / (std::sqrt(3.0) * 2.0 * std::numbers::pi * m.flux_linkage_Wb * static_cast<double>(m.pole_pairs));
}

MotorFile read_motor(const std::filesystem::path& path) { return read_motor(TomlFile::read(path)); }

MotorFile read_motor(const TomlFile& file) {
  (void)file.format({1});
  const TomlTable root = file.root();
  MotorFile m;
  m.resistance_ohm = root.number("resistance_ohm", {0.001, 10.0, "ohm"});
  const TomlTable inductance = root.table("inductance_H");
  m.inductance_d_H = inductance.number("d", {5e-7, 1e-2, "H"});
  m.inductance_q_H = inductance.number("q", {5e-7, 1e-2, "H"});
  m.flux_linkage_Wb = root.number("flux_linkage_Wb", {1e-5, 0.1, "Wb"});
  m.pole_pairs = static_cast<int>(root.integer("pole_pairs", 1, 30));
  m.inertia_kg_m2 = root.number("inertia_kg_m2", {1e-9, 1e-2, "kg m^2"});
  m.static_friction_N_m = root.number("static_friction_N_m", {0.0, 0.5, "N m"});
  m.cogging_N_m = root.number("cogging_N_m", {0.0, 0.5, "N m"});
  file.refuse_unknown_keys();

  if (m.inductance_q_H < m.inductance_d_H || m.inductance_q_H > 3.0 * m.inductance_d_H)
    inductance.fail("q",
                    fmt::format("inductance_H.q = {} H with d = {} H: saliency {:.2f} is outside 1 to 3", m.inductance_q_H,
                                m.inductance_d_H, m.inductance_q_H / m.inductance_d_H),
                    "d and q exchanged, or line-to-line values mixed with phase values",
                    "give both for one phase; q is not below d in magnet motors");
  // A slip of units or a mix of line and phase shows in the speed constant.
  constexpr double kMinKv_rpm_V = 50.0, kMaxKv_rpm_V = 20000.0;
  if (const double kv = speed_constant_rpm_V(m); kv < kMinKv_rpm_V || kv > kMaxKv_rpm_V)
    root.fail("flux_linkage_Wb",
              fmt::format("flux_linkage_Wb = {} Wb with {} pole pairs is a motor of {:.0f} rpm/V, credible is {:.0f} to {:.0f}",
                          m.flux_linkage_Wb, m.pole_pairs, kv, kMinKv_rpm_V, kMaxKv_rpm_V),
              "poles given instead of pole pairs, or flux in other units",
              "use flux = 60 / (sqrt(3) * 2 pi * Kv * pole_pairs), Kv in rpm/V");
  return m;
}

}  // namespace rotorloop::sim
