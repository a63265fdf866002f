// While one lives, SIGINT (Ctrl-C) and SIGTERM set a flag instead of ending the program: the command ends early by itself, keeps what it
// found, marked incomplete. A second signal ends the program at once.
#pragma once
#include <atomic>
#include <csignal>
#include <string>

namespace rotorloop::cli {

class StopSignals {
 public:
  StopSignals();
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  const std::atomic<bool>* flag() const;
  bool asked() const;
  int exit_code() const;     // 130 or 143, by the signal; 0 before one came
  std::string name() const;  // "SIGINT", "SIGTERM"

 private:
  struct sigaction previous_int_ {
  }, previous_term_{};
};

}  // namespace rotorloop::cli
