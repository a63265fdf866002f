#include "bench/stand/instruments/poll_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/base/error.hpp"
#include "host/base/nearest.hpp"

namespace rotorloop::modbus {
namespace {

// What must come by one read: a channel, or one with its sign.
struct Span {
  int fc = 3;
  int begin = 0, end = 0;
  std::vector<std::size_t> channels;
};

std::vector<bool> needed(const Profile& p, const std::vector<std::string>& wanted) {
  std::vector<bool> need(p.channels.size(), wanted.empty());
  std::vector<std::string> names;
  for (const Channel& c : p.channels) names.push_back(c.name);
  for (const std::string& name : wanted) {
    bool found = false;
    for (std::size_t i = 0; i < p.channels.size(); ++i)
      if (p.channels[i].name == name) need[i] = found = true;
    if (!found)
      throw Error({p.path.generic_string(), fmt::format("{} has no channel \"{}\"", p.title(), name), "",
                   fmt::format("{}use one of: {}", did_you_mean(name, names), fmt::join(names, ", "))});
  }
  for (std::size_t i = 0; i < p.channels.size(); ++i)
    if (need[i])
      for (const auto& other : {p.channels[i].sign, p.channels[i].scale_of, p.channels[i].when})
        if (other) need[other->channel] = true;  // they depend on nothing themselves, or on a channel that does not
  return need;
}

// Joins spans that touch, overlap, or leave at most max_gap registers between them.
std::vector<ReadGroup> join(std::vector<Span> spans, const Profile& p) {
  std::stable_sort(spans.begin(), spans.end(), [](const Span& a, const Span& b) { return a.fc != b.fc ? a.fc < b.fc : a.begin < b.begin; });
  std::vector<ReadGroup> groups;
  for (const Span& s : spans) {
    ReadGroup* last = groups.empty() ? nullptr : &groups.back();
    const int last_end = last ? last->address + last->count : 0;
    const bool joins =
        last && last->fc == s.fc && s.begin - last_end <= p.max_gap && std::max(last_end, s.end) - last->address <= p.max_registers;
    if (!joins) {
      groups.push_back({s.fc, static_cast<std::uint16_t>(s.begin), static_cast<std::uint16_t>(s.end - s.begin), {}});
      last = &groups.back();
    } else {
      last->count = static_cast<std::uint16_t>(std::max(last_end, s.end) - last->address);
    }
    for (const std::size_t c : s.channels)
      if (std::find(last->channels.begin(), last->channels.end(), c) == last->channels.end()) last->channels.push_back(c);
  }
  return groups;
}

Span span_of(const Profile& p, std::size_t i) {
  const Channel& c = p.channels[i];
  Span s{c.fc, c.address, c.address + static_cast<int>(c.registers()), {}};
  if (c.sign) {
    const Channel& word = p.channels[c.sign->channel];
    s.begin = std::min<int>(s.begin, word.address);
    s.end = std::max<int>(s.end, word.address + static_cast<int>(word.registers()));
    s.channels.push_back(c.sign->channel);
  }
  s.channels.push_back(i);
  return s;
}

// A slow channel that a fast read brings anyway costs nothing.
bool rides_along(const Span& s, std::vector<ReadGroup>& groups) {
  for (ReadGroup& g : groups)
    if (g.fc == s.fc && g.address <= s.begin && s.end <= g.address + g.count) {
      g.channels.insert(g.channels.end(), s.channels.begin(), s.channels.end());
      return true;
    }
  return false;
}

}  // namespace

PollPlan make_plan(const Profile& p, const std::vector<std::string>& wanted) {
  const std::vector<bool> need = needed(p, wanted);
  PollPlan plan;
  for (const PollRate rate : {PollRate::fast, PollRate::slow, PollRate::once}) {
    std::vector<Span> spans;
    for (std::size_t i = 0; i < p.channels.size(); ++i) {
      if (!need[i] || p.channels[i].rate != rate) continue;
      const Span s = span_of(p, i);
      if (rate != PollRate::slow || !rides_along(s, plan.fast)) spans.push_back(s);
    }
    (rate == PollRate::fast ? plan.fast : rate == PollRate::slow ? plan.slow : plan.once) = join(std::move(spans), p);
  }
  return plan;
}

std::int64_t exchange_ns(const ReadGroup& g, const ExchangeTiming& t, std::int64_t turnaround_ns) {
  return t.gap_ns + 8 * t.character_ns + turnaround_ns + (5 + 2 * std::int64_t{g.count}) * t.character_ns;
}

namespace {
std::int64_t ns(double ms) { return std::llround(ms * 1e6); }
}  // namespace

ExchangeTiming rtu_timing(const Profile& p, const SerialFormat& format) {
  const std::int64_t character = format.character_ns();
  return {character, std::max(ns(p.gap_ms), frame_gap_ns(format.baud, character)), ns(p.timeout_ms),
          std::max(ns(p.byte_timeout_ms), 4 * character), ns(p.late_max_ms)};
}
ExchangeTiming tcp_timing(const Profile& p) { return {0, 0, ns(p.timeout_ms), ns(p.timeout_ms), ns(p.late_max_ms)}; }

SerialFormat serial_format(const Profile& p, int baud) { return {baud ? baud : p.baud.front(), p.parity, p.stop_bits}; }

}  // namespace rotorloop::modbus
