#include "bench/sysid/identify/parameter_choice.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <set>

#include "bench/sysid/identify/start_values.hpp"
#include "host/base/error.hpp"
#include "host/base/nearest.hpp"

namespace rotorloop::identify {
namespace {

// Accelerometer biases of small IMUs, over temperature and mounting: without poses only this keeps bias and lean apart.
constexpr double kAccelBiasPrior_m_s2 = 0.3;

[[noreturn]] void unknown(const std::string& name, const host::TermList& terms) {
  std::vector<std::string> names;
  for (int i = 0; i < estimate::kCoreParameters + static_cast<int>(terms.parameters()); ++i)
    names.push_back(estimate::parameter_info(i, terms).name);
  throw Error(
      {name, "is no parameter of this model", "a misspelt name, or a term that was not added with --term",
       did_you_mean(name, names) + fmt::format("use one of {}", fmt::join(names, ", ")) + ", or a group such as drag or pose_sensor"});
}

struct NamedNumber {
  std::string name;
  double u = 0.0;
};
NamedNumber with_prior(const std::string& text) {
  const auto at = text.find('=');
  if (at == std::string::npos) return {text, 0.0};
  NamedNumber out{text.substr(0, at), 0.0};
  const char *begin = text.data() + at + 1, *end = text.data() + text.size();
  if (const auto r = std::from_chars(begin, end, out.u); r.ec != std::errc{} || r.ptr != end || !(out.u > 0.0))
    throw Error({text, "wants a standard deviation above 0 after the equals sign, in SI units", "", "for example --free accel_bias=0.3"});
  return out;
}

// What the user frees, holds, or wants for each flight by itself.
void apply(const ParameterSelection& wishes, const host::TermList& terms, bool several, std::vector<estimate::FreeParameter>& out) {
  for (const std::string& text : wishes.free) {
    const NamedNumber wish = with_prior(text);
    for (const int p : parameters_named(wish.name, terms)) {
      const auto found = std::find_if(out.begin(), out.end(), [&](const estimate::FreeParameter& f) { return f.parameter == p; });
      if (found == out.end()) {
        out.push_back({p, false, wish.u});
      } else if (wish.u > 0.0) {
        found->prior_u = wish.u;
      }
    }
  }
  for (const std::string& name : wishes.hold) {
    const auto held = parameters_named(name, terms);
    std::erase_if(out, [&](const estimate::FreeParameter& f) { return std::find(held.begin(), held.end(), f.parameter) != held.end(); });
  }
  for (const std::string& name : wishes.per_flight) {
    for (const int p : parameters_named(name, terms)) {
      for (estimate::FreeParameter& f : out) f.per_flight = f.per_flight || (f.parameter == p && several);
    }
  }
}

}  // namespace

std::vector<int> parameters_named(const std::string& name, const host::TermList& terms) {
  if (const int one = estimate::find_parameter(name, terms); one >= 0) return {one};
  std::vector<int> out;
  for (int i = 0; i < estimate::kCoreParameters + static_cast<int>(terms.parameters()); ++i) {
    if (estimate::parameter_info(i, terms).name.starts_with(name + ".")) out.push_back(i);
  }
  if (out.empty()) unknown(name, terms);
  return out;
}

double prior_u_of(const host::VehicleFile& vehicle, int parameter, const host::TermList& terms) {
  const std::string name = estimate::parameter_info(parameter, terms).name;
  const bool rotor =
      std::find(estimate::kRotorInertiaNames.begin(), estimate::kRotorInertiaNames.end(), name) != estimate::kRotorInertiaNames.end();
  return host::uncertainty_of(vehicle, name).value_or(rotor ? vehicle.rotor_inertia_kg_m2.u : 0.0);
}

std::vector<estimate::FreeParameter> choose_parameters(std::span<const estimate::GridFlight> flights, const host::VehicleFile& vehicle,
                                                       const host::TermList& terms, const ParameterSelection& wishes) {
  const auto any = [&](auto&& has) { return std::any_of(flights.begin(), flights.end(), has); };
  const bool pose = any([](const estimate::GridFlight& g) { return !g.pose.empty(); });
  const bool place = pose || any([](const estimate::GridFlight& g) { return !g.position.empty(); });
  const bool gyro = any([](const estimate::GridFlight& g) { return !g.gyro.empty(); });
  const bool accel = any([](const estimate::GridFlight& g) { return !g.accel.empty(); });
  const bool commands = any([](const estimate::GridFlight& g) { return g.input.from_commands(); });
  const bool speeds = any([](const estimate::GridFlight& g) { return !g.input.from_commands(); });
  const bool battery = commands && !any([](const estimate::GridFlight& g) { return g.input.from_commands() && mean_battery_V(g) <= 0.0; });

  std::vector<estimate::FreeParameter> out;
  const auto add = [&](int parameter, bool per_flight = false, double prior_u = 0.0) { out.push_back({parameter, per_flight, prior_u}); };
  // All forces and inertias scale with the mass: only the scales know it, and their uncertainty belongs into every other.
  if (const double u = prior_u_of(vehicle, estimate::kMass, terms); u > 0.0) add(estimate::kMass, false, u);
  for (const int p : {estimate::kIxx, estimate::kIyy, estimate::kIzz, estimate::kCq, estimate::kComX, estimate::kComY}) add(p);
  if (speeds) add(estimate::kK1);  // with commands alone their gain stands in its place
  if (place) add(estimate::kK2);   // climb speed is known from places only
  add(estimate::kCdh);
  if (place) {
    add(estimate::kCdxy);
    add(estimate::kCdz);
  }
  if (pose) {
    for (const int p : {estimate::kOffsetX, estimate::kOffsetY, estimate::kOffsetZ, estimate::kTurnX, estimate::kTurnY, estimate::kTurnZ,
                        estimate::kPoseDelay})
      add(p);
  }
  for (int i = 0; gyro && i < 3; ++i) add(estimate::kGyroBiasX + i, flights.size() > 1);
  for (int i = 0; accel && i < 3; ++i) add(estimate::kAccelBiasX + i, flights.size() > 1, pose ? 0.0 : kAccelBiasPrior_m_s2);
  if (commands) {
    add(estimate::kCommandGain);
    add(estimate::kCommandLag);
  }
  if (battery) add(estimate::kVoltageExponent);
  // The state of a dynamic term at the start is the flight's own.
  for (std::size_t k = 0; k < terms.parameters(); ++k) {
    const int parameter = estimate::kCoreParameters + static_cast<int>(k);
    if (!terms.is_start(k)) {
      add(parameter);
    } else if (const double u = terms.start_u(k); u > 0.0) {
      add(parameter, flights.size() > 1, u);
    }
  }

  apply(wishes, terms, flights.size() > 1, out);
  if (out.empty()) throw Error({"--hold", "leaves no parameter free", "", "hold fewer"});
  return out;
}

}  // namespace rotorloop::identify
