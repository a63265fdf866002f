// What `stand run` and `stand demo` share: options of a run, what is shown while it goes on, and what is printed at its end.
#pragma once
#include <filesystem>
#include <optional>

#include "bench/stand/virtual/virtual_run.hpp"
#include "cli/stand/run_page.hpp"

namespace CLI {
class App;
}

namespace rotorloop::cli {

struct StandRunOptions : stand_run::RunOptions {
  StandRunOptions();
  std::filesystem::path setup;
  bool json = false, jsonl = false, quiet = false, live = false;
  bool summary = true;  // one line about the run on stdout at its end, where neither json nor jsonl is asked for
  int live_port = 0;
};
void add_sequence_options(CLI::App& command, StandRunOptions& options);

struct VirtualOptions : virtual_stand::VirtualRunOptions {
  double pace = 0.0;  // seconds of the stand in a second of the clock; 0: as fast as it goes
};
void add_virtual_options(CLI::App& command, VirtualOptions& options);

// Progress of a running session on stderr and, with jsonl, on stdout: one line for each step.
class RunProgress {
 public:
  explicit RunProgress(const StandRunOptions& options) : options_(options) {}
  void operator()(const stand_run::Session& session);

 private:
  const StandRunOptions& options_;
  std::size_t printed_ = 0;
};

// Progress and live page of a run; `pace` holds virtual time back (RunPace), 0 does not.
class RunScreen {
 public:
  RunScreen(const StandRunOptions& options, double pace);
  RunScreen(const RunScreen&) = delete;
  RunScreen& operator=(const RunScreen&) = delete;
  stand_run::RunObserver observer;

 private:
  RunProgress progress_;
  std::optional<RunPage> page_;
  RunPace pace_;
};

// The run in virtual time with what is printed of it. Returns the exit code.
int run_virtually(StandRunOptions& options, VirtualOptions& virtual_options, const modbus::StandSetup& setup, const stand_run::Plan& plan);
// Prints how it ended; 0, 4 tripped, 5 steps that did not settle.
int print_end(const StandRunOptions& options, const stand_run::RunSummary& summary);

}  // namespace rotorloop::cli
