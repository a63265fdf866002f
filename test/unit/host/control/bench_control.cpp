// What one millisecond of control costs. Budgets: mixer 1 µs, IMU sample 8 µs on average and 30 µs with a pose.
#include <benchmark/benchmark.h>

#include "host/control/gains_file.hpp"
#include "host/control/trajectory_generator.hpp"
#include "host/estimate/estimator.hpp"
#include "host/vehicle/thrust.hpp"
#include "test/unit/host/control/paper_vehicle.hpp"
#include "test/unit/host/control/test_terms.hpp"

namespace rotorloop::host {
namespace {

const VehicleModel kVehicle = test::paper_vehicle();

ControllerConfig config() { return controller_config(read_gains(ROTORLOOP_SOURCE_DIR "/vehicles/gains.toml"), Variant::pd_ff_thrust_drag); }

// The argument: 0 within limits, 1 yaw saturated, 2 torque saturated.
void mixer(benchmark::State& run) {
  const Mixer m(kVehicle, {});
  const Eigen::Vector3d torque = run.range(0) == 0   ? Eigen::Vector3d(0.02, -0.01, 0.002)
                                 : run.range(0) == 1 ? Eigen::Vector3d(0.02, -0.01, 0.5)
                                                     : Eigen::Vector3d(3.0, -1.5, 0.1);
  std::array<double, 4> guess{900, 910, 950, 960};
  double wobble = 0.0;
  for (auto _ : run) {
    wobble = wobble > 1.0 ? 0.0 : wobble + 0.01;
    guess = m.solve({8.0 + wobble, torque, {5.0, 1.0, 2.0}, {1.0, -0.5, 0.2}}, guess).omega_rad_s;
    benchmark::DoNotOptimize(guess);
  }
}
BENCHMARK(mixer)->Arg(0)->Arg(1)->Arg(2);

// The argument: how many added terms the vehicle has.
void controller_step(benchmark::State& run) {
  ControllerConfig with = config();
  if (run.range(0) >= 1) test::add(with.terms, test::kThrustGrowth, {0.2});
  if (run.range(0) >= 5) {
    test::add(with.terms, test::kThrustScale, {0.95});
    test::add(with.terms, test::kWeakThird, {-0.05});
    test::add(with.terms, test::kRearDownwash, {0.1});
    test::add(with.terms, test::kPush, {0.1, 0.003});
  }
  const Controller c(kVehicle, with);
  const Trajectory t = general().trajectory;
  ControllerState state;
  StateEstimate e;
  e.valid = true;
  double time_s = 2.0;
  for (auto _ : run) {
    const Setpoint s = t.at(time_s);
    time_s = time_s > 16.0 ? 2.0 : time_s + 1e-3;
    e.p_W_m = s.p_W_m;
    e.v_W_m_s = s.v_W_m_s;
    const Command command = c.step(state, e, s);
    e.q_WB = command.diagnostics.q_WB_sp;  // the vehicle follows
    e.w_B_rad_s = command.diagnostics.w_B_sp_rad_s;
    benchmark::DoNotOptimize(command);
  }
}
BENCHMARK(controller_step)->Arg(0)->Arg(1)->Arg(5);

void trajectory_at(benchmark::State& run) {
  const Trajectory t = general().trajectory;
  double time_s = 2.0;
  for (auto _ : run) {
    time_s = time_s > 16.0 ? 2.0 : time_s + 1e-3;
    benchmark::DoNotOptimize(t.at(time_s));
  }
}
BENCHMARK(trajectory_at);

void thrust_solved_exactly(benchmark::State& run) {
  double v = 0.0;
  for (auto _ : run) {
    v = v > 3.0 ? -3.0 : v + 0.01;
    benchmark::DoNotOptimize(solve_thrust(kVehicle.thrust, 940.0, v, 5.0));
  }
}
BENCHMARK(thrust_solved_exactly);

// With a pose every 5 samples, 15 late: the average. With every sample: what the worst one costs.
void estimator_imu_sample(benchmark::State& run) {
  Estimator estimator({}, kVehicle);
  ImuSample imu;
  imu.accel_B_m_s2 = {0, 0, kGravity_m_s2};
  PoseSample pose;
  pose.q_WS = kVehicle.pose_sensor_q_BS;
  const auto every = run.range(0);
  std::int64_t k = 0;
  for (auto _ : run) {
    imu.time_us = 1000 * k;
    if (k > 20 && k % every == 0) {
      pose.time_us = imu.time_us - 15'000;
      estimator.on_pose(pose);
    }
    benchmark::DoNotOptimize(estimator.on_imu(imu));
    ++k;
  }
}
BENCHMARK(estimator_imu_sample)->Arg(5)->Arg(1);

}  // namespace
}  // namespace rotorloop::host

BENCHMARK_MAIN();
