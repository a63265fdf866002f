#include "bench/sysid/log/log_mapping.hpp"

#include <fmt/format.h>

#include <charconv>
#include <set>

#include "host/base/toml_file.hpp"

namespace rotorloop::log {
namespace {

struct QuantityTraits {
  LogQuantity quantity;
  std::string_view name;
  std::size_t columns;
  std::string_view si;  // "" when any unit will do
};
constexpr std::array kQuantities{
    QuantityTraits{LogQuantity::pose, "pose", 3, "m"},
    QuantityTraits{LogQuantity::position, "position", 3, "m"},
    QuantityTraits{LogQuantity::velocity, "velocity", 3, "m/s"},
    QuantityTraits{LogQuantity::gyro, "gyro", 3, "rad/s"},
    QuantityTraits{LogQuantity::accel, "accel", 3, "m/s2"},
    QuantityTraits{LogQuantity::rotor_speed, "rotor_speed", 4, "rad/s"},
    QuantityTraits{LogQuantity::motor_command, "motor_command", 4, "1"},
    QuantityTraits{LogQuantity::battery, "battery", 1, "V"},
    QuantityTraits{LogQuantity::extra, "extra", 1, ""},
    QuantityTraits{LogQuantity::attitude, "attitude", 4, "1"},
};
constexpr QuantityTraits kAngles{LogQuantity::attitude, "attitude", 3, "rad"};
const QuantityTraits& traits(LogQuantity q) { return kQuantities[static_cast<std::size_t>(q)]; }

constexpr Range kAnything{-1e12, 1e12, "1"};

MappedTime read_time(const TomlTable& t, const MappedTime& fallback) {
  MappedTime time;
  time.column = fallback.column.empty() ? t.text("column") : t.text("column", fallback.column);
  time.nanoseconds = t.text("nanoseconds", "");
  if (t.has("rate_Hz")) {  // the column counts frames
    if (t.has("unit"))
      t.fail("rate_Hz", "rate_Hz and unit both say what a step of the column is", "",
             "give rate_Hz where the column counts frames, unit where it holds a time");
    time.s_per_unit = 1.0 / t.number("rate_Hz", {0.1, 1e6, "Hz"});
  } else {
    time.s_per_unit = find_log_unit(t.choice("unit", {"s", "ms", "us", "ns"}))->factor;
  }
  time.where = t.where();
  return time;
}

MappedColumn read_column(const TomlTable& t, const std::string& text) {
  if (!text.starts_with("=")) {
    if (text.empty()) t.fail("columns", "has an empty name", "", "give a column's name, or a constant such as \"= 0\"");
    return {text, std::nullopt};
  }
  const auto first = text.find_first_not_of(" ", 1);
  double v = 0.0;
  const char* const end = text.data() + text.size();
  const char* const begin = first == std::string::npos ? end : text.data() + first;
  const auto [used, ec] = std::from_chars(begin, end, v);
  if (ec != std::errc{} || used != end || !(v - v == 0.0))
    t.fail("columns", fmt::format("\"{}\" is not a constant", text), "", "write \"= 0.5\", or a column's name without the equals sign");
  return {text, v};
}

void read_columns(const TomlTable& t, const QuantityTraits& q, MappedStream& s) {
  const auto names = t.texts("columns");
  if (names.size() != q.columns)
    t.fail("columns", fmt::format("{} has {} columns, expected {}", q.name, names.size(), q.columns),
           q.quantity == LogQuantity::attitude ? "an attitude is a quaternion, or with `euler` three angles about x, y and z"
           : q.columns == 4                    ? "columns are those of our rotors 1 front right, 2 rear left, 3 front left, 4 rear right"
                                               : "",
           q.columns == 1   ? "give one column"
           : q.columns == 3 ? "give x, y and z"
                            : "give one column for each rotor");
  std::set<std::string> seen;
  for (const auto& n : names) {
    s.columns.push_back(read_column(t, n));
    if (!s.columns.back().constant && !seen.insert(n).second)
      t.fail("columns", fmt::format("names \"{}\" twice", n), "a slip of copying", "name each column once");
  }
}

// Brackets at the end of an extra's name: "payload_x[m]" is in m.
std::string_view unit_in_name(std::string_view name) {
  const auto open = name.rfind('[');
  if (open == std::string_view::npos || !name.ends_with("]") || open == 0) return {};
  return name.substr(open + 1, name.size() - open - 2);
}

void read_unit(const TomlTable& t, const QuantityTraits& q, MappedStream& s) {
  const std::string unit = t.text("unit", q.quantity == LogQuantity::motor_command ? "1" : "");
  const std::string_view expected = q.quantity == LogQuantity::extra ? unit_in_name(s.extra_name) : q.si;
  if (unit.empty()) (void)t.text("unit");  // throws: the key is missing
  const LogUnit* const u = find_written_unit(unit, expected);
  if (!u || u->si != expected)
    t.fail("unit", fmt::format("unit = \"{}\" is no unit of {}", unit, s.label()), "",
           fmt::format("use one of: {}", log_units_of(expected)));
  double factor = u->factor * t.number("scale", {-1e9, 1e9, "1"}, 1.0);
  if (factor == 0.0) t.fail("scale", "scale = 0 leaves nothing", "", "leave it out, or give the factor");
  if (u->electrical) factor /= static_cast<double>(t.integer("pole_pairs", 1, 30));
  std::vector<double> sign(s.columns.size(), 1.0);
  if (t.has("sign")) sign = t.numbers("sign", s.columns.size(), {-1.0, 1.0, "1"});
  for (const double x : sign) {
    if (x != 1.0 && x != -1.0)
      t.fail("sign", fmt::format("sign holds {}, expected 1 or -1", number_text(x)), "", "give 1 or -1 for each column");
    s.to_si.push_back(x * factor);
  }
}

// Which way the quaternion turns, what the axes are, and in which of the two frames the vector stands.
void read_frames(const TomlTable& t, const TomlTable& root, const QuantityTraits& q, MappedStream& s) {
  const auto axes = root.optional_table("axes");
  const auto read = [&](const char* key, const char* up, const char* down) {
    const std::string whole = axes ? axes->choice(key, {up, down, "y_up"}, up) : up;
    const std::string own = t.choice(key, {up, down, "y_up"}, whole);
    return own == "y_up" ? LogAxes::y_up : own == down ? LogAxes::z_down : LogAxes::z_up;
  };
  s.world = read("world", "W", "NED");
  s.body = read("body", "B", "FRD");
  if (q.columns != 3 && q.quantity != LogQuantity::attitude) return;
  s.world_to_body = t.choice("direction", {"body_to_world", "world_to_body"}, "body_to_world") == "world_to_body";
  if (q.quantity == LogQuantity::attitude) return;
  if (t.has("quaternion")) {
    s.quaternion = t.texts("quaternion");
    if (s.quaternion.size() != 4)
      t.fail("quaternion", fmt::format("quaternion has {} columns, expected 4", s.quaternion.size()), "",
             "give the columns of w, x, y, z, in this order");
    if (std::set<std::string>(s.quaternion.begin(), s.quaternion.end()).size() != 4)
      t.fail("quaternion", "quaternion names a column twice", "a slip of copying", "give the columns of w, x, y, z, in this order");
  }
  const bool world_by_nature =
      q.quantity == LogQuantity::pose || q.quantity == LogQuantity::position || q.quantity == LogQuantity::velocity;
  const std::string frame = t.choice("frame", {"world", "body"}, world_by_nature ? "world" : "body");
  s.in_world_axes = frame == "world";
  if ((q.quantity == LogQuantity::pose || q.quantity == LogQuantity::position) && !s.in_world_axes)
    t.fail("frame", fmt::format("frame = \"body\" has no meaning for a {}", q.name), "", "leave it out");
  if (q.quantity == LogQuantity::accel) s.gravity_removed = t.choice("gravity", {"included", "removed"}, "included") == "removed";
  const bool must_turn = s.in_world_axes != world_by_nature || s.gravity_removed;
  if ((must_turn || q.quantity == LogQuantity::pose) && s.quaternion.empty())
    t.fail("quaternion", fmt::format("{} needs an attitude and none is given", q.name),
           q.quantity == LogQuantity::pose ? "" : "it must be turned between world and body",
           q.quantity == LogQuantity::pose ? "give the columns of w, x, y, z; a position without attitude is quantity = \"position\""
                                           : "give the columns of w, x, y, z of the same table in `quaternion`");
}

MappedStream read_stream(const TomlTable& t, const TomlTable& root, const std::vector<MappedSource>& sources) {
  MappedStream s;
  s.where = t.where();
  const std::string word = t.choice(
      "quantity", {"pose", "position", "attitude", "velocity", "gyro", "accel", "rotor_speed", "motor_command", "battery", "extra"});
  for (const auto& q : kQuantities)
    if (q.name == word) s.quantity = q.quantity;
  if (s.quantity == LogQuantity::attitude && t.has("euler"))
    s.euler = t.choice("euler", {"zyx", "zxy", "yzx", "yxz", "xyz", "xzy", "vector"});
  const QuantityTraits& q = s.euler.empty() ? traits(s.quantity) : kAngles;
  if (s.quantity == LogQuantity::extra) {
    s.extra_name = t.text("name");
    const auto unit = unit_in_name(s.extra_name);
    if (unit.empty() || log_units_of(unit).empty() || s.extra_name.find_first_of(",\n\r\"") != std::string::npos)
      t.fail("name", fmt::format("name = \"{}\" does not end in an SI unit", s.extra_name), "",
             "write for example \"payload_x[m]\"; without comma, quote or line feed");
  }
  const std::string from = t.text("from", "");
  s.source = sources.size();
  std::string known;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if (sources[i].name == from) s.source = i;
    known += (known.empty() ? "" : ", ") + (sources[i].name.empty() ? std::string("(left out: the log itself)") : sources[i].name);
  }
  if (s.source == sources.size())
    t.fail(t.has("from") ? "from" : "quantity", fmt::format("from = \"{}\" is no source of this mapping", from), "",
           fmt::format("use one of: {}; or add [source.{}]", known, from.empty() ? "NAME" : from));
  read_columns(t, q, s);
  read_unit(t, q, s);
  read_frames(t, root, q, s);
  if (s.quantity == LogQuantity::attitude && s.euler.empty()) {
    for (const MappedColumn& c : s.columns) s.quaternion.push_back(c.name);
    s.columns.clear();
  }
  if (s.quantity == LogQuantity::motor_command) {
    s.zero = t.number("zero", kAnything, 0.0);
    s.full_scale = t.number("full_scale", kAnything);
    if (s.full_scale == s.zero)
      t.fail("full_scale", "full_scale equals zero: every command would be the same", "", "give the value of full thrust");
  }
  s.drop_held = t.choice("held", {"keep", "drop"}, "keep") == "drop";
  s.blank = t.choice("blank", {"skip", "refuse"}, "skip") == "refuse" ? BlankPolicy::refuse : BlankPolicy::skip;
  if (t.has("missing_value")) s.missing_value = t.number("missing_value", kAnything);
  if (const auto c = t.optional_table("only_if")) s.only_if = MappedCondition{c->text("column"), c->number("is", kAnything)};
  s.time_offset_s = t.number("time_offset_s", {-10.0, 10.0, "s"}, 0.0);
  s.optional = t.boolean("optional", s.quantity == LogQuantity::extra);  // nothing is fitted to an extra
  return s;
}

void read_sources(const TomlTable& root, LogMapping& m) {
  MappedTime own;
  if (m.kind == LogKind::csv) {
    const auto time = root.table("time");
    own = read_time(time, {});
    m.start_at_zero = time.choice("start", {"as_logged", "zero"}, "as_logged") == "zero";
    m.sources.push_back({"", "", "", 0, own, root.where()});
  } else if (const auto time = root.optional_table("time")) {
    m.start_at_zero = time->choice("start", {"as_logged", "zero"}, "as_logged") == "zero";
  }
  const auto table = root.optional_table("source");
  if (!table) return;
  for (const auto& key : table->keys()) {
    const auto t = table->table(key);
    MappedSource s;
    s.name = key;
    s.where = t.where();
    if (m.kind == LogKind::csv) {
      s.suffix = t.text("suffix");
      if (s.suffix.empty() || s.suffix.find_first_of("/\\") != std::string::npos)
        t.fail("suffix", fmt::format("suffix = \"{}\" does not name a file beside the log", s.suffix), "",
               "give what follows the log's stem, for example \"_mocap.csv\"");
      const auto time = t.optional_table("time");
      s.time = time ? read_time(*time, own) : own;
    } else if (m.kind == LogKind::dataflash) {
      s.topic = t.text("message");
      s.multi_id = static_cast<int>(t.integer("instance", 0, 255, 0));
      s.time = {t.text("time_column", "TimeUS"), "", 1e-6, t.where()};
    } else {
      s.topic = t.text("topic");
      s.multi_id = static_cast<int>(t.integer("multi_id", 0, 255, 0));
      s.time = {t.text("time_column", "timestamp"), "", 1e-6, t.where()};  // ULog's stamps are in µs
    }
    m.sources.push_back(std::move(s));
  }
}

LogMapping from_toml(const TomlFile& file) {
  file.format({1});
  const TomlTable root = file.root();
  LogMapping m;
  m.path = file.path();
  m.name = root.text("name");
  const std::string kind = root.choice("log", {"csv", "ulog", "dataflash"});
  m.kind = kind == "ulog" ? LogKind::ulog : kind == "dataflash" ? LogKind::dataflash : LogKind::csv;
  if (m.kind == LogKind::csv) {
    const std::string separator = root.choice("separator", {",", ";", "tab"}, ",");
    m.separator = separator == "tab" ? '\t' : separator[0];
  }
  read_sources(root, m);
  for (const auto& t : root.tables("stream", 1, 200)) m.streams.push_back(read_stream(t, root, m.sources));
  file.refuse_unknown_keys();
  return m;
}

}  // namespace

std::string_view name(LogKind kind) { return kind == LogKind::csv ? "CSV" : kind == LogKind::ulog ? "ULog" : "DataFlash"; }
std::string_view name(LogQuantity quantity) { return traits(quantity).name; }

std::string MappedStream::label() const { return quantity == LogQuantity::extra ? "extra " + extra_name : std::string(name(quantity)); }

LogMapping read_log_mapping(const std::filesystem::path& path) { return from_toml(TomlFile::read(path)); }
LogMapping parse_log_mapping(std::string_view text, const std::filesystem::path& name_for_errors) {
  return from_toml(TomlFile::parse(text, name_for_errors));
}

}  // namespace rotorloop::log
