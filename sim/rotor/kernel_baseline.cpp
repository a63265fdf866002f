// The kernel for every CPU: two lanes, which is what all 64-bit x86 and ARM processors have.
#if defined(__x86_64__)
#include <emmintrin.h>
#endif

#include "sim/rotor/annulus_flow.hpp"
#include "sim/rotor/inflow.hpp"
#include "sim/rotor/kernel.hpp"
#include "sim/rotor/prandtl.hpp"
#include "sim/rotor/section_table.hpp"

namespace rotorloop::sim::kernel {
namespace {
#define ROTOR_TARGET

template <int W>
struct Lane;

template <>
struct Lane<2> {
  typedef double D __attribute__((vector_size(16)));
  typedef long long I __attribute__((vector_size(16)));
  typedef unsigned long long U __attribute__((vector_size(16)));

#if defined(__x86_64__)
  static D sqrt(D x) { return _mm_sqrt_pd(x); }
  static D least(D x, D y) { return _mm_min_pd(x, y); }
  static D most(D x, D y) { return _mm_max_pd(x, y); }
#else
  static D sqrt(D x) { return D{__builtin_sqrt(x[0]), __builtin_sqrt(x[1])}; }
  static D least(D x, D y) { return x < y ? x : y; }
  static D most(D x, D y) { return x > y ? x : y; }
#endif
  // Section table at two nodes: (up, drag) there and at the next direction, between two rows of Reynolds number.
  static void gather(const double* const* nodes, const I& place, D in_row, D& up0, D& drag0, D& up1, D& drag1) {
    D first[2], second[2];
    for (int i = 0; i < 2; ++i) {
      const D* low = reinterpret_cast<const D*>(nodes[i] + place[i]);
      const D* high = low + SectionTable::kStride;
      const D share = {in_row[i], in_row[i]};
      first[i] = low[0] + share * (high[0] - low[0]);
      second[i] = low[1] + share * (high[1] - low[1]);
    }
    up0 = D{first[0][0], first[1][0]};
    drag0 = D{first[0][1], first[1][1]};
    up1 = D{second[0][0], second[1][0]};
    drag1 = D{second[0][1], second[1][1]};
  }
};

#include "sim/rotor/kernel_lanes.inc"
}  // namespace

void solve_baseline(const Problem& problem, const Memory& memory, Solution& solution) {
  for (int first = 0; first < problem.count; first += 2) search<2>(problem, first, memory, solution);
}

}  // namespace rotorloop::sim::kernel
