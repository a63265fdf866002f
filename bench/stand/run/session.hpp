// A run on a stand: turns the motor through a plan over the CAN bus, takes readings of the instruments, and stops when it must. One thread,
// no waits, no clock but the bus's: on ports (port_pump.hpp) and in virtual time (bench/stand/virtual) it is the same object. It joins what
// comes next (sequencer.hpp), what ends a run (watch.hpp) and what is written (recorder.hpp) to the bus.
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bench/stand/run/instrument_check.hpp"
#include "bench/stand/run/recorder.hpp"
#include "bench/stand/run/sequencer.hpp"
#include "bench/stand/run/watch.hpp"
#include "host/tools/esc_table.hpp"
#include "host/tools/tool_node.hpp"

namespace rotorloop::stand_run {

inline constexpr const char* kDutyParameter = "stat_duty_q";  // what an ESC that says the voltage it gives calls it

struct SessionOptions : SequencerOptions {
  int esc_index = 0;
  int esc_pole_pairs = 0;      // as the ESC has it; 0: not known
  double airspeed_m_s = 0.0;   // of a wind tunnel
  std::uint8_t duty_node = 0;  // ESC that is asked for the voltage that it gives ten times a second; 0: none that has it
  // Whether the stand is in this configuration (abab); asked again and again with the motor disarmed until it says so. None: always.
  std::function<bool(char configuration)> configured;
};

enum class RunEnd : std::uint8_t { running, done, stopped, tripped };
const char* name(RunEnd end);

class Session {
 public:
  // Listens through the tool from now on. What it gets by reference must outlive it.
  Session(const modbus::StandSetup& setup, Plan plan, tools::ToolNode& tool, tools::EscTable& table, RunFiles& files,
          SessionOptions options);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  void take(const StandReading& reading);
  // An instrument gave nothing good for longer than its limit.
  void note_stale(const std::string& channel, double age_ms);
  // The first ramps down and disarms, the second stops at once.
  void ask_stop(const std::string& who);
  // Sends what is due and judges what came; call at least every 5 ms. Polls the tool.
  void step();

  bool done() const { return sequencer_.phase() == Phase::done; }
  RunEnd end() const { return end_; }
  const std::optional<Trip>& trip() const { return trip_; }
  const std::vector<StepMeans>& steps() const { return recorder_.steps(); }
  // Instruments that have said nothing yet, by axis; empty: the run can begin.
  std::string missing() const;
  double elapsed_s() const { return recorder_.seconds(tool_.now_ns()); }
  std::size_t segment() const { return sequencer_.segment_index(); }
  const Plan& plan() const { return plan_; }
  std::optional<double> newest(modbus::StandAxis axis) const { return recorder_.newest(axis); }
  double set_point_rad_s() const { return sequencer_.set_point_rad_s(); }
  double esc_rad_s() const { return esc_omega_; }
  const LimitMonitor& limits() const { return watch_.limits(); }
  const modbus::StandSetup& setup() const { return setup_; }
  double settle_s() const { return options_.settle_s; }
  bool stopping() const { return sequencer_.phase() == Phase::ramping_down || sequencer_.phase() == Phase::stopping; }
  bool turning() const { return sequencer_.turning(); }
  std::vector<std::string> unwatched() const { return watch_.unwatched(); }
  double air_mean(modbus::StandAxis axis) const { return recorder_.mean(axis); }

 private:
  void on_status(const protocols::EscStatus& status);
  void ask_duty();
  BusState bus_state() const;
  void stop_for(const Trip& trip);
  void stop_at_once();
  void begin();
  void drive();
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
  Sequencer sequencer_;
  Watch watch_;
  Recorder recorder_;
  InstrumentCheck instruments_;
  std::size_t holds_checked_ = 0;
  RunEnd end_ = RunEnd::running;
  std::optional<Trip> trip_;
  std::int64_t heard_ns_ = -1, foreign_ns_ = -1;
  double esc_omega_ = 0.0;
  std::int64_t next_command_ns_ = 0, next_arming_ns_ = 0, next_duty_ns_ = 0;
  bool armed_ = false;
  int stops_asked_ = 0;
};

}  // namespace rotorloop::stand_run
