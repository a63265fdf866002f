// A program run as a child that is talked to line by line over its standard input and output. Its standard error goes to a file.
#pragma once
#include <atomic>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

#include "host/base/child_process.hpp"

namespace rotorloop::hil {

class LineProcess {
 public:
  enum class Wait : unsigned char { line, timeout, ended, stopped };

  // `command`: a line for /bin/sh. `error_log` empty: standard error is shared. Throws Error (ExitCode::device) when nothing can be
  // started.
  LineProcess(const std::string& command, const std::filesystem::path& error_log);
  // Closes its input, gives it two seconds to end, then kills it with all it started in its process group.
  ~LineProcess();

  // False when it does not read any more.
  bool send(std::string_view line);
  // The next line without its newline. A line longer than a megabyte counts as `ended`. `stop` ends the wait early.
  Wait receive(std::string& line, double timeout_s, const std::atomic<bool>* stop);
  // After Wait::ended: "ended with exit code 1", "ended by signal 11 (Segmentation fault)".
  std::string ending();

 private:
  LineProcess(std::pair<Descriptor, Descriptor> ends, const std::string& command, Descriptor error_log);
  Descriptor socket_;
  ChildProcess child_;
  std::string buffer_;
};

}  // namespace rotorloop::hil
