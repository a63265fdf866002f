// What a flight is judged by. Tracking error = |true centre-of-mass position - set-point| (3-D norm, and the magnitude of
// its vertical component), averaged over time from the first to the last motion of the trajectory, then over seeds; the
// same from the estimate, which is all that a real flight would have, is kept beside it.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bench/hil/flight/scenario.hpp"
#include "host/base/deadlines.hpp"

namespace rotorloop::hil {

inline constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

struct TrackingSample {
  double t_s = 0.0;
  Eigen::Vector3d true_p_W_m = Eigen::Vector3d::Zero();  // centre of mass
  Eigen::Vector3d est_p_W_m = Eigen::Vector3d::Zero();   // what the controller estimated
  Eigen::Vector3d sp_p_W_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d sp_v_W_m_s = Eigen::Vector3d::Zero();
  double sp_yaw_rad = 0.0;
};

struct ErrorFigures {
  double mean_3d_cm = kNotMeasured, max_3d_cm = kNotMeasured, rms_3d_cm = kNotMeasured;
  double mean_z_cm = kNotMeasured, max_z_cm = kNotMeasured;
  double mean_horizontal_cm = kNotMeasured;
};

struct TrackingFigures {
  ErrorFigures truth;                          // true position against set-point
  ErrorFigures estimate;                       // estimated position against set-point
  double estimator_mean_3d_cm = kNotMeasured;  // estimated against true position
  double first_motion_s = kNotMeasured, last_motion_s = kNotMeasured;
  std::uint64_t samples = 0;
};

// Fed with every sample of a flight in time order (equal steps), at any rate. A sample moves when its set-point velocity
// exceeds kMotionSpeed_m_s or its yaw differs from the sample before; samples before the first and after the last such
// sample do not count. No allocation.
class TrackingMeter {
 public:
  static constexpr double kMotionSpeed_m_s = 1e-3;  // well above the rounding of a log, well below any flight
  static constexpr double kMotionYaw_rad = 1e-6;
  void add(const TrackingSample& s);
  TrackingFigures figures() const;  // figures are not-a-number when the trajectory never moved

 private:
  struct Sums {
    double norm = 0, square = 0, z = 0, horizontal = 0, max_norm = 0, max_z = 0;
    void add(const Eigen::Vector3d& error_m);
    void take(Sums& pending);
    ErrorFigures figures(std::uint64_t n) const;
  };
  Sums truth_, estimate_, estimator_;                          // up to the last motion
  Sums pending_truth_, pending_estimate_, pending_estimator_;  // since then: count only if motion follows
  std::uint64_t n_ = 0, pending_n_ = 0;
  double first_s_ = kNotMeasured, last_s_ = kNotMeasured, previous_yaw_rad_ = 0.0;
  bool any_ = false;
};

enum class FlightEnd : std::uint8_t {
  completed,
  crashed,      // ground contact outside landing, or attitude or distance beyond recovery
  safe_state,   // the flight computer disarmed the motors, for the reason in end_detail
  interrupted,  // the user stopped the run
  incomplete,   // the controller under test ended, hung, or broke its handshake: end_detail says which
  late,         // paced: further behind real time than may be caught up; the motors were disarmed
};
std::string_view flight_end_name(FlightEnd end);

// How a paced flight kept to real time.
struct PaceResult {
  double pace = 1.0;  // seconds of flight per second of real time
  Lateness lateness;
};

// One flight, of one variant, with one seed. What was not measured stays not-a-number and is written as null.
struct FlightResult {
  std::string flight;
  Variant variant = Variant::pd_ff;
  std::uint64_t seed = 0;
  FlightEnd end = FlightEnd::completed;
  std::string end_detail;   // why, when not completed
  double duration_s = 0.0;  // virtual time
  double max_speed_m_s = kNotMeasured, max_accel_m_s2 = kNotMeasured;
  TrackingFigures tracking;
  std::array<double, 2> bus_load_mean_percent{kNotMeasured, kNotMeasured};  // by BusName
  std::array<double, 2> bus_load_max_percent{kNotMeasured, kNotMeasured};   // worst window (window length: log header)
  std::array<double, 4> rpm_error_rms_rad_s{kNotMeasured, kNotMeasured, kNotMeasured, kNotMeasured};  // command - speed
  double limited_share = kNotMeasured;  // share of time in which any limiter acted, 0..1
  // While flying: angle between the attitude that the controller wants and the true one, and the four commanded speeds.
  double attitude_error_mean_deg = kNotMeasured, attitude_error_max_deg = kNotMeasured;
  double command_mean_rad_s = kNotMeasured, command_std_rad_s = kNotMeasured;
  std::map<std::string, double> counters;  // named counts of abnormal events (lost frames, limiter trips, …)
  std::optional<PaceResult> pace;          // none: lockstep
};

// Over seeds. std is the sample standard deviation (n - 1), 0 for n = 1.
struct Spread {
  double mean = kNotMeasured, std = kNotMeasured, min = kNotMeasured, max = kNotMeasured;
  int n = 0;
};
Spread spread_of(const std::vector<double>& values);  // ignores not-a-number

struct Reduction {
  double percent = kNotMeasured;      // of the means over seeds: 100 (1 - to/from), as the paper reports it
  double std_percent = kNotMeasured;  // spread of the same figure seed by seed
  int n = 0;
};

struct TableCell {
  std::string flight;
  Variant variant = Variant::pd_ff;
  Spread error_3d_cm, error_z_cm, estimate_error_3d_cm, estimate_error_z_cm, estimator_error_cm;
  Spread attitude_error_deg, command_mean_rad_s, command_std_rad_s;
  int flown = 0, completed = 0;
};

struct LimitResult {
  std::string name;  // "mean_tracking_error horizontal pd_ff 3d"
  double value = kNotMeasured;
  std::string unit;
  double limit = 0.0;
  bool upper = true;  // true: value <= limit passes; false: value >= limit passes
  bool pass = false;  // false as well when value was not measured
};

enum class Verdict : std::uint8_t { pass, fail, incomplete };
std::string_view verdict_name(Verdict v);

struct Assessment {
  std::vector<TableCell> table;  // flights in scenario order, then as variants_of(); only what was flown
  std::vector<LimitResult> limits;
  // incomplete: a planned flight is missing or was interrupted, or a limit's figure was not measured.
  // fail: every flight was flown, and one crashed or missed a limit. Error limits are judged over completed flights alone.
  Verdict verdict = Verdict::incomplete;
};

// `planned`: number of flights asked for. The bus load judged is the worst window of any flight.
Assessment assess(const Scenario& scenario, const std::vector<FlightResult>& results, std::size_t planned);

Reduction reduction(const std::vector<FlightResult>& results, const std::string& flight, Variant from, Variant to, ErrorAxis axis);
const TableCell* find_cell(const Assessment& a, const std::string& flight, Variant variant);

// The axis that a flight is tabled by: z when a limit or a published figure of it says so, else 3-D.
ErrorAxis table_axis(const Scenario& scenario, const std::string& flight);

// The tracking table for a terminal (fixed width, no colour), as the paper prints it: one line per flight and variant with
// mean, spread, estimate, reduction against the first variant flown, and the published figure if the scenario has one.
std::string tracking_table_text(const Scenario& scenario, const Assessment& a, const std::vector<FlightResult>& results);
std::string limits_text(const Assessment& a);
std::string pace_text(const PaceResult& p);  // how late a paced flight was, in a line
// Attitude error and motor commands of every variant, where a controller that is not ours flew; else empty.
std::string controllers_text(const Assessment& a);

}  // namespace rotorloop::hil
