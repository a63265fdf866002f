#include "host/control/gains_file.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/base/constants.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::host {

namespace {

constexpr double kSeparation = 4.0;  // below it the two loops fight: the position loop sees the attitude lag as phase loss

AxisGains axis(const TomlTable& root, std::string_view key, double frequency_max_rad_s) {
  const TomlTable t = root.table(key);
  return {.frequency_rad_s = t.number("frequency_rad_s", {0.1, frequency_max_rad_s, "rad/s"}),
          .damping = t.number("damping", {0.3, 2.0, "1"})};
}

GainsFile gains_from(const TomlFile& file) {
  file.format({1});
  const TomlTable root = file.root();
  GainsFile out;
  out.gains = {.horizontal = axis(root, "horizontal", 20.0),
               .vertical = axis(root, "vertical", 20.0),
               .roll_pitch = axis(root, "roll_pitch", 100.0),
               .yaw = axis(root, "yaw", 100.0)};
  const TomlTable limits = root.table("limits");
  out.limits.tilt_max_rad = limits.number("tilt_max_deg", {5.0, 85.0, "deg"}) * kRad_per_deg;
  out.limits.vertical_min_weight = limits.number("vertical_thrust_min_weight", {0.0, 0.9, "1"});
  out.limits.total_max_weight = limits.number("thrust_max_weight", {1.1, 20.0, "1"});
  out.omega_min_rad_s = limits.number("omega_min_rad_s", {1.0, 5000.0, "rad/s"});
  out.omega_max_rad_s = limits.number("omega_max_rad_s", {10.0, 10000.0, "rad/s"});
  file.refuse_unknown_keys();
  if (out.omega_min_rad_s >= out.omega_max_rad_s)
    limits.fail("omega_min_rad_s",
                fmt::format("limits.omega_min_rad_s = {} rad/s is not below limits.omega_max_rad_s = {} rad/s",
                            number_text(out.omega_min_rad_s), number_text(out.omega_max_rad_s)),
                "ends swapped", "give the lower speed as omega_min_rad_s");
  const double inner = out.gains.roll_pitch.frequency_rad_s;
  const double outer = std::max(out.gains.horizontal.frequency_rad_s, out.gains.vertical.frequency_rad_s);
  if (inner < kSeparation * out.gains.horizontal.frequency_rad_s)
    root.table("roll_pitch")
        .fail("frequency_rad_s",
              fmt::format("roll_pitch.frequency_rad_s = {} rad/s is less than {} times horizontal.frequency_rad_s = {} rad/s",
                          number_text(inner), number_text(kSeparation), number_text(out.gains.horizontal.frequency_rad_s)),
              fmt::format("position gains too high for this attitude loop (fastest position axis: {} rad/s)", number_text(outer)),
              "lower the horizontal frequency or raise roll_pitch");
  return out;
}

}  // namespace

GainsFile read_gains(const std::filesystem::path& path) { return gains_from(TomlFile::read(path)); }
GainsFile parse_gains(std::string_view text, const std::filesystem::path& name) { return gains_from(TomlFile::parse(text, name)); }

ControllerConfig controller_config(const GainsFile& file, Variant variant) {
  ControllerConfig c;
  c.gains = file.gains;
  c.limits = file.limits;
  c.variant = variant;
  c.omega_min_rad_s = file.omega_min_rad_s;
  c.omega_max_rad_s = file.omega_max_rad_s;
  return c;
}

}  // namespace rotorloop::host
