// The loop must not touch the heap. Eigen asserts on its own allocations in this binary (EIGEN_NO_MALLOC), and every allocation
// of any kind is counted while estimator and controller run.
#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>

#include "host/control/controller.hpp"
#include "host/control/trajectory.hpp"
#include "host/estimate/estimator.hpp"
#include "test/unit/host/control/paper_vehicle.hpp"
#include "test/unit/host/control/test_terms.hpp"

namespace {
long allocations = 0;
}

#if defined(__SANITIZE_ADDRESS__)  // the sanitizer owns malloc and calls this for every allocation
extern "C" void __sanitizer_malloc_hook(const volatile void*, std::size_t) { ++allocations; }
#else
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
void* calloc(std::size_t n, std::size_t size) {
  ++allocations;
  return __libc_calloc(n, size);
}
void* realloc(void* p, std::size_t size) {
  ++allocations;
  return __libc_realloc(p, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++allocations;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
  ++allocations;
  *out = __libc_memalign(alignment, size);
  return *out ? 0 : 12;  // ENOMEM
}
}
#endif

namespace rotorloop::host {
namespace {

TEST(AllocationCounter, SeesAnAllocation) {
  const long before = allocations;
  std::unique_ptr<double[]> p(new double[100]);
  asm volatile("" : : "r"(p.get()) : "memory");
  EXPECT_GT(allocations, before);
}

TEST(ControlLoop, TenSecondsOfEstimatorTrajectoryAndControllerAllocateNothing) {
  Trajectory trajectory;
  trajectory.count = 1;
  trajectory.segments[0].duration_s = 20.0;
  trajectory.segments[0].x_m.c = {0, 0, 0.05, 0, 0, 0, 0, 0};
  const VehicleModel vehicle = test::paper_vehicle();
  ControllerConfig config;
  config.gains = {{3.4, 0.8}, {4.2, 0.9}, {20.0, 0.9}, {6.0, 0.9}};
  config.terms = test::terms_with(test::kThrustGrowth, {0.2});
  test::add(config.terms, test::kRearDownwash, {0.1});
  const Controller controller(vehicle, config);
  ControllerState state;
  Estimator estimator({}, vehicle);
  ImuSample imu;
  imu.accel_B_m_s2 = {0, 0, kGravity_m_s2};
  PoseSample pose;
  pose.q_WS = vehicle.pose_sensor_q_BS;
  double sum = 0.0;
  const long before = allocations;
  for (int k = 0; k < 10000; ++k) {
    imu.time_us = 1000 * k;
    if (k % 5 == 0 && k > 20) {
      pose.time_us = imu.time_us - 15'000;
      pose.p_W_m.x() = k > 5000 ? 0.5 : 0.0;  // a jump, so that gate and reset run too
      estimator.on_pose(pose);
    }
    const StateEstimate& e = estimator.on_imu(imu);
    sum += controller.step(state, e, trajectory.at(1e-3 * k)).omega_rad_s[0];
  }
  EXPECT_EQ(allocations - before, 0);
  EXPECT_GE(estimator.counters().resets, 1u);
  EXPECT_TRUE(estimator.estimate().valid);
  EXPECT_GT(sum, 0.0);
}

}  // namespace
}  // namespace rotorloop::host
