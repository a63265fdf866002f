// What happens on the disk of a rotor, for its page: maps of load, angle of attack, inflow and Reynolds number.
#pragma once
#include <string>

#include "bench/render/disk_map.hpp"
#include "sim/rotor/disk.hpp"

namespace rotorloop::propeller {

// One quantity of every cell as a map with wind and rotation marked; label with unit.
using DiskQuantity = double (*)(const sim::DiskCell&);
render::DiskMap disk_map_of(const sim::Rotor& rotor, const sim::RotorCondition& condition, const sim::RotorDisk& disk,
                            DiskQuantity quantity, const std::string& label);

// HTML. The rotor's own resolution is that of the maps.
std::string disk_section_html(const sim::Rotor& rotor, const sim::RotorCondition& condition);

}  // namespace rotorloop::propeller
