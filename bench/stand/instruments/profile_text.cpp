#include "bench/stand/instruments/profile_text.hpp"

#include <fmt/format.h>

#include "bench/stand/instruments/poll_plan.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::modbus {

std::string quirks_text(const Profile& p, const Channel& c) {
  std::string text;
  const auto add = [&text](const std::string& more) { text += (text.empty() ? "" : ", ") + more; };
  if (c.order != WordOrder::ABCD) add(std::string(name(c.order)));
  if (c.range)
    add(fmt::format("raw {} … {} is {} … {}", number_text(c.range->raw_min), number_text(c.range->raw_max), number_text(c.range->value_min),
                    number_text(c.range->value_max)));
  if (c.scale != 1.0) add("× " + number_text(c.scale));
  if (c.offset != 0.0) add("+ " + number_text(c.offset));
  if (c.scale_of) add(fmt::format("× by {}", p.channels[c.scale_of->channel].name));
  if (c.negative_from) add(fmt::format("negative from {}", number_text(*c.negative_from)));
  if (c.sign) add(fmt::format("sign: {} bit {}", p.channels[c.sign->channel].name, c.sign->shift));
  if (c.when) add(fmt::format("when {} is one of {}", p.channels[c.when->channel].name, fmt::join(c.when_in, ", ")));
  if (!c.not_available.empty()) add(fmt::format("none: {:#06x}", fmt::join(c.not_available, ", ")));
  for (const auto& [bit, number] : c.bits) add(fmt::format("{} {}", number, bit));
  return text;
}

std::string evidence_text(const Profile& p) {
  return p.evidence == "hardware" ? "hardware"
         : p.evidence == "manual" ? "manual: copied from documents, not seen on hardware"
                                  : "emulated: made up for tests";
}

std::string profile_text(const Profile& p) {
  std::string out = fmt::format("{}\nsource    {}\nevidence  {}\n", p.title(), p.source, evidence_text(p));
  out += fmt::format(
      "bus       {} baud, 8{}{}{}, factory address {}; at most {} registers a read; answer within {} ms, never after {} ms\n          {}\n",
      fmt::join(p.baud, ", "), p.parity, p.stop_bits, p.tcp ? ", TCP" : "", p.slave, p.max_registers, number_text(p.timeout_ms),
      number_text(p.late_max_ms), p.bus_source);
  out += fmt::format("\n{:<18} {:>3} {:>6} {:<4} {:<5} {:<12} {:<6} {}\n", "channel", "fc", "addr", "type", "rate", "quantity", "unit", "");
  for (const Channel& c : p.channels) {
    out += fmt::format("{:<18} {:>3} {:>6} {:<4} {:<5} {:<12} {:<6} {}\n", c.name, c.fc, c.address, name(c.type), name(c.rate), c.quantity,
                       c.unit, quirks_text(p, c));
    if (!c.note.empty()) out += fmt::format("{:<18} {}\n", "", c.note);
    if (c.source != p.source) out += fmt::format("{:<18} source: {}\n", "", c.source);
  }
  for (const DeviceCommand& c : p.commands) {
    out += fmt::format("command {}{}:", c.name, c.wears ? " (wears the memory: asked for explicitly only)" : "");
    for (const CommandStep& s : c.steps) out += fmt::format(" fc {} addr {} value {}", s.fc, s.address, fmt::join(s.values, " "));
    out += c.source == p.source ? "\n" : fmt::format("; {}\n", c.source);
  }
  const SerialFormat format = serial_format(p);
  std::int64_t cycle = 0;
  for (const ReadGroup& g : make_plan(p).fast) {
    out += fmt::format("read fc {} registers {} … {}\n", g.fc, g.address, g.address + g.count - 1);
    cycle += exchange_ns(g, rtu_timing(p, format), static_cast<std::int64_t>(p.turnaround_ms * 1e6));
  }
  if (cycle)
    out += fmt::format("fast channels at {}: {:.0f} Hz, with a turnaround of {} ms, alone on the bus\n", text(format),
                       1e9 / static_cast<double>(cycle), number_text(p.turnaround_ms));
  return out;
}

}  // namespace rotorloop::modbus
