// IMRC's brushless Crazyflie with 4.7 g on a cable and without: its flights as the checks leave them, and the vehicle of the loaded
// flights as its nominal model has it, without its load.
#pragma once
#include <fmt/format.h>

#include <cmath>

#include "bench/sysid/identify/identified_vehicle.hpp"
#include "bench/sysid/log/check/checks.hpp"
#include "test/unit/bench/sysid/identify/measured_fit.hpp"

namespace rotorloop::identify {

inline const MeasuredSet kBare{"imrc_cf21bl_bare"}, kPayload{"imrc_cf21bl_payload"};
// 4.7 g by the lab's scales. The load's place against the vehicle's, both by motion capture, swings as a pendulum of 0.483 m does whose
// pivot is the vehicle (0.476 to 0.488 m in five flights); from frame to frame they are 0.52 m apart.
inline constexpr double kLoad_kg = 4.7e-3, kSwing_m = 0.483;
// So the hook hangs below the origin of the vehicle's markers by the difference.
inline constexpr double kHookBelowPose_m = 0.519 - kSwing_m;

// Turning is the vehicle file's: these flights are slow, and the load shows in the forces.
inline const char* const kHeld[] = {"body.mass",    "pose_sensor.offset", "pose_delay",
                                    "body.inertia", "torque_model",       "effect.rotor_inertia_reaction"};
inline const std::vector<std::string> kFlights{"eckart29", "eckart43", "eckart45", "eckart67", "eckart68"};

inline IdentifyOptions options() {
  IdentifyOptions o;
  o.grid.rate_Hz = 100.0;  // as the motion capture
  o.grid.use_gyro = o.grid.use_accel = true;
  o.terms.add(*host::find_term("rotor_inertia_reaction"));
  o.wishes.hold.assign(std::begin(kHeld), std::end(kHeld));
  o.fit.noise.rounds = 4;
  o.fit.tolerance = 0.5;
  return o;
}

inline void print(const char* what, const Identification& r) {
  fmt::print("{}: log likelihood {:.1f}, {} iterations, converged {}\n", what, r.fit.log_likelihood, r.fit.iterations, r.fit.converged);
  for (const estimate::Estimate& e : r.fit.estimates) {
    if (e.flight < 0)
      fmt::print("  {:<24} {:>12.5g} ± {:.2g}, robust {:.2g}\n", estimate::estimate_name(e, r.problem), e.value, e.u, e.u_robust);
  }
  std::fflush(stdout);
}

// What the checks leave of flights by name.
inline std::vector<FlightToFit> checked(const MeasuredSet& set, const std::vector<std::string>& stems) {
  std::vector<FlightToFit> out;
  for (const std::string& stem : stems) {
    log::CheckedFlight c = log::check_flight(set.flight(stem), host::to_model(set.vehicle()));
    c.throw_if_refused();
    out.push_back({.record = c.flight, .role = FlightRole::any, .segments = c.segments});
  }
  return out;
}

inline const Identification& bare_fit() {
  static const Identification r = identify(checked(kBare, {"eckart00", "eckart17", "eckart22", "eckart34"}), kBare.vehicle(), options());
  return r;
}

// The vehicle that flew with the load, without it: thrust and drag of the bare flights, its own weight.
inline host::VehicleFile vehicle_without_load() {
  host::VehicleFile v = identified_vehicle(bare_fit().fit, kBare.vehicle(), {0, 0}, "test", {});
  v.mass_kg = kPayload.vehicle().mass_kg;
  v.effects.push_back({"rotor_inertia_reaction", {{"J_r_kg_m2", {3.9e-8, 0.0, host::Origin::guess}}}, {}});
  return v;
}

inline IdentifyOptions knowing(const host::VehicleFile& v) {
  IdentifyOptions o = options();
  for (const char* name : {"thrust_model.k2", "drag.c_dh", "drag.c_dxy", "drag.c_dz"})
    o.wishes.free.push_back(fmt::format("{}={}", name, host::uncertainty_of(v, name).value_or(0.0)));
  // Thrust scatters by 0.8 % between the bare flights; these flew months apart on other batteries.
  o.wishes.free.push_back(fmt::format("thrust_model.k1={}", std::hypot(v.k1_N_s2.u, 0.015 * v.k1_N_s2.value)));
  return o;
}

}  // namespace rotorloop::identify
