#include "bench/stand/evaluate/stand_mapping.hpp"

#include <fmt/format.h>

#include "bench/sysid/log/log_units.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::stand {
namespace {

struct QuantityTraits {
  StandQuantity quantity;
  std::string_view name, si;
};
constexpr std::array kQuantities{
    QuantityTraits{StandQuantity::rotor_speed, "rotor_speed", "rad/s"},
    QuantityTraits{StandQuantity::thrust, "thrust", "N"},
    QuantityTraits{StandQuantity::torque, "torque", "N m"},
    QuantityTraits{StandQuantity::voltage, "voltage", "V"},
    QuantityTraits{StandQuantity::current, "current", "A"},
    QuantityTraits{StandQuantity::airspeed, "airspeed", "m/s"},
    QuantityTraits{StandQuantity::command, "command", "1"},
};

StandChannel read_channel(const TomlTable& t, bool has_join) {
  StandChannel c;
  c.where = t.where();
  const std::string word = t.choice("quantity", {"rotor_speed", "thrust", "torque", "voltage", "current", "airspeed", "command"});
  std::string_view si;
  for (const auto& q : kQuantities)
    if (q.name == word) {
      c.quantity = q.quantity;
      si = q.si;
    }
  c.columns = t.texts("columns");
  const std::size_t most = c.quantity == StandQuantity::rotor_speed ? 4 : 1;
  if (c.columns.empty() || c.columns.size() > most)
    t.fail("columns", fmt::format("{} has {} columns, expected 1{}", word, c.columns.size(), most > 1 ? " to 4" : ""), "",
           most > 1 ? "give one column for each rotor on the stand" : "give one column");
  const std::string unit = t.text("unit", c.quantity == StandQuantity::command ? "1" : "");
  const log::LogUnit* const u = log::find_written_unit(unit, si);
  if (!u || u->si != si)
    t.fail("unit", fmt::format("unit = \"{}\" is no unit of {}", unit, word), "", fmt::format("use one of: {}", log::log_units_of(si)));
  c.to_si = u->factor * t.number("scale", {-1e9, 1e9, "1"}, 1.0);
  if (c.to_si == 0.0) t.fail("scale", "scale = 0 leaves nothing", "", "leave it out, or give the factor; -1 turns the sign");
  if (u->electrical) c.to_si /= static_cast<double>(t.integer("pole_pairs", 1, 30));
  c.joined = t.choice("from", {"file", "join"}, "file") == "join";
  if (c.joined && !has_join) t.fail("from", "from = \"join\", and the mapping has no [join]", "", "add [join] with file, key and to");
  return c;
}

std::optional<std::array<std::size_t, 2>> read_part(const TomlTable& t, std::string_view key) {
  if (!t.has(key)) return std::nullopt;
  const auto v = t.integers(key, 0, 200);
  if (v.size() != 2 || v[1] < 1)
    t.fail(key, fmt::format("{} holds {} numbers", key, v.size()), "", "give place and length of the part of the name, such as [0, 1]");
  return std::array{static_cast<std::size_t>(v[0]), static_cast<std::size_t>(v[1])};
}

StandMapping from_toml(const TomlFile& file) {
  file.format({1});
  const TomlTable root = file.root();
  StandMapping m;
  m.path = file.path();
  m.name = root.text("name");
  const std::string separator = root.choice("separator", {",", ";", "tab", "blank"}, ",");
  m.separator = separator == "tab" ? '\t' : separator == "blank" ? ' ' : separator[0];
  if (root.has("header")) m.header = root.texts("header");
  if (const auto t = root.optional_table("time")) {
    m.time_column = t->text("column");
    m.s_per_unit = log::find_log_unit(t->choice("unit", {"s", "ms", "us"}))->factor;
  }
  if (const auto t = root.optional_table("series")) {
    if (!m.time_column) t->fail("average_s", "[series] without [time]", "", "add [time] with column and unit");
    m.average_s = t->number("average_s", {1e-3, 60.0, "s"});
    m.slope_max_rad_s2 = t->number("slope_max_rad_s2", {1e-3, 1e6, "rad/s^2"});
  }
  if (const auto t = root.optional_table("join")) m.join = StandJoin{t->text("file"), t->text("key"), t->text("to")};
  if (const auto t = root.optional_table("shaft_power")) m.efficiency = t->number("efficiency", {0.05, 1.0, "1"});
  if (const auto t = root.optional_table("keep")) {
    m.omega_max_rad_s = t->number("omega_max_rad_s", {1.0, 1e5, "rad/s"}, m.omega_max_rad_s);
    m.shaft_power_min_W = t->number("shaft_power_min_W", {0.0, 1e6, "W"}, 0.0);
  }
  if (const auto t = root.optional_table("propeller")) {
    if (t->has("diameter_m")) m.diameter_m = t->number("diameter_m", {0.01, 10.0, "m"});
    m.density_given = t->has("air_density_kg_m3");
    m.air_density_kg_m3 = t->number("air_density_kg_m3", {0.5, 1.5, "kg/m^3"}, m.air_density_kg_m3);
  }
  if (const auto t = root.optional_table("file_name")) {
    m.motor_in_name = read_part(*t, "motor");
    m.propeller_in_name = read_part(*t, "propeller");
  }
  for (const auto& t : root.tables("channel", 1, 40)) m.channels.push_back(read_channel(t, m.join.has_value()));
  file.refuse_unknown_keys();
  return m;
}

}  // namespace

std::string_view name(StandQuantity q) { return kQuantities[static_cast<std::size_t>(q)].name; }

StandMapping read_stand_mapping(const std::filesystem::path& path) { return from_toml(TomlFile::read(path)); }
StandMapping parse_stand_mapping(std::string_view text, const std::filesystem::path& name_for_errors) {
  return from_toml(TomlFile::parse(text, name_for_errors));
}

}  // namespace rotorloop::stand
