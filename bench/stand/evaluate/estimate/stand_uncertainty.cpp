#include "bench/stand/evaluate/estimate/stand_uncertainty.hpp"

namespace rotorloop::stand {

StandUncertainty read_stand_uncertainty(const TomlTable& t, const std::string& source) {
  StandUncertainty s;
  const auto take = [&](const char* key, KnownU& known, Range range) {
    if (t.has(key)) known = {t.number(key, range), source};
  };
  constexpr Range kShare{0.0, 0.5, "1"};
  take("thrust_calibration", s.thrust_calibration, kShare);
  take("torque_calibration", s.torque_calibration, kShare);
  take("arm_length", s.arm_length, kShare);
  take("alignment_rad", s.alignment_rad, {0.0, 0.5, "rad"});
  take("rotor_speed", s.rotor_speed, kShare);
  take("density", s.air_density, kShare);
  take("voltage", s.voltage, kShare);
  take("current", s.current, kShare);
  take("zero_thrust", s.zero_thrust, kShare);
  take("zero_torque", s.zero_torque, kShare);
  take("hysteresis", s.hysteresis, kShare);
  take("cross_talk_m", s.cross_talk_m, {0.0, 0.1, "N m per N"});
  if (t.has("cross_talk_m")) s.cross_talk_share = {0.0, source};
  return s;
}

}  // namespace rotorloop::stand
