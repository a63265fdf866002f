#include <gtest/gtest.h>

#include "bench/identify/checks.hpp"
#include "test/unit/bench/identify/measured_flights.hpp"

namespace rotorloop::bench {
namespace {
using namespace testing;

TEST(Explore, Print) {
  if (measured_flights().empty()) GTEST_SKIP();
  for (const char* set :
       {"imrc_cf21bl_bare", "imrc_cf21bl_payload", "imrc_cf21_brushed", "idsia_nanodrone_cf21bl", "neurobem_test", "undeclared_a",
        "undeclared_b", "undeclared_c", "undeclared_d", "undeclared_e", "undeclared_f", "nanobench_cf21", "crazypad_faults"})
    for (const auto& file : flights_of(set)) {
      const MeasuredFlight f = read_measured(file);
      std::fputs(findings_table(check_flight(f.record, f.vehicle)).c_str(), stdout);
    }
}

}  // namespace
}  // namespace rotorloop::bench
