#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "bench/stand/instruments/profile.hpp"
#include "bench/stand/instruments/units.hpp"
#include "host/base/nearest.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::modbus {
namespace {

constexpr std::array kBauds{1200, 2400, 4800, 9600, 14400, 19200, 38400, 57600, 115200, 230400, 460800, 921600};

std::string non_empty(const TomlTable& t, std::string_view key, std::string_view what) {
  std::string text = t.text(key);
  if (text.find_first_not_of(" \t\n") == std::string::npos) t.fail(key, fmt::format("{} is empty", key), "", fmt::format("say {}", what));
  return text;
}

constexpr std::string_view kSourceHelp =
    "where the numbers come from: document with its page, or the code or measurement they were taken from";

void read_bus(const TomlTable& t, Profile& p) {
  for (const auto baud : t.integers("baud", 1200, 921600)) {
    if (std::find(kBauds.begin(), kBauds.end(), baud) == kBauds.end())
      t.fail("baud", fmt::format("baud has {}, which no port offers", baud), "", fmt::format("use rates of: {}", fmt::join(kBauds, ", ")));
    p.baud.push_back(static_cast<int>(baud));
  }
  if (p.baud.empty()) t.fail("baud", "baud is empty", "", "list the rates of the device, the one to use first");
  const std::string format = t.choice("format", {"8N1", "8N2", "8E1", "8E2", "8O1", "8O2"});
  p.parity = format[1];
  p.stop_bits = format[2] - '0';
  p.tcp = t.boolean("tcp", false);
  p.slave = static_cast<int>(t.integer("slave", 1, 247, 1));
  p.max_registers = static_cast<int>(t.integer("max_regs", 1, 125, 125));
  p.max_gap = static_cast<int>(t.integer("max_gap", 0, 124, 0));
  p.gap_ms = t.number("gap_ms", {0.0, 1000.0, "ms"}, 0.0);
  p.timeout_ms = t.number("timeout_ms", {1.0, 10000.0, "ms"});
  p.byte_timeout_ms = t.number("byte_timeout_ms", {0.5, 1000.0, "ms"}, 20.0);
  p.late_max_ms = t.number("late_max_ms", {1.0, 60000.0, "ms"}, std::max(200.0, 2.0 * p.timeout_ms));
  if (p.late_max_ms < p.timeout_ms)
    t.fail("late_max_ms",
           fmt::format("late_max_ms = {} ms is below timeout_ms = {} ms", number_text(p.late_max_ms), number_text(p.timeout_ms)), "",
           "an answer that is still awaited is not late: give at least timeout_ms");
  p.turnaround_ms = t.number("turnaround_ms", {0.0, 10000.0, "ms"}, 2.0);
  if (p.turnaround_ms > p.timeout_ms)
    t.fail("turnaround_ms",
           fmt::format("turnaround_ms = {} ms is above timeout_ms = {} ms", number_text(p.turnaround_ms), number_text(p.timeout_ms)),
           "every read would time out", "raise timeout_ms, or lower turnaround_ms");
  p.bus_source = non_empty(t, "source", kSourceHelp);
}

void read_quantity(const TomlTable& t, Channel& c) {
  c.quantity = t.choice("quantity", {"force", "torque", "voltage", "current", "power", "energy", "temperature", "pressure", "humidity",
                                     "speed", "acceleration", "status", "setting", "raw"});
  const bool plain = c.quantity == "status" || c.quantity == "setting" || c.quantity == "raw";
  c.unit = plain ? t.text("unit", "1") : t.text("unit");
  const ChannelUnit* const unit = find_unit(c.unit);
  const bool fits = unit && (plain || unit->quantity.empty() || unit->quantity == c.quantity);
  if (!fits)
    t.fail("unit", fmt::format("unit = \"{}\" is no unit of {}", c.unit, c.quantity), "",
           fmt::format("use one of: {}", units_of(plain ? "" : c.quantity)));
}

void read_scale(const TomlTable& t, Channel& c) {
  c.scale = t.number("scale", {-1e12, 1e12, "1"}, 1.0);
  if (c.scale == 0.0) t.fail("scale", "scale = 0 leaves nothing", "", "leave it out, or give the factor from raw value to unit");
  c.offset = t.number("offset", {-1e12, 1e12, c.unit}, 0.0);
  if (const auto r = t.optional_table("range")) {
    const auto raw = r->numbers("raw", 2, {-1e15, 1e15, "1"});
    const auto value = r->numbers("value", 2, {-1e12, 1e12, c.unit});
    if (raw[0] >= raw[1])
      r->fail("raw", fmt::format("raw = [{}, {}] does not rise", number_text(raw[0]), number_text(raw[1])), "",
              "give the smaller raw value first");
    if (value[0] == value[1]) r->fail("value", "both ends have the same value", "", "give the values at both ends of raw");
    if (t.has("scale") || t.has("offset"))
      t.fail("range", "range stands beside scale or offset", "", "keep one: range, or scale with offset");
    c.range = Channel::LinearRange{raw[0], raw[1], value[0], value[1]};
  }
  if (t.has("negative_from")) {
    c.negative_from = t.number("negative_from", {1.0, 4294967295.0, "1"});
    if (c.type != WordType::u16 && c.type != WordType::u32)
      t.fail("negative_from", fmt::format("negative_from with type {}", name(c.type)), "the type has a sign already",
             "use it with u16 or u32");
  }
}

void read_raw_lists(const TomlTable& t, Channel& c) {
  const int width = static_cast<int>(16 * c.registers());
  const std::int64_t most = width >= 64 ? std::int64_t{0x7FFFFFFFFFFFFFFF} : (std::int64_t{1} << width) - 1;
  if (t.has("na"))
    for (const auto raw : t.integers("na", 0, most)) c.not_available.push_back(static_cast<std::uint64_t>(raw));
  if (const auto bits = t.optional_table("bits"))
    for (const std::string& key : bits->keys()) c.bits[key] = static_cast<int>(bits->integer(key, 0, width - 1));
}

Channel read_channel(const TomlTable& t, const Profile& p, WordOrder bus_order) {
  Channel c;
  c.where = t.where();
  c.name = non_empty(t, "name", "a short name, such as net");
  if (c.name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_") != std::string::npos)
    t.fail("name", fmt::format("name = \"{}\" has other characters than letters, digits and _", c.name), "",
           "rename it: stand files and CSV headers use the name");
  c.fc = static_cast<int>(t.integer("fc", 3, 4, 3));
  c.address = static_cast<std::uint16_t>(t.integer("addr", 0, 65535));
  c.type = word_type(t.choice("type", {"u16", "s16", "u32", "s32", "f32", "u64", "f64"}));
  if (c.address + c.registers() > 65536u)
    t.fail("addr", fmt::format("addr = {} with type {} passes register 65535", c.address, name(c.type)), "", "correct the address");
  if (static_cast<int>(c.registers()) > p.max_registers)
    t.fail("type", fmt::format("type {} needs {} registers, one read has max_regs = {}", name(c.type), c.registers(), p.max_registers), "",
           "raise max_regs or correct the type");
  c.order = t.has("word_order") ? word_order(t.choice("word_order", {"ABCD", "CDAB", "BADC", "DCBA"})) : bus_order;
  const std::string rate = t.choice("rate", {"fast", "slow", "once"}, "fast");
  c.rate = rate == "fast" ? PollRate::fast : rate == "slow" ? PollRate::slow : PollRate::once;
  read_quantity(t, c);
  read_scale(t, c);
  read_raw_lists(t, c);
  c.source = t.has("source") ? non_empty(t, "source", kSourceHelp) : p.source;
  c.note = t.text("note", "");
  return c;
}

// The channel that `key` of `t` names; channels of one name are told by number, so only unique names can be referred to.
std::size_t channel_index(const TomlTable& t, std::string_view key, const Profile& p) {
  const std::string wanted = t.text(key);
  std::vector<std::string> names;
  std::size_t found = p.channels.size(), times = 0;
  for (std::size_t i = 0; i < p.channels.size(); ++i) {
    names.push_back(p.channels[i].name);
    if (p.channels[i].name == wanted) {
      found = i;
      ++times;
    }
  }
  if (times == 1) return found;
  t.fail(
      key, fmt::format("{} = \"{}\" {}", key, wanted, times ? "names several channels" : "is no channel of this profile"), "",
      times ? "give the channel a name of its own" : fmt::format("{}use one of: {}", did_you_mean(wanted, names), fmt::join(names, ", ")));
}

const Channel& whole_number(const TomlTable& t, const Profile& p, std::size_t index) {
  const Channel& c = p.channels[index];
  if (c.type == WordType::f32 || c.type == WordType::f64)
    t.fail("channel", fmt::format("channel {} is {}, and its bits are asked for", c.name, name(c.type)), "",
           "refer to a channel of an integer type");
  if (c.when) t.fail("channel", fmt::format("channel {} itself depends on another", c.name), "", "refer to a channel without `when`");
  return c;
}

void read_sign(const TomlTable& s, const Profile& p, Channel& c) {
  OtherChannel other;
  other.channel = channel_index(s, "channel", p);
  const Channel& word = whole_number(s, p, other.channel);
  other.shift = static_cast<int>(s.integer("bit", 0, static_cast<std::int64_t>(16 * word.registers()) - 1));
  other.mask = std::uint64_t{1} << other.shift;
  const int first = std::min<int>(word.address, c.address);
  const int span = std::max<int>(word.address + static_cast<int>(word.registers()), c.address + static_cast<int>(c.registers())) - first;
  if (word.fc != c.fc || span > p.max_registers || word.rate != c.rate)
    s.fail("channel", fmt::format("{} and its sign in {} cannot come by one read", c.name, word.name),
           "another function code or rate, or more than max_regs between them: a sign of another moment would turn the value",
           "give both the same fc and rate, within max_regs registers");
  if (c.type == WordType::s16 || c.type == WordType::s32 || c.negative_from)
    s.fail("channel", fmt::format("{} has a sign of its own and one in {}", c.name, word.name), "",
           "use an unsigned type, or leave sign out");
  c.sign = other;
}

void read_references(const TomlTable& t, const Profile& p, Channel& c) {
  if (const auto s = t.optional_table("sign")) read_sign(*s, p, c);
  if (const auto s = t.optional_table("scale_from")) {
    OtherChannel other;
    other.channel = channel_index(*s, "channel", p);
    (void)whole_number(*s, p, other.channel);
    other.shift = static_cast<int>(s->integer("shift", 0, 63, 0));
    other.mask = static_cast<std::uint64_t>(s->integer("mask", 1, 0x7FFFFFFFFFFFFFFF, 0x7FFFFFFFFFFFFFFF));
    c.scale_of = other;
    const TomlTable map = s->table("map");
    for (const std::string& key : map.keys()) {
      if (key.empty() || key.size() > 10 || key.find_first_not_of("0123456789") != std::string::npos)
        map.fail(key, fmt::format("map has the key \"{}\"", key), "",
                 "keys are the raw value of the other channel, after mask and shift, as decimal digits");
      const double factor = map.number(key, {-1e12, 1e12, "1"});
      if (factor == 0.0) map.fail(key, "a factor of 0 leaves nothing", "", "give the factor from raw value to unit");
      c.scale_map[std::stoull(key)] = factor;
    }
    if (c.scale_map.empty()) s->fail("map", "map is empty", "", "give at least one factor, such as { \"2\" = 0.01 }");
    if (c.range) t.fail("scale_from", "scale_from stands beside range", "", "keep one of them");
  }
  if (const auto w = t.optional_table("when")) {
    OtherChannel other;
    other.channel = channel_index(*w, "channel", p);
    if (whole_number(*w, p, other.channel).rate != PollRate::once)
      w->fail("channel", fmt::format("channel {} is not read once", p.channels[other.channel].name),
              "which channels a device has must be known before they are read", "give that channel rate = \"once\"");
    for (const auto raw : w->integers("in", 0, 0xFFFFFFFF)) c.when_in.push_back(static_cast<std::uint64_t>(raw));
    if (c.when_in.empty()) w->fail("in", "in is empty: the channel would never be there", "", "list the raw values of the other channel");
    c.when = other;
  }
}

// Two channels of one name are variants of a device: never both there.
void check_names(const std::vector<TomlTable>& tables, const std::vector<std::size_t>& table_of, const Profile& p) {
  for (std::size_t i = 0; i < p.channels.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) {
      const Channel &a = p.channels[k], &b = p.channels[i];
      if (a.name != b.name) continue;
      const bool apart = a.when && b.when && a.when->channel == b.when->channel &&
                         std::none_of(a.when_in.begin(), a.when_in.end(),
                                      [&](auto v) { return std::find(b.when_in.begin(), b.when_in.end(), v) != b.when_in.end(); });
      if (!apart)
        tables[table_of[i]].fail("name", fmt::format("channel \"{}\" is there twice, first at {}", b.name, a.where), "",
                                 "rename one, or give both a `when` that never holds together");
    }
}

void read_channels(const TomlTable& root, Profile& p, WordOrder bus_order) {
  const auto tables = root.tables("channel", 1, 400);
  std::vector<std::size_t> table_of;
  for (std::size_t i = 0; i < tables.size(); ++i) {
    const Channel first = read_channel(tables[i], p, bus_order);
    const auto count = tables[i].integer("count", 1, 64, 1);
    const auto stride = tables[i].integer("stride", 1, 1000, static_cast<std::int64_t>(first.registers()));
    if (count == 1 && tables[i].has("stride"))
      tables[i].fail("stride", "stride without count", "", "give count, the number of channels, or leave stride out");
    if (first.address + (count - 1) * stride + static_cast<std::int64_t>(first.registers()) > 65536)
      tables[i].fail("count", fmt::format("count = {} with stride {} passes register 65535", count, stride), "",
                     "correct addr, count or stride");
    for (std::int64_t n = 0; n < count; ++n) {
      Channel c = first;
      if (count > 1) c.name += std::to_string(n + 1);
      c.address = static_cast<std::uint16_t>(first.address + n * stride);
      p.channels.push_back(c);
      table_of.push_back(i);
    }
  }
  for (std::size_t i = 0; i < p.channels.size(); ++i) read_references(tables[table_of[i]], p, p.channels[i]);
  check_names(tables, table_of, p);
}

void read_commands(const TomlTable& root, Profile& p) {
  const auto commands = root.optional_table("command");
  if (!commands) return;
  for (const std::string& key : commands->keys()) {
    const TomlTable t = commands->table(key);
    DeviceCommand command{
        key, t.has("source") ? non_empty(t, "source", kSourceHelp) : p.source, {}, t.choice("wear", {"ram", "flash", "eeprom"}) != "ram"};
    for (const TomlTable& s : t.tables("steps", 1, 16)) {
      CommandStep step;
      step.fc = static_cast<int>(s.integer("fc", 6, 16, 6));
      if (step.fc != 6 && step.fc != 16)
        s.fail("fc", fmt::format("fc = {} does not write registers", step.fc), "", "use 6 (one register) or 16 (several)");
      step.address = static_cast<std::uint16_t>(s.integer("addr", 0, 65535));
      if (s.is_array("value")) {
        for (const auto v : s.integers("value", 0, 65535)) step.values.push_back(static_cast<std::uint16_t>(v));
      } else {
        step.values.push_back(static_cast<std::uint16_t>(s.integer("value", 0, 65535)));
      }
      const bool fits = step.fc == 6 ? step.values.size() == 1
                                     : !step.values.empty() && step.values.size() <= 123 && step.address + step.values.size() <= 65536;
      if (!fits)
        s.fail("value", fmt::format("fc = {} with {} values at addr {}", step.fc, step.values.size(), step.address), "",
               "fc 6 writes one value, fc 16 up to 123, none beyond register 65535");
      command.steps.push_back(std::move(step));
    }
    p.commands.push_back(std::move(command));
  }
}

Profile from_toml(const TomlFile& file) {
  file.format({1});
  const TomlTable root = file.root();
  Profile p;
  p.path = file.path();
  const TomlTable device = root.table("device");
  p.vendor = non_empty(device, "vendor", "who makes the device");
  p.model = non_empty(device, "model", "which device it is");
  p.source = non_empty(device, "source", kSourceHelp);
  p.evidence = device.choice("evidence", {"manual", "emulated", "hardware"});
  const TomlTable bus = root.table("bus");
  read_bus(bus, p);
  const WordOrder order = word_order(bus.choice("word_order", {"ABCD", "CDAB", "BADC", "DCBA"}, "ABCD"));
  read_channels(root, p, order);
  read_commands(root, p);
  file.refuse_unknown_keys();
  return p;
}

}  // namespace

Profile read_profile(const std::filesystem::path& path) { return from_toml(TomlFile::read(path)); }
Profile parse_profile(std::string_view text, const std::filesystem::path& name) { return from_toml(TomlFile::parse(text, name)); }

std::string_view name(PollRate rate) { return rate == PollRate::fast ? "fast" : rate == PollRate::slow ? "slow" : "once"; }

const Channel* Profile::find(std::string_view channel) const {
  for (const Channel& c : channels)
    if (c.name == channel) return &c;
  return nullptr;
}

std::string text(const SerialFormat& f) { return fmt::format("{} 8{}{}", f.baud, f.parity, f.stop_bits); }

}  // namespace rotorloop::modbus
