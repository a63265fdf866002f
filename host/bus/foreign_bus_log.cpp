#include "host/bus/foreign_bus_log.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "host/base/error.hpp"

namespace rotorloop {
namespace {

using Words = std::vector<std::string_view>;

Words words_of(std::string_view line) {
  Words out;
  for (std::size_t i = 0; i < line.size();) {
    i = line.find_first_not_of(" \t\r", i);
    if (i == std::string_view::npos) break;
    const std::size_t end = std::min(line.find_first_of(" \t\r", i), line.size());
    out.push_back(line.substr(i, end - i));
    i = end;
  }
  return out;
}

std::optional<std::uint32_t> whole(std::string_view word, int base) {
  std::uint32_t v = 0;
  const auto [used, ec] = std::from_chars(word.data(), word.data() + word.size(), v, base);
  return ec == std::errc{} && used == word.data() + word.size() && !word.empty() ? std::optional(v) : std::nullopt;
}
// Where Windows writes decimals with a comma these programs may do so too.
std::optional<double> number(std::string_view given) {
  std::string word(given);
  std::replace(word.begin(), word.end(), ',', '.');
  double v = 0.0;
  const auto [used, ec] = std::from_chars(word.data(), word.data() + word.size(), v);
  return ec == std::errc{} && used == word.data() + word.size() && !word.empty() ? std::optional(v) : std::nullopt;
}

// `words` from the first data byte on. False where a byte is missing or none.
bool take_data(const Words& words, std::size_t from, std::size_t length, int base, BusFrame& frame) {
  if (length > (frame.fd ? 64u : 8u) || from + length > words.size()) return false;
  for (std::size_t i = 0; i < length; ++i) {
    const auto byte = whole(words[from + i], base);
    if (!byte || *byte > 255) return false;
    frame.data[i] = static_cast<std::uint8_t>(*byte);
  }
  frame.length = static_cast<std::uint8_t>(length);
  return true;
}

bool take_id(std::string_view word, int base, bool extended, BusFrame& frame) {
  const auto id = whole(word, base);
  if (!id || *id >= (extended ? 1u << 29 : 1u << 11)) return false;
  frame.id = *id;
  frame.extended = extended;
  return true;
}

enum class Line { passed_over, frame, remote, error, damaged };

BusLog parse_lines(std::string_view text, const std::string& name, const char* program,
                   const std::function<Line(const Words&, LoggedFrame&)>& parse) {
  BusLog log;
  log.interfaces.emplace_back();
  std::size_t number_of_line = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const bool ended = end < text.size();
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    ++number_of_line;
    LoggedFrame entry;
    switch (parse(words_of(line), entry)) {
      case Line::frame:
        log.frames.push_back(entry);
        break;
      case Line::remote:
        ++log.skipped_remote;
        break;
      case Line::error:
        ++log.skipped_error;
        break;
      case Line::damaged:
        if (!ended) {
          log.notes.push_back("line " + std::to_string(number_of_line) + " was cut off and is left out");
          break;
        }
        throw Error({.where = name + ":" + std::to_string(number_of_line),
                     .what = std::string("holds no frame as ") + program + " writes it, found \"" + std::string(line.substr(0, 80)) + "\"",
                     .likely = "a damaged line, or a version of the format that is not known here",
                     .remedy = "repair or remove the line, or record with candump -L"});
      case Line::passed_over:
        break;
    }
  }
  return log;
}

// What ";$NAME=" is followed by; empty without it.
std::string_view trc_key(std::string_view text, std::string_view key) {
  const auto at = text.find(key);
  if (at == std::string_view::npos) return {};
  const auto from = at + key.size();
  return text.substr(from, std::min(text.find_first_of("\r\n", from), text.size()) - from);
}

std::int64_t since_1970_ns(double days_since_1899) {
  constexpr double kDaysTo1970 = 25569.0;  // from 1899-12-30, the day zero of STARTTIME
  return days_since_1899 > kDaysTo1970 ? std::llround((days_since_1899 - kDaysTo1970) * 86400.0 * 1e6) * 1000 : 0;
}

// One row of version 2, by the letters of its columns.
Line trc_by_columns(const Words& w, std::string_view columns, std::int64_t start_ns, LoggedFrame& out) {
  std::size_t length = 0, at = 0;
  std::string_view type = "DT", id;
  for (const char c : columns) {
    if (c == ',') continue;
    if (c == 'D') break;  // data stands last
    if (at >= w.size()) return Line::damaged;
    const std::string_view word = w[at++];
    if (c == 'O') {
      const auto ms = number(word);
      if (!ms) return Line::damaged;
      out.time_ns = start_ns + std::llround(*ms * 1e3) * 1000;
    }
    if (c == 'T') type = word;
    if (c == 'I') id = word;
    if (c == 'l' || c == 'L') {
      const auto n = whole(word, 10);
      if (!n) return Line::damaged;
      length = *n <= 8 || c == 'l' ? *n : std::array<std::size_t, 16>{0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64}[*n & 15u];
    }
  }
  if (type == "RR") return Line::remote;
  if (type == "ER" || type == "EC" || type == "ST" || type == "EV") return type == "EV" ? Line::passed_over : Line::error;
  out.frame.fd = type.starts_with("F") || type == "BI";
  out.frame.bit_rate_switch = type == "FB" || type == "BI";
  return take_id(id, 16, id.size() > 4, out.frame) && take_data(w, at, length, 16, out.frame) ? Line::frame : Line::damaged;
}

// Versions 1: "1)  1059.9  Rx  0300  8  00 …", without the type in 1.0, with a bus before and "-" behind the type in 1.2 and 1.3.
Line trc_version_1(const Words& w, std::int64_t start_ns, LoggedFrame& out) {
  std::size_t at = 1;
  const auto ms = at < w.size() ? number(w[at++]) : std::nullopt;
  if (!ms) return Line::damaged;
  out.time_ns = start_ns + std::llround(*ms * 1e3) * 1000;
  if (at < w.size() && w[at].size() == 1 && at + 1 < w.size() && !whole(w[at + 1], 16)) ++at;  // the bus
  if (at < w.size() && (w[at] == "Error" || w[at] == "Warng")) return Line::error;
  if (at < w.size() && (w[at] == "Rx" || w[at] == "Tx")) ++at;
  if (at >= w.size()) return Line::damaged;
  const std::string_view id = w[at++];
  if (at < w.size() && w[at] == "-") ++at;
  const auto length = at < w.size() ? whole(w[at++], 10) : std::nullopt;
  if (!length) return Line::damaged;
  if (at < w.size() && w[at] == "RTR") return Line::remote;
  return take_id(id, 16, id.size() > 4, out.frame) && take_data(w, at, *length, 16, out.frame) ? Line::frame : Line::damaged;
}

// "0.015991 1  1F334455x  Rx  d 8 0A …", or "0.015991 CANFD 1 Rx 1F334455x [name] 1 0 d 64 …" with BRS, ESI, code and length.
Line asc_line(const Words& w, int base, LoggedFrame& out) {
  const auto seconds = w.empty() ? std::nullopt : number(w[0]);
  if (!seconds || w.size() < 3) return Line::passed_over;
  out.time_ns = std::llround(*seconds * 1e6) * 1000;
  const bool fd_row = w[1] == "CANFD";
  if (std::find(w.begin(), w.end(), "ErrorFrame") != w.end()) return Line::error;
  std::size_t at = 2;
  if (fd_row) at = 4;
  if (!fd_row && !whole(w[1], 10)) return Line::passed_over;
  if (at >= w.size()) return Line::damaged;
  std::string_view id = w[at++];
  const bool extended = id.ends_with("x");
  if (extended) id.remove_suffix(1);
  if (!whole(id, base)) return Line::passed_over;  // "Statistic:" and other events
  if (fd_row) {
    if (at < w.size() && w[at] != "0" && w[at] != "1") ++at;  // the name of the message
    if (at + 3 >= w.size()) return Line::damaged;
    out.frame.bit_rate_switch = w[at] == "1";
    const auto length = whole(w[at + 3], 10);
    out.frame.fd = true;
    return length && take_id(id, base, extended, out.frame) && take_data(w, at + 4, *length, base, out.frame) ? Line::frame : Line::damaged;
  }
  if (at + 1 >= w.size()) return Line::damaged;
  if (w[at + 1] == "r") return Line::remote;
  const auto length = at + 2 < w.size() ? whole(w[at + 2], 16) : std::nullopt;
  if (w[at + 1] != "d" || !length) return Line::damaged;
  return take_id(id, base, extended, out.frame) && take_data(w, at + 3, *length, base, out.frame) ? Line::frame : Line::damaged;
}

}  // namespace

bool looks_like_trc(std::string_view text) { return text.starts_with(";$FILEVERSION") || text.starts_with(";##########"); }

bool looks_like_asc(std::string_view text) {
  const std::string_view head = text.substr(0, 400);
  return head.starts_with("date ") || head.find("base hex") != std::string_view::npos || head.find("base dec") != std::string_view::npos;
}

BusLog parse_trc(std::string_view text, const std::string& name) {
  const std::string_view columns = trc_key(text, ";$COLUMNS="), start = trc_key(text, ";$STARTTIME=");
  const std::int64_t start_ns = since_1970_ns(number(start).value_or(0.0));
  return parse_lines(text, name, "PCAN-View", [&](const Words& w, LoggedFrame& out) {
    if (w.empty() || w[0].starts_with(";")) return Line::passed_over;
    return columns.empty() ? trc_version_1(w, start_ns, out) : trc_by_columns(w, columns, start_ns, out);
  });
}

BusLog parse_asc(std::string_view text, const std::string& name) {
  const std::string_view head = text.substr(0, 400);
  const int base = head.find("base dec") != std::string_view::npos ? 10 : 16;
  const bool relative = head.find("timestamps relative") != std::string_view::npos;  // to the line before, whatever that told
  std::int64_t before_ns = 0;
  return parse_lines(text, name, "Vector's programs", [&](const Words& w, LoggedFrame& out) {
    const Line line = asc_line(w, base, out);
    if (relative) out.time_ns = before_ns += out.time_ns;
    return line;
  });
}

}  // namespace rotorloop
