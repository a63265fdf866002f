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
constexpr std::uint16_t kCommandPort = 5761;  // TCP: it listens there once its sensors are there, and a state before that ends it
constexpr int kStart_ms = 6000,
              kLook_ms = 10;  // half a second on an idle machine; shorter than the wait of the run, which could not say why

// In step: this many states in a row answered, each within the wait. Three starts of four need fewer than 60 states for it, some hundreds,
// some never come into step. All starts together take 8 s; the run waits 10 s for an answer.
constexpr int kInStep = 20, kStartStates = 120, kStartWait_ms = 5, kMostStarts = 7;
constexpr double kStep_s = 1e-3;

[[noreturn]] void refuse(const std::string& what, const std::string& why, const std::string& remedy) {
  throw Error({"betaflight", what, why, remedy}, ExitCode::device);
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

// The ports are fixed: a network of its own lets flights run side by side. Where a program may not have one, one flies at a time.
int separate_network() {
  if (own_network()) {
    const int s = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    ifreq loopback{};
    std::memcpy(loopback.ifr_name, "lo", 3);
    loopback.ifr_flags = IFF_UP | IFF_LOOPBACK | IFF_RUNNING;
    const bool up = s >= 0 && ioctl(s, SIOCSIFFLAGS, &loopback) == 0;
    const int why = errno;
    if (s >= 0) close(s);
    if (!up) refuse("the loopback of a new network cannot be switched on", strerror(why), "allow network name spaces, or none at all");
    return -1;
  }
  const int lock = open("/tmp/rotorloop-betaflight.lock", O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (lock >= 0 && flock(lock, LOCK_EX | LOCK_NB) != 0)
    refuse("another flight has its ports", "no network name spaces on this machine: one Betaflight flies at a time", "fly with --jobs 1");
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

bool listens(std::uint16_t port) {
  const int s = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const sockaddr_in to = loopback(port);
  const bool yes = s >= 0 && connect(s, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
  if (s >= 0) close(s);
  return yes;
}

// In `folder`, with its output in `log` there. It stays in our process group, which the runner ends as a whole.
pid_t start(const std::filesystem::path& program, const std::filesystem::path& folder, const char* log,
            std::initializer_list<std::string> words) {
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
  if (error != 0)
    refuse(fmt::format("{} cannot be started", name), strerror(error), "give ROTORLOOP_BETAFLIGHT the path of its simulator program");
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

BetaflightLink::BetaflightLink(const std::filesystem::path& program, const std::filesystem::path& folder, const std::string& config)
    : program_(program), folder_(folder) {
  lock_ = separate_network();
  std::error_code ec;
  std::filesystem::remove(folder / "eeprom.bin", ec);
  std::ofstream(folder / "betaflight.config") << config;
  child_ = start(program, folder, "betaflight_config.log", {"--config", "betaflight.config"});
  for (int waited_ms = 0; running() && waited_ms < kStart_ms; waited_ms += kLook_ms) poll(nullptr, 0, kLook_ms);
  const bool stuck = running();
  end_child();
  if (stuck) refuse(fmt::format("loads its configuration for more than {} s", kStart_ms / 1000), "", "see betaflight_config.log");
  if (const auto lines = refused_lines(folder / "betaflight_config.log"); !lines.empty())
    refuse("refuses lines of its configuration: " + lines, "another version of Betaflight", "see betaflight_config.log");
  if (!std::filesystem::is_regular_file(folder / "eeprom.bin", ec)) refuse("wrote no eeprom.bin", "", "see betaflight_config.log");
  motors_ = bound(kMotorsPort);
  to_state_ = connected(kStatePort);
  to_sticks_ = connected(kSticksPort);
  try {
    start_program();
  } catch (...) {
    end();
    throw;
  }
}

void BetaflightLink::start_program() {
  child_ = start("/usr/bin/stdbuf", folder_, "betaflight.log", {"-oL", program_.string()});  // it says once a second why it does not arm
  wait_until_started();
}

bool BetaflightLink::in_step() {
  std::array<float, 4> motors;
  BetaflightState rest{.specific_force_m_s2 = {0.0, 0.0, -9.81}};
  for (int states = 0, answered = 0; states < kStartStates && running(); ++states, lead_s_ += kStep_s) {
    send(rest);
    answered = receive(motors, kStartWait_ms) ? answered + 1 : 0;
    if (answered == kInStep) return true;
  }
  return false;
}

void BetaflightLink::get_in_step() {
  for (int starts = 1; !in_step(); ++starts) {
    if (!running()) refuse("its program ended while it started", "", "see betaflight.log");
    if (starts == kMostStarts)
      refuse(fmt::format("its control loop does not follow the states, {} starts tried", starts),
             "the machine is busy, or it is another program", "fly again with --jobs 1; see betaflight.log");
    end_child();
    lead_s_ = 0.0;
    start_program();
  }
}

void BetaflightLink::wait_until_started() {
  for (int waited_ms = 0; !listens(kCommandPort); waited_ms += kLook_ms) {
    if (!running()) refuse("its program ended while it started", "", "see betaflight.log");
    if (waited_ms >= kStart_ms)
      refuse(fmt::format("its program does not listen on TCP port {} after {} s", kCommandPort, kStart_ms / 1000), "",
             "see betaflight.log");
    poll(nullptr, 0, kLook_ms);
  }
}

BetaflightLink::~BetaflightLink() { end(); }

void BetaflightLink::end_child() {
  if (child_ <= 0) return;
  kill(child_, SIGKILL);
  while (waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {
  }
  child_ = -1;
}

void BetaflightLink::end() {
  end_child();
  for (const int fd : {to_state_, to_sticks_, motors_, lock_})
    if (fd >= 0) close(fd);
}

void BetaflightLink::send(BetaflightState s) {
  s.t_s += lead_s_;
  static_assert(sizeof(BetaflightState) == 18 * sizeof(double), "the packet is the structure, on a little-endian machine");
  (void)::send(to_state_, &s, sizeof s, MSG_NOSIGNAL);  // refused until it listens
}

void BetaflightLink::send(double t_s, const BetaflightSticks& sticks) {
  t_s += lead_s_;
  std::array<unsigned char, sizeof t_s + sizeof sticks> packet;
  std::memcpy(packet.data(), &t_s, sizeof t_s);
  std::memcpy(packet.data() + sizeof t_s, sticks.data(), sizeof sticks);
  (void)::send(to_sticks_, packet.data(), packet.size(), MSG_NOSIGNAL);
}

bool BetaflightLink::receive(std::array<float, 4>& motors) { return receive(motors, kMotorWait_ms); }

bool BetaflightLink::receive(std::array<float, 4>& motors, int wait_ms) {
  bool any = false;
  for (;;) {
    pollfd ready{.fd = motors_, .events = POLLIN, .revents = 0};
    if (poll(&ready, 1, any ? 0 : wait_ms) <= 0) return any;
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
