// One solve, three kernels, batches and threads: always the same bits.
#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <thread>
#include <vector>

#include "test/unit/sim/rotor/fixtures.hpp"

namespace rotorloop::sim {
namespace {
using test::rotor;

bool same(const RotorLoads& a, const RotorLoads& b) {
  return a.force_R_N == b.force_R_N && a.moment_R_N_m == b.moment_R_N_m && a.shaft_torque_N_m == b.shaft_torque_N_m &&
         a.induced_m_s == b.induced_m_s && a.status == b.status && a.iterations == b.iterations;
}
// States of a flight, then leaps through the envelope: reverse flow, vortex ring, windmill, cold starts after bad input.
RotorCondition state(int i) {
  if (i < 600) return test::flight_state(i);
  RotorCondition c = test::random_condition(static_cast<std::uint64_t>(i), 30.0, 0.0, 2500.0, 20.0);
  if (i % 50 == 0) c.v_R_m_s.x() = 1e200;
  return c;
}

class Kernel : public testing::TestWithParam<RotorKernel> {};
TEST_P(Kernel, GivesTheBitsOfTheBaselineAtAnyResolution) {
  if (!runs_here(GetParam())) GTEST_SKIP() << "this CPU lacks the instructions of the kernel";
  for (const RotorResolution r : {RotorResolution{}, {4, 8}, {7, 12}, {12, 16}, {13, 128}, {64, 36}, {9, 16, 4}}) {
    const Rotor any(test::triblade(), r);
    RotorWarmStart plain, wide;
    for (int i = 0; i<1200; i += r.azimuth> 16 ? 7 : 1) {
      const RotorLoads a = solve_rotor(any, state(i), plain, RotorKernel::baseline), b = solve_rotor(any, state(i), wide, GetParam());
      ASSERT_TRUE(same(a, b)) << "state " << i << ", " << r.radial << " x " << r.azimuth << " nodes";
      for (std::size_t k = 0; k < any.annuli().size(); ++k) ASSERT_EQ(plain.induced_m_s[k], wide.induced_m_s[k]);
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Wide, Kernel, testing::Values(RotorKernel::v3, RotorKernel::v4),
                         [](const auto& p) { return p.param == RotorKernel::v3 ? "v3" : "v4"; });

TEST(KernelChoice, OfThisCpuRunsHere) {
  EXPECT_TRUE(runs_here(RotorKernel::baseline));
  EXPECT_TRUE(runs_here(fastest_rotor_kernel()));
}

// What each rotor of a vehicle, in its own conditions, gives alone.
std::vector<RotorLoads> one_by_one(int rotors, int steps) {
  std::vector<RotorWarmStart> warm(static_cast<std::size_t>(rotors));
  std::vector<RotorLoads> out;
  for (int i = 0; i < steps; ++i)
    for (int j = 0; j < rotors; ++j) out.push_back(solve_rotor(rotor(), state(i + 31 * j), warm[static_cast<std::size_t>(j)]));
  return out;
}
std::vector<RotorLoads> in_batches(int rotors, int steps) {
  std::vector<RotorWarmStart> warm(static_cast<std::size_t>(rotors));
  std::vector<RotorJob> jobs(static_cast<std::size_t>(rotors));
  std::vector<RotorLoads> out;
  for (int i = 0; i < steps; ++i) {
    for (int j = 0; j < rotors; ++j)
      jobs[static_cast<std::size_t>(j)] = {&rotor(), state(i + 31 * j), &warm[static_cast<std::size_t>(j)], {}};
    solve_rotors(jobs);
    for (const RotorJob& job : jobs) out.push_back(job.loads);
  }
  return out;
}
bool same(const std::vector<RotorLoads>& a, const std::vector<RotorLoads>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (!same(a[i], b[i])) return false;
  return true;
}
TEST(Batch, OfAnySizeGivesTheBitsOfSingleSolves) {
  for (int rotors : {1, 2, 3, 4, 5, 8, 11}) EXPECT_TRUE(same(in_batches(rotors, 700), one_by_one(rotors, 700))) << rotors;
}
TEST(Batch, OfEachThreadGivesTheSameBitsWhileOthersRun) {
  const std::vector<RotorLoads> alone = one_by_one(4, 700);
  std::array<std::vector<RotorLoads>, 3> found;
  std::vector<std::thread> threads;
  for (auto& f : found) threads.emplace_back([&f] { f = in_batches(4, 700); });
  for (std::thread& t : threads) t.join();
  for (const auto& f : found) EXPECT_TRUE(same(f, alone));
}
TEST(Rotor, CopyOutlivesTheOriginal) {
  auto original = std::make_unique<Rotor>(test::triblade());
  const Rotor copy = *original;
  original.reset();
  RotorWarmStart a, b;
  EXPECT_TRUE(same(solve_rotor(copy, state(0), a), solve_rotor(rotor(), state(0), b)));
}

}  // namespace
}  // namespace rotorloop::sim
