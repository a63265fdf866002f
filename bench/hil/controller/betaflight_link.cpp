#include "bench/hil/controller/betaflight_link.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <net/if.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <spawn.h>
#include <string.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <initializer_list>
#include <vector>

#include "host/base/error.hpp"

extern char** environ;

namespace rotorloop::hil {
namespace {

constexpr std::uint16_t kStatePort = 9003, kSticksPort = 9004, kMotorsPort = 9002;
constexpr int kMotorWait_ms = 20;  // it answers each state at most once, and not every one

[[noreturn]] void refuse(const std::string& what, const std::string& why, const std::string& remedy) {
  throw Error({"betaflight", what, why, remedy}, ExitCode::device);
}

// The ports are fixed: a network of its own lets flights run side by side. Where a program may not have one, they queue.
int separate_network() {
  if (unshare(CLONE_NEWNET) == 0) {
    const int s = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    ifreq loopback{};
    std::memcpy(loopback.ifr_name, "lo", 3);
    loopback.ifr_flags = IFF_UP | IFF_LOOPBACK | IFF_RUNNING;
    const bool up = s >= 0 && ioctl(s, SIOCSIFFLAGS, &loopback) == 0;
    if (s >= 0) close(s);
    if (!up) refuse("the loopback of a new network cannot be switched on", strerror(errno), "fly one flight at a time as another user");
    return -1;
  }
  const int lock = open("/tmp/rotorloop-betaflight.lock", O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (lock >= 0) flock(lock, LOCK_EX);
  return lock;
}

sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in a{};
  a.sin_family = AF_INET;
  a.sin_port = htons(port);
  a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return a;
}

int connected(std::uint16_t port) {
  const int s = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const sockaddr_in to = loopback(port);
  if (s < 0 || connect(s, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) refuse("no socket", strerror(errno), "");
  return s;
}

int bound(std::uint16_t port) {
  const int s = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const sockaddr_in at = loopback(port);
  if (s < 0 || bind(s, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0)
    refuse(fmt::format("UDP port {} is taken", port), strerror(errno), "end the other program that speaks to Betaflight's simulator");
  return s;
}

// In `folder`, with its output in `log` there. It stays in our process group, which the runner ends as a whole.
pid_t start(const std::filesystem::path& program, const std::filesystem::path& folder, const char* log, std::initializer_list<std::string> words) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log, O_WRONLY | O_CREAT | O_TRUNC, 0644);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  std::string name = program.string();
  std::vector<std::string> copies(words);
  std::vector<char*> arguments{name.data()};
  for (std::string& w : copies) arguments.push_back(w.data());
  arguments.push_back(nullptr);
  pid_t child = -1;
  const int error = posix_spawn(&child, name.c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) refuse(fmt::format("{} cannot be started", name), strerror(error), "give ROTORLOOP_BETAFLIGHT the path of its simulator program");
  return child;
}

// The lines that its command line refused, from what it printed.
std::string refused_lines(const std::filesystem::path& log) {
  std::ifstream in(log);
  std::string line, out;
  while (std::getline(in, line))
    if (line.find("###ERROR") != std::string::npos) out += (out.empty() ? "" : "; ") + line;
  return out;
}

}  // namespace

BetaflightLink::BetaflightLink(const std::filesystem::path& program, const std::filesystem::path& folder, const std::string& config) {
  lock_ = separate_network();
  std::error_code ec;
  std::filesystem::remove(folder / "eeprom.bin", ec);
  std::ofstream(folder / "betaflight.config") << config;
  int status = 0;
  const pid_t loader = start(program, folder, "betaflight_config.log", {"--config", "betaflight.config"});
  while (waitpid(loader, &status, 0) < 0 && errno == EINTR) {
  }
  if (const auto lines = refused_lines(folder / "betaflight_config.log"); !lines.empty())
    refuse("refuses lines of its configuration: " + lines, "another version of Betaflight", "see betaflight_config.log");
  if (!std::filesystem::is_regular_file(folder / "eeprom.bin", ec)) refuse("wrote no eeprom.bin", "", "see betaflight_config.log");
  motors_ = bound(kMotorsPort);
  to_state_ = connected(kStatePort);
  to_sticks_ = connected(kSticksPort);
  child_ = start(program, folder, "betaflight.log", {});
}

BetaflightLink::~BetaflightLink() {
  if (child_ > 0) {
    kill(child_, SIGKILL);
    while (waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  for (const int fd : {to_state_, to_sticks_, motors_, lock_})
    if (fd >= 0) close(fd);
}

void BetaflightLink::send(const BetaflightState& s) {
  static_assert(sizeof(BetaflightState) == 18 * sizeof(double), "the packet is the structure, on a little-endian machine");
  (void)::send(to_state_, &s, sizeof s, MSG_NOSIGNAL);  // refused until it listens
}

void BetaflightLink::send(double t_s, const BetaflightSticks& sticks) {
  std::array<unsigned char, sizeof t_s + sizeof sticks> packet;
  std::memcpy(packet.data(), &t_s, sizeof t_s);
  std::memcpy(packet.data() + sizeof t_s, sticks.data(), sizeof sticks);
  (void)::send(to_sticks_, packet.data(), packet.size(), MSG_NOSIGNAL);
}

bool BetaflightLink::receive(std::array<float, 4>& motors) {
  bool any = false;
  for (;;) {
    pollfd ready{.fd = motors_, .events = POLLIN, .revents = 0};
    if (poll(&ready, 1, any ? 0 : kMotorWait_ms) <= 0) return any;
    std::array<unsigned char, 64> packet;
    if (recv(motors_, packet.data(), packet.size(), 0) != sizeof motors) continue;
    std::memcpy(motors.data(), packet.data(), sizeof motors);
    any = true;
  }
}

bool BetaflightLink::running() {
  if (child_ > 0 && waitpid(child_, nullptr, WNOHANG) == child_) child_ = -1;
  return child_ > 0;
}

}  // namespace rotorloop::hil
