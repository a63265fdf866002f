// What a run writes: readings as they come, rows of one time, means of steps, events, and the two seconds before a trip.
#pragma once
#include <array>
#include <cmath>
#include <deque>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bench/stand/instruments/stand_setup.hpp"
#include "bench/stand/run/run_files.hpp"
#include "bench/stand/run/sample_grid.hpp"
#include "bench/stand/run/sequence.hpp"
#include "bench/stand/run_folder.hpp"
#include "protocols/types/esc.hpp"

namespace rotorloop::stand_run {

struct StandReading {
  modbus::StandAxis axis = modbus::StandAxis::thrust;
  double value = 0.0;                               // SI; thrust and torque before the calibration matrix
  std::int64_t sampled_ns = 0, uncertainty_ns = 0;  // of the bus's clock
};

using ShownRange = std::array<std::pair<double, double>, stand::kColumns>;
constexpr ShownRange nothing_shown() {
  ShownRange r{};
  r.fill({HUGE_VAL, -HUGE_VAL});
  return r;
}

// A step's means, thrust and torque after the calibration matrix.
struct StepMeans {
  int number = 0;
  char configuration = 'A';
  Motion motion = Motion::hold;
  double wanted_rad_s = 0.0, t_s = 0.0, duration_s = 0.0, omega_rad_s = 0.0, thrust_N = 0.0, torque_N_m = 0.0, voltage_V = 0.0,
         current_A = 0.0, esc_voltage_V = 0.0, esc_current_A = 0.0;
  // Least and greatest that each column of the samples showed, before the calibration matrix; not ordered where it showed nothing.
  ShownRange shown = nothing_shown();
  int samples = 0;
  bool settled = true, limited = false;
};

// What was commanded from a time on.
struct Commanded {
  std::int64_t t_ns = 0;
  double target_rad_s = 0.0;
  int step = -1;  // -1: none
  std::size_t segment = 0;
  bool settled = true;
};

class Recorder {
 public:
  // What it gets by reference must outlive it.
  Recorder(const modbus::StandSetup& setup, const Plan& plan, RunFiles& files, std::int64_t now_ns);
  void begin(std::int64_t now_ns);  // times of the files count from here
  void reading(const StandReading& reading);
  void status(const protocols::EscStatus& status, std::int64_t now_ns);
  void duty(double duty_q, std::int64_t now_ns);
  void commanded(const Commanded& from_now_on) { timeline_.push_back(from_now_on); }
  // Writes the rows that are complete by now and returns them. `limited`: a limit holds the speed down.
  std::vector<GridRow> rows(std::int64_t now_ns, bool limited);
  void event(const char* what, nlohmann::ordered_json fields, std::int64_t now_ns);
  void history();      // trip.csv
  void finish_step();  // its row of steps.csv

  // Whether speed and thrust rest: means of the halves of the last half second.
  bool rests() const;
  void forget_recent() { recent_.clear(); }
  double seconds(std::int64_t ns) const { return 1e-9 * static_cast<double>(ns - begun_ns_); }
  const std::vector<StepMeans>& steps() const { return steps_; }
  // Axes of the stand file of which nothing has come yet.
  std::vector<std::string> missing() const;
  std::optional<double> newest(modbus::StandAxis axis) const;  // thrust and torque after the matrix
  double mean(modbus::StandAxis axis) const;                   // of all readings; not-a-number where nothing measures it
  bool measures(modbus::StandAxis axis) const { return newest_.contains(axis); }

 private:
  struct Newest {
    double value = 0.0, sum = 0.0, n = 0.0;
  };
  void line(std::int64_t t_ns, const std::string& text);
  void row(const GridRow& row, bool limited);

  const modbus::StandSetup& setup_;
  const Plan& plan_;
  RunFiles& files_;
  SampleGrid grid_;
  std::int64_t begun_ns_;
  std::map<modbus::StandAxis, Newest> newest_;
  std::deque<Commanded> timeline_;
  std::deque<GridRow> recent_;  // of the last half second
  std::deque<std::pair<std::int64_t, std::string>> history_;
  std::vector<StepMeans> steps_;
  std::optional<StepMeans> open_;  // of rows that have come
};

}  // namespace rotorloop::stand_run
