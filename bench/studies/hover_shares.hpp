// Hover in a log of motor commands without rotor speeds: what the controller asked of each rotor on average, and how its demand sways.
// Both come from the commands alone, so that a log needs nothing but them and a height.
#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "bench/sysid/log/flight_record.hpp"

namespace rotorloop::studies {

// What the commands of a log stand for. thrust: the firmware makes up for the battery, a command asks for thrust (Crazyflie firmware
// with battery compensation); duty: share of the battery voltage.
enum class CommandMeaning { thrust, duty };

constexpr double kSwayLow_Hz = 0.2, kSwayHigh_Hz = 0.8;  // a load on a string of 0.4 to 6 m swings there
enum HoverChannel : std::size_t { kTotalDemand, kRollDemand, kPitchDemand, kYawDemand };

struct HoverShare {
  std::string flight;
  std::array<double, 4> demand{};  // mean thrust demand of our rotors 1 to 4, in units of full command
  double battery_V = 0.0;
  double saturated = 0.0;  // share of the samples in which a rotor is at full command
  std::array<double, 4>
      sway{};           // by HoverChannel: rms between the two frequencies, of the mean demand; 0: no stretch of hover is long enough
  double sway_s = 0.0;  // length of those stretches
  std::size_t samples = 0;
};

// Samples above four fifths of the flight's usual height that climb or sink by less than 0.15 m/s. Empty when there are fewer than 200.
std::optional<HoverShare> hover_share(const log::FlightRecord& flight, CommandMeaning meaning);

// Of reference flights at several battery voltages: the meaning that leaves less scatter in their total.
CommandMeaning command_meaning(const std::vector<log::FlightRecord>& reference);

}  // namespace rotorloop::studies
