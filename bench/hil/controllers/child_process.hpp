// A program run as a child that is talked to line by line over its standard input and output. Its standard error goes to a file.
#pragma once
#include <sys/types.h>

#include <atomic>
#include <filesystem>
#include <string>
#include <string_view>

namespace rotorloop::hil {

class ChildProcess {
 public:
  enum class Wait : unsigned char { line, timeout, ended, stopped };

  // `command`: a line for /bin/sh. `error_log` empty: standard error is shared. Throws Error (ExitCode::device) when nothing can be
  // started.
  ChildProcess(const std::string& command, const std::filesystem::path& error_log);
  // Closes its input, gives it two seconds to end, then kills it with all it started in its process group.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  // False when it does not read any more.
  bool send(std::string_view line);
  // The next line without its newline. A line longer than a megabyte counts as `ended`. `stop` ends the wait early.
  Wait receive(std::string& line, double timeout_s, const std::atomic<bool>* stop);
  // After Wait::ended: "ended with exit code 1", "ended by signal 11 (Segmentation fault)".
  std::string ending();

 private:
  bool wait_for_end(int timeout_ms);
  pid_t child_ = -1;
  int socket_ = -1, exit_watch_ = -1;
  bool reaped_ = false;
  int status_ = 0;
  std::string buffer_;
};

}  // namespace rotorloop::hil
