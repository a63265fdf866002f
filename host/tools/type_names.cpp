#include "host/tools/type_names.hpp"

#include <array>

namespace rotorloop::tools {
namespace {

struct NamedType {
  bool service;
  std::uint16_t id;
  std::string_view name;
};

constexpr std::array kNamedTypes = std::to_array<NamedType>({
    {true, 1, "uavcan.protocol.GetNodeInfo"},
    {true, 2, "uavcan.protocol.GetDataTypeInfo"},
    {true, 4, "uavcan.protocol.GetTransportStats"},
    {true, 5, "uavcan.protocol.RestartNode"},
    {true, 10, "uavcan.protocol.param.ExecuteOpcode"},
    {true, 11, "uavcan.protocol.param.GetSet"},
    {true, 15, "uavcan.protocol.enumeration.Begin"},
    {true, 40, "uavcan.protocol.file.BeginFirmwareUpdate"},
    {true, 45, "uavcan.protocol.file.GetInfo"},
    {true, 46, "uavcan.protocol.file.GetDirectoryEntryInfo"},
    {true, 47, "uavcan.protocol.file.Delete"},
    {true, 48, "uavcan.protocol.file.Read"},
    {true, 49, "uavcan.protocol.file.Write"},
    {true, 63, "uavcan.tunnel.Call"},
    {false, 1, "uavcan.protocol.dynamic_node_id.Allocation"},
    {false, 4, "uavcan.protocol.GlobalTimeSync"},
    {false, 5, "uavcan.protocol.Panic"},
    {false, 341, "uavcan.protocol.NodeStatus"},
    {false, 342, "dronecan.protocol.Stats"},
    {false, 343, "dronecan.protocol.CanStats"},
    {false, 344, "dronecan.protocol.GlobalTime"},
    {false, 380, "uavcan.protocol.enumeration.Indication"},
    {false, 1003, "uavcan.equipment.ahrs.RawIMU"},
    {false, 1010, "uavcan.equipment.actuator.ArrayCommand"},
    {false, 1011, "uavcan.equipment.actuator.Status"},
    {false, 1030, "uavcan.equipment.esc.RawCommand"},
    {false, 1031, "uavcan.equipment.esc.RPMCommand"},
    {false, 1034, "uavcan.equipment.esc.Status"},
    {false, 1036, "uavcan.equipment.esc.StatusExtended"},
    {false, 1045, "dronecan.sensors.rpm.RPM"},
    {false, 1060, "uavcan.equipment.gnss.Fix"},
    {false, 1061, "uavcan.equipment.gnss.Auxiliary"},
    {false, 1063, "uavcan.equipment.gnss.Fix2"},
    {false, 1080, "uavcan.equipment.indication.BeepCommand"},
    {false, 1081, "uavcan.equipment.indication.LightsCommand"},
    {false, 1091, "uavcan.equipment.power.CircuitStatus"},
    {false, 1092, "uavcan.equipment.power.BatteryInfo"},
    {false, 1100, "uavcan.equipment.safety.ArmingStatus"},
    {false, 1110, "uavcan.equipment.device.Temperature"},
    {false, 2010, "uavcan.tunnel.Broadcast"},
    {false, 3001, "uavcan.tunnel.Targetted"},
    {false, 16370, "uavcan.protocol.debug.KeyValue"},
    {false, 16371, "dronecan.protocol.FlexDebug"},
    {false, 16383, "uavcan.protocol.debug.LogMessage"},
    {false, 20000, "ardupilot.indication.SafetyState"},
});

}  // namespace

std::string_view type_name(bool service, std::uint16_t id) {
  for (const NamedType& t : kNamedTypes) {
    if (t.service == service && t.id == id) return t.name;
  }
  return {};
}

std::string short_type_name(bool service, std::uint16_t id) {
  std::string_view name = type_name(service, id);
  if (name.empty()) return (service ? "service " : "message ") + std::to_string(id);
  const std::size_t last = name.rfind('.');
  const std::size_t before = name.rfind('.', last - 1);
  const std::string_view group = name.substr(before + 1, last - before - 1);
  return std::string(group == "protocol" ? name.substr(last + 1) : name.substr(before + 1));
}

}  // namespace rotorloop::tools
