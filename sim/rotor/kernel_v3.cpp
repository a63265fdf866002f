// The kernel for x86-64-v3 CPUs (AVX2; 2013 and later): four lanes.
#if defined(__x86_64__)
#include <immintrin.h>

#include "sim/rotor/annulus_flow.hpp"
#include "sim/rotor/inflow.hpp"
#include "sim/rotor/kernel.hpp"
#include "sim/rotor/prandtl.hpp"
#include "sim/rotor/section_table.hpp"

#define ROTOR_TARGET __attribute__((target("avx2")))

namespace rotorloop::sim::kernel {
namespace {
#include "sim/rotor/kernel_lane4.inc"
#include "sim/rotor/kernel_lanes.inc"
}  // namespace

ROTOR_TARGET void solve_v3(const Problem& problem, const Memory& memory, Solution& solution) {
  for (int first = 0; first < problem.count; first += 4) search<4>(problem, first, memory, solution);
}

}  // namespace rotorloop::sim::kernel
#endif
