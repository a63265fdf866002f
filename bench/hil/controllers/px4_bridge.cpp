#include "bench/hil/controllers/px4_bridge.hpp"

#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "bench/hil/controllers/autopilot_bridge.hpp"
#include "bench/hil/controllers/autopilot_program.hpp"
#include "bench/hil/controllers/mavlink.hpp"
#include "bench/hil/controllers/ned_frames.hpp"
#include "host/base/error.hpp"

namespace rotorloop::hil {
namespace {

// docs.px4.io, simulation, "Simulator MAVLink API": the simulator listens on TCP 4560, PX4 connects.
constexpr std::uint16_t kSimulatorPort = 4560;
constexpr int kControlsWait_ms = 100, kConnect_ms = 8000;
constexpr int kFirstControls = 80;  // sensor messages that it may leave unanswered while it boots: 8 s of waiting
constexpr std::uint64_t kStepsPerSensor = 4, kStepsPerGps = 100;  // 250 Hz, 10 Hz
constexpr std::uint8_t kArmedFlag = 128;                          // MAV_MODE_FLAG_SAFETY_ARMED
constexpr std::uint32_t kAllSensors = 0x1FFF;                     // HIL_SENSOR_UPDATED_…
constexpr double kPx4Idle = 0.05;                                 // of the output, at throttle zero when armed
constexpr double kEarthRadius_m = 6'371'000.0, kHomeLatitude_deg = 47.4, kHomeLongitude_deg = 8.55;
const Eigen::Vector3d kField_W_gauss{0.21, 0.0, 0.43};  // north, east, down at that place; no declination, so that x of the world is north

std::uint64_t time_us_of(const rotorloop_controller_input& in) { return static_cast<std::uint64_t>(std::llround(in.t_s * 1e6)); }
std::uint16_t pulse_us(double share) { return static_cast<std::uint16_t>(std::lround(1500.0 + 500.0 * std::clamp(share, -1.0, 1.0))); }

mavlink::Payload sensor_of(const rotorloop_controller_input& in) {
  mavlink::Payload p;
  p.add(time_us_of(in));
  const auto three = [&](const std::array<double, 3>& v) {
    for (const double x : v) p.add(static_cast<float>(x));
  };
  three(to_ned(in.accel_B_m_s2));
  three(to_ned(in.gyro_B_rad_s));
  const std::array<double, 4> q = in.estimate_valid ? to_ned(in.estimate_q_WB) : std::array<double, 4>{1, 0, 0, 0};
  const Eigen::Vector3d field = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).conjugate() * kField_W_gauss;
  three({field.x(), field.y(), field.z()});
  const double height_m = in.estimate_p_W_m[2];
  p.add(static_cast<float>(1013.25 * std::pow(1.0 - 2.25577e-5 * height_m, 5.25588)));  // hPa, standard atmosphere
  p.add(0.0f).add(static_cast<float>(height_m)).add(25.0f).add(kAllSensors);
  return p;
}

mavlink::Payload gps_of(const rotorloop_controller_input& in) {
  const auto position = to_ned(in.estimate_p_W_m), velocity = to_ned(in.estimate_v_W_m_s);
  constexpr double kDegrees = 180.0 / std::numbers::pi / kEarthRadius_m;
  const auto cm_s = [](double v) { return static_cast<std::int16_t>(std::lround(100.0 * v)); };
  const double ground_m_s = std::hypot(velocity[0], velocity[1]);
  const double course_deg = std::fmod(std::atan2(velocity[1], velocity[0]) * 180.0 / std::numbers::pi + 360.0, 360.0);
  mavlink::Payload p;
  p.add(time_us_of(in));
  p.add(static_cast<std::int32_t>(std::lround(1e7 * (kHomeLatitude_deg + position[0] * kDegrees))));
  p.add(static_cast<std::int32_t>(
      std::lround(1e7 * (kHomeLongitude_deg + position[1] * kDegrees / std::cos(kHomeLatitude_deg * std::numbers::pi / 180.0)))));
  p.add(static_cast<std::int32_t>(std::lround(-1000.0 * position[2])));
  p.add(std::uint16_t{30}).add(std::uint16_t{40}).add(static_cast<std::uint16_t>(std::lround(100.0 * ground_m_s)));
  p.add(cm_s(velocity[0])).add(cm_s(velocity[1])).add(cm_s(velocity[2]));
  p.add(static_cast<std::uint16_t>(std::lround(100.0 * course_deg))).add(std::uint8_t{3}).add(std::uint8_t{12});
  return p;
}

// Roll, pitch (forward is high), throttle, yaw, then a switch that arms.
mavlink::Payload channels_of_pilot(const rotorloop_controller_input& in, const PilotCommand& w) {
  const double throttle = w.flying ? std::clamp((w.thrust_share - kPx4Idle) / (1.0 - kPx4Idle), 0.0, 1.0) : 0.0;
  mavlink::Payload p;
  p.add(time_us_of(in));
  p.add(pulse_us(w.roll_deg / kAngleLimit_deg)).add(pulse_us(w.pitch_deg / kAngleLimit_deg)).add(pulse_us(2.0 * throttle - 1.0));
  p.add(pulse_us(-w.yaw_left_deg_s / kFullStickRate_deg_s)).add(pulse_us(w.arm ? 1.0 : -1.0));
  for (int channel = 6; channel <= 12; ++channel) p.add(pulse_us(-1.0));
  p.add(std::uint8_t{254});
  return p;
}

class Px4Link final : public AutopilotLink {
 public:
  Px4Link(const std::filesystem::path& program, const std::filesystem::path& folder) {
    lock_ = separate_network("px4");
    listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(kSimulatorPort);
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int yes = 1;
    setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    if (bind(listener_, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0 || listen(listener_, 1) != 0)
      throw Error({"px4", fmt::format("TCP port {} is taken", kSimulatorPort), "", "end the other simulator"}, ExitCode::device);
    program_.start(program, folder, "px4.log", {});
  }
  ~Px4Link() override {
    program_.end();
    for (const int fd : {px4_, listener_, lock_})
      if (fd >= 0) close(fd);
  }

  void synchronize(const rotorloop_controller_input&) override {
    pollfd ready{.fd = listener_, .events = POLLIN, .revents = 0};
    for (int waited_ms = 0; poll(&ready, 1, kControlsWait_ms) <= 0; waited_ms += kControlsWait_ms) {
      if (!program_.running()) throw Error({"px4", "its program ended while it started", "", "see px4.log"}, ExitCode::device);
      if (waited_ms >= kConnect_ms)
        throw Error({"px4", fmt::format("did not connect to TCP port {} within {} s", kSimulatorPort, kConnect_ms / 1000),
                     "its simulator interface is not started", "see px4.log"},
                    ExitCode::device);
    }
    px4_ = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    const int yes = 1;
    setsockopt(px4_, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  }
  // Its time is that of the sensors; it answers each of their messages with controls. What it left unanswered stays so until the next one.
  bool exchange(const rotorloop_controller_input& in, const PilotCommand& wish, std::array<float, 4>& motors) override {
    if (in.step % kStepsPerStick == 0) send(mavlink::kHilRcInputsRaw, channels_of_pilot(in, wish));
    if (in.step % kStepsPerGps == 0) send(mavlink::kHilGps, gps_of(in));
    if (in.step % kStepsPerSensor == 0) {
      send(mavlink::kHilSensor, sensor_of(in));
      answered_ = receive();
      booting_ = booting_ && !answered_ && ++sensors_ < kFirstControls;
    }
    motors = controls_;
    return answered_ || booting_;
  }
  bool running() override { return program_.running() && !closed_; }

 private:
  void send(const mavlink::Message& m, const mavlink::Payload& payload) {
    const auto bytes = mavlink::frame(m, payload, sequence_++);
    if (::send(px4_, bytes.data(), bytes.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(bytes.size())) closed_ = true;
  }
  bool receive() {
    std::vector<std::uint8_t> payload;
    while (!finder_.next(payload)) {
      pollfd ready{.fd = px4_, .events = POLLIN, .revents = 0};
      if (closed_ || poll(&ready, 1, kControlsWait_ms) <= 0) return false;
      std::array<std::uint8_t, 2048> bytes;
      const auto n = recv(px4_, bytes.data(), bytes.size(), 0);
      if (n <= 0) {
        closed_ = true;
        return false;
      }
      finder_.add({bytes.data(), static_cast<std::size_t>(n)});
    }
    const bool armed = (payload[80] & kArmedFlag) != 0;
    // Motors 1 to 4 of its quad X are ours: front right, rear left, front left, rear right.
    for (std::size_t i = 0; i < 4; ++i) {
      float control = 0.0f;
      std::memcpy(&control, payload.data() + 16 + 4 * i, sizeof control);
      controls_[i] = armed && control > 0.0f ? std::min(control, 1.0f) : 0.0f;
    }
    return true;
  }

  AutopilotProgram program_;
  int listener_ = -1, px4_ = -1, lock_ = -1;
  mavlink::Finder finder_{mavlink::kHilActuatorControls};
  std::array<float, 4> controls_{};
  std::uint8_t sequence_ = 0;
  int sensors_ = 0;
  bool answered_ = false, booting_ = true, closed_ = false;
};

}  // namespace

int serve_px4() {
  return serve_autopilot({.name = "px4",
                          .variable = "ROTORLOOP_PX4",
                          .log = "px4.log",
                          .wait_ms = kControlsWait_ms,
                          .start = [](const BridgeFiles&, const auto&... of) { return std::make_unique<Px4Link>(of...); }});
}

}  // namespace rotorloop::hil
