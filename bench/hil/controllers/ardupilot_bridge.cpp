#include "bench/hil/controllers/ardupilot_bridge.hpp"

#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

#include "bench/hil/controllers/autopilot_bridge.hpp"
#include "bench/hil/controllers/autopilot_program.hpp"
#include "bench/hil/controllers/ned_frames.hpp"
#include "host/base/error.hpp"

namespace rotorloop::hil {
namespace {

// libraries/SITL/examples/JSON/readme.md of ArduPilot (045bdf5): servo packets to UDP 9002, JSON text back to whoever sent them.
constexpr std::uint16_t kServoPort = 9002, kMagic16 = 18458, kMagic32 = 29569;
constexpr int kServoWait_ms = 100, kFirstServo_ms = 8000;
// The share of the output that turns a motor when armed; also in the parameters below.
constexpr double kSpinMin = 0.05;
constexpr const char* kHome = "47.4,8.55,0,0";  // latitude, longitude, altitude, heading: x of the world is north

double channel(double share) { return std::round(1500.0 + 500.0 * std::clamp(share, -1.0, 1.0)); }

// Channels of a pilot in Stabilize mode: pitch is positive nose up there, yaw to the right.
nlohmann::json channels_of(const PilotCommand& w) {
  const double output = std::clamp((w.thrust_share - kSpinMin) / (1.0 - kSpinMin), 0.0, 1.0);
  return {{"rc_1", channel(w.roll_deg / kAngleLimit_deg)},
          {"rc_2", channel(-w.pitch_deg / kAngleLimit_deg)},
          {"rc_3", w.flying ? std::round(1000.0 + 1000.0 * output * output) : 1000.0},  // its motors take the root of the thrust
          {"rc_4", channel(-w.yaw_left_deg_s / kFullStickRate_deg_s)},
          {"rc_5", 1000.0},
          {"rc_6", 1000.0},
          {"rc_7", w.arm ? 2000.0 : 1000.0},
          {"rc_8", 1000.0}};
}

std::string state_text(const rotorloop_controller_input& in, const PilotCommand& w) {
  nlohmann::json j{{"timestamp", in.t_s},
                   {"imu", {{"gyro", to_ned(in.gyro_B_rad_s)}, {"accel_body", to_ned(in.accel_B_m_s2)}}},
                   {"position", to_ned(in.estimate_p_W_m)},
                   {"velocity", to_ned(in.estimate_v_W_m_s)},
                   {"quaternion", std::array<double, 4>{1, 0, 0, 0}},
                   {"rc", channels_of(w)}};
  if (in.estimate_valid) j["quaternion"] = to_ned(in.estimate_q_WB);
  return "\n" + j.dump() + "\n";
}

class ArduPilotLink final : public AutopilotLink {
 public:
  ArduPilotLink(const std::filesystem::path& program, const std::filesystem::path& folder) {
    lock_ = separate_network("ardupilot");
    servo_ = bound_socket("ardupilot", kServoPort);
    std::ofstream(folder / "ardupilot.parm") << ardupilot_parameters();
    program_.start(program, folder, "ardupilot.log",
                   {"--wipe", "--model", "JSON:127.0.0.1", "--home", kHome, "--defaults", "ardupilot.parm"});
  }
  ~ArduPilotLink() override {
    program_.end();
    for (const int fd : {servo_, lock_})
      if (fd >= 0) close(fd);
  }

  void synchronize(const rotorloop_controller_input&) override {
    std::array<float, 4> motors{};
    for (int waited_ms = 0; !receive(motors, kServoWait_ms); waited_ms += kServoWait_ms) {
      if (!program_.running()) throw Error({"ardupilot", "its program ended while it started", "", "see ardupilot.log"}, ExitCode::device);
      if (waited_ms >= kFirstServo_ms)
        throw Error({"ardupilot", fmt::format("sent no servo packet to UDP {} within {} s", kServoPort, kFirstServo_ms / 1000),
                     "another program, or another port", "see ardupilot.log"},
                    ExitCode::device);
    }
  }
  // It waits for a state before it goes on: one servo packet each.
  bool exchange(const rotorloop_controller_input& in, const PilotCommand& wish, std::array<float, 4>& motors) override {
    const std::string text = state_text(in, wish);
    (void)::sendto(servo_, text.data(), text.size(), MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&from_), sizeof from_);
    return receive(motors, kServoWait_ms);
  }
  bool running() override { return program_.running(); }

 private:
  bool receive(std::array<float, 4>& motors, int wait_ms) {
    pollfd ready{.fd = servo_, .events = POLLIN, .revents = 0};
    while (poll(&ready, 1, wait_ms) > 0) {
      std::array<unsigned char, 128> packet;
      socklen_t size = sizeof from_;
      const auto bytes = recvfrom(servo_, packet.data(), packet.size(), 0, reinterpret_cast<sockaddr*>(&from_), &size);
      if (take(packet, bytes < 0 ? 0 : static_cast<std::size_t>(bytes), motors)) return true;
    }
    return false;
  }
  // uint16 magic, uint16 frame rate, uint32 frame count, then 16 or 32 pulse widths in µs. A count again is a packet sent again.
  bool take(const std::array<unsigned char, 128>& packet, std::size_t bytes, std::array<float, 4>& motors) {
    const auto word = [&](std::size_t at) { return static_cast<std::uint32_t>(packet[at] | packet[at + 1] << 8); };
    if (!(bytes == 40 && word(0) == kMagic16) && !(bytes == 72 && word(0) == kMagic32)) return false;
    const std::uint32_t count = word(4) | word(6) << 16;
    if (any_ && count == count_) return false;
    any_ = true;
    count_ = count;
    // Motors 1 to 4 of its quad X are ours: front right, rear left, front left, rear right.
    for (std::size_t i = 0; i < 4; ++i) motors[i] = std::clamp(static_cast<float>(word(8 + 2 * i)) - 1000.0f, 0.0f, 1000.0f) / 1000.0f;
    return true;
  }

  AutopilotProgram program_;
  int servo_ = -1, lock_ = -1;
  sockaddr_in from_{};
  std::uint32_t count_ = 0;
  bool any_ = false;
};

}  // namespace

std::string ardupilot_parameters() {
  return fmt::format(
      "FRAME_CLASS 1\nFRAME_TYPE 1\n"         // quad, X
      "SIM_RATE_HZ 1000\n"                    // a state each millisecond
      "MOT_PWM_MIN 1000\nMOT_PWM_MAX 2000\n"  // output 0 to 1
      "MOT_SPIN_ARM {0}\nMOT_SPIN_MIN {0}\nMOT_SPIN_MAX 1\n"
      "MOT_THST_EXPO 1\n"                        // thrust goes with the square of the output
      "MOT_THST_HOVER 0.5\nMOT_HOVER_LEARN 0\n"  // the throttle stick is thrust, in a straight line
      "MOT_BAT_VOLT_MAX 0\n"                     // the ESC holds its speed whatever the battery
      "ANGLE_MAX {1:.0f}\nPILOT_Y_RATE {2:.0f}\n"
      "FLTMODE1 0\nFLTMODE2 0\nFLTMODE3 0\nFLTMODE4 0\nFLTMODE5 0\nFLTMODE6 0\n"  // Stabilize
      "RC7_OPTION 153\nARMING_CHECK 0\nDISARM_DELAY 0\n",                         // channel 7 arms
      kSpinMin, 100.0 * kAngleLimit_deg, kFullStickRate_deg_s);
}

int serve_ardupilot() {
  return serve_autopilot({.name = "ardupilot",
                          .variable = "ROTORLOOP_ARDUPILOT",
                          .log = "ardupilot.log",
                          .wait_ms = kServoWait_ms,
                          .start = [](const BridgeFiles&, const auto&... of) { return std::make_unique<ArduPilotLink>(of...); }});
}

}  // namespace rotorloop::hil
