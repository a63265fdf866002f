// A profile as people read it: every register with its quirks and where the numbers come from.
#pragma once
#include <string>

#include "bench/stand/instruments/profile.hpp"

namespace rotorloop::modbus {

std::string profile_text(const Profile& profile);
// "gross 7 u32, kg, sign status.7": one channel in a line.
std::string quirks_text(const Profile& profile, const Channel& channel);
// "evidence: manual (not seen on hardware)".
std::string evidence_text(const Profile& profile);

}  // namespace rotorloop::modbus
