// What a Modbus device answers, as data: a profile file (docs/files.md, "Device profile") holds its registers with type, scale and every
// quirk, each with its source. The master reads by it, the emulated device answers by it, `stand profile show` prints it.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bench/stand/instruments/word_codec.hpp"

namespace rotorloop::modbus {

enum class PollRate : std::uint8_t { fast, slow, once };  // every cycle; every n-th cycle; when the device is found
std::string_view name(PollRate rate);

// A value that another register of the device decides about: the raw bits of channel `channel`, masked and shifted.
struct OtherChannel {
  std::size_t channel = 0;  // index into Profile::channels
  std::uint64_t mask = ~std::uint64_t{0};
  int shift = 0;
  std::uint64_t part(std::uint64_t raw) const { return (raw & mask) >> shift; }
};

struct Channel {
  std::string name, quantity, unit, source, note;
  int fc = 3;                 // 3: holding registers, 4: input registers
  std::uint16_t address = 0;  // on the wire, from 0: "40008" is 7
  WordType type = WordType::u16;
  WordOrder order = WordOrder::ABCD;
  PollRate rate = PollRate::fast;
  double scale = 1.0, offset = 0.0;  // value = raw * scale + offset, in `unit`

  struct LinearRange {
    double raw_min, raw_max, value_min, value_max;  // raw values beyond are out of range
  };
  std::optional<LinearRange> range;      // instead of scale and offset
  std::optional<double> negative_from;   // raw >= this means -(raw - this)
  std::optional<OtherChannel> sign;      // one bit: 1 is negative
  std::optional<OtherChannel> scale_of;  // with scale_map: raw value of the other channel to a factor
  std::map<std::uint64_t, double> scale_map;
  std::optional<OtherChannel> when;  // the channel is there only when the other holds one of when_in
  std::vector<std::uint64_t> when_in;
  std::vector<std::uint64_t> not_available;  // raw values that stand for "no measurement"
  std::map<std::string, int> bits;           // of a status word
  std::string where;                         // "file:line"

  std::size_t registers() const { return register_count(type); }
};

struct CommandStep {
  int fc = 6;  // 6: one register, 16: several
  std::uint16_t address = 0;
  std::vector<std::uint16_t> values;
};

// What a device can be made to do by writing registers.
struct DeviceCommand {
  std::string name, source;
  std::vector<CommandStep> steps;
  bool wears = false;  // writes flash or EEPROM: asked for explicitly only
};

struct SerialFormat {
  int baud = 9600;
  char parity = 'N';
  int stop_bits = 1;
  int bits_per_character() const { return 1 + 8 + (parity == 'N' ? 0 : 1) + stop_bits; }
  std::int64_t character_ns() const { return (1'000'000'000LL * bits_per_character() + baud - 1) / baud; }
};
std::string text(const SerialFormat& format);  // "115200 8N1"

struct Profile {
  std::filesystem::path path;
  std::string vendor, model, source, evidence;  // evidence: manual, emulated or hardware
  std::vector<int> baud;                        // the first is meant unless told otherwise
  char parity = 'N';
  int stop_bits = 1;
  bool tcp = false;
  int slave = 1;              // factory setting
  int max_registers = 125;    // of one read
  int max_gap = 0;            // registers that may be read in vain to join two reads
  double gap_ms = 0.0;        // silence before a request; never below 3.5 characters
  double timeout_ms = 100.0;  // from the end of a request to the first byte of its answer
  double byte_timeout_ms = 20.0;
  double late_max_ms = 200.0;  // no answer begins later than this after the end of its request
  double turnaround_ms = 2.0;  // typical, for predicted rates and the emulated device
  std::string bus_source;
  std::vector<Channel> channels;
  std::vector<DeviceCommand> commands;

  std::string title() const { return vendor + " " + model; }
  const Channel* find(std::string_view channel) const;  // nullptr when there is none
};

// Both throw Error (ExitCode::usage) with file, line, column, value, allowed range and remedy.
Profile read_profile(const std::filesystem::path& path);
Profile parse_profile(std::string_view text, const std::filesystem::path& name_for_errors);

}  // namespace rotorloop::modbus
