#include "bench/sysid/identify/parameter_names.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <map>
#include <vector>

#include "host/effects/term.hpp"

namespace rotorloop::identify {
namespace {

// In the order of enum Parameter.
constexpr std::array<std::string_view, estimate::kCoreParameters> kMeaning{{
    "mass; weighed, never from flight",
    "moment of inertia about x (roll)",
    "moment of inertia about y (pitch)",
    "moment of inertia about z (yaw)",
    "product of inertia of x and y",
    "product of inertia of x and z",
    "product of inertia of y and z",
    "torque of a rotor by the square of its speed",
    "centre of mass ahead of the geometric centre",
    "centre of mass to the left of the geometric centre",
    "thrust by the square of the speed, without flow through the rotor",
    "thrust by the product of speed and flow through the rotor",
    "drag of the rotors: in their plane, by thrust and speed",
    "drag of the airframe in its plane, by the square of the speed",
    "drag of the airframe along z, by the square of the speed",
    "lean of the pose sensor's world against gravity, along x",
    "lean of the pose sensor's world against gravity, along y",
    "place of the pose sensor ahead of the centre of mass",
    "place of the pose sensor to the left of the centre of mass",
    "place of the pose sensor above the centre of mass",
    "turn of the pose sensor about x, from the vehicle file's",
    "turn of the pose sensor about y, from the vehicle file's",
    "turn of the pose sensor about z, from the vehicle file's",
    "stamps of poses later than the moment they show",
    "constant offset of the gyro about x",
    "constant offset of the gyro about y",
    "constant offset of the gyro about z",
    "constant offset of the accelerometer along x",
    "constant offset of the accelerometer along y",
    "constant offset of the accelerometer along z",
    "place of the IMU ahead of the centre of mass",
    "place of the IMU to the left of the centre of mass",
    "place of the IMU above the centre of mass",
    "stamps of rotor speeds later than the moment they show",
    "rise of rotor speed from command 0 to 1, at the reference voltage",
    "rotor speed at command 0, at the reference voltage",
    "rotor speed goes with this power of the battery's voltage",
    "time constant from command to rotor speed",
}};
static_assert(!kMeaning.back().empty(), "every parameter has a meaning");

// A symbol counts by characters, not bytes.
std::string padded(const std::string& text, std::size_t width) {
  const auto shown = static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
  return text + std::string(width > shown ? width - shown : 1, ' ');
}

// All that stands before a dot and has several parameters: "pose_sensor", "pose_sensor.offset".
std::vector<std::string> groups() {
  std::map<std::string, int> members;
  for (int p = 0; p < estimate::kCoreParameters; ++p) {
    const std::string name = estimate::parameter_info(p, {}).name;
    for (std::size_t dot = name.find('.'); dot != std::string::npos; dot = name.find('.', dot + 1)) ++members[name.substr(0, dot)];
  }
  std::vector<std::string> out;
  for (const auto& [group, count] : members) {
    if (count > 1) out.push_back(group);
  }
  return out;
}

}  // namespace

std::string_view meaning_of(estimate::Parameter parameter) { return kMeaning[static_cast<std::size_t>(parameter)]; }

std::string names_table(const host::EffectCatalogue& catalogue) {
  std::string out = "Parameters, for --free, --hold and --per-flight, by name or by symbol:\n";
  for (int p = 0; p < estimate::kCoreParameters; ++p) {
    const estimate::ParameterInfo info = estimate::parameter_info(p, {});
    out += fmt::format("  {}{}{}{}\n", padded(info.name, 24), padded(info.symbol, 10), padded(info.unit, 9),
                       meaning_of(static_cast<estimate::Parameter>(p)));
  }
  out += fmt::format("Groups of them: {}\n", fmt::join(groups(), ", "));
  out += "\nTerms, for --term; once added their parameters are effect.TERM.NAME, all of one effect.TERM:\n";
  for (const host::Term& term : host::all_terms()) {
    const std::string id(term.info.id);
    std::vector<std::string> numbers;
    for (const host::TermParameter& p : term.info.parameters) numbers.push_back(fmt::format("{} [{}]", p.name, p.unit));
    const host::CatalogueEffect* row = catalogue.find(id);
    out += fmt::format("  {}{}; {}\n", padded(id, 28), row ? row->name : id, fmt::join(numbers, ", "));
  }
  return out;
}

}  // namespace rotorloop::identify
