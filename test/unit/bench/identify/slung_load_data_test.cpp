// IMRC's brushless Crazyflie with 4.7 g on a cable of 0.52 m: what its bare flights say of thrust and drag makes the load stand out.
// The load's place, which motion capture measured too, is used where a test says so and nowhere else.
#include <fmt/format.h>

#include <cmath>

#include "bench/identify/checks.hpp"
#include "bench/identify/flight_motion.hpp"
#include "bench/identify/identified_vehicle.hpp"
#include "bench/identify/stream_reader.hpp"
#include "test/unit/bench/identify/measured_fit.hpp"

namespace rotorloop::bench {
namespace {

const MeasuredSet kBare{"imrc_cf21bl_bare"}, kPayload{"imrc_cf21bl_payload"};
constexpr double kLoad_kg = 4.7e-3, kCable_m = 0.518;

IdentifyOptions options() {
  IdentifyOptions o;
  o.grid.rate_Hz = 100.0;  // as the motion capture
  o.grid.use_gyro = o.grid.use_accel = true;
  o.terms.add(*host::find_term("rotor_inertia_reaction"));
  o.wishes = {.free = {}, .hold = {"body.mass", "pose_sensor.offset", "pose_delay"}, .per_flight = {}};
  o.fit.noise.rounds = 4;
  o.fit.tolerance = 0.5;
  return o;
}

void print(const Identification& r) {
  for (const Estimate& e : r.fit.estimates)
    fmt::print("  {:<24} {:>12.5g} ± {:.2g}, robust {:.2g}\n", estimate_name(e, r.problem), e.value, e.u, e.u_robust);
  fmt::print("  log likelihood {:.1f}, {} iterations, converged {}\n", r.fit.log_likelihood, r.fit.iterations, r.fit.converged);
}

// What the checks leave of flights by name.
std::vector<FlightToFit> checked(const MeasuredSet& set, const std::vector<std::string>& stems) {
  std::vector<FlightToFit> out;
  for (const std::string& stem : stems) {
    const CheckedFlight c = check_flight(set.flight(stem), host::to_model(set.vehicle()));
    if (c.refusal) {
      fmt::print("{} refused: {}\n", stem, c.refusal->what);
      continue;
    }
    out.push_back({.record = c.flight, .role = FlightRole::any, .segments = c.segments});
  }
  return out;
}

// The vehicle as its bare flights say, at the weight that it has without the load in the other flights.
host::VehicleFile bare_vehicle() {
  const Identification r = identify(checked(kBare, {"eckart00", "eckart17", "eckart22", "eckart34"}), kBare.vehicle(), options());
  print(r);
  host::VehicleFile v = identified_vehicle(r.fit, kBare.vehicle(), {0, 0}, "test", {});
  v.mass_kg = kPayload.vehicle().mass_kg;
  return v;
}

Identification with_load(const host::VehicleFile& bare, const std::vector<std::string>& stems) {
  host::VehicleFile v = bare;
  v.effects.push_back({"slung_load", {{"mass_kg", {2e-3, 0.0, host::Origin::guess}}, {"length_m", {0.45, 0.0, host::Origin::guess}}}, {}});
  IdentifyOptions o = options();
  o.terms.add(*host::find_term("slung_load"));
  const auto prior = [&](const char* name, double least) {
    o.wishes.free.push_back(fmt::format("{}={}", name, std::max(least, host::uncertainty_of(v, name).value_or(0.0))));
  };
  prior("thrust_model.k1", 0.02 * v.k1_N_s2.value);  // of other propellers on another battery
  prior("thrust_model.k2", 0.0);
  prior("drag.c_dh", 0.0);
  prior("drag.c_dxy", 0.0);
  prior("drag.c_dz", 0.0);
  // Turning is the bare vehicle's; what the load adds to it comes through the height of the hook.
  for (const char* name : {"body.inertia", "torque_model", "effect.rotor_inertia_reaction", "effect.slung_load.drag_1_m"}) o.wishes.hold.push_back(name);
  return identify(checked(kPayload, stems), v, o, [](const IdentifyProgress& p) { fmt::print("{} {} {:.1f} {:.2f} {}\n", p.part, p.fit.iteration, p.fit.cost, p.fit.decrement, p.fit.noise_round); std::fflush(stdout); });
}

TEST(SlungLoadMeasured, mass_is_found_within_20_percent_and_length_within_5_from_the_vehicles_motion_alone) {
  if (!MeasuredSet::present()) GTEST_SKIP() << "ROTORLOOP_DATA is not set: IMRC's payload flights are not fitted";
  const host::VehicleFile bare = bare_vehicle();
  const Identification r = with_load(bare, {"eckart29", "eckart43", "eckart45", "eckart67", "eckart68"});
  print(r);
  const int mass = find_parameter("effect.slung_load.mass_kg", r.problem.start.terms),
            length = find_parameter("effect.slung_load.length_m", r.problem.start.terms);
  EXPECT_NEAR(r.fit.find(mass)->value, kLoad_kg, 0.2 * kLoad_kg);
  EXPECT_NEAR(r.fit.find(length)->value, kCable_m, 0.05 * kCable_m);
}

}  // namespace
}  // namespace rotorloop::bench
