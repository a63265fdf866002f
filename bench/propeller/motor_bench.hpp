// Throttle in, speed, current and thrust out: a six-step drive turning the blade-element rotor, against a measured staircase of
// throttle steps (motor 2306 of 1800 rpm/V, propeller HQ 5136, six cells). The whole chain in one comparison.
//
// Protocol: rows 4 and 8 of the ten are held out, the others fitted; at most four scalars; limits on every held-out row: speed 3 %,
// current 8 %, thrust 6 %. All that was fixed before a figure was seen; which four scalars was not (docs/acceptance/motor_bench.md).
// Not fitted on any row with a propeller:
// - the speed constant of the data sheet, read as no-load rpm per volt;
// - throttle curve and friction from the same motor and ESC WITHOUT a propeller (a file of its own, five steps to half throttle;
//   from the last of them straight on to full duty at full throttle);
// - the measured bus voltage of each row.
// The propeller is known by name only: the shipped three-blade plan form at 5.1 in with a helix of 3.6 in stands for it.
#pragma once
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "bench/propeller/motor_bench_file.hpp"
#include "host/base/least_squares.hpp"
#include "sim/drive/six_step.hpp"
#include "sim/rotor/blade.hpp"

namespace rotorloop::propeller {

constexpr double kBenchSpeedConstant_rpm_V = 1800.0;                                 // data sheet
constexpr double kBenchRadius_m = 0.5 * 5.1 * 0.0254, kBenchPitchRatio = 3.6 / 4.3;  // 4.3 in: the shipped blade's helix
constexpr double kBenchDensity_kg_m3 = 1.2;   // not recorded; thrust goes with it, and chord_scale takes up the error
constexpr double kTwistSpeed_rad_s = 3000.0;  // about full throttle

// What may be fitted; the values here are those without a fit.
struct BenchParameters {
  double resistance_ohm = 0.06;       // winding line to line and two switches; data sheets of 2306 motors near 1800 rpm/V, +-30 %
  double phase_inductance_H = 15e-6;  // that of the reference motor file
  double pitch_offset_deg = 0.0;
  double chord_scale = 1.0;
  double drag_scale = 1.3;  // the shipped blade's
  double twist_deg = 0.0;   // nose up at kTwistSpeed_rad_s, with the square of speed: blades that give under load
};
enum class BenchScalar : std::uint8_t { resistance, inductance, pitch, chord, drag, twist };
using BenchForm = std::vector<BenchScalar>;
// Chosen by the smallest rms over the eight FITTED rows among the forms of four that docs/acceptance/motor_bench.md lists.
inline const BenchForm kBenchForm = {BenchScalar::inductance, BenchScalar::chord, BenchScalar::drag, BenchScalar::twist};

// Thrust and torque of the propeller on the stand over speed.
class PropellerCurve {
 public:
  PropellerCurve(const sim::Blade& reference, const BenchParameters& p);
  double thrust_N(double omega_rad_s) const { return at(thrust_N_s2_, omega_rad_s); }
  double torque_N_m(double omega_rad_s) const { return at(torque_N_m_s2_, omega_rad_s); }

 private:
  static constexpr double kStep_rad_s = 300.0;
  static constexpr std::size_t kNodes = 11;  // to 3300 rad/s; coefficients over speed squared run straight between
  using Table = std::array<double, kNodes>;
  static double at(const Table& table, double omega_rad_s);
  Table thrust_N_s2_{}, torque_N_m_s2_{};
};

// What the steps without a propeller say, given the electrical parameters: effective duty of each throttle, and friction.
struct EscCalibration {
  std::vector<double> throttle, duty;  // the last is full throttle: 1
  double static_friction_N_m = 0.0, viscous_friction_N_m_s = 0.0;
  double friction_rms_N_m = 0.0;  // about the straight line
  double duty_at(double throttle) const;
};
sim::SixStepParameters six_step_parameters(const BenchParameters& p, int pole_pairs);
EscCalibration calibrate_esc(const MotorBenchFile& motor_alone, const sim::SixStepParameters& electrical);

struct BenchValues {
  double omega_rad_s = 0.0, bus_A = 0.0, thrust_N = 0.0;
};
struct BenchComparison {
  double throttle = 0.0;
  bool held_out = false;
  BenchValues measured, fitted, unfitted;
  double overlap_share = 0.0;  // of the fitted drive, sim/drive/six_step.hpp
  // (fitted - measured) / measured
  BenchValues relative_error() const;
};

struct MotorBenchData {
  MotorBenchFile propeller, motor_alone;
};
// `data_folder`: the one that ROTORLOOP_DATA names. Throws Error.
MotorBenchData read_motor_bench_data(const std::filesystem::path& data_folder);

struct MotorBenchResult {
  LeastSquaresFit fit;  // of `form`, in its order
  BenchForm form;
  BenchParameters parameters;
  EscCalibration esc;
  std::vector<BenchComparison> rows;
  double fitted_rms = 0.0;     // of the residuals over their tolerances, fitted rows
  BenchValues worst_held_out;  // magnitudes of relative errors
};
struct BenchLimits {
  double omega = 0.03, bus_A = 0.08, thrust = 0.06;
};
constexpr BenchLimits kBenchLimits{};

// `held_out`: indices of rows, 0 the first.
MotorBenchResult fit_motor_bench(const MotorBenchData& data, const sim::Blade& reference, const BenchForm& form = kBenchForm,
                                 const std::vector<std::size_t>& held_out = {3, 7}, const BenchParameters& start = {});

// Every choice of two rows held out, each fitted anew: for how many all held-out figures lie within the limits, and the worst.
struct LeaveTwoOut {
  int choices = 0, within = 0;
  BenchValues rms, worst;  // of the held-out relative errors, over all choices
};
LeaveTwoOut leave_two_out(const MotorBenchData& data, const sim::Blade& reference, const BenchParameters& start);

// The whole validation, for `rotorloop rotor validate`. `blade_file`: vehicles/blades/triblade_5in.toml.
MotorBenchResult validate_motor_bench(const std::filesystem::path& data_folder, const std::filesystem::path& blade_file);
bool within_limits(const MotorBenchResult& result);  // the held-out rows
std::vector<std::string> report_lines(const MotorBenchResult& result);

}  // namespace rotorloop::propeller
