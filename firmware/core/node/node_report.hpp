// What an ESC has to say besides numbers: why it is not turning, and the last faults; as codes and as text.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware/core/interface.hpp"
#include "firmware/core/node/command_input.hpp"
#include "firmware/core/node/text_line.hpp"

namespace rotorloop::firmware {

enum class WhyOff : std::uint8_t {
  turning,
  parameters,   // out of range, or the store is empty or damaged: save valid ones
  starting_up,  // calibration and self-test
  restarting,   // on its way into a restart or an update
  duplicate,    // another node has this node id or this esc_index
  no_index,     // esc_index is not assigned
  not_armed,
  no_order,  // none heard since arming
  order_expired,
  zero_first,  // after arming an order of zero is awaited
  order_zero,
  motor,  // the motor control refuses: a fault, or its reason in the telemetry
  commissioning,
};

constexpr const char* why_text(WhyOff why) {
  constexpr std::array<const char*, 13> kTexts{
      "turning",       "parameters",    "starting up",  "restarting",    "duplicate node id or esc_index",
      "no esc_index",  "not armed",     "no order",     "order expired", "zero throttle first",
      "order is zero", "motor control", "commissioning"};
  return kTexts[static_cast<std::size_t>(why)];
}

constexpr const char* fault_text(Fault fault) {
  constexpr std::array<const char*, 9> kTexts{"none",         "overcurrent", "undervoltage",    "overvoltage", "stall",
                                              "start failed", "sensor",      "overtemperature", "self-test"};
  return kTexts[static_cast<std::size_t>(fault) < kTexts.size() ? static_cast<std::size_t>(fault) : 0];
}

constexpr const char* blocked_text(Blocked blocked) {
  constexpr std::array<const char*, 14> kTexts{
      "nothing",         "parameters that this board cannot serve", "calibrating",         "current sensor",  "no order",
      "stale order",     "too many faults: order zero first",       "pause after a fault", "overvoltage",     "undervoltage",
      "overtemperature", "temperature sensor open or short",        "self-test",           "self-test failed"};
  return kTexts[static_cast<std::size_t>(blocked) < kTexts.size() ? static_cast<std::size_t>(blocked) : 0];
}

// Legs A, B, C are phases U, V, W.
constexpr TextLine broken_line(const BridgeReport& found) {
  const Broken broken = found.broken;
  constexpr std::array<const char*, 3> kLegs{"A", "B", "C"};
  if (broken == Broken::none) return TextLine{};
  if (broken == Broken::several) return "several parts open, or no motor";
  const bool high = broken == Broken::high_open || broken == Broken::high_short;
  const bool open = broken != Broken::high_short && broken != Broken::low_short;
  TextLine line(broken == Broken::phase_open ? "phase " : "FET ");
  line.add(kLegs[found.leg % 3u]);
  if (broken != Broken::phase_open) line.add(high ? " high" : " low");
  return line.add(open ? " open" : " short");
}

constexpr TextLine why_line(WhyOff why, const Telemetry& motor) {
  TextLine line(why_text(why));
  if (why == WhyOff::motor && motor.blocked != Blocked::none) line.add(", ").add(blocked_text(motor.blocked));
  if (why == WhyOff::motor && motor.blocked == Blocked::broken) return line.add(", ").add(broken_line(motor.self_test));
  if (why == WhyOff::motor && motor.fault != Fault::none) line.add(", ").add(fault_text(motor.fault));
  return line;
}

// A fault as it was seen by the node; the newest of the last four can be read over the bus.
struct FaultRecord {
  Fault fault = Fault::none;
  MotorState state = MotorState::off;  // before it
  std::uint32_t uptime_s = 0;
  float bus_V = 0.0f, current_A = 0.0f, temperature_K = 0.0f;
  std::int32_t rpm = 0;
  BridgeReport self_test{};
};

constexpr TextLine describe(const FaultRecord& r) {
  TextLine line(fault_text(r.fault));
  if (r.fault == Fault::none) return line;
  if (r.fault == Fault::self_test) line.add(": ").add(broken_line(r.self_test));
  line.add(" at ").add_tenths(r.bus_V).add(" V ").add_tenths(r.current_A).add(" A ").add(r.rpm).add(" rpm ");
  return line.add_tenths(r.temperature_K - 273.15f).add(" C, uptime ").add(static_cast<std::int32_t>(r.uptime_s)).add(" s");
}

class FaultLog {
 public:
  static constexpr std::size_t kKept = 4;
  constexpr void add(const FaultRecord& r) {
    for (std::size_t i = kKept - 1; i > 0; --i) records_[i] = records_[i - 1];
    records_[0] = r;
    ++count_;
  }
  constexpr const FaultRecord& get(std::size_t ago) const { return records_[ago]; }
  constexpr std::uint32_t count() const { return count_; }

 private:
  std::array<FaultRecord, kKept> records_{};
  std::uint32_t count_ = 0;
};

}  // namespace rotorloop::firmware
