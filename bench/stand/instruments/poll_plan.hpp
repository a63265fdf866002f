// Which reads bring all channels of a device: contiguous registers by one read, a channel never cut, a value and its sign together.
#pragma once
#include <vector>

#include "bench/stand/instruments/exchange.hpp"
#include "bench/stand/instruments/profile.hpp"

namespace rotorloop::modbus {

struct ReadGroup {
  int fc = 3;
  std::uint16_t address = 0, count = 0;
  std::vector<std::size_t> channels;  // of the profile, by address
};

struct PollPlan {
  std::vector<ReadGroup> fast, slow, once;
};

// `wanted`: names of the channels to read, with those that they depend on; empty: all. Throws Error (usage) for a name that is none.
PollPlan make_plan(const Profile& profile, const std::vector<std::string>& wanted = {});

// Time that one read needs at least: gap, request, turnaround, answer. `turnaround_ns` counts from the end of the request.
std::int64_t exchange_ns(const ReadGroup& group, const ExchangeTiming& timing, std::int64_t turnaround_ns);

ExchangeTiming rtu_timing(const Profile& profile, const SerialFormat& format);
ExchangeTiming tcp_timing(const Profile& profile);
SerialFormat serial_format(const Profile& profile, int baud = 0);  // 0: the profile's first rate

}  // namespace rotorloop::modbus
