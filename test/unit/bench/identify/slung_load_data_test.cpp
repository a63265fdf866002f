// IMRC's brushless Crazyflie with 4.7 g on a cable of 0.52 m: what its bare flights say of thrust and drag makes the load stand out.
// The load's place, which motion capture measured too, is used where a test says so and nowhere else.
#include <fmt/format.h>

#include <cmath>

#include "bench/diagnose/memory_scan.hpp"
#include "bench/identify/checks.hpp"
#include "bench/identify/flight_motion.hpp"
#include "bench/identify/identified_vehicle.hpp"
#include "bench/identify/signal.hpp"
#include "test/unit/bench/identify/measured_fit.hpp"

namespace rotorloop::bench {
namespace {

const MeasuredSet kBare{"imrc_cf21bl_bare"}, kPayload{"imrc_cf21bl_payload"};
// 4.7 g by the lab's scales. The load's place against the vehicle's, both by motion capture, swings as a pendulum of 0.483 m does whose
// pivot is the vehicle (0.476 to 0.488 m in five flights); from frame to frame they are 0.52 m apart.
constexpr double kLoad_kg = 4.7e-3, kSwing_m = 0.483;

// Turning is the vehicle file's: these flights are slow, and the load shows in the forces.
const char* const kHeld[] = {"body.mass",    "pose_sensor.offset", "pose_delay",
                             "body.inertia", "torque_model",       "effect.rotor_inertia_reaction"};
const std::vector<std::string> kFlights{"eckart29", "eckart43", "eckart45", "eckart67", "eckart68"};

IdentifyOptions options() {
  IdentifyOptions o;
  o.grid.rate_Hz = 100.0;  // as the motion capture
  o.grid.use_gyro = o.grid.use_accel = true;
  o.terms.add(*host::find_term("rotor_inertia_reaction"));
  o.wishes.hold.assign(std::begin(kHeld), std::end(kHeld));
  o.fit.noise.rounds = 4;
  o.fit.tolerance = 0.5;
  return o;
}

void print(const char* what, const Identification& r) {
  fmt::print("{}: log likelihood {:.1f}, {} iterations, converged {}\n", what, r.fit.log_likelihood, r.fit.iterations, r.fit.converged);
  for (const Estimate& e : r.fit.estimates) {
    if (e.flight < 0) fmt::print("  {:<24} {:>12.5g} ± {:.2g}, robust {:.2g}\n", estimate_name(e, r.problem), e.value, e.u, e.u_robust);
  }
  std::fflush(stdout);
}

// What the checks leave of flights by name.
std::vector<FlightToFit> checked(const MeasuredSet& set, const std::vector<std::string>& stems) {
  std::vector<FlightToFit> out;
  for (const std::string& stem : stems) {
    CheckedFlight c = check_flight(set.flight(stem), host::to_model(set.vehicle()));
    c.throw_if_refused();
    out.push_back({.record = c.flight, .role = FlightRole::any, .segments = c.segments});
  }
  return out;
}

const Identification& bare_fit() {
  static const Identification r = identify(checked(kBare, {"eckart00", "eckart17", "eckart22", "eckart34"}), kBare.vehicle(), options());
  return r;
}

// The vehicle that flew with the load, without it: thrust and drag of the bare flights, its own weight.
host::VehicleFile vehicle_without_load() {
  host::VehicleFile v = identified_vehicle(bare_fit().fit, kBare.vehicle(), {0, 0}, "test", {});
  v.mass_kg = kPayload.vehicle().mass_kg;
  v.effects.push_back({"rotor_inertia_reaction", {{"J_r_kg_m2", {3.9e-8, 0.0, host::Origin::guess}}}, {}});
  return v;
}

IdentifyOptions knowing(const host::VehicleFile& v) {
  IdentifyOptions o = options();
  for (const char* name : {"thrust_model.k2", "drag.c_dh", "drag.c_dxy", "drag.c_dz"})
    o.wishes.free.push_back(fmt::format("{}={}", name, host::uncertainty_of(v, name).value_or(0.0)));
  // Thrust scatters by 0.8 % between the bare flights; these flew months apart on other batteries.
  o.wishes.free.push_back(fmt::format("thrust_model.k1={}", std::hypot(v.k1_N_s2.u, 0.015 * v.k1_N_s2.value)));
  return o;
}

Identification with_load(IdentifyOptions o, host::VehicleFile v, double length_m) {
  v.effects.push_back({"slung_load",
                       {{"mass_kg", {2e-3, 0.0, host::Origin::guess}},
                        {"length_m", {length_m, 0.0, host::Origin::guess}},
                        {"attach_z_m", {-0.01, 0.0, host::Origin::guess}}},
                       {}});
  o.terms.add(*host::find_term("slung_load"));
  o.wishes.hold.push_back("effect.slung_load.drag_1_m");
  return identify(checked(kPayload, kFlights), v, o);
}

const Estimate& estimate(const Identification& r, const std::string& name) {
  return *r.fit.find(find_parameter("effect.slung_load." + name, r.problem.start.terms));
}

// Root mean square of what the model's force lacks in the world, below 6 Hz, over all flights of a fit.
Eigen::Vector3d residual_force_N(const Identification& r) {
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  double count = 0.0;
  for (std::size_t f = 0; f < r.flights.size(); ++f) {
    const GridFlight& g = r.flights[f];
    const ModelValues& v = r.fit.values[f];
    RotorInput input = g.input;
    input.prepare(v);
    const Model model(v);
    std::array<std::vector<double>, 3> rows;
    std::size_t hint = 0;
    for (const VectorFix& a : g.accel) {
      const BodyState& x = r.fit.states[f][a.knot];
      const double t = g.time_s(a.knot);
      const Eigen::Vector3d bias(v[kAccelBiasX], v[kAccelBiasY], v[kAccelBiasZ]);
      const Eigen::Vector3d e =
          x.q_WB * Eigen::Vector3d(v[kMass] * (a.value - bias) - model.instant(x, input.at(t, hint, false), t).force_B_N);
      for (std::size_t i = 0; i < 3; ++i) rows[i].push_back(e[static_cast<Eigen::Index>(i)]);
    }
    for (std::size_t i = 0; i < 3; ++i) {
      for (const double e : zero_phase_low_pass(rows[i], 6.0, 1.0 / g.step_s)) squares[static_cast<Eigen::Index>(i)] += e * e;
    }
    count += static_cast<double>(rows[0].size());
  }
  return (squares / count).cwiseSqrt();
}

// The residual of the vehicle without a load has the shape of a load's pull, and of a load on a string of about this length.
TEST(SlungLoadMeasured, stands_out_of_the_payload_flights_at_its_length_and_not_of_the_bare_ones) {
  if (!MeasuredSet::present()) GTEST_SKIP() << "ROTORLOOP_DATA is not set: IMRC's payload flights are not scanned";
  const host::VehicleFile v = vehicle_without_load();
  print("bare", bare_fit());
  const Identification without = identify(checked(kPayload, kFlights), v, knowing(v));
  print("payload without a load in the model", without);
  const host::Term& term = *host::find_term("slung_load");
  const auto loaded = scan_memory(without, term, 2), bare = scan_memory(bare_fit(), term, 2);
  for (const auto* points : {&loaded, &bare}) {
    for (std::size_t i = 0; i < 5; ++i) {
      const ScanPoint& p = (*points)[i];
      fmt::print("  {:.2f} g on {:.2f} m, damping {:.2f}, drag {:.2f}: {:.1f} % of the residual\n", 1e3 * p.parameters[0], p.parameters[1],
                 p.parameters[2], p.parameters[3], 100.0 * p.gain);
    }
  }
  EXPECT_GT(loaded.front().gain, 5.0 * bare.front().gain);
  EXPECT_NEAR(loaded.front().parameters[1], kSwing_m, 0.1);
}

TEST(SlungLoadMeasured, mass_is_found_within_20_percent_and_length_within_5_from_the_vehicles_motion_alone) {
  if (!MeasuredSet::present()) GTEST_SKIP() << "ROTORLOOP_DATA is not set: IMRC's payload flights are not fitted";
  const host::VehicleFile v = vehicle_without_load();
  const Identification r = with_load(knowing(v), v, 0.45);
  print("load from the motion alone", r);
  fmt::print("  residual force {:.2f}, {:.2f}, {:.2f} mN\n", 1e3 * residual_force_N(r).x(), 1e3 * residual_force_N(r).y(),
             1e3 * residual_force_N(r).z());
  EXPECT_TRUE(r.fit.converged);
  EXPECT_NEAR(estimate(r, "mass_kg").value, kLoad_kg, 0.2 * kLoad_kg);
  EXPECT_NEAR(estimate(r, "length_m").value, kSwing_m, 0.05 * kSwing_m);
}

TEST(SlungLoadMeasured, mass_is_found_within_10_percent_with_the_loads_place_measured_and_4p5_mN_are_left_along_x) {
  if (!MeasuredSet::present()) GTEST_SKIP() << "ROTORLOOP_DATA is not set: IMRC's payload flights are not fitted";
  const host::VehicleFile v = vehicle_without_load();
  IdentifyOptions o = knowing(v);
  o.grid.use_load = true;
  for (const char* name : {"length_m", "damping", "start_d_x", "start_d_y", "start_rate_x", "start_rate_y"})
    o.wishes.hold.push_back(std::string("effect.slung_load.") + name);
  const Identification r = with_load(o, v, kSwing_m);
  print("load with its place measured", r);
  const Eigen::Vector3d left_N = residual_force_N(r);
  fmt::print("  residual force {:.2f}, {:.2f}, {:.2f} mN\n", 1e3 * left_N.x(), 1e3 * left_N.y(), 1e3 * left_N.z());
  EXPECT_NEAR(estimate(r, "mass_kg").value, kLoad_kg, 0.1 * kLoad_kg);
  EXPECT_LE(left_N.x(), 4.5e-3);
}

}  // namespace
}  // namespace rotorloop::bench
