#include "bench/stand/instruments/slave_device.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bench/stand/instruments/poll_plan.hpp"
#include "host/base/error.hpp"
#include "host/base/nearest.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::modbus {
namespace {

constexpr std::uint8_t kIllegalFunction = 1, kIllegalAddress = 2, kIllegalValue = 3;

std::vector<std::uint8_t> exception(std::uint8_t fc, std::uint8_t code) { return {static_cast<std::uint8_t>(fc | 0x80u), code}; }
std::uint16_t word_of(std::span<const std::uint8_t> pdu, std::size_t i) { return static_cast<std::uint16_t>((pdu[i] << 8) | pdu[i + 1]); }

}  // namespace

std::vector<std::uint8_t> RegisterSlave::answer(std::span<const std::uint8_t> pdu, std::int64_t now_ns) {
  if (pdu.empty()) return {};
  const std::uint8_t fc = pdu[0];
  if (fc != 3 && fc != 4 && fc != 6 && fc != 16) return exception(fc, kIllegalFunction);
  if (pdu.size() < 5) return exception(fc, kIllegalValue);
  const std::uint16_t address = word_of(pdu, 1), count = word_of(pdu, 3);
  if (fc == 6) return write(address, count) ? std::vector<std::uint8_t>(pdu.begin(), pdu.begin() + 5) : exception(fc, kIllegalAddress);
  if (count == 0 || count > (fc == 16 ? 123 : 125)) return exception(fc, kIllegalValue);
  if (fc == 16) {
    if (pdu.size() != 6u + 2u * count || pdu[5] != 2 * count) return exception(fc, kIllegalValue);
    for (std::size_t i = 0; i < count; ++i)
      if (!write(static_cast<std::uint16_t>(address + i), word_of(pdu, 6 + 2 * i))) return exception(fc, kIllegalAddress);
    return {pdu.begin(), pdu.begin() + 5};
  }
  for (unsigned i = 0; i < count; ++i)
    if (address + i > 65535u || !readable(fc, static_cast<std::uint16_t>(address + i))) return exception(fc, kIllegalAddress);
  sample(now_ns);
  std::vector<std::uint8_t> out{fc, static_cast<std::uint8_t>(2 * count)};
  for (unsigned i = 0; i < count; ++i) {
    const std::uint16_t v = value(fc, static_cast<std::uint16_t>(address + i));
    out.push_back(static_cast<std::uint8_t>(v >> 8));
    out.push_back(static_cast<std::uint8_t>(v & 0xFFu));
  }
  return out;
}

SlaveDevice::SlaveDevice(Profile profile) : profile_(std::move(profile)) {
  for (const Channel& c : profile_.channels)
    for (std::size_t i = 0; i < c.registers(); ++i) space(c.fc).emplace(static_cast<std::uint16_t>(c.address + i), 0);
  const PollPlan plan = make_plan(profile_);  // what a read brings in vain, to join registers or a value and its sign, is there too
  for (const auto* groups : {&plan.fast, &plan.slow, &plan.once})
    for (const ReadGroup& g : *groups)
      for (unsigned i = 0; i < g.count; ++i) space(g.fc).emplace(static_cast<std::uint16_t>(g.address + i), std::uint16_t{0});
  // Registers that others depend on hold something that the profile knows, so that the device is one of those it describes.
  for (const Channel& c : profile_.channels) {
    if (c.scale_of && !c.scale_map.contains(c.scale_of->part(raw(c.scale_of->channel))))
      set_raw(c.scale_of->channel, raw(c.scale_of->channel) | ((c.scale_map.begin()->first << c.scale_of->shift) & c.scale_of->mask));
    if (c.when && raw(c.when->channel) == 0) set_raw(c.when->channel, c.when_in.front());
  }
}

std::uint64_t SlaveDevice::raw(std::size_t index) const {
  const Channel& c = profile_.channels[index];
  std::vector<std::uint16_t> words;
  for (std::size_t i = 0; i < c.registers(); ++i) words.push_back(value(c.fc, static_cast<std::uint16_t>(c.address + i)));
  return assemble(words, c.order);
}

void SlaveDevice::set_raw(std::size_t index, std::uint64_t bits) {
  const Channel& c = profile_.channels[index];
  std::vector<std::uint16_t> words(c.registers());
  spread(bits, c.order, words);
  for (std::size_t i = 0; i < words.size(); ++i) space(c.fc)[static_cast<std::uint16_t>(c.address + i)] = words[i];
}

void SlaveDevice::set(std::string_view name, double value) {
  const RawLookup others = [this](std::size_t c) { return std::optional(raw(c)); };
  std::vector<std::string> names;
  for (std::size_t i = 0; i < profile_.channels.size(); ++i) {
    const Channel& c = profile_.channels[i];
    names.push_back(c.name);
    if (c.name != name) continue;
    if (c.when && std::find(c.when_in.begin(), c.when_in.end(), c.when->part(raw(c.when->channel))) == c.when_in.end()) continue;
    const auto encoded = encode(c, value, others);
    if (!encoded)
      throw Error({c.where, fmt::format("channel {} cannot hold {} {}", c.name, number_text(value), c.unit), "",
                   "give a value within its type and range"});
    set_raw(i, encoded->raw);
    if (c.sign) {
      const std::uint64_t word = raw(c.sign->channel);
      set_raw(c.sign->channel, encoded->negative ? word | c.sign->mask : word & ~c.sign->mask);
    }
    return;
  }
  throw Error({profile_.path.generic_string(), fmt::format("{} has no channel \"{}\"", profile_.title(), name), "",
               fmt::format("{}use one of: {}", did_you_mean(std::string(name), names), fmt::join(names, ", "))});
}

void SlaveDevice::sample(std::int64_t now_ns) {
  if (on_sample) on_sample(*this, now_ns);
}
bool SlaveDevice::readable(int fc, std::uint16_t address) const { return space(fc).contains(address); }
std::uint16_t SlaveDevice::value(int fc, std::uint16_t address) const {
  const auto found = space(fc).find(address);
  return found == space(fc).end() ? std::uint16_t{0} : found->second;
}
bool SlaveDevice::write(std::uint16_t address, std::uint16_t value) {
  bool known = holding_.contains(address);
  for (const DeviceCommand& c : profile_.commands)
    for (const CommandStep& s : c.steps) known = known || (address >= s.address && address < s.address + s.values.size());
  if (!known) return false;
  if (holding_.contains(address)) holding_[address] = value;
  if (on_write) on_write(*this, address, value);
  return true;
}

}  // namespace rotorloop::modbus
