// Names of the DroneCAN data types that are met in the field, by identifier. Source: the public DSDL definitions of DroneCAN.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>

namespace rotorloop::tools {

// Full name, "uavcan.equipment.esc.Status"; empty for a type that is not in the list.
std::string_view type_name(bool service, std::uint16_t id);

// The last word of it, "Status" with the one before, "esc.Status"; a number, "message 20641", for an unknown type.
std::string short_type_name(bool service, std::uint16_t id);

}  // namespace rotorloop::tools
