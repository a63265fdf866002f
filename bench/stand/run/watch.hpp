// When a run must end before its plan does: limits of the stand file, readings and an ESC that fall silent, others on the bus.
#pragma once
#include <array>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "bench/stand/run/limits.hpp"
#include "bench/stand/run/sample_grid.hpp"
#include "protocols/types/esc.hpp"

namespace rotorloop::stand_run {

// What the bus shows of the ESC and of others.
struct BusState {
  int esc_index = 0;
  std::int64_t heard_ns = -1;    // of the ESC; -1: never
  std::int64_t foreign_ns = -1;  // of a command that is not ours
  bool shares_index = false;
  std::string esc_fault;  // empty: none
  double elapsed_s = 0.0;
  bool files_failed = false;
};

class Watch {
 public:
  // Says each trip to `trip`, also those after the first. The setup must outlive it.
  Watch(const modbus::StandSetup& setup, int esc_pole_pairs, std::function<void(const Trip&)> trip);
  // Of an instrument, also before the motor turns: how old its newest reading is.
  void note_sample(modbus::StandAxis axis, std::int64_t sampled_ns) { sampled_[axis] = sampled_ns; }

  // While the motor turns. `load`: newest thrust and torque, after the calibration matrix.
  void reading(modbus::StandAxis axis, double value, const std::array<double, 2>& load, std::int64_t now_ns);
  // `set_point_rad_s`: that the rotor must follow; 0: none.
  void status(const protocols::EscStatus& status, double set_point_rad_s, std::int64_t now_ns);
  void left_zero(std::int64_t now_ns) {
    left_zero_ns_ = now_ns;
    followed_ = false;
  }
  // In a steady hold an independent speed that is another than the ESC's: pole pairs, or marks on the rotor, were counted wrong.
  void speeds(const GridRow& row, bool steady_hold);
  void stale(const std::string& channel, double age_ms, std::int64_t now_ns);
  void bus(const BusState& state, std::int64_t now_ns);

  const LimitMonitor& limits() const { return limits_; }
  // Limits of the file that nothing on this stand measures.
  std::vector<std::string> unwatched() const;

 private:
  void value(const char* limit, const std::string& source, double value, std::int64_t now_ns);
  void stop(const char* limit, std::string what, modbus::LimitAction action, std::int64_t now_ns);

  const modbus::StandSetup& setup_;
  int esc_pole_pairs_;
  std::function<void(const Trip&)> trip_;
  LimitMonitor limits_;
  std::map<modbus::StandAxis, std::int64_t> sampled_;
  std::int64_t left_zero_ns_ = -1;
  bool followed_ = false;  // the rotor has come near its set-point since it left zero
  int wrong_ratio_rows_ = 0;
};

}  // namespace rotorloop::stand_run
