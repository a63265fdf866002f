// A program run as a process of its own. One owner of what is easily got wrong: signals that arrive between fork and exec, descriptors
// that leak into the child, the reason why it could not be started, waiting with a limit, and never leaving it behind.
#pragma once
#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host/base/descriptor.hpp"

namespace rotorloop {

// A pipe that no child inherits by accident. Throws Error (device).
struct Pipe {
  Pipe();
  Descriptor read, write;
};

// A file for the output of a child, emptied. Throws Error (device) with the path.
Descriptor output_file(const std::filesystem::path& path);

struct ChildSetup {
  std::filesystem::path program{};
  std::vector<std::string> arguments{};  // without the program's name
  std::filesystem::path folder{};        // it starts in; empty: that of this process
  // Descriptors that become its standard input (-1: /dev/null), output and messages (-1: those of this process).
  int input = -1, output = -1, errors = -1;
  std::optional<std::vector<std::string>> environment{};  // "NAME=value"; unset: that of this process
  std::vector<int> inherited{};                           // further descriptors that stay open in it
  bool own_group = false;                                 // ended together with whatever it has started
  // Runs in the child, in `folder`, before the program: gives privileges up. Returns why it failed; empty: done. With it, `program`
  // is opened before, as its path may not be reachable afterwards.
  std::function<std::string()> prepare{};
};

struct ChildEnd {
  int exit_code = 0;
  int signal = 0;  // that ended it; 0: it ended by itself
};

class ChildProcess {
 public:
  // Returns once the program runs. Throws Error (device) naming the program and the reason when it cannot be run.
  explicit ChildProcess(const ChildSetup& setup);
  ~ChildProcess();  // kills it, its group too, and waits for its end
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  // How it ended; nothing when it has not within the time. Without a limit it waits for the end.
  std::optional<ChildEnd> wait(std::optional<int> limit_ms = std::nullopt);
  void signal(int number);  // nothing happens after its end

 private:
  pid_t pid_ = -1;
  Descriptor exit_watch_;  // readable once the process has ended
  bool own_group_ = false;
  std::optional<ChildEnd> end_;
};

// Everything that can be read from a descriptor until its other end is closed.
std::string read_all(int fd);

// What a program prints. Throws Error (device) when it cannot be run.
std::string output_of(const std::filesystem::path& program, const std::vector<std::string>& arguments);

}  // namespace rotorloop
