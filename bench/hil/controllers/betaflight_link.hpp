// Betaflight's simulator program and the packets it talks: little-endian, over UDP on loopback, on ports that it does not let choose.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>

#include "bench/hil/controllers/autopilot_program.hpp"

namespace rotorloop::hil {

// Its frames: body x-forward, y-right, z-down for rates and specific force; world east, north, up for the velocity.
struct BetaflightState {
  double t_s = 0.0;
  std::array<double, 3> rate_rad_s{}, specific_force_m_s2{};
  std::array<double, 4> q_wxyz{1, 0, 0, 0};
  std::array<double, 3> velocity_m_s{};
  std::array<double, 3> longitude_latitude_deg_altitude_m{};
  double pressure_Pa = 101'325.0;
};
using BetaflightSticks = std::array<std::uint16_t, 16>;  // 1000 to 2000 µs: roll, pitch, throttle, yaw, AUX1, …

class BetaflightLink {
 public:
  // It answers each state at most once, after its next control step; a wait this long is rare where it has a core of its own.
  static constexpr int kMotorWait_ms = 100;

  // Loads `config` in `folder` and starts the program there. Each has a network of its own where that is allowed; elsewhere one flies at a
  // time. Throws Error: cannot be started, a line of the configuration is refused, a port is taken.
  BetaflightLink(const std::filesystem::path& program, const std::filesystem::path& folder, const std::string& config);
  ~BetaflightLink();
  BetaflightLink(const BetaflightLink&) = delete;
  BetaflightLink& operator=(const BetaflightLink&) = delete;

  // Sends states at rest until it answers one after the other; starts it again when it does not come into step. Its time is ahead of the
  // flight's from then on. Throws Error: it never did.
  void synchronize();
  void send(BetaflightState state);
  void send(double t_s, const BetaflightSticks& sticks);
  // Motors 0 to 1 in its order rear right, front right, rear left, front left. False: none came within the wait; the last ones stay.
  bool receive(std::array<float, 4>& motors);
  bool running() { return child_.running(); }  // false once the program has ended

 private:
  void start_program();
  void wait_until_started();
  bool in_step();
  bool receive(std::array<float, 4>& motors, int wait_ms);
  void end();

  std::filesystem::path program_, folder_;
  double lead_s_ = 0.0;
  AutopilotProgram child_;
  int to_state_ = -1, to_sticks_ = -1, motors_ = -1, lock_ = -1;
};

}  // namespace rotorloop::hil
