// One value from the registers of its channel, and back: scale, range, coded negatives, signs and scales that stand in other registers.
#pragma once
#include <functional>
#include <optional>

#include "bench/stand/instruments/profile.hpp"

namespace rotorloop::modbus {

enum class Quality : std::uint8_t {
  good,
  not_available,  // the device says that it has no measurement, or a float that is none
  out_of_range,   // a raw value outside the channel's range
  unknown_scale,  // the register with the scale was not read yet, or holds what the profile does not list
  absent,         // `when` says that this device has no such channel
};
std::string_view name(Quality quality);

struct ChannelValue {
  double value = 0.0;  // in the channel's unit; meaningful when good
  Quality quality = Quality::not_available;
  std::uint64_t raw = 0;
};

// Raw bits of the channel with this index; none when it was not read yet.
using RawLookup = std::function<std::optional<std::uint64_t>(std::size_t channel)>;

ChannelValue decode(const Channel& channel, std::uint64_t raw, const RawLookup& others);

// What a device holds for a value: the raw bits, and the sign bit of the other channel where there is one. None when it cannot hold it.
struct EncodedValue {
  std::uint64_t raw = 0;
  bool negative = false;  // for Channel::sign
};
std::optional<EncodedValue> encode(const Channel& channel, double value, const RawLookup& others);

}  // namespace rotorloop::modbus
