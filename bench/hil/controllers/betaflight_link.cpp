#include "bench/hil/controllers/betaflight_link.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstring>
#include <fstream>

#include "host/base/error.hpp"

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

// TCP on loopback.
bool listens(std::uint16_t port) {
  const int s = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(port);
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const bool yes = s >= 0 && connect(s, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
  if (s >= 0) close(s);
  return yes;
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
  lock_ = separate_network("betaflight");
  std::error_code ec;
  std::filesystem::remove(folder / "eeprom.bin", ec);
  std::ofstream(folder / "betaflight.config") << config;
  child_.start(program, folder, "betaflight_config.log", {"--config", "betaflight.config"});
  for (int waited_ms = 0; running() && waited_ms < kStart_ms; waited_ms += kLook_ms) poll(nullptr, 0, kLook_ms);
  const bool stuck = running();
  child_.end();
  if (stuck) refuse(fmt::format("loads its configuration for more than {} s", kStart_ms / 1000), "", "see betaflight_config.log");
  if (const auto lines = refused_lines(folder / "betaflight_config.log"); !lines.empty())
    refuse("refuses lines of its configuration: " + lines, "another version of Betaflight", "see betaflight_config.log");
  if (!std::filesystem::is_regular_file(folder / "eeprom.bin", ec)) refuse("wrote no eeprom.bin", "", "see betaflight_config.log");
  motors_ = bound_socket("betaflight", kMotorsPort);
  to_state_ = connected_socket("betaflight", kStatePort);
  to_sticks_ = connected_socket("betaflight", kSticksPort);
  try {
    start_program();
  } catch (...) {
    end();
    throw;
  }
}

void BetaflightLink::start_program() {
  child_.start("/usr/bin/stdbuf", folder_, "betaflight.log", {"-oL", program_.string()});  // it says once a second why it does not arm
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

void BetaflightLink::synchronize() {
  for (int starts = 1; !in_step(); ++starts) {
    if (!running()) refuse("its program ended while it started", "", "see betaflight.log");
    if (starts == kMostStarts)
      refuse(fmt::format("its control loop does not follow the states, {} starts tried", starts),
             "the machine is busy, or it is another program", "fly again with --jobs 1; see betaflight.log");
    child_.end();
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

void BetaflightLink::end() {
  child_.end();
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

}  // namespace rotorloop::hil
