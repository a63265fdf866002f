// What every autopilot behind the handshake has in common: a pilot whose sticks are our position loop, notes of what happens, the lockstep
// loop over standard input and output, and named ends. One autopilot is one AutopilotLink.
#pragma once
#include <array>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "bench/hil/controllers/handshake.hpp"
#include "bench/hil/controllers/motor_map.hpp"
#include "host/control/gains_file.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::hil {

struct BridgeFiles {
  host::VehicleModel vehicle;
  host::GainsFile gains;
  MotorMap map;
};
// Throws Error: unreadable files.
BridgeFiles read_bridge_files(const std::filesystem::path& vehicle_file, const std::filesystem::path& gains_file);

// What the pilot's hands do, in physical terms; each autopilot makes stick positions of it.
struct PilotCommand {
  bool arm = false, flying = false;
  double roll_deg = 0.0, pitch_deg = 0.0;  // to the right, nose down
  double yaw_left_deg_s = 0.0;
  double thrust_share = 0.0;  // speed that the thrust needs, as a share of omega_min to omega_max: 0 to 1 and beyond
};
inline constexpr double kAutopilotArm_s = 5.5;       // it starts and calibrates until 5 s of its time
inline constexpr double kAutopilotStart_s = 8.0;     // of the trajectory
inline constexpr std::uint64_t kStepsPerStick = 10;  // 100 Hz, as a radio link sends

class AutopilotLink {
 public:
  virtual ~AutopilotLink() = default;
  virtual void synchronize(const rotorloop_controller_input& first) = 0;  // throws Error: it never did
  // One control step: state and sticks to it, motor outputs 0 to 1 in our order back. False: none came within the wait; the last ones stay.
  virtual bool exchange(const rotorloop_controller_input& in, const PilotCommand& wish, std::array<float, 4>& motors) = 0;
  virtual bool running() = 0;  // false once the program has ended
};

struct AutopilotBridge {
  const char* name;      // as --controller takes it
  const char* variable;  // of the environment, that names its program
  const char* log;       // what the program printed, in the flight's folder
  int wait_ms;           // of exchange(), for the notes
  // Throws Error: it cannot be started.
  std::function<std::unique_ptr<AutopilotLink>(const BridgeFiles& files, const std::filesystem::path& program,
                                               const std::filesystem::path& folder)>
      start;
};

// Runs until standard input is closed; what cannot be done goes out as {"error": …} in place of the first answer. Returns the exit code.
int serve_autopilot(const AutopilotBridge& bridge);

// Throws Error: the variable is not set, or names no file.
std::filesystem::path autopilot_program(const char* name, const char* variable);

}  // namespace rotorloop::hil
