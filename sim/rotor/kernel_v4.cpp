// The kernel for x86-64-v4 CPUs (AVX-512): eight lanes, and four where no more annuli are left.
#if defined(__x86_64__)
#include <immintrin.h>

#include "sim/rotor/annulus_flow.hpp"
#include "sim/rotor/inflow.hpp"
#include "sim/rotor/kernel.hpp"
#include "sim/rotor/prandtl.hpp"
#include "sim/rotor/section_table.hpp"

#define ROTOR_TARGET __attribute__((target("avx512f,avx512dq,avx512vl")))

namespace rotorloop::sim::kernel {
namespace {
#include "sim/rotor/kernel_lane4.inc"

template <>
struct Lane<8> {
  typedef double D __attribute__((vector_size(64)));
  typedef long long I __attribute__((vector_size(64)));
  typedef unsigned long long U __attribute__((vector_size(64)));

  ROTOR_TARGET static D sqrt(D x) {
    return _mm512_maskz_sqrt_pd(0xff, x);  // the plain form warns of its own undefined value in gcc 12
  }
  ROTOR_TARGET static D least(D x, D y) { return _mm512_maskz_min_pd(0xff, x, y); }
  ROTOR_TARGET static D most(D x, D y) { return _mm512_maskz_max_pd(0xff, x, y); }
  // As Lane<4>::gather; each register holds two nodes, of lanes i and i + 4.
  ROTOR_TARGET static void gather(const double* const* nodes, const I& place, D in_row, D& up0, D& drag0, D& up1, D& drag1) {
    D at[4];
    const D share[4] = {
        __builtin_shufflevector(in_row, in_row, 0, 0, 0, 0, 4, 4, 4, 4), __builtin_shufflevector(in_row, in_row, 1, 1, 1, 1, 5, 5, 5, 5),
        __builtin_shufflevector(in_row, in_row, 2, 2, 2, 2, 6, 6, 6, 6), __builtin_shufflevector(in_row, in_row, 3, 3, 3, 3, 7, 7, 7, 7)};
    for (int i = 0; i < 4; ++i) {
      const double *left = nodes[i] + place[i], *right = nodes[i + 4] + place[i + 4];
      const D low = pair(left, right), high = pair(left + 2 * SectionTable::kStride, right + 2 * SectionTable::kStride);
      at[i] = low + share[i] * (high - low);
    }
    const D up01 = __builtin_shufflevector(at[0], at[1], 0, 8, 2, 10, 4, 12, 6, 14);
    const D up23 = __builtin_shufflevector(at[2], at[3], 0, 8, 2, 10, 4, 12, 6, 14);
    const D drag01 = __builtin_shufflevector(at[0], at[1], 1, 9, 3, 11, 5, 13, 7, 15);
    const D drag23 = __builtin_shufflevector(at[2], at[3], 1, 9, 3, 11, 5, 13, 7, 15);
    up0 = __builtin_shufflevector(up01, up23, 0, 1, 8, 9, 4, 5, 12, 13);
    up1 = __builtin_shufflevector(up01, up23, 2, 3, 10, 11, 6, 7, 14, 15);
    drag0 = __builtin_shufflevector(drag01, drag23, 0, 1, 8, 9, 4, 5, 12, 13);
    drag1 = __builtin_shufflevector(drag01, drag23, 2, 3, 10, 11, 6, 7, 14, 15);
  }

 private:
  using D4 = Lane<4>::Unaligned;
  ROTOR_TARGET static D pair(const double* left, const double* right) {
    const D4 l = *reinterpret_cast<const D4*>(left), r = *reinterpret_cast<const D4*>(right);
    return __builtin_shufflevector(l, r, 0, 1, 2, 3, 4, 5, 6, 7);
  }
};

#include "sim/rotor/kernel_lanes.inc"
}  // namespace

ROTOR_TARGET void solve_v4(const Problem& problem, const Memory& memory, Solution& solution) {
  int first = 0;
  for (; first + 4 < problem.count; first += 8) search<8>(problem, first, memory, solution);
  if (first < problem.count) search<4>(problem, first, memory, solution);
}

}  // namespace rotorloop::sim::kernel
#endif
