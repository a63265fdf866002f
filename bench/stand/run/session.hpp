// A run on a stand: turns the motor through a plan over the CAN bus, takes readings of the instruments, watches the limits, and stops. One
// thread, no waits, no clock but the bus's: on ports (port_pump.hpp) and in virtual time (bench/stand/virtual) it is the same object.
#pragma once
#include <deque>
#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bench/stand/instruments/stand_setup.hpp"
#include "bench/stand/run/limits.hpp"
#include "bench/stand/run/run_files.hpp"
#include "bench/stand/run/sample_grid.hpp"
#include "bench/stand/run/sequence.hpp"
#include "host/tools/esc_table.hpp"
#include "host/tools/tool_node.hpp"

namespace rotorloop::stand_run {

inline constexpr const char* kDutyParameter = "stat_duty_q";  // what an ESC that says the voltage it gives calls it

struct SessionOptions {
  int esc_index = 0;
  int esc_pole_pairs = 0;       // as the ESC has it; 0: not known
  std::uint8_t duty_node = 0;   // ESC that is asked for the voltage that it gives ten times a second; 0: none that has it
  double settle_s = 0.7;        // at least, after each change of speed; zeros three times as long
  double settle_most_s = 5.0;   // then the step counts as it is, marked unsettled
  double slew_rad_s2 = 2000.0;  // of starts, stops and large changes
  // Whether the stand is in this configuration (abab); asked again and again with the motor disarmed until it says so. None: always.
  std::function<bool(char configuration)> configured;
};

struct StandReading {
  modbus::StandAxis axis = modbus::StandAxis::thrust;
  double value = 0.0;                               // SI; thrust and torque before the calibration matrix
  std::int64_t sampled_ns = 0, uncertainty_ns = 0;  // of the bus's clock
};

enum class RunEnd : std::uint8_t { running, done, stopped, tripped };
const char* name(RunEnd end);

// A step's means, thrust and torque after the calibration matrix.
struct StepMeans {
  int number = 0;
  char configuration = 'A';
  Motion motion = Motion::hold;
  double wanted_rad_s = 0.0, t_s = 0.0, duration_s = 0.0, omega_rad_s = 0.0, thrust_N = 0.0, torque_N_m = 0.0, voltage_V = 0.0,
         current_A = 0.0;
  int samples = 0;
  bool settled = true, limited = false;
};

class Session {
 public:
  // Listens through the tool from now on. What it gets by reference must outlive it.
  Session(const modbus::StandSetup& setup, Plan plan, tools::ToolNode& tool, tools::EscTable& table, RunFiles& files,
          SessionOptions options);

  void take(const StandReading& reading);
  // An instrument gave nothing good for longer than its limit.
  void note_stale(const std::string& channel, double age_ms);
  // The first ramps down and disarms, the second stops at once.
  void ask_stop(const std::string& who);
  // Sends what is due and judges what came; call at least every 5 ms. Polls the tool.
  void step();

  bool done() const { return phase_ == Phase::done; }
  RunEnd end() const { return end_; }
  const std::optional<Trip>& trip() const { return trip_; }
  const std::vector<StepMeans>& steps() const { return steps_; }
  // Instruments that have said nothing yet, by axis; empty: the run can begin.
  std::string missing() const;
  double elapsed_s() const { return seconds(tool_.now_ns()); }
  std::size_t segment() const { return segment_; }
  const Plan& plan() const { return plan_; }
  std::optional<double> newest(modbus::StandAxis axis) const;  // thrust and torque after the matrix
  double set_point_rad_s() const { return set_point_; }
  double esc_rad_s() const { return esc_omega_; }
  const LimitMonitor& limits() const { return limits_; }
  const modbus::StandSetup& setup() const { return setup_; }
  double settle_s() const { return options_.settle_s; }
  bool stopping() const { return phase_ == Phase::ramping_down || phase_ == Phase::stopping; }
  bool turning() const { return phase_ == Phase::running || phase_ == Phase::ramping_down; }
  // Limits of the file that nothing on this stand measures.
  std::vector<std::string> unwatched() const;
  double air_mean(modbus::StandAxis axis) const;  // not-a-number where nothing measures it

 private:
  enum class Phase : std::uint8_t { waiting, running, ramping_down, stopping, done };
  struct Newest {
    double value = 0.0;
    std::int64_t sampled_ns = -1;
    double sum = 0.0, n = 0.0;
  };
  struct TimelineEntry {
    std::int64_t t_ns;
    double target_rad_s;
    int step;  // -1: none
    std::size_t segment;
    bool settled;
  };
  struct Kept {  // for the history before a trip
    std::int64_t t_ns;
    std::string line;
  };
  double seconds(std::int64_t ns) const { return 1e-9 * static_cast<double>(ns - begun_ns_); }
  void on_status(const protocols::EscStatus& status);
  void ask_duty();
  void watch_value(const char* limit, const std::string& source, double value);
  void watch_bus();
  void watch_speeds(const GridRow& row);
  void stop_for(const Trip& trip);
  void take_rows();
  void take_row(const GridRow& row);
  bool rests() const;
  void begin();
  void drive();
  void next_segment();
  void finish_step();
  void command();
  void send(double omega_rad_s);
  void arm(bool armed);
  void finish(RunEnd end);
  void note(const char* what, nlohmann::ordered_json fields);

  const modbus::StandSetup& setup_;
  Plan plan_;
  tools::ToolNode& tool_;
  tools::EscTable& table_;
  RunFiles& files_;
  SessionOptions options_;
  LimitMonitor limits_;
  SampleGrid grid_;
  Phase phase_ = Phase::waiting;
  RunEnd end_ = RunEnd::running;
  std::optional<Trip> trip_;
  std::map<modbus::StandAxis, Newest> newest_;
  std::int64_t begun_ns_, heard_ns_ = -1, foreign_ns_ = -1;
  double esc_omega_ = 0.0;
  double set_point_ = 0.0, ceiling_ = 0.0;  // ceiling: of a limit whose action is hold; 0: none
  std::int64_t next_command_ns_ = 0, next_arming_ns_ = 0, next_duty_ns_ = 0, stopping_ns_ = 0, last_drive_ns_ = 0, left_zero_ns_ = -1;
  bool followed_ = false;  // the rotor has come near its set-point since it left zero
  bool armed_ = false;
  std::size_t segment_ = 0;
  std::int64_t segment_ns_ = 0, measure_ns_ = -1;
  int step_ = -1, steps_begun_ = 0;
  bool step_settled_ = true, step_limited_ = false;
  std::deque<TimelineEntry> timeline_;
  std::deque<GridRow> recent_;  // of the last half second
  std::deque<Kept> history_;
  std::vector<StepMeans> steps_;
  std::optional<StepMeans> open_;  // of rows that have come
  int wrong_ratio_rows_ = 0;
  int stops_asked_ = 0;
};

}  // namespace rotorloop::stand_run
