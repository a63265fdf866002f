// Readers of QPROP's files, on files written here.
#include "bench/propeller/oracles/qprop_case.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "host/base/error.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::bench {
namespace {
const char* const kDefinition = R"(! a propeller
Some name of it

 2   3.0   ! Nblades [R]
 0.5  5.8
 -0.3 1.2
 0.028 0.05 0.02 0.5
 70000 -0.7
 0.0254 0.0254 1.0
 0. 0. 1.0
# r chord beta
 0.75 0.66 27
 1.5  0.63 15
 3.0  0.19 4
)";
}  // namespace

TEST(CubicSpline, ReproducesAParabolaExactly) {
  const auto f = [](double x) { return 1.0 - 2.0 * x + 3.0 * x * x; };
  const CubicSpline s({0.0, 0.5, 0.7, 1.5}, {f(0.0), f(0.5), f(0.7), f(1.5)});
  for (double x : {0.0, 0.2, 0.6, 1.1, 1.5}) EXPECT_NEAR(s(x), f(x), 1e-12);
}
}  // namespace rotorloop::bench
