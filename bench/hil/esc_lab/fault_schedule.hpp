// Seeded schedules of faults, each from a copy of an ESC that starts or flies on a drawn board: one or two things break at random times,
// for a while or for good, and the set-point is renewed or not. Whatever happens, nothing is driven without a fresh set-point, and an ESC
// that does not drive though it should says why.
#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bench/hil/esc_lab/esc_trace.hpp"
#include "bench/hil/esc_lab/motor_classes.hpp"
#include "firmware/core/motor/config.hpp"

namespace rotorloop::esc_lab {

struct FaultOutcome {
  std::uint64_t number = 0;
  std::string faults;  // names of what broke
  double simulated_ms = 0.0;
  double driven_stale_ms = 0.0;   // bridge on without a fresh set-point: none allowed
  double blind_running_ms = 0.0;  // a rotor at rest reported as running: at most kBlindRunning_ms
  bool dead_without_reason = false, latched_without_fault = false;
  bool latched = false, tripped = false;
};
// For which a rotor at rest may be reported as running: the slip check takes 60 ms, a catch in between as long again.
inline constexpr double kBlindRunning_ms = 150.0;
bool fault_handled(const FaultOutcome& o);
std::string fault_failure(const FaultOutcome& o);  // what is wrong, in words; empty when nothing is

struct FaultSettings {
  std::uint64_t from = 1, count = 100;
  // Edge by edge while a leg is broken, in steps of at most this: four times that of the judge (sim/drive/switched_bridge.hpp).
  double switched_step_s = 1e-6;
  std::function<void(firmware::MotorConfig&)> change = {};  // an ablation
  std::function<void(const FaultOutcome&)> each = {};
};

// Schedule n begins from a copy of draw n % draws.size(), starting or flying in turn. All draws must stand on one board. In the order of
// their ends.
std::vector<FaultOutcome> run_fault_schedules(const std::vector<EscDraw>& draws, const FaultSettings& settings);
// One of them again, with its trace.
FaultOutcome trace_fault_schedule(const std::vector<EscDraw>& draws, const FaultSettings& settings, std::uint64_t number, EscTrace& trace);

}  // namespace rotorloop::esc_lab
