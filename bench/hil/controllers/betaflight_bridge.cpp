#include "bench/hil/controllers/betaflight_bridge.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "bench/hil/controllers/autopilot_bridge.hpp"
#include "bench/hil/controllers/betaflight_config.hpp"
#include "bench/hil/controllers/betaflight_link.hpp"

namespace rotorloop::hil {
namespace {

constexpr double kStickCentre_us = 1500.0, kStickHalf_us = 500.0, kStickLow_us = 1000.0, kStickHigh_us = 2000.0;
// Ours 1 front-right, 2 rear-left, 3 front-left, 4 rear-right, in Betaflight's order rear right, front right, rear left, front left.
constexpr std::array<std::size_t, 4> kMotorOfRotor{1, 2, 3, 0};
// Where the flight is on Earth matters to nobody; one degree of latitude is 111 320 m.
constexpr double kLongitude_deg = 8.55, kLatitude_deg = 47.4, kMetresPerDegree = 111'320.0;

std::uint16_t stick(double us) { return static_cast<std::uint16_t>(std::lround(std::clamp(us, kStickLow_us, kStickHigh_us))); }

BetaflightSticks sticks_of(const PilotCommand& wish) {
  BetaflightSticks s;
  s.fill(static_cast<std::uint16_t>(kStickCentre_us));
  s[2] = stick(kStickLow_us);
  s[4] = stick(wish.arm ? kStickHigh_us : kStickLow_us);  // arm
  s[5] = stick(kStickHigh_us);                            // angle mode
  if (!wish.flying) return s;
  s[0] = stick(kStickCentre_us + kStickHalf_us * wish.roll_deg / kAngleLimit_deg);
  s[1] = stick(kStickCentre_us + kStickHalf_us * wish.pitch_deg / kAngleLimit_deg);
  // Output with the speed, and above idle and the end of its dead travel the stick with output.
  const double share = (wish.thrust_share - kMotorIdle) / (1.0 - kMotorIdle);
  s[2] = stick(kMinCheck_us + std::clamp(share, 0.0, 1.0) * (kStickHigh_us - kMinCheck_us));
  s[3] = stick(kStickCentre_us - kStickHalf_us * wish.yaw_left_deg_s / kFullStickRate_deg_s);
  return s;
}

BetaflightState state_of(const rotorloop_controller_input& in) {
  const auto& w = in.gyro_B_rad_s;
  const auto& a = in.accel_B_m_s2;
  const auto& q = in.estimate_q_WB;
  const auto& v = in.estimate_v_W_m_s;
  const auto& p = in.estimate_p_W_m;
  BetaflightState s{
      .t_s = in.t_s,
      .rate_rad_s = {w[0], -w[1], w[2]},
      .specific_force_m_s2 = {a[0], -a[1], -a[2]},
      .velocity_m_s = {v[0], v[1], v[2]},
      .longitude_latitude_deg_altitude_m = {kLongitude_deg + p[0] / kMetresPerDegree, kLatitude_deg + p[1] / kMetresPerDegree, p[2]},
      .pressure_Pa = 101'325.0 * std::pow(1.0 - 2.25577e-5 * p[2], 5.25588)};  // standard atmosphere
  if (in.estimate_valid) s.q_wxyz = {q[0], q[1], -q[2], -q[3]};
  return s;
}

class BetaflightAutopilot final : public AutopilotLink {
 public:
  BetaflightAutopilot(const BridgeFiles& f, const std::filesystem::path& program, const std::filesystem::path& folder)
      : link_(program, folder, betaflight_config(f.vehicle, f.map)) {}
  void synchronize(const rotorloop_controller_input&) override { link_.synchronize(); }
  bool exchange(const rotorloop_controller_input& in, const PilotCommand& wish, std::array<float, 4>& motors) override {
    if (in.step % kStepsPerStick == 0) link_.send(in.t_s, sticks_of(wish));
    link_.send(state_of(in));
    const bool answered = link_.receive(theirs_);
    for (std::size_t i = 0; i < 4; ++i) motors[i] = theirs_[kMotorOfRotor[i]];
    return answered;
  }
  bool running() override { return link_.running(); }

 private:
  BetaflightLink link_;
  std::array<float, 4> theirs_{};
};

}  // namespace

std::string betaflight_config_of(const std::filesystem::path& vehicle_file, const std::filesystem::path& gains_file) {
  const BridgeFiles f = read_bridge_files(vehicle_file, gains_file);
  return betaflight_config(f.vehicle, f.map);
}

int serve_betaflight() {
  return serve_autopilot({.name = "betaflight",
                          .variable = "ROTORLOOP_BETAFLIGHT",
                          .log = "betaflight.log",
                          .wait_ms = BetaflightLink::kMotorWait_ms,
                          .start = [](const auto&... of) { return std::make_unique<BetaflightAutopilot>(of...); }});
}

}  // namespace rotorloop::hil
