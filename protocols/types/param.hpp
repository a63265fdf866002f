// Parameters over the bus, enumeration of ESCs, and the allocation of node ids (docs/wire.md §2).
#pragma once
#include <cstddef>
#include <cstdint>

#include "protocols/dsdl.hpp"
#include "protocols/transfer.hpp"

namespace rotorloop::protocols {

inline constexpr std::size_t kMaxParameterName = 92;

// A union: the member that `kind` names is the one that counts.
struct ParamValue {
  static constexpr const char* kName = "uavcan.protocol.param.Value";
  enum class Kind : std::uint8_t { empty, integer, real, boolean, string };
  Kind kind = Kind::empty;
  std::int64_t integer = 0;
  float real = 0.0f;
  std::uint8_t boolean = 0;
  Text<128> string{};
  friend constexpr bool operator==(const ParamValue&, const ParamValue&) = default;

  static constexpr ParamValue of(std::int64_t v) { return {.kind = Kind::integer, .integer = v}; }
  static constexpr ParamValue of(float v) { return {.kind = Kind::real, .real = v}; }
  static constexpr ParamValue of(bool v) { return {.kind = Kind::boolean, .boolean = v ? std::uint8_t{1} : std::uint8_t{0}}; }

  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    constexpr std::size_t kMembers = 5;
    f.member(0, kMembers, "empty", v.kind, [&](auto& g, const char* name) { g.group("uavcan.protocol.param.Empty", name, [](auto&) {}); });
    f.member(1, kMembers, "integer_value", v.kind, [&](auto& g, const char* name) { g.value(name, i(64), v.integer); });
    f.member(2, kMembers, "real_value", v.kind, [&](auto& g, const char* name) { g.value(name, kFloat32, v.real); });
    f.member(3, kMembers, "boolean_value", v.kind, [&](auto& g, const char* name) { g.value(name, u(8), v.boolean); });
    f.member(4, kMembers, "string_value", v.kind, [&](auto& g, const char* name) { g.items(name, u(8), v.string.items, v.string.count); });
  }
};

struct NumericValue {
  static constexpr const char* kName = "uavcan.protocol.param.NumericValue";
  enum class Kind : std::uint8_t { empty, integer, real };
  Kind kind = Kind::empty;
  std::int64_t integer = 0;
  float real = 0.0f;
  friend constexpr bool operator==(const NumericValue&, const NumericValue&) = default;

  static constexpr NumericValue of(std::int64_t v) { return {.kind = Kind::integer, .integer = v}; }
  static constexpr NumericValue of(float v) { return {.kind = Kind::real, .real = v}; }

  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    constexpr std::size_t kMembers = 3;
    f.member(0, kMembers, "empty", v.kind, [&](auto& g, const char* name) { g.group("uavcan.protocol.param.Empty", name, [](auto&) {}); });
    f.member(1, kMembers, "integer_value", v.kind, [&](auto& g, const char* name) { g.value(name, i(64), v.integer); });
    f.member(2, kMembers, "real_value", v.kind, [&](auto& g, const char* name) { g.value(name, kFloat32, v.real); });
  }
};

// An empty value reads, any other one sets. A name that is not empty goes before the index.
struct ParamGetSet {
  static constexpr DataType kType{.service = true, .id = 11, .signature = 0xA7B622F939D1A4D5};
  static constexpr const char* kName = "uavcan.protocol.param.GetSet";
  std::uint16_t index = 0;  // 13 bits
  ParamValue value{};
  Text<kMaxParameterName> name{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("index", u(13), v.index);
    f.nested("value", v.value);
    f.tail("name", u(8), v.name.items, v.name.count);
  }
};

// Empty value and empty name: no such parameter. A set that was refused answers the old value.
struct ParamGetSetResponse {
  static constexpr DataType kType = ParamGetSet::kType;
  static constexpr const char* kName = ParamGetSet::kName;
  ParamValue value{}, default_value{};
  NumericValue max_value{}, min_value{};
  Text<kMaxParameterName> name{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.padding(5);
    f.nested("value", v.value);
    f.padding(5);
    f.nested("default_value", v.default_value);
    f.padding(6);
    f.nested("max_value", v.max_value);
    f.padding(6);
    f.nested("min_value", v.min_value);
    f.tail("name", u(8), v.name.items, v.name.count);
  }
};

struct ParamExecuteOpcode {
  static constexpr DataType kType{.service = true, .id = 10, .signature = 0x3B131AC5EB69D2CD};
  static constexpr const char* kName = "uavcan.protocol.param.ExecuteOpcode";
  static constexpr std::uint8_t kSave = 0, kErase = 1;
  std::uint8_t opcode = 0;
  std::int64_t argument = 0;  // 48 bits, reserved
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("opcode", u(8), v.opcode);
    f.value("argument", i(48), v.argument);
  }
};

struct ParamExecuteOpcodeResponse {
  static constexpr DataType kType = ParamExecuteOpcode::kType;
  static constexpr const char* kName = ParamExecuteOpcode::kName;
  std::int64_t argument = 0;
  bool ok = false;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("argument", i(48), v.argument);
    f.value("ok", kBool, v.ok);
  }
};

struct EnumerationBegin {
  static constexpr DataType kType{.service = true, .id = 15, .signature = 0x196AE06426A3B5D8};
  static constexpr const char* kName = "uavcan.protocol.enumeration.Begin";
  static constexpr std::uint16_t kCancel = 0, kForever = 65535;
  std::uint16_t timeout_s = kCancel;
  Text<kMaxParameterName> parameter{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("timeout_sec", u(16), v.timeout_s);
    f.tail("parameter_name", u(8), v.parameter.items, v.parameter.count);
  }
};

struct EnumerationBeginResponse {
  static constexpr DataType kType = EnumerationBegin::kType;
  static constexpr const char* kName = EnumerationBegin::kName;
  enum class Error : std::uint8_t { ok = 0, invalid_mode = 1, invalid_parameter = 2, unsupported = 3, unknown = 255 };
  Error error = Error::ok;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("error", u(8), v.error);
  }
};

struct EnumerationIndication {
  static constexpr DataType kType{.service = false, .id = 380, .signature = 0x884CB63050A84F35};
  static constexpr const char* kName = "uavcan.protocol.enumeration.Indication";
  NumericValue value{};
  Text<kMaxParameterName> parameter{};
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.padding(6);
    f.nested("value", v.value);
    f.tail("parameter_name", u(8), v.parameter.items, v.parameter.count);
  }
};

// Requests are anonymous (source node 0) and carry at most 6 bytes of the unique id; the allocator repeats all that it knows.
struct Allocation {
  static constexpr DataType kType{.service = false, .id = 1, .signature = 0x0B2A812620A11D40};
  static constexpr const char* kName = "uavcan.protocol.dynamic_node_id.Allocation";
  static constexpr std::size_t kMaxIdBytesInRequest = 6;
  static constexpr std::uint64_t kRequestPeriodMin_us = 600'000, kRequestPeriodMax_us = 1'000'000, kFollowUpMax_us = 400'000,
                                 kAllocatorForgets_us = 500'000;
  static constexpr std::uint8_t kAnyNode = 0, kFirstToTry = 125;
  std::uint8_t node_id = kAnyNode;
  bool first_part = false;
  BoundedArray<std::uint8_t, 16> unique_id{};
  friend constexpr bool operator==(const Allocation&, const Allocation&) = default;
  template <class F, class Self>
  static constexpr void describe(F& f, Self& v) {
    f.value("node_id", u(7), v.node_id);
    f.value("first_part_of_unique_id", kBool, v.first_part);
    f.tail("unique_id", u(8), v.unique_id.items, v.unique_id.count);
  }
};

}  // namespace rotorloop::protocols
