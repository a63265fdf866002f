#include "bench/stand/evaluate/estimate/stand_uncertainty.hpp"

#include <utility>

namespace rotorloop::stand {

StandUncertainty stand_uncertainty(const std::map<std::string, double>& given, const std::string& source) {
  using S = StandUncertainty;
  constexpr std::pair<const char*, KnownU S::*> kKnown[] = {{"thrust_calibration", &S::thrust_calibration},
                                                            {"torque_calibration", &S::torque_calibration},
                                                            {"arm_length", &S::arm_length},
                                                            {"alignment_rad", &S::alignment_rad},
                                                            {"rotor_speed", &S::rotor_speed},
                                                            {"density", &S::air_density},
                                                            {"voltage", &S::voltage},
                                                            {"current", &S::current},
                                                            {"zero_thrust", &S::zero_thrust},
                                                            {"zero_torque", &S::zero_torque},
                                                            {"hysteresis", &S::hysteresis},
                                                            {"cross_talk_m", &S::cross_talk_m}};
  static_assert(std::size(kKnown) == kUncertaintyKeys.size());
  S s;
  for (const auto& [key, known] : kKnown)
    if (const auto at = given.find(key); at != given.end()) s.*known = {at->second, source};
  if (given.contains("cross_talk_m")) s.cross_talk_share = {0.0, source};
  return s;
}

}  // namespace rotorloop::stand
