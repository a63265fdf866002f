// Units that device profiles may use, and the SI unit each becomes.
#pragma once
#include <string>
#include <string_view>

namespace rotorloop::modbus {

struct ChannelUnit {
  std::string_view name, quantity, si;  // quantity "": fits any
  double to_si;
};

const ChannelUnit* find_unit(std::string_view name);  // nullptr: unknown
std::string units_of(std::string_view quantity);      // "N, kN, kg", for messages

}  // namespace rotorloop::modbus
