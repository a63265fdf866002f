// The whole loop: fly, identify, diagnose, fly again. The bench (this process) knows the plant and starts the flights; identification
// and diagnosis (sandboxed processes) know the logs and the vehicle file. Stage by stage, each in its own folder of the run:
//   1-fly         flights to learn from and flights held out           rotorloop hil
//   2-before      the judged flights, with the vehicle file as it was  rotorloop hil
//   3-identify    sandboxed: the vehicle's parameters, no effect added
//   4-diagnose    sandboxed: what is missing, added and fitted again, checked on the flights held out
//   5-identified  the judged flights with the vehicle of stage 3       rotorloop hil --vehicle
//   6-after       the judged flights with the vehicle of stage 4       rotorloop hil --vehicle
#pragma once
#include <atomic>
#include <filesystem>
#include <functional>
#include <string>

#include "bench/hil/closed_loop/plan.hpp"

namespace rotorloop::closed_loop {

struct LoopOptions {
  std::filesystem::path runs_dir = "runs";
  std::string name;                         // of the run folder; empty: "close-" and the plan's name
  bool force = false;                       // start anew: the run folder is emptied
  std::filesystem::path program;            // rotorloop
  std::filesystem::path diagnosis_program;  // what runs sandboxed; empty: program
  int jobs = 1;
  bool require_isolation = false;  // end before the diagnosis when no sandbox holds
  std::string command_line, version;
  std::function<void(const std::string& stage, const std::string& text)> message;  // progress and messages
  const std::atomic<bool>* stop = nullptr;
};

// Runs what is not done yet and leaves result.json and report.html; returns the run folder. Throws Error: bad inputs (usage), logs that
// the diagnosis could not use (data_quality), interrupted.
std::filesystem::path close_loop(const LoopPlan& plan, const LoopOptions& options);

}  // namespace rotorloop::closed_loop
