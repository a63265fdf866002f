#include "bench/sysid/identify/start_values.hpp"

#include <cmath>

#include "host/vehicle/thrust.hpp"

namespace rotorloop::identify {
namespace {

constexpr double kGood = 0.1;  // relative: what the first Newton step takes in its stride

// Mean of Σ x² cos(tilt) over the flights, x speeds of the rotors or, with commands, commands u (V / V_reference).
double mean_square_upright(std::span<const estimate::GridFlight> flights, const estimate::ModelValues& values, bool commands) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const estimate::GridFlight& g : flights) {
    if (g.input.from_commands() != commands) continue;
    estimate::RotorInput input = g.input;
    estimate::ModelValues v = values;
    v[estimate::kCommandGain] = 1.0;  // speeds are then commands
    v[estimate::kCommandOffset] = 0.0;
    input.prepare(v);
    const auto states = estimate::guess_states(g, values);
    std::size_t hint = 0;
    for (std::size_t k = 0; k < g.nodes; ++k) {
      if (k + 1 < g.nodes && !g.linked[k]) continue;
      const estimate::RotorInputSample u = input.at(g.time_s(k), hint, false);
      double squares = 0.0;
      for (const double w : u.omega_rad_s) squares += w * w;
      const double upright = g.pose.empty() ? 1.0 : (states[k].q_WB * Eigen::Vector3d::UnitZ()).z();
      sum += squares * upright;
      ++count;
    }
  }
  return count > 0 ? sum / static_cast<double>(count) : 0.0;
}

}  // namespace

double mean_battery_V(const estimate::GridFlight& g) {
  constexpr std::size_t kEvery = 20;  // nodes: voltage changes slowly
  double sum = 0.0, n = 0.0;
  std::size_t hint = 0;
  for (std::size_t k = 0; k < g.nodes; k += kEvery, n += 1.0) sum += g.input.at(g.time_s(k), hint, false).battery_V;
  return n > 0.0 ? sum / n : 0.0;
}

StartValues start_values(std::span<const estimate::GridFlight> flights, const host::VehicleFile& vehicle, const host::TermList& terms) {
  const host::VehicleModel model = host::to_model(vehicle);
  StartValues out{.values = estimate::model_values(model, terms), .file = {}};
  estimate::ModelValues& v = out.values;
  for (std::size_t k = 0; k < terms.parameters(); ++k) {
    const auto term = terms.term_of(k);
    for (const host::VehicleEffect& e : vehicle.effects) {
      if (e.id != terms.term(term).info.id) continue;
      for (const host::EffectParameter& p : e.parameters) {
        if (p.name == terms.parameter(k).name) v[estimate::kCoreParameters + static_cast<int>(k)] = p.quantity.value;
      }
    }
  }
  double volts = 0.0, with_volts = 0.0;
  for (const estimate::GridFlight& g : flights) {
    if (const double V = mean_battery_V(g); g.input.from_commands() && V > 0.0) {
      volts += V;
      with_volts += 1.0;
    }
  }
  v.reference_V = with_volts > 0.0 ? volts / with_volts : 0.0;
  out.file = v;
  const double c_t = host::static_c_t(model.thrust);
  if (const double u2 = mean_square_upright(flights, v, true); u2 > 0.0) {
    v[estimate::kCommandGain] = std::sqrt(model.weight_N() / (c_t * u2));
    out.file[estimate::kCommandGain] = v[estimate::kCommandGain];  // no vehicle file has one: a prior is about this
  }
  if (const double w2 = mean_square_upright(flights, v, false); w2 > 0.0) {
    const double scale = model.weight_N() / (c_t * w2);
    if (std::fabs(scale - 1.0) > kGood) {
      // c_t = k1 + k2 u with 2ρA u² = c_t: both parts scale alike when k2 goes with the root of the scale.
      out.thrust_scale = scale;
      v[estimate::kK1] *= scale;
      v[estimate::kK2] *= std::sqrt(scale);
      v[estimate::kCq] *= scale;
    }
  }
  return out;
}

}  // namespace rotorloop::identify
