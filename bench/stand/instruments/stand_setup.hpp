// A thrust stand as it stands there: which instruments are on which bus, which channel is which axis, calibration, lags, clearances,
// limits and serial numbers (docs/files.md, "Stand file"). Nothing of it may be missing when a motor is to turn.
#pragma once
#include <array>
#include <map>

#include "bench/stand/instruments/load_calibration.hpp"
#include "bench/stand/instruments/port_link.hpp"
#include "bench/stand/instruments/profile.hpp"

namespace rotorloop::modbus {

struct StandPart {
  std::string name, serial;
};

struct StandDevice {
  std::string name;
  Profile profile;
  int slave = 1;
  std::vector<std::string> channels;  // empty: all
  double full_scale = 0.0;            // of channels in FS: in N or N m
  double stale_ms = 200.0, slow_stale_ms = 5000.0;
};

struct StandBus {
  PortName port;
  SerialFormat format;
  int slow_divider = 20;
  std::vector<StandDevice> devices;
};

enum class StandAxis : std::uint8_t {
  thrust,
  torque,
  voltage,
  current,
  power,
  motor_temperature,
  esc_temperature,
  air_temperature,
  air_pressure,
  air_humidity,
  rotor_speed,
  vibration
};
std::string_view name(StandAxis axis);

struct BoundChannel {
  StandAxis axis = StandAxis::thrust;
  std::size_t bus = 0, device = 0, channel = 0;
  double to_si = 1.0;                   // thrust and torque: to N or N m before the matrix
  double lag_ms = 0.0, u_lag_ms = 0.0;  // behind the rotor's speed, from a chirp
};

enum class LimitAction : std::uint8_t { hold, ramp_down, cut };
struct StandLimit {
  double max = 0.0, debounce_ms = 0.0;
  LimitAction action = LimitAction::cut;
};

struct StandSetup {
  std::filesystem::path path;
  std::string name;
  StandPart motor, esc, propeller;
  int pole_pairs = 7;
  double diameter_m = 0.0, propeller_omega_max_rad_s = 0.0;
  double expected_c_t_N_s2 = 0.0, expected_c_q_N_m_s2 = 0.0;  // for predictions before a run; 0: not given
  double clearance_front_m = 0.0, clearance_behind_m = 0.0, clearance_side_m = 0.0;
  std::vector<StandBus> buses;
  std::vector<BoundChannel> axes;
  LoadCalibration calibration;
  std::string calibrated_on, expires_on;      // "2026-11-20"
  double u_calibration = 0.0;                 // relative standard uncertainty of the weights and arms
  std::map<std::string, StandLimit> limits;   // by key of the file; every one is there
  std::map<std::string, double> uncertainty;  // standard uncertainties by key of docs/files.md, "Stand uncertainty"; goes into each run
  std::vector<std::string> notes;             // what is allowed and should be known

  bool expired(const std::string& today) const { return today > expires_on; }  // both as "2026-11-20"
};

// Both throw Error (usage) with file, line and column. Profiles are looked for beside the file, then by `find_profile`.
using FindProfile = std::filesystem::path (*)(const std::string&);
StandSetup read_stand_setup(const std::filesystem::path& path, FindProfile find_profile);
StandSetup parse_stand_setup(std::string_view text, const std::filesystem::path& name_for_errors, FindProfile find_profile);

std::string stand_setup_text(const StandSetup& setup, const std::string& today);

}  // namespace rotorloop::modbus
