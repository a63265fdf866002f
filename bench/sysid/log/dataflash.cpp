#include "bench/sysid/log/dataflash.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>

#include "host/base/constants.hpp"
#include "host/base/error.hpp"

namespace rotorloop::log {
namespace {

constexpr std::uint8_t kFormatType = 128;  // FMT: describes all others, itself too
constexpr std::size_t kHeadBytes = 3, kFormatBytes = 89, kNameBytes = 4, kTypesBytes = 16, kLabelsBytes = 64;
constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
// One loop of the autopilot logs all its ESCs one behind the other; the next round is a loop of 2.5 ms or more later.
constexpr double kRound_us = 2000.0;
// WGS 84.
constexpr double kEquator_m = 6378137.0, kEccentricity2 = 6.69437999014e-3;

struct TypesOfSize {
  std::string_view letters;
  std::size_t bytes;
};
constexpr std::array kTypes{TypesOfSize{"bBM", 1}, TypesOfSize{"hHcCg", 2}, TypesOfSize{"iIeELfn", 4},
                            TypesOfSize{"qQd", 8}, TypesOfSize{"N", 16},    TypesOfSize{"Za", 64}};
constexpr std::string_view kSigned = "bhiqceL", kHundredths = "cCeE";

// Bytes of one value; 0 for a letter that no format has.
std::size_t bytes_of(char type) {
  for (const auto& t : kTypes)
    if (t.letters.find(type) != std::string_view::npos) return t.bytes;
  return 0;
}
bool is_number(char type) { return type != 'n' && type != 'N' && type != 'Z' && type != 'a'; }

double of_half(std::uint16_t h) {
  const int exponent = (h >> 10) & 31;
  const double sign = (h & 0x8000) != 0 ? -1.0 : 1.0, fraction = static_cast<double>(h & 1023);
  if (exponent == 31) return fraction == 0.0 ? sign * std::numeric_limits<double>::infinity() : kNoNumber;
  return sign * (exponent == 0 ? std::ldexp(fraction, -24) : std::ldexp(1024.0 + fraction, exponent - 25));
}

std::vector<std::string> split(std::string_view text, char at) {
  std::vector<std::string> out;
  while (!text.empty()) {
    const auto end = text.find(at);
    out.emplace_back(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return out;
}

// "RPM[2]" is RPM of instance 2.
std::optional<std::pair<std::string, int>> indexed(const std::string& column) {
  const auto open = column.find('[');
  if (open == std::string::npos || open == 0 || column.back() != ']') return std::nullopt;
  int k = 0;
  const char* const end = column.data() + column.size() - 1;
  const auto [used, failed] = std::from_chars(column.data() + open + 1, end, k);
  if (failed != std::errc{} || used != end || k < 0 || k > 255) return std::nullopt;
  return std::pair{column.substr(0, open), k};
}

// "Lat[m]" is Lat in metres.
std::optional<std::string> in_metres(const std::string& column) {
  return column.ends_with("[m]") ? std::optional(column.substr(0, column.size() - 3)) : std::nullopt;
}

// Metres north (of latitudes) or east (of longitudes) of the first reading.
std::vector<double> metres(const std::vector<double>& latitude_deg, const std::vector<double>& longitude_deg, bool north) {
  std::vector<double> out(latitude_deg.size(), kNoNumber);
  std::optional<std::size_t> first;
  double per_deg = 0.0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (latitude_deg[i] == 0.0 && longitude_deg[i] == 0.0) continue;
    if (!first) {
      first = i;
      const double s = std::sin(kRad_per_deg * latitude_deg[i]), w = 1.0 - kEccentricity2 * s * s;
      per_deg = kRad_per_deg * (north ? kEquator_m * (1.0 - kEccentricity2) / (w * std::sqrt(w))
                                      : kEquator_m / std::sqrt(w) * std::cos(kRad_per_deg * latitude_deg[i]));
    }
    out[i] = per_deg * (north ? latitude_deg[i] - latitude_deg[*first] : longitude_deg[i] - longitude_deg[*first]);
  }
  return out;
}

}  // namespace

DataFlash DataFlash::parse(std::string bytes, const std::filesystem::path& path) {
  DataFlash log;
  log.bytes_ = std::move(bytes);
  log.formats_[kFormatType] = {
      "FMT",
      kFormatBytes,
      {{"Type", 'B', 3, ""}, {"Length", 'B', 4, ""}, {"Name", 'n', 5, ""}, {"Format", 'N', 9, ""}, {"Columns", 'Z', 25, ""}},
      std::nullopt,
      {}};
  log.scan();
  log.apply_units();
  for (auto& [type, message] : log.formats_)
    if (!message.at.empty() && type != kFormatType) log.messages_.push_back(std::move(message));
  if (log.messages_.empty())
    throw Error({path.generic_string(), fmt::format("holds no message of a DataFlash log in {} bytes", log.bytes_.size()),
                 "cut before its first data, or another kind of file with that ending", "give the .BIN as the autopilot wrote it"},
                ExitCode::data_quality);
  const auto note = [&](std::size_t n, std::string_view what) {
    if (n > 0) log.notes_.push_back(fmt::format("{} {}", n, what));
  };
  note(log.skipped_, "damaged bytes were skipped, up to the next message");
  note(log.unknown_, "messages of a type that the log does not describe are left out");
  note(log.bad_formats_, "descriptions of messages cannot be read, or contradict an earlier one, and are left out");
  return log;
}

// The next place where a message of a known type begins and ends where another begins, or at the end of the file.
std::size_t DataFlash::next_head(std::size_t from) const {
  for (std::size_t at = bytes_.find(kDataFlashHead, from); at != std::string::npos; at = bytes_.find(kDataFlashHead, at + 1)) {
    if (at + kHeadBytes > bytes_.size()) break;
    const auto known = formats_.find(static_cast<std::uint8_t>(bytes_[at + 2]));
    if (known == formats_.end()) continue;
    const std::size_t end = at + known->second.bytes;
    if (end == bytes_.size() || (end < bytes_.size() && bytes_.compare(end, 2, kDataFlashHead) == 0)) return at;
  }
  return bytes_.size();
}

void DataFlash::scan() {
  for (std::size_t at = 0; at < bytes_.size();) {
    const std::size_t left = bytes_.size() - at;
    const bool head = left >= kHeadBytes && bytes_.compare(at, 2, kDataFlashHead) == 0;
    const auto known = head ? formats_.find(static_cast<std::uint8_t>(bytes_[at + 2])) : formats_.end();
    if (known == formats_.end()) {
      const std::string_view rest = std::string_view(bytes_).substr(at);
      if (rest.find_first_not_of(rest[0]) == std::string_view::npos && (rest[0] == '\xFF' || rest[0] == '\0')) return;  // blank flash
      const std::size_t next = next_head(at + 1);
      if (head && left > kHeadBytes) ++unknown_;
      if (!head) skipped_ += next - at;
      at = next;
      continue;
    }
    const std::size_t size = known->second.bytes;
    if (size > left) {
      const std::size_t next = next_head(at + 1);
      if (next == bytes_.size()) {
        notes_.push_back(
            fmt::format("the log ends at byte {}: the message {} there is cut ({} of {} bytes)", at, known->second.name, left, size));
        return;
      }
      skipped_ += next - at;
      at = next;
      continue;
    }
    if (known->first == kFormatType) read_format(at);
    known->second.at.push_back(at);
    at += size;
  }
}

void DataFlash::read_format(std::size_t at) {
  const auto type = static_cast<std::uint8_t>(integer(at + 3, 1));
  DataFlashMessage m;
  m.bytes = integer(at + 4, 1);
  m.name = text(at + 5, kNameBytes);
  const std::string types = text(at + 5 + kNameBytes, kTypesBytes);
  const auto labels = split(text(at + 5 + kNameBytes + kTypesBytes, kLabelsBytes), ',');
  std::size_t offset = kHeadBytes;
  for (std::size_t i = 0; i < types.size(); ++i) {
    const std::size_t size = bytes_of(types[i]);
    if (size == 0) return void(++bad_formats_);
    if (i < labels.size()) m.fields.push_back({labels[i], types[i], offset, ""});
    offset += size;
  }
  if (type == kFormatType) return;  // it describes itself, as we know it
  if (offset != m.bytes || m.name.empty()) return void(++bad_formats_);
  const auto [before, is_new] = formats_.try_emplace(type, m);
  if (!is_new && (before->second.name != m.name || before->second.bytes != m.bytes)) ++bad_formats_;
}

// FMTU names a unit and a multiplier for each field, by letters that UNIT and MULT explain; '#' marks the number of an instance.
void DataFlash::apply_units() {
  std::map<char, std::string> units;
  std::map<char, double> multipliers;
  const auto fields_of = [&](const char* name, std::string_view types) -> const DataFlashMessage* {
    const DataFlashMessage* m = nullptr;
    for (const auto& [type, f] : formats_)
      if (f.name == name) m = &f;
    if (!m || m->fields.size() < types.size()) return nullptr;
    for (std::size_t i = 0; i < types.size(); ++i)
      if (bytes_of(m->fields[i].type) != bytes_of(types[i])) return nullptr;
    return m;
  };
  if (const auto* m = fields_of("UNIT", "QbZ"))
    for (const std::size_t at : m->at) units[static_cast<char>(bytes_[at + m->fields[1].offset])] = text(at + m->fields[2].offset, 64);
  if (const auto* m = fields_of("MULT", "Qbd"))
    for (const std::size_t at : m->at)
      multipliers[static_cast<char>(bytes_[at + m->fields[1].offset])] = number(at + m->fields[2].offset, 'd');
  const auto* m = fields_of("FMTU", "QBNN");
  if (!m) return;
  for (const std::size_t at : m->at) {
    const auto described = formats_.find(static_cast<std::uint8_t>(integer(at + m->fields[1].offset, 1)));
    if (described == formats_.end()) continue;
    const std::string u = text(at + m->fields[2].offset, 16), x = text(at + m->fields[3].offset, 16);
    auto& fields = described->second.fields;
    for (std::size_t i = 0; i < fields.size() && i < u.size(); ++i) {
      if (u[i] == '#' && is_number(fields[i].type)) described->second.instance = i;
      const auto unit = units.find(u[i]);
      if (unit == units.end() || unit->second.empty() || u[i] == '#') continue;
      // The letters c, C, e, E and L carry their factor themselves.
      const bool carried = fields[i].type == 'L' || kHundredths.find(fields[i].type) != std::string_view::npos;
      const auto factor = i < x.size() && !carried ? multipliers.find(x[i]) : multipliers.end();
      const bool plain = factor == multipliers.end() || factor->second == 1.0 || factor->second == 0.0;
      fields[i].unit = plain ? unit->second : fmt::format("{:g} {}", factor->second, unit->second);
    }
  }
}

std::uint64_t DataFlash::integer(std::size_t at, std::size_t size) const {  // little endian, whatever the host is
  std::uint64_t v = 0;
  for (std::size_t i = 0; i < size; ++i) v |= std::uint64_t{static_cast<unsigned char>(bytes_[at + i])} << (8 * i);
  return v;
}

std::string DataFlash::text(std::size_t at, std::size_t size) const {
  const std::string_view field = std::string_view(bytes_).substr(at, size);
  return std::string(field.substr(0, field.find('\0')));
}

double DataFlash::number(std::size_t at, char type) const {
  const std::size_t size = bytes_of(type);
  const std::uint64_t v = integer(at, size);
  if (type == 'f') return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(v)));
  if (type == 'd') return std::bit_cast<double>(v);
  if (type == 'g') return of_half(static_cast<std::uint16_t>(v));
  const std::size_t unused = 64 - 8 * size;
  const bool has_sign = kSigned.find(type) != std::string_view::npos;
  const double x = has_sign ? static_cast<double>(static_cast<std::int64_t>(v << unused) >> unused) : static_cast<double>(v);
  if (kHundredths.find(type) != std::string_view::npos) return x / 100.0;
  return type == 'L' ? x / 1e7 : x;
}

const DataFlashMessage* DataFlash::find(std::string_view name) const {
  const auto m = std::find_if(messages_.begin(), messages_.end(), [&](const auto& x) { return x.name == name; });
  return m == messages_.end() ? nullptr : &*m;
}

std::set<int> DataFlash::instances(const DataFlashMessage& m) const {
  std::set<int> out;
  if (m.instance)
    for (const std::size_t at : m.at) out.insert(static_cast<int>(number(at + m.fields[*m.instance].offset, m.fields[*m.instance].type)));
  return out;
}

std::vector<std::size_t> DataFlash::rows_of(const DataFlashMessage& m, int instance) const {
  if (!m.instance) return m.at;
  std::vector<std::size_t> rows;
  const auto& field = m.fields[*m.instance];
  for (const std::size_t at : m.at)
    if (static_cast<int>(number(at + field.offset, field.type)) == instance) rows.push_back(at);
  return rows;
}

std::optional<std::vector<double>> DataFlash::column(const DataFlashMessage& m, const std::vector<std::size_t>& rows,
                                                     std::string_view name) const {
  const auto place = [&](std::string_view wanted) {
    return std::find_if(m.fields.begin(), m.fields.end(), [&](const auto& f) { return f.name == wanted; });
  };
  double factor = 1.0;
  auto field = place(name);
  if (field == m.fields.end() && name == "TimeUS") {
    field = place("TimeMS");
    factor = 1000.0;
  }
  if (field == m.fields.end() || !is_number(field->type)) return std::nullopt;
  std::vector<double> values;
  values.reserve(rows.size());
  for (const std::size_t at : rows) values.push_back(factor * number(at + field->offset, field->type));
  return values;
}

std::optional<ColumnTable> DataFlash::table(const std::string& name, int instance, const std::set<std::string>& wanted) const {
  if (std::any_of(wanted.begin(), wanted.end(), [](const auto& c) { return indexed(c).has_value(); })) return rounds(name, wanted);
  const DataFlashMessage* m = find(name);
  if (!m) return std::nullopt;
  const auto rows = rows_of(*m, instance);
  if (rows.empty()) return std::nullopt;
  ColumnTable table;
  table.rows = rows.size();
  for (const auto& f : m->fields)
    if (is_number(f.type)) table.names.push_back(f.unit.empty() ? f.name : fmt::format("{} ({})", f.name, f.unit));
  for (const auto& want : wanted) {
    auto values = column(*m, rows, want);
    if (const auto base = in_metres(want); !values && base) {
      const auto latitude = column(*m, rows, "Lat"), longitude = column(*m, rows, "Lng");
      if (latitude && longitude && (*base == "Lat" || *base == "Lng")) values = metres(*latitude, *longitude, *base == "Lat");
    }
    if (values) table.columns[want] = std::move(*values);
  }
  return table;
}

std::optional<ColumnTable> DataFlash::rounds(const std::string& name, const std::set<std::string>& wanted) const {
  struct Row {
    double t_us;
    int instance;
    const DataFlashMessage* message;
    std::size_t at;
  };
  std::vector<Row> all;
  const auto take = [&](const DataFlashMessage& m, std::optional<int> numbered) {
    const auto t = column(m, m.at, "TimeUS");
    for (std::size_t i = 0; t && i < m.at.size(); ++i) {
      const int k = m.instance ? static_cast<int>(number(m.at[i] + m.fields[*m.instance].offset, m.fields[*m.instance].type)) : 0;
      all.push_back({(*t)[i], numbered.value_or(k), &m, m.at[i]});
    }
  };
  if (const auto* m = find(name)) take(*m, std::nullopt);
  for (int k = 0; k < 9 && !find(name); ++k)
    if (const auto* m = find(name + std::to_string(k + 1))) take(*m, k);
  if (all.empty()) return std::nullopt;
  std::stable_sort(all.begin(), all.end(), [](const Row& a, const Row& b) { return a.at < b.at; });  // as they were written
  ColumnTable table;
  std::vector<double> t_us;
  std::vector<std::map<int, Row>> of_round;
  for (const Row& r : all) {
    if (of_round.empty() || of_round.back().contains(r.instance) || !(std::abs(r.t_us - t_us.back()) <= kRound_us)) {
      of_round.emplace_back();
      t_us.push_back(r.t_us);
    }
    of_round.back().emplace(r.instance, r);
  }
  table.rows = of_round.size();
  for (const auto& f : all.front().message->fields) table.names.push_back(f.name + "[0]");
  for (const auto& want : wanted) {
    const auto path = indexed(want);
    std::vector<double> values(table.rows, kNoNumber);
    bool found = false;
    for (std::size_t i = 0; path && i < table.rows; ++i)
      if (const auto r = of_round[i].find(path->second); r != of_round[i].end())
        if (const auto v = column(*r->second.message, {r->second.at}, path->first)) {
          values[i] = v->front();
          found = true;
        }
    if (found) table.columns[want] = std::move(values);
    if (want == "TimeUS") table.columns[want] = t_us;
  }
  return table;
}

}  // namespace rotorloop::log
