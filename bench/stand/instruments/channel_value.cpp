#include "bench/stand/instruments/channel_value.hpp"

#include <algorithm>
#include <cmath>

namespace rotorloop::modbus {
namespace {

// The factor of the moment; none when the other register does not say.
std::optional<double> factor(const Channel& c, const RawLookup& others) {
  if (!c.scale_of) return c.scale;
  const auto raw = others(c.scale_of->channel);
  if (!raw) return std::nullopt;
  const auto found = c.scale_map.find(c.scale_of->part(*raw));
  return found == c.scale_map.end() ? std::nullopt : std::optional(found->second * c.scale);
}

bool is_there(const Channel& c, const RawLookup& others) {
  if (!c.when) return true;
  const auto raw = others(c.when->channel);
  return raw && std::find(c.when_in.begin(), c.when_in.end(), c.when->part(*raw)) != c.when_in.end();
}

}  // namespace

std::string_view name(Quality q) {
  switch (q) {
    case Quality::good:
      return "good";
    case Quality::not_available:
      return "not available";
    case Quality::out_of_range:
      return "out of range";
    case Quality::unknown_scale:
      return "unknown scale";
    case Quality::absent:
      return "not there";
  }
  return "";
}

ChannelValue decode(const Channel& c, std::uint64_t raw, const RawLookup& others) {
  ChannelValue v{0.0, Quality::good, raw};
  const auto refuse = [&](Quality why) {
    v.quality = why;
    return v;
  };
  if (!is_there(c, others)) return refuse(Quality::absent);
  if (std::find(c.not_available.begin(), c.not_available.end(), raw) != c.not_available.end()) return refuse(Quality::not_available);
  double number = to_number(raw, c.type);
  if (!std::isfinite(number)) return refuse(Quality::not_available);
  if (c.range) {
    if (number < c.range->raw_min || number > c.range->raw_max) return refuse(Quality::out_of_range);
    v.value = c.range->value_min +
              (number - c.range->raw_min) * (c.range->value_max - c.range->value_min) / (c.range->raw_max - c.range->raw_min);
    return v;
  }
  if (c.negative_from && number >= *c.negative_from) number = *c.negative_from - number;
  if (c.sign) {
    const auto word = others(c.sign->channel);
    if (!word) return refuse(Quality::not_available);
    if (c.sign->part(*word)) number = -number;
  }
  const auto scale = factor(c, others);
  if (!scale) return refuse(Quality::unknown_scale);
  v.value = number * *scale + c.offset;
  return v;
}

std::optional<EncodedValue> encode(const Channel& c, double value, const RawLookup& others) {
  EncodedValue out;
  double number = 0.0;
  if (c.range) {
    const double share = (value - c.range->value_min) / (c.range->value_max - c.range->value_min);
    number = std::nearbyint(c.range->raw_min + share * (c.range->raw_max - c.range->raw_min));
    if (number < c.range->raw_min || number > c.range->raw_max) return std::nullopt;
  } else {
    const auto scale = factor(c, others);
    if (!scale) return std::nullopt;
    number = (value - c.offset) / *scale;
    const bool integer = c.type != WordType::f32 && c.type != WordType::f64;
    if (integer) number = std::nearbyint(number);
    if (c.sign && number < 0.0) {
      out.negative = true;
      number = -number;
    }
    if (c.negative_from) {
      if (std::abs(number) >= *c.negative_from) return std::nullopt;
      if (number < 0.0) number = *c.negative_from - number;
    }
  }
  const auto raw = to_bits(number, c.type);
  if (!raw || std::find(c.not_available.begin(), c.not_available.end(), *raw) != c.not_available.end()) return std::nullopt;
  out.raw = *raw;
  return out;
}

}  // namespace rotorloop::modbus
