// Every data type of the house in one list, for tools that take types by name or by number (recordings, adapters) and for tests
// that have to visit all of them. What runs on a target names its few types instead.
#pragma once
#include "protocols/types.hpp"
#include "protocols/types/vehicle.hpp"

namespace rotorloop::protocols {

// Calls f.template operator()<T>() for each message.
template <class F>
constexpr void for_each_message(F&& f) {
  const auto all = [&]<class... T>() { (f.template operator()<T>(), ...); };
  all.template operator()<NodeStatus, GlobalTimeSync, Panic, Allocation, EnumerationIndication, RawCommand, RpmCommand, EscStatus,
                          EscStatusExtended, RpmSensor, ArmingStatus, SafetyState, BeepCommand, LightsCommand, LogMessage, KeyValue,
                          FlexDebug, NodeStats, CanStats, GlobalTime, RawImu, GnssFix, GnssFix2, GnssAuxiliary, CircuitStatus, BatteryInfo,
                          DeviceTemperature, ActuatorArrayCommand, ActuatorStatus, TunnelBroadcast, TunnelTargetted>();
}

// Calls f.template operator()<Request, Response>() for each service.
template <class F>
constexpr void for_each_service(F&& f) {
  f.template operator()<GetNodeInfo, GetNodeInfoResponse>();
  f.template operator()<GetDataTypeInfo, GetDataTypeInfoResponse>();
  f.template operator()<GetTransportStats, GetTransportStatsResponse>();
  f.template operator()<RestartNode, RestartNodeResponse>();
  f.template operator()<ParamExecuteOpcode, ParamExecuteOpcodeResponse>();
  f.template operator()<ParamGetSet, ParamGetSetResponse>();
  f.template operator()<EnumerationBegin, EnumerationBeginResponse>();
  f.template operator()<BeginFirmwareUpdate, BeginFirmwareUpdateResponse>();
  f.template operator()<FileGetInfo, FileGetInfoResponse>();
  f.template operator()<GetDirectoryEntryInfo, GetDirectoryEntryInfoResponse>();
  f.template operator()<FileDelete, FileDeleteResponse>();
  f.template operator()<FileRead, FileReadResponse>();
  f.template operator()<FileWrite, FileWriteResponse>();
  f.template operator()<TunnelCall, TunnelCallResponse>();
}

}  // namespace rotorloop::protocols
