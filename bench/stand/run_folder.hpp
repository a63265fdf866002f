// The folder of a run on a stand (docs/files.md, "Run on a thrust stand"): its files, the columns of its tables and the keys of run.toml.
// The session that writes a run and the estimate that reads it both have them from here.
#pragma once
#include <array>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "host/base/toml_file.hpp"

namespace rotorloop::stand {

inline constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

inline constexpr const char *kFactsFile = "run.toml", *kSamplesFile = "samples.csv", *kReadingsFile = "readings.csv",
                            *kStepsFile = "steps.csv", *kEventsFile = "events.jsonl", *kTripFile = "trip.csv";

// samples.csv, at 100 Hz: kTime, kStep, configuration (0: A, the bare stand; 1: B of abab), kTarget, then what is measured.
inline constexpr std::string_view kTime = "t_s", kStep = "step", kTarget = "target_rad_s";
struct SampleColumn {
  std::string_view name;
  int decimals;  // below 0: six significant digits
};
inline constexpr SampleColumn kSampleColumns[] = {
    {"omega_rad_s", 4},    {"thrust_N", 5},       {"torque_N_m", 7}, {"voltage_V", 5},   {"current_A", 5}, {"independent_rad_s", 4},
    {"esc_voltage_V", -1}, {"esc_current_A", -1}, {"esc_degC", -1},  {"motor_degC", -1}, {"duty_q", -1}};
// Thrust and torque after the calibration matrix; voltage and current of the supply; independent: of a speed sensor beside the ESC; duty:
// the line-to-line voltage along the torque axis, over the bus voltage.
inline constexpr std::size_t kOmegaColumn = 0, kThrustColumn = 1, kTorqueColumn = 2, kVoltageColumn = 3, kCurrentColumn = 4,
                             kIndependentColumn = 5, kEscVoltageColumn = 6, kEscCurrentColumn = 7, kEscTemperatureColumn = 8,
                             kMotorTemperatureColumn = 9, kDutyColumn = 10, kColumns = std::size(kSampleColumns);
std::string samples_header();
// `step`: number of the hold that a settled sample of the bare stand belongs to, -1: none; `measured`: kColumns values, not-a-number where
// there is none.
std::string sample_line(double t_s, int step, char configuration, double target_rad_s, const std::vector<double>& measured);

inline constexpr std::string_view kReadingsHeader = "t_s,u_t_ms,channel,value";
inline constexpr std::string_view kStepsHeader =
    "step,configuration,motion,wanted_rad_s,t_s,duration_s,omega_rad_s,thrust_N,torque_N_m,voltage_V,current_A,samples,settled,limited";

// What the ESC measured of its motor at rest before the run.
struct MeasuredWinding {
  double phase_ohm = 0.0, winding_ohm = 0.0;  // with the ESC's switches; less what it knows of them: what a motor file holds
  double inductance_d_H = 0.0, inductance_q_H = 0.0;
  double u_resistance = 0.0, u_inductance = 0.0;  // relative
  double degC = kNotMeasured;                     // of the ESC, and of a motor that has not turned
};

// What an axis of the stand was read by, and how sure its profile is: "manual" is copied from documents and was never seen on hardware.
struct Instrument {
  std::string axis, model, channel, evidence, source;
};

// What stands beside the samples. An empty text, a zero and not-a-number are not known, and not written.
struct RunFacts {
  std::string motor, propeller, mount, esc, stand;  // serial numbers or names; mount: counts remounts
  int pole_pairs = 0;
  double diameter_m = kNotMeasured;
  std::string sequence, started_utc, version, end, trip;
  bool simulated = false;
  double air_density_kg_m3 = kNotMeasured;  // given by a person; else from what instruments read
  double air_temperature_degC = kNotMeasured, air_pressure_Pa = kNotMeasured, air_humidity = kNotMeasured;  // humidity: 0 to 1
  double airspeed_m_s = kNotMeasured;  // along the axis, of a wind tunnel: > 0 as in climb
  std::optional<MeasuredWinding> winding;
  std::map<std::string, double> uncertainty;  // standard uncertainties, by key
  std::vector<Instrument> instruments;
  std::string calibrated_on, calibration_expires, stand_sha256;  // dates as "2026-11-20"
  int esc_node = 0;
  std::string esc_name, esc_unique_id, esc_software, esc_image_crc;
  std::vector<std::pair<std::string, std::string>> esc_parameters;
  bool duty_along = false;  // of samples.csv, not of run.toml: it has duty_q, not duty
};
std::string run_toml(const RunFacts& facts);
// Throws Error (usage) with file, line and range; keys that nobody knows are passed over.
RunFacts read_run_toml(const std::filesystem::path& file);

// [uncertainty] of a run or of a stand file.
struct UncertaintyKey {
  const char* key;
  Range range;
};
inline constexpr Range kShareOfValue{0.0, 0.5, "1"};
inline constexpr std::array kUncertaintyKeys{UncertaintyKey{"thrust_calibration", kShareOfValue},
                                             UncertaintyKey{"torque_calibration", kShareOfValue},
                                             UncertaintyKey{"arm_length", kShareOfValue},
                                             UncertaintyKey{"alignment_rad", {0.0, 0.5, "rad"}},
                                             UncertaintyKey{"rotor_speed", kShareOfValue},
                                             UncertaintyKey{"density", kShareOfValue},
                                             UncertaintyKey{"voltage", kShareOfValue},
                                             UncertaintyKey{"current", kShareOfValue},
                                             UncertaintyKey{"zero_thrust", kShareOfValue},
                                             UncertaintyKey{"zero_torque", kShareOfValue},
                                             UncertaintyKey{"hysteresis", kShareOfValue},
                                             UncertaintyKey{"cross_talk_m", {0.0, 0.1, "N m per N"}}};
// Those that the table has. Throws Error (usage) for a value out of range.
std::map<std::string, double> read_uncertainties(const TomlTable& table);

}  // namespace rotorloop::stand
