// An autopilot's simulator program as a child, in a network of its own where that is allowed, and the sockets that speak to it.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/base/child_process.hpp"

namespace rotorloop::hil {

// `name`: of the autopilot, for messages. All throw Error.
// Ports are fixed: a network of its own lets flights run side by side (-1). Elsewhere one flies at a time: the lock to keep open.
int separate_network(const std::string& name);
int connected_socket(const std::string& name, std::uint16_t port);  // UDP on loopback
int bound_socket(const std::string& name, std::uint16_t port);

class AutopilotProgram {
 public:
  // In `folder`, with its output in `log` there. Ends one that runs.
  void start(const std::filesystem::path& program, const std::filesystem::path& folder, const char* log,
             const std::vector<std::string>& words);
  bool running();  // false once it has ended
  void end() { child_.reset(); }

 private:
  std::optional<ChildProcess> child_;
};

}  // namespace rotorloop::hil
