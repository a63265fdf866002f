#include "bench/hil/controllers/autopilot_program.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <net/if.h>
#include <sched.h>
#include <string.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "host/base/error.hpp"

namespace rotorloop::hil {
namespace {

[[noreturn]] void refuse_program(const std::string& name, const std::string& what, const std::string& why, const std::string& remedy) {
  throw Error({name, what, why, remedy}, ExitCode::device);
}

void write_line(const char* path, const std::string& line) {
  std::ofstream(path) << line;  // what was refused shows in the next step
}

// Who may not have a network of their own may as the only user of a name space; files keep their owner.
bool own_network() {
  if (unshare(CLONE_NEWNET) == 0) return true;
  const uid_t user = geteuid();
  const gid_t group = getegid();
  if (unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return false;
  write_line("/proc/self/setgroups", "deny");
  write_line("/proc/self/uid_map", fmt::format("{0} {0} 1", user));
  write_line("/proc/self/gid_map", fmt::format("{0} {0} 1", group));
  return true;
}

sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in a{};
  a.sin_family = AF_INET;
  a.sin_port = htons(port);
  a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return a;
}

}  // namespace

int separate_network(const std::string& name) {
  if (own_network()) {
    const int s = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    ifreq loopback{};
    std::memcpy(loopback.ifr_name, "lo", 3);
    loopback.ifr_flags = IFF_UP | IFF_LOOPBACK | IFF_RUNNING;
    const bool up = s >= 0 && ioctl(s, SIOCSIFFLAGS, &loopback) == 0;
    const int why = errno;
    if (s >= 0) close(s);
    if (!up)
      refuse_program(name, "the loopback of a new network cannot be switched on", strerror(why),
                     "allow network name spaces, or none at all");
    return -1;
  }
  const int lock = open(("/tmp/rotorloop-" + name + ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (lock >= 0 && flock(lock, LOCK_EX | LOCK_NB) != 0)
    refuse_program(name, "another flight has its ports", "no network name spaces on this machine: one flies at a time",
                   "fly with --jobs 1");
  return lock;
}

int connected_socket(const std::string& name, std::uint16_t port) {
  const int s = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const sockaddr_in to = loopback(port);
  if (s < 0 || connect(s, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) refuse_program(name, "no socket", strerror(errno), "");
  return s;
}

int bound_socket(const std::string& name, std::uint16_t port) {
  const int s = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const sockaddr_in at = loopback(port);
  if (s < 0 || bind(s, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0)
    refuse_program(name, fmt::format("UDP port {} is taken", port), strerror(errno), "end the other program that speaks to its simulator");
  return s;
}

// It stays in our process group, which the runner ends as a whole.
void AutopilotProgram::start(const std::filesystem::path& program, const std::filesystem::path& folder, const char* log,
                             const std::vector<std::string>& words) {
  child_.reset();
  const Descriptor output = output_file(folder / log);
  child_.emplace(ChildSetup{.program = program, .arguments = words, .folder = folder, .output = output.get(), .errors = output.get()});
}

bool AutopilotProgram::running() { return child_ && !child_->wait(0); }

}  // namespace rotorloop::hil
