// Answers GetSet: first the parameters, in the order of the table, then the values of a commissioning ("commission…"), which are never
// stored, then values that can only be read ("stat_…"). Index without gaps, empty answer at the end; a name goes before the index. What is
// set is clamped into its range and kept apart until the motor is off; a value that contradicts another parameter is refused, and the
// answer shows the old one.
#pragma once
#include <cstddef>
#include <cstdint>

#include "firmware/core/node/commission_service.hpp"
#include "firmware/core/node/node_report.hpp"
#include "firmware/core/node/parameters.hpp"
#include "protocols/types/param.hpp"

namespace rotorloop::firmware {

// What can be read beside the parameters.
struct Readings {
  WhyOff why = WhyOff::turning;
  const FaultLog* faults = nullptr;
  const Telemetry* motor = nullptr;
  std::uint32_t commanders = 0, conflicts = 0;
  const Parameters* started = nullptr;  // those of the last start
};

class ParameterServer {
 public:
  static constexpr std::size_t kNumbers = 11, kReadings = kNumbers + FaultLog::kKept;
  static constexpr std::size_t kFirstReading = kParameterRanges.size() + kCommissionValues.size(), kCount = kFirstReading + kReadings;

  // `edited`: what the bus sees and sets.
  static protocols::ParamGetSetResponse answer(const protocols::ParamGetSet& request, Parameters& edited, CommissionService& commission,
                                               const Readings& readings) {
    protocols::ParamGetSetResponse r;
    const std::size_t index = index_of(request);
    if (index >= kCount) return r;
    if (index >= kFirstReading) {
      reading(index - kFirstReading, edited, commission, readings, r);
      return r;
    }
    if (index >= kParameterRanges.size()) {
      commission_value(index - kParameterRanges.size(), request.value, commission, r);
      return r;
    }
    const ParameterRange& range = kParameterRanges[index];
    if (request.value.kind != protocols::ParamValue::Kind::empty) set(range, request.value, edited);
    r.name = protocols::Text<protocols::kMaxParameterName>(range.name);
    r.value = value_of(range, range.get(edited));
    r.default_value = value_of(range, range.get(Parameters{}));
    if (range.kind == ParameterKind::boolean) return r;  // limits of a boolean mean nothing
    r.min_value = limit_of(range, range.min);
    r.max_value = limit_of(range, range.max);
    return r;
  }

  // What a request to begin or to end a commissioning asks for; -1: it is none.
  static std::int32_t commission_asked(const protocols::ParamGetSet& request) {
    if (index_of(request) != kParameterRanges.size()) return -1;
    const auto v = number_of(request.value);
    return v && *v >= 0.0f && *v <= kCommissionValues[0].max ? static_cast<std::int32_t>(*v) : -1;
  }

 private:
  static std::size_t index_of(const protocols::ParamGetSet& request) {
    if (request.name.count == 0) return request.index;
    std::uint32_t hash = kHashStart;
    for (const std::uint8_t c : request.name.view()) hash = hash_step(hash, c);
    for (std::size_t i = 0; i < kCount; ++i) {
      if (kHashes[i] == hash && request.name.is(name_of(i))) return i;
    }
    return kCount;
  }
  static constexpr const char* name_of(std::size_t i) {
    return i < kParameterRanges.size() ? kParameterRanges[i].name
           : i < kFirstReading         ? kCommissionValues[i - kParameterRanges.size()].name
                                       : kReadingNames[i - kFirstReading];
  }
  // None for what is no number, not-a-number included.
  static constexpr std::optional<float> number_of(const protocols::ParamValue& v) {
    using Kind = protocols::ParamValue::Kind;
    if (v.kind == Kind::empty || v.kind == Kind::string) return std::nullopt;
    const float asked = v.kind == Kind::real      ? v.real
                        : v.kind == Kind::integer ? static_cast<float>(v.integer)
                        : v.boolean != 0          ? 1.0f
                                                  : 0.0f;
    return asked == asked ? std::optional(asked) : std::nullopt;
  }

  static void commission_value(std::size_t i, const protocols::ParamValue& asked, CommissionService& commission,
                               protocols::ParamGetSetResponse& r) {
    const CommissionValue& row = kCommissionValues[i];
    if (const auto v = number_of(asked)) commission.set_value(i, *v);
    const auto as_value = [&](float v) { return row.integer ? protocols::ParamValue::of(whole(v)) : protocols::ParamValue::of(v); };
    const auto as_limit = [&](float v) { return row.integer ? protocols::NumericValue::of(whole(v)) : protocols::NumericValue::of(v); };
    r.name = protocols::Text<protocols::kMaxParameterName>(row.name);
    r.value = as_value(commission.value(i));
    r.default_value = as_value(0.0f);
    r.min_value = as_limit(0.0f);
    r.max_value = as_limit(row.max);
  }

  static constexpr void set(const ParameterRange& range, const protocols::ParamValue& v, Parameters& edited) {
    const auto asked = number_of(v);
    if (!asked) return;
    Parameters candidate = edited;
    range.set(candidate, clamp_parameter(range, *asked));
    // One that was wrong before may be corrected step by step: only a new contradiction is refused.
    if (check(candidate) && !check(edited)) return;
    edited = candidate;
  }

  // Over 32 bits: from a float to 64 at once is double precision on the target.
  static constexpr std::int64_t whole(float v) { return static_cast<std::int32_t>(v); }
  static constexpr protocols::ParamValue value_of(const ParameterRange& range, float v) {
    switch (range.kind) {
      case ParameterKind::boolean:
        return protocols::ParamValue::of(v != 0.0f);
      case ParameterKind::integer:
        return protocols::ParamValue::of(whole(v));
      default:
        return protocols::ParamValue::of(v);
    }
  }
  static constexpr protocols::NumericValue limit_of(const ParameterRange& range, float v) {
    return range.kind == ParameterKind::integer ? protocols::NumericValue::of(whole(v)) : protocols::NumericValue::of(v);
  }

  static constexpr std::array<const char*, kReadings> kReadingNames{
      "stat_why_off", "stat_faults", "stat_errors",     "stat_commanders", "stat_conflicts", "stat_trips",   "stat_energy", "stat_winding",
      "stat_restart", "stat_duty_q", "stat_commission", "stat_fault_1",    "stat_fault_2",   "stat_fault_3", "stat_fault_4"};

  static constexpr std::array<std::uint32_t, kCount> make_hashes() {
    std::array<std::uint32_t, kCount> hashes{};
    for (std::size_t i = 0; i < kCount; ++i) hashes[i] = parameter_hash(name_of(i));
    return hashes;
  }
  static const std::array<std::uint32_t, kCount> kHashes;

  // What was set and is not in force before a restart: the first names, and how many more.
  static constexpr TextLine waiting_for_restart(const Parameters& edited, const Parameters& started) {
    constexpr std::int32_t kNamed = 4;
    TextLine line;
    std::int32_t count = 0;
    for (const ParameterRange& r : kParameterRanges) {
      if (r.in_force != InForce::at_start || r.get(edited) == r.get(started)) continue;
      if (++count <= kNamed) line.add(count > 1 ? ", " : "").add(r.name);
    }
    if (count > kNamed) line.add(" and ").add(count - kNamed).add(" more");
    return count == 0 ? TextLine("none") : line;
  }

  static void reading(std::size_t i, const Parameters& edited, const CommissionService& commission, const Readings& from,
                      protocols::ParamGetSetResponse& r) {
    r.name = protocols::Text<protocols::kMaxParameterName>(kReadingNames[i]);
    const auto text = [&](const TextLine& line) {
      r.value.kind = protocols::ParamValue::Kind::string;
      r.value.string.assign(line.text().view());
    };
    const auto number = [&](std::uint32_t v) { r.value = protocols::ParamValue::of(static_cast<std::int64_t>(v)); };
    const Telemetry motor = from.motor != nullptr ? *from.motor : Telemetry{};
    if (i >= kNumbers) return text(describe(from.faults != nullptr ? from.faults->get(i - kNumbers) : FaultRecord{}));
    switch (i) {
      case 0:
        return text(why_line(from.why, motor));
      case 1:
        return number(from.faults != nullptr ? from.faults->count() : 0u);
      case 2:
        return number(motor.error_count);
      case 3:
        return number(from.commanders);
      case 4:
        return number(from.conflicts);
      case 5:
        return number(motor.trips);
      case 6:
        r.value = protocols::ParamValue::of(motor.energy_J);
        return;
      case 7:
        r.value = protocols::ParamValue::of(motor.winding_K);
        return;
      case 8:
        return text(from.started != nullptr ? waiting_for_restart(edited, *from.started) : TextLine("none"));
      case 9:
        r.value = protocols::ParamValue::of(motor.duty_q);
        return;
      default:
        return text(commission.state_text());
    }
  }
};

inline constexpr std::array<std::uint32_t, ParameterServer::kCount> ParameterServer::kHashes = ParameterServer::make_hashes();

}  // namespace rotorloop::firmware
