#include "bench/stand/instruments/stand_setup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/stand/instruments/poll_plan.hpp"
#include "bench/stand/instruments/units.hpp"
#include "bench/stand/run_folder.hpp"
#include "host/base/error.hpp"
#include "host/base/nearest.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::modbus {
namespace {

struct AxisTraits {
  StandAxis axis;
  std::string_view name, si;
};
constexpr std::array kAxes{
    AxisTraits{StandAxis::thrust, "thrust", "N"},
    AxisTraits{StandAxis::torque, "torque", "N m"},
    AxisTraits{StandAxis::voltage, "voltage", "V"},
    AxisTraits{StandAxis::current, "current", "A"},
    AxisTraits{StandAxis::power, "power", "W"},
    AxisTraits{StandAxis::motor_temperature, "motor_temperature", "degC"},
    AxisTraits{StandAxis::esc_temperature, "esc_temperature", "degC"},
    AxisTraits{StandAxis::air_temperature, "air_temperature", "degC"},
    AxisTraits{StandAxis::air_pressure, "air_pressure", "Pa"},
    AxisTraits{StandAxis::air_humidity, "air_humidity", "%"},
    AxisTraits{StandAxis::rotor_speed, "rotor_speed", "rad/s"},
    AxisTraits{StandAxis::vibration, "vibration", "m/s^2"},
};

struct LimitTraits {
  std::string_view key, unit;
  double most;
};
constexpr std::array kLimits{
    LimitTraits{"current_A", "A", 1000.0},          LimitTraits{"voltage_V", "V", 1000.0},
    LimitTraits{"omega_rad_s", "rad/s", 10000.0},   LimitTraits{"thrust_N", "N", 10000.0},
    LimitTraits{"torque_N_m", "N m", 1000.0},       LimitTraits{"vibration_m_s2", "m/s^2", 5000.0},
    LimitTraits{"temperature_degC", "degC", 200.0}, LimitTraits{"tracking_error_rad_s", "rad/s", 5000.0},
    LimitTraits{"stale_ms", "ms", 60000.0},         LimitTraits{"run_time_s", "s", 86400.0},
};
constexpr double kSpeedOfSound_m_s = 340.0;  // dry air at 15 degC: the limit is meant for rooms
constexpr double kTipMachMax = 0.6;

StandPart read_part(const TomlTable& t) {
  StandPart p{t.text("name"), t.text("serial")};
  for (const char* key : {"name", "serial"})
    if (t.text(key).empty())
      t.fail(key, fmt::format("{} is empty", key), "",
             "what is measured must be known later: give name and serial number, or a label that you stuck on it");
  return p;
}

std::string read_date(const TomlTable& t, std::string_view key) {
  const std::string d = t.text(key);
  bool good = d.size() == 10 && d[4] == '-' && d[7] == '-';
  for (std::size_t i = 0; good && i < d.size(); ++i) good = i == 4 || i == 7 || (d[i] >= '0' && d[i] <= '9');
  if (good) {
    const int month = std::stoi(d.substr(5, 2)), day = std::stoi(d.substr(8, 2));
    good = month >= 1 && month <= 12 && day >= 1 && day <= 31;
  }
  if (!good) t.fail(key, fmt::format("{} = \"{}\" is no date", key, d), "", "write it as \"2026-11-20\"");
  return d;
}

std::filesystem::path profile_file(const TomlTable& t, const std::filesystem::path& beside, FindProfile find) {
  const std::string given = t.text("profile");
  std::error_code error;
  const auto near = (beside.parent_path() / given).lexically_normal();
  if (std::filesystem::is_regular_file(near, error)) return near;
  try {
    return find(given);
  } catch (const Error& e) {
    t.fail("profile", e.text().what, e.text().likely, e.text().remedy);
  }
}

StandDevice read_device(const TomlTable& t, const StandSetup& s, FindProfile find) {
  StandDevice d;
  d.name = t.text("name");
  if (d.name.empty() || d.name.find('.') != std::string::npos)
    t.fail("name", fmt::format("name = \"{}\" is empty or has a point", d.name), "",
           "axes name channels as DEVICE.CHANNEL: give a name without a point");
  d.profile = read_profile(profile_file(t, s.path, find));
  d.slave = static_cast<int>(t.integer("slave", 1, 247, d.profile.slave));
  if (t.has("channels")) d.channels = t.texts("channels");
  for (const std::string& c : d.channels)
    if (!d.profile.find(c))
      t.fail("channels", fmt::format("{} has no channel \"{}\"", d.profile.title(), c), "",
             fmt::format("rotorloop stand profile show {} lists them", d.profile.path.stem().string()));
  d.full_scale = t.number("full_scale", {1e-6, 1e6, "N or N m"}, 0.0);
  d.stale_ms = t.number("stale_ms", {1.0, 60000.0, "ms"}, 200.0);
  d.slow_stale_ms = t.number("slow_stale_ms", {1.0, 600000.0, "ms"}, std::max(5000.0, d.stale_ms));
  return d;
}

// What the line allows, and what one silent device costs the others, must fit into the limits of age.
void check_rates(const std::vector<TomlTable>& tables, const StandBus& b) {
  std::int64_t cycle_ns = 0, wait_ns = 0;
  for (const StandDevice& d : b.devices) {
    const ExchangeTiming timing = b.port.tcp ? tcp_timing(d.profile) : rtu_timing(d.profile, b.format);
    for (const ReadGroup& g : make_plan(d.profile, d.channels).fast)
      cycle_ns += exchange_ns(g, timing, static_cast<std::int64_t>(d.profile.turnaround_ms * 1e6));
    if (b.devices.size() > 1) wait_ns = std::max(wait_ns, timing.timeout_ns + timing.late_max_ns);
  }
  for (std::size_t i = 0; i < b.devices.size(); ++i) {
    const double needed_ms = 1e-6 * static_cast<double>(2 * cycle_ns + wait_ns);
    if (b.devices[i].stale_ms >= needed_ms) continue;
    tables[i].fail(
        "stale_ms",
        fmt::format("stale_ms = {} ms of {} is below {:.0f} ms: two cycles of this bus{}", number_text(b.devices[i].stale_ms),
                    b.devices[i].name, std::ceil(needed_ms), wait_ns ? " and the silence after one lost answer of another device" : ""),
        wait_ns ? "several devices share the bus, and one that fails would make the others stale" : "",
        wait_ns ? "give each fast device a bus of its own, or raise stale_ms"
                : "raise stale_ms, read fewer channels, or raise the baud rate");
  }
}

StandBus read_bus(const TomlTable& t, const StandSetup& s, FindProfile find) {
  StandBus b;
  try {
    b.port = parse_port(t.text("port"), "");
  } catch (const Error& e) {
    if (!e.text().where.empty()) throw;
    t.fail("port", e.text().what, e.text().likely, e.text().remedy);
  }
  b.slow_divider = static_cast<int>(t.integer("slow_divider", 1, 10000, 20));
  const auto tables = t.tables("device", 1, 32);
  for (const TomlTable& d : tables) {
    b.devices.push_back(read_device(d, s, find));
    for (std::size_t i = 0; i + 1 < b.devices.size(); ++i)
      if (b.devices[i].slave == b.devices.back().slave)
        d.fail(
            "slave",
            fmt::format("{} and {} have the same address {} on one bus", b.devices[i].name, b.devices.back().name, b.devices.back().slave),
            "", "give each an address of its own, at the device too");
    for (const StandBus& other : s.buses)
      for (const StandDevice& e : other.devices)
        if (e.name == b.devices.back().name) d.fail("name", fmt::format("device \"{}\" is there twice", e.name), "", "rename one");
  }
  const Profile& first = b.devices.front().profile;
  b.format = serial_format(first, static_cast<int>(t.integer("baud", 1200, 921600, first.baud.front())));
  for (std::size_t i = 0; i < tables.size(); ++i) {
    const Profile& p = b.devices[i].profile;
    if (b.port.tcp && !p.tcp)
      tables[i].fail("profile", fmt::format("{} has no TCP", p.title()), "it is behind a gateway, or the port is wrong",
                     "give a serial port; for a gateway set tcp = true in a copy of the profile");
    if (!b.port.tcp && (std::find(p.baud.begin(), p.baud.end(), b.format.baud) == p.baud.end() || p.parity != b.format.parity ||
                        p.stop_bits != b.format.stop_bits))
      tables[i].fail("profile", fmt::format("{} does not speak {}", p.title(), text(b.format)),
                     "devices of one bus need one rate and format",
                     "set baud of the bus to a rate that all have, or give it a bus of its own");
  }
  check_rates(tables, b);
  return b;
}

BoundChannel read_axis(const TomlTable& t, const StandSetup& s) {
  BoundChannel a;
  std::string_view si;
  const std::string word = t.choice("axis", {"thrust", "torque", "voltage", "current", "power", "motor_temperature", "esc_temperature",
                                             "air_temperature", "air_pressure", "air_humidity", "rotor_speed", "vibration"});
  for (const AxisTraits& k : kAxes)
    if (k.name == word) {
      a.axis = k.axis;
      si = k.si;
    }
  const std::string channel = t.text("channel");
  std::vector<std::string> known;
  bool found = false;
  for (std::size_t b = 0; b < s.buses.size(); ++b)
    for (std::size_t d = 0; d < s.buses[b].devices.size(); ++d) {
      const StandDevice& device = s.buses[b].devices[d];
      for (std::size_t c = 0; c < device.profile.channels.size(); ++c) {
        const std::string full = device.name + "." + device.profile.channels[c].name;
        known.push_back(full);
        const bool read = device.channels.empty() || std::find(device.channels.begin(), device.channels.end(),
                                                               device.profile.channels[c].name) != device.channels.end();
        if (full == channel && !read)
          t.fail("channel", fmt::format("{} is not among the channels that are read of {}", channel, device.name), "",
                 "add it to channels of the device");
        if (full == channel && !found) {
          a.bus = b;
          a.device = d;
          a.channel = c;
          found = true;
        }
      }
    }
  if (!found)
    t.fail("channel", fmt::format("channel = \"{}\" is none of this stand", channel), "",
           fmt::format("{}channels are DEVICE.CHANNEL", did_you_mean(channel, known)));
  const StandDevice& device = s.buses[a.bus].devices[a.device];
  const Channel& c = device.profile.channels[a.channel];
  const ChannelUnit* const unit = find_unit(c.unit);
  const std::string_view fitting = a.axis == StandAxis::thrust ? "force" : a.axis == StandAxis::torque ? "torque" : "";
  if (c.unit == "FS" && c.quantity != fitting) {
    t.fail("channel", fmt::format("{} is a {}, axis {} needs {}", channel, c.quantity, word, si), "the wrong channel",
           "bind another channel");
  } else if (c.unit == "FS") {
    if (device.full_scale <= 0.0)
      t.fail("channel", fmt::format("{} is a share of full scale, and {} has no full_scale", channel, device.name), "",
             fmt::format("give full_scale of the device in {}", si));
    a.to_si = device.full_scale;
  } else if (c.unit == "1" || unit->si != si) {
    t.fail("channel", fmt::format("{} is in {}, axis {} needs {}", channel, c.unit, word, si), "the wrong channel",
           "bind another channel, or correct its unit in the profile");
  } else {
    a.to_si = unit->to_si;
  }
  a.lag_ms = t.number("lag_ms", {-1000.0, 10000.0, "ms"}, 0.0);
  a.u_lag_ms = t.number("u_lag_ms", {0.0, 1000.0, "ms"}, 0.0);
  return a;
}

void read_axes(const TomlTable& root, StandSetup& s) {
  for (const TomlTable& t : root.tables("axis", 2, 40)) {
    const BoundChannel a = read_axis(t, s);
    for (const BoundChannel& other : s.axes)
      if (other.axis == a.axis) t.fail("axis", fmt::format("axis {} is bound twice", name(a.axis)), "", "keep one");
    s.axes.push_back(a);
  }
  for (const StandAxis needed : {StandAxis::thrust, StandAxis::torque})
    if (std::none_of(s.axes.begin(), s.axes.end(), [&](const BoundChannel& a) { return a.axis == needed; }))
      throw Error({root.where("axis"), fmt::format("no [[axis]] is {} (column 1)", name(needed)), "",
                   fmt::format("add [[axis]] with axis = \"{}\" and its channel", name(needed))});
}

void read_calibration(const TomlTable& t, StandSetup& s) {
  s.calibrated_on = read_date(t, "date");
  s.expires_on = read_date(t, "expires");
  if (s.expires_on <= s.calibrated_on)
    t.fail("expires", fmt::format("expires {} is not after date {}", s.expires_on, s.calibrated_on), "", "give a later date");
  const std::array full_scale{t.number("full_scale_N", {1e-3, 1e5, "N"}), t.number("full_scale_N_m", {1e-6, 1e4, "N m"})};
  s.u_calibration = t.number("u_relative", {1e-6, 0.1, "1"});
  std::vector<LoadCase> cases;
  for (const TomlTable& c : t.tables("case", kLeastLoadCases, 1000)) {
    const auto reading = c.numbers("reading", 2, {-1e12, 1e12, "units of the channels"});
    const LoadCase k{{c.number("force_N", {-1e5, 1e5, "N"}), c.number("torque_N_m", {-1e4, 1e4, "N m"})}, {reading[0], reading[1]}};
    for (std::size_t i = 0; i < 2; ++i)
      if (std::abs(k.load[i]) > 1.2 * full_scale[i])
        c.fail(i ? "torque_N_m" : "force_N",
               fmt::format("{} is beyond 120 % of full scale, {}", number_text(k.load[i]), number_text(full_scale[i])),
               "another unit, or a slipped digit", "correct the load or full scale");
    cases.push_back(k);
  }
  std::string problem;
  s.calibration = fit_calibration(cases, full_scale, problem);
  if (!problem.empty())
    t.fail("case", problem, "", "load with pure force of both signs, pure torque of both signs and combinations (weight at an arm)");
  for (std::size_t i = 0; i < 2; ++i) {
    const double percent = 100.0 * s.calibration.residual_max[i] / full_scale[i];
    if (percent > 5.0)
      t.fail("case", fmt::format("{} is {:.1f} % of full scale off in one case", i ? "torque" : "thrust", percent),
             "a slipped digit, exchanged loads or readings, or a case with the wrong sign", "check the cases; 5 % is the most");
    if (percent > 0.5)
      s.notes.push_back(fmt::format("calibration leaves {:.2f} % of full scale in {}: friction, or a case that was misread", percent,
                                    i ? "torque" : "thrust"));
  }
}

void read_limits(const TomlTable& t, StandSetup& s) {
  for (const LimitTraits& k : kLimits) {
    const TomlTable limit = t.table(k.key);
    StandLimit l{limit.number("max", {1e-6, k.most, k.unit}), limit.number("debounce_ms", {0.0, 10000.0, "ms"}), LimitAction::cut};
    const std::string action = limit.choice("action", {"hold", "ramp_down", "cut"});
    l.action = action == "hold" ? LimitAction::hold : action == "ramp_down" ? LimitAction::ramp_down : LimitAction::cut;
    s.limits[std::string(k.key)] = l;
  }
  const double omega = s.limits.at("omega_rad_s").max;
  if (omega > s.propeller_omega_max_rad_s)
    t.table("omega_rad_s")
        .fail("max",
              fmt::format("{} rad/s is above {} rad/s, the most that the propeller may turn", number_text(omega),
                          number_text(s.propeller_omega_max_rad_s)),
              "", "lower it, or correct propeller.omega_max_rad_s by its data sheet");
  if (s.limits.at("thrust_N").max > 1.2 * s.calibration.full_scale[0])
    t.table("thrust_N")
        .fail("max",
              fmt::format("{} N is above 120 % of the calibrated {} N", number_text(s.limits.at("thrust_N").max),
                          number_text(s.calibration.full_scale[0])),
              "", "lower it, or calibrate over a wider range");
  if (s.limits.at("torque_N_m").max > 1.2 * s.calibration.full_scale[1])
    t.table("torque_N_m")
        .fail("max",
              fmt::format("{} N m is above 120 % of the calibrated {} N m", number_text(s.limits.at("torque_N_m").max),
                          number_text(s.calibration.full_scale[1])),
              "", "lower it, or calibrate over a wider range");
}

void read_propeller(const TomlTable& t, StandSetup& s) {
  s.propeller = read_part(t);
  s.diameter_m = t.number("diameter_m", {0.02, 3.0, "m"});
  s.propeller_omega_max_rad_s = t.number("omega_max_rad_s", {1.0, 20000.0, "rad/s"});
  s.expected_c_t_N_s2 = t.number("expected_c_t_N_s2", {0.0, 1.0, "N s^2"}, 0.0);
  s.expected_c_q_N_m_s2 = t.number("expected_c_q_N_m_s2", {0.0, 1.0, "N m s^2"}, 0.0);
  const double mach = s.propeller_omega_max_rad_s * 0.5 * s.diameter_m / kSpeedOfSound_m_s;
  if (mach > kTipMachMax)
    t.fail("omega_max_rad_s",
           fmt::format("{} rad/s with {} m gives tip Mach {:.2f}, at most {}", number_text(s.propeller_omega_max_rad_s),
                       number_text(s.diameter_m), mach, kTipMachMax),
           "RPM instead of rad/s, or the radius instead of the diameter",
           fmt::format("give at most {:.0f} rad/s", std::floor(kTipMachMax * kSpeedOfSound_m_s / (0.5 * s.diameter_m))));
}

void read_clearance(const TomlTable& t, StandSetup& s) {
  s.clearance_front_m = t.number("front_m", {0.0, 100.0, "m"});
  s.clearance_behind_m = t.number("behind_m", {0.0, 100.0, "m"});
  s.clearance_side_m = t.number("side_m", {0.0, 100.0, "m"});
  const double radius_m = 0.5 * s.diameter_m;
  if (s.clearance_side_m < radius_m)
    t.fail("side_m",
           fmt::format("{} m from the axis is inside the propeller of {} m radius", number_text(s.clearance_side_m), number_text(radius_m)),
           "", "measure from the axis to the nearest wall or person");
  const double ratio = radius_m / (4.0 * std::max(1e-6, std::min(s.clearance_front_m, s.clearance_behind_m)));
  const double gain = ratio < 1.0 ? 1.0 / (1.0 - ratio * ratio) - 1.0 : 1.0;  // Cheeseman and Bennett 1955
  if (gain > 0.004)
    s.notes.push_back(fmt::format("a wall at {:.2f} m changes thrust by about {:.1f} %",
                                  std::min(s.clearance_front_m, s.clearance_behind_m), 100.0 * gain));
}

void read_uncertainty(const TomlTable& root, StandSetup& s) {
  if (const auto t = root.optional_table("uncertainty")) s.uncertainty = stand::read_uncertainties(*t);
  s.uncertainty.insert(
      {{"thrust_calibration", s.u_calibration}, {"torque_calibration", s.u_calibration}, {"cross_talk_m", s.calibration.cross_talk_u_m}});
}

StandSetup from_toml(const TomlFile& file, FindProfile find) {
  file.format({1});
  const TomlTable root = file.root();
  StandSetup s;
  s.path = file.path();
  s.name = root.text("name");
  s.motor = read_part(root.table("motor"));
  const TomlTable esc = root.table("esc");
  s.esc = read_part(esc);
  s.pole_pairs = static_cast<int>(esc.integer("pole_pairs", 1, 30));
  read_propeller(root.table("propeller"), s);
  read_clearance(root.table("clearance"), s);
  for (const TomlTable& t : root.tables("bus", 1, 8)) s.buses.push_back(read_bus(t, s, find));
  read_axes(root, s);
  read_calibration(root.table("calibration"), s);
  read_limits(root.table("limits"), s);
  read_uncertainty(root, s);
  file.refuse_unknown_keys();
  for (const StandBus& b : s.buses)
    for (const StandDevice& d : b.devices)
      if (d.profile.evidence != "hardware")
        s.notes.push_back(fmt::format("{}: profile of {} has evidence \"{}\": settle word order, scale and sign with a known weight",
                                      d.name, d.profile.title(), d.profile.evidence));
  return s;
}

}  // namespace

std::string_view name(StandAxis axis) { return kAxes[static_cast<std::size_t>(axis)].name; }

StandSetup read_stand_setup(const std::filesystem::path& path, FindProfile find) { return from_toml(TomlFile::read(path), find); }
StandSetup parse_stand_setup(std::string_view text, const std::filesystem::path& name, FindProfile find) {
  return from_toml(TomlFile::parse(text, name), find);
}

}  // namespace rotorloop::modbus
