// The units that flight logs come in, each with its factor to SI. A mapping file names them; nothing else converts.
#pragma once
#include <span>
#include <string>
#include <string_view>

namespace rotorloop::log {

struct LogUnit {
  std::string_view name;  // as mapping files write it
  std::string_view si;    // what a value is in after multiplying with the factor
  double factor = 1.0;
  bool electrical = false;  // a speed of the motor's field: the mapping's pole_pairs divide it
};

std::span<const LogUnit> log_units();
const LogUnit* find_log_unit(std::string_view name);  // nullptr when there is none
// The same as other programs write it in their headers: "N·cm", "N.cm" and "Ncm" are "N cm", "RPM" is "rpm". Only units of `si`.
const LogUnit* find_written_unit(std::string_view written, std::string_view si);
std::string log_units_of(std::string_view si);  // names with that SI unit, for messages: "m, mm, cm"

}  // namespace rotorloop::log
