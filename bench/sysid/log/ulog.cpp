#include "bench/sysid/log/ulog.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <limits>
#include <set>

#include "host/base/error.hpp"

namespace rotorloop::log {
namespace {

constexpr std::size_t kHeaderBytes = 16, kMessageHeaderBytes = 3;
constexpr std::size_t kLargestMessage = 65535;  // its size is a 16-bit number
constexpr std::size_t kLongestName = 255;
constexpr int kDeepestNesting = 16;
constexpr std::string_view kIgnoredTypes = "BMPQRLCS";  // flags (read before), parameters, text and marks: no part of a flight
constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

struct BaseType {
  std::string_view name;
  std::size_t bytes;
};
constexpr std::array kBaseTypes{BaseType{"int8_t", 1},  BaseType{"uint8_t", 1},  BaseType{"int16_t", 2}, BaseType{"uint16_t", 2},
                                BaseType{"int32_t", 4}, BaseType{"uint32_t", 4}, BaseType{"int64_t", 8}, BaseType{"uint64_t", 8},
                                BaseType{"float", 4},   BaseType{"double", 8},   BaseType{"bool", 1},    BaseType{"char", 1}};

std::size_t base_bytes(std::string_view type) {
  for (const auto& t : kBaseTypes)
    if (t.name == type) return t.bytes;
  return 0;
}

// "float[3]" -> {"float", 3}; nothing for what is no type.
struct TypeText {
  std::string_view type;
  std::size_t count = 1;
  bool is_array = false;
};
std::optional<TypeText> parse_type(std::string_view text) {
  TypeText t{text};
  const auto open = text.find('[');
  if (open != std::string_view::npos) {
    if (text.back() != ']') return std::nullopt;
    const auto digits = text.substr(open + 1, text.size() - open - 2);
    const auto [used, ec] = std::from_chars(digits.data(), digits.data() + digits.size(), t.count);
    if (ec != std::errc{} || used != digits.data() + digits.size() || t.count == 0 || t.count > kLargestMessage) return std::nullopt;
    t.type = text.substr(0, open);
    t.is_array = true;
  }
  if (t.type.empty() || t.type.size() > kLongestName) return std::nullopt;
  return t;
}

bool is_padding(std::string_view field) { return field.starts_with("_padding"); }

// What C allows, so that a path such as "esc[2].esc_rpm" can be taken apart.
bool is_identifier(std::string_view name) {
  return !name.empty() && name.size() <= kLongestName && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  });
}

}  // namespace

ULog ULog::parse(std::string bytes, const std::filesystem::path& name) {
  const auto refuse = [&](std::string what, std::string likely) {
    throw Error({name.generic_string(), std::move(what), std::move(likely), "record or download the log again"}, ExitCode::data_quality);
  };
  if (!std::string_view(bytes).starts_with(kULogMagic))
    refuse("is not a ULog: it does not begin with its magic bytes", "another format, or damage");
  if (bytes.size() < kHeaderBytes)
    refuse(fmt::format("ends within the header: {} bytes, expected at least {}", bytes.size(), kHeaderBytes), "the file was cut");
  const int version = static_cast<unsigned char>(bytes[kULogMagic.size()]);
  if (version > 1) refuse(fmt::format("has ULog version {}, known are 0 and 1", version), "a log of a newer tool");
  ULog log;
  log.bytes_ = std::move(bytes);
  log.read_messages(name);
  return log;
}

void ULog::read_messages(const std::filesystem::path& name) {
  // The flag message, where there is one, comes first: bits that a reader has to know, and where data were appended.
  if (bytes_.size() >= kHeaderBytes + kMessageHeaderBytes + 40 && bytes_[kHeaderBytes + 2] == 'B' && integer_at(kHeaderBytes, 2) >= 40) {
    const std::size_t flags = kHeaderBytes + kMessageHeaderBytes;
    for (std::size_t i = 0; i < 8; ++i) {
      const unsigned known = i == 0 ? 1u : 0u;  // bit 0: data were appended
      const unsigned bits = static_cast<unsigned char>(bytes_[flags + 8 + i]);
      if (bits & ~known)
        throw Error({name.generic_string(), fmt::format("has incompatible flags {:#04x} in byte {}, known is {:#04x}", bits, i, known),
                     "a log of a newer tool, or damage", "convert it with the tool that wrote it"},
                    ExitCode::data_quality);
    }
    if (bytes_[flags + 8] & 1)
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint64_t at = integer_at(flags + 16 + 8 * i, 8);
        if (at == 0) continue;
        if (at >= bytes_.size() || at < flags + 40 || (!appended_.empty() && at <= appended_.back()))
          notes_.push_back(fmt::format("the place of appended data, byte {}, is not in the file and is not used", at));
        else
          appended_.push_back(static_cast<std::size_t>(at));
      }
  }
  std::size_t begin = kHeaderBytes;
  for (std::size_t k = 0; k <= appended_.size(); ++k) {
    const bool last = k == appended_.size();
    const std::size_t end = last ? bytes_.size() : appended_[k];
    read_segment(begin, end, last);
    begin = end;
  }
  const auto note = [&](std::size_t n, std::string_view what) {
    if (n > 0) notes_.push_back(fmt::format("{} {}", n, what));
  };
  note(unknown_type_, "messages of unknown type are left out");
  note(unknown_id_, "data messages without a known subscription are left out");
  note(bad_format_, "definitions that cannot be read are left out");
  note(skipped_bytes_, "damaged bytes were skipped, up to the next synchronisation mark");
  if (dropouts_ > 0) notes_.push_back(fmt::format("the logger dropped out {} times, {:.3f} s in all", dropouts_, dropout_s_));
}

void ULog::read_segment(std::size_t begin, std::size_t end, bool last) {
  std::size_t at = begin;
  while (at < end) {
    const bool header = end - at >= kMessageHeaderBytes;
    const std::size_t size = header ? static_cast<std::size_t>(integer_at(at, 2)) : 0;
    if (header && size <= end - at - kMessageHeaderBytes) {
      read_message(bytes_[at + 2], at + kMessageHeaderBytes, size);
      at += kMessageHeaderBytes + size;
      continue;
    }
    // A message that reaches past the end: damage when a synchronisation mark follows, else the end of a log that was cut.
    const std::size_t mark = bytes_.find(kULogSync, at);
    if (mark != std::string::npos && mark + kULogSync.size() <= end) {
      skipped_bytes_ += mark + kULogSync.size() - at;
      at = mark + kULogSync.size();
      continue;
    }
    notes_.push_back(fmt::format("{} at byte {}: the message there is cut ({} of {} bytes)",
                                 last ? "the log ends" : "data before those appended end", at, end - at,
                                 header ? size + kMessageHeaderBytes : kMessageHeaderBytes));
    return;
  }
}

void ULog::read_message(char type, std::size_t begin, std::size_t size) {
  const std::string_view body = std::string_view(bytes_).substr(begin, size);
  switch (type) {
    case 'F':
      read_format(body);
      return;
    case 'I':
      read_info(body);
      return;
    case 'A':
      read_subscription(begin, size);
      return;
    case 'D': {
      const auto it = size < 2 ? subscribed_.end() : subscribed_.find(static_cast<std::uint16_t>(integer_at(begin, 2)));
      if (it == subscribed_.end())
        ++unknown_id_;
      else
        topics_[it->second].messages.emplace_back(begin + 2, size - 2);
      return;
    }
    case 'O':
      if (size >= 2) {
        ++dropouts_;
        dropout_s_ += 1e-3 * static_cast<double>(integer_at(begin, 2));
      }
      return;
    default:
      if (kIgnoredTypes.find(type) == std::string_view::npos) ++unknown_type_;
  }
}

// "vehicle_odometry:uint64_t timestamp;float[3] position;…"
void ULog::read_format(std::string_view text) {
  const auto colon = text.find(':');
  if (colon == std::string_view::npos || colon == 0 || colon > kLongestName) return void(++bad_format_);
  Format format;
  std::set<std::string_view> names;
  for (std::string_view rest = text.substr(colon + 1); !rest.empty();) {
    const auto semicolon = rest.find(';');
    const auto field = rest.substr(0, semicolon);
    rest.remove_prefix(semicolon == std::string_view::npos ? rest.size() : semicolon + 1);
    if (field.empty()) continue;
    const auto space = field.find(' ');
    const auto type = space == std::string_view::npos ? std::nullopt : parse_type(field.substr(0, space));
    if (!type || !is_identifier(field.substr(space + 1)) || !names.insert(field.substr(space + 1)).second) return void(++bad_format_);
    format.fields.push_back({std::string(type->type), std::string(field.substr(space + 1)), type->count, type->is_array});
  }
  if (format.fields.empty()) return void(++bad_format_);
  formats_.emplace(text.substr(0, colon), std::move(format));  // the first of a name counts
}

void ULog::read_info(std::string_view body) {
  if (body.empty()) return;
  const std::size_t length = static_cast<unsigned char>(body[0]);
  if (length == 0 || length + 1 > body.size()) return void(++bad_format_);
  const auto key = body.substr(1, length);
  const auto space = key.find(' ');
  if (space == std::string_view::npos || !key.starts_with("char[")) return;  // numbers: nothing that we need
  info_.emplace(key.substr(space + 1), body.substr(length + 1));
}

void ULog::read_subscription(std::size_t begin, std::size_t size) {
  if (size < 4) return void(++bad_format_);
  const int multi_id = static_cast<unsigned char>(bytes_[begin]);
  const auto id = static_cast<std::uint16_t>(integer_at(begin + 1, 2));
  const std::string name = bytes_.substr(begin + 3, size - 3);
  if (!size_of(name, 0)) return void(++bad_format_);
  const auto [it, is_new] = topic_index_.try_emplace({name, multi_id}, topics_.size());
  subscribed_[id] = it->second;
  if (is_new) topics_.push_back({name, multi_id, {}});
}

// Bytes of one value of `type`; nothing for a type that is unknown, holds itself, or is larger than any message.
std::optional<std::size_t> ULog::size_of(const std::string& type, int depth) const {
  if (const std::size_t n = base_bytes(type)) return n;
  if (const auto known = sizes_.find(type); known != sizes_.end()) return known->second;
  const auto it = formats_.find(type);
  if (it == formats_.end() || depth >= kDeepestNesting) return std::nullopt;
  sizes_[type] = std::nullopt;  // what holds itself finds this
  std::size_t total = 0;
  for (const auto& f : it->second.fields) {
    const auto one = size_of(f.type, depth + 1);
    if (!one) return std::nullopt;
    total += *one * f.count;  // both at most 65535
    if (total > kLargestMessage) return std::nullopt;
  }
  return sizes_[type] = total;
}

std::optional<ULog::Place> ULog::find_field(const std::string& format, std::string_view path) const {
  std::size_t offset = 0;
  std::string within = format;
  for (;;) {
    const auto dot = path.find('.');
    std::string_view name = path.substr(0, dot);
    std::size_t index = 0;
    const auto open = name.find('[');
    const bool indexed = open != std::string_view::npos;
    if (indexed) {
      const auto digits = name.substr(open + 1, name.size() - open - 2);
      const auto [used, ec] = std::from_chars(digits.data(), digits.data() + digits.size(), index);
      if (name.back() != ']' || ec != std::errc{} || used != digits.data() + digits.size()) return std::nullopt;
      name = name.substr(0, open);
    }
    const auto it = formats_.find(within);
    if (it == formats_.end()) return std::nullopt;
    const Field* found = nullptr;
    for (const auto& f : it->second.fields) {
      const auto one = size_of(f.type, 0);
      if (!one) return std::nullopt;
      if (f.name == name && !is_padding(name)) {
        if (f.is_array != indexed || index >= f.count) return std::nullopt;
        offset += index * *one;
        found = &f;
        break;
      }
      offset += f.count * *one;
    }
    if (!found) return std::nullopt;
    if (dot == std::string_view::npos) return base_bytes(found->type) ? std::optional(Place{offset, found->type}) : std::nullopt;
    within = found->type;
    path.remove_prefix(dot + 1);
  }
}

void ULog::list_fields(const std::string& format, const std::string& prefix, std::size_t most, std::vector<std::string>& out,
                       int depth) const {
  const auto it = formats_.find(format);
  if (it == formats_.end() || depth > kDeepestNesting) return;
  for (const auto& f : it->second.fields) {
    if (is_padding(f.name)) continue;
    for (std::size_t i = 0; i < f.count; ++i) {
      if (out.size() >= most) return;
      const std::string path = prefix + f.name + (f.is_array ? fmt::format("[{}]", i) : "");
      if (base_bytes(f.type))
        out.push_back(path);
      else
        list_fields(f.type, path + ".", most, out, depth + 1);
    }
  }
}

std::vector<std::string> ULog::fields(const std::string& topic_name, std::size_t most) const {
  std::vector<std::string> out;
  if (size_of(topic_name, 0)) list_fields(topic_name, "", most, out, 0);
  return out;
}

const ULogTopic* ULog::topic(std::string_view name, int multi_id) const {
  const auto it = topic_index_.find({std::string(name), multi_id});
  return it == topic_index_.end() ? nullptr : &topics_[it->second];
}

std::optional<std::vector<double>> ULog::column(const ULogTopic& topic, std::string_view field) const {
  const auto place = find_field(topic.name, field);
  if (!place) return std::nullopt;
  const std::size_t bytes = base_bytes(place->type);
  std::vector<double> values;
  values.reserve(topic.messages.size());
  for (const auto& [begin, size] : topic.messages)
    values.push_back(place->offset + bytes <= size ? value_at(begin + place->offset, place->type) : kNoValue);
  return values;
}

std::uint64_t ULog::integer_at(std::size_t at, std::size_t bytes) const {  // little endian, whatever the host is
  std::uint64_t v = 0;
  for (std::size_t i = 0; i < bytes; ++i) v |= std::uint64_t{static_cast<unsigned char>(bytes_[at + i])} << (8 * i);
  return v;
}

double ULog::value_at(std::size_t at, std::string_view type) const {
  const std::uint64_t v = integer_at(at, base_bytes(type));
  if (type == "float") return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(v)));
  if (type == "double") return std::bit_cast<double>(v);
  if (type == "int8_t" || type == "char") return static_cast<double>(static_cast<std::int8_t>(v));
  if (type == "int16_t") return static_cast<double>(static_cast<std::int16_t>(v));
  if (type == "int32_t") return static_cast<double>(static_cast<std::int32_t>(v));
  if (type == "int64_t") return static_cast<double>(static_cast<std::int64_t>(v));
  return static_cast<double>(v);
}

}  // namespace rotorloop::log
