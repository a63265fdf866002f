// The scan for dynamic terms never reads values of one term as another's, and what a worker throws reaches the caller.
#include "bench/sysid/diagnose/dynamic_term_scan.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host/base/error.hpp"
#include "test/support/model_true_flight.hpp"
#include "test/support/model_true_vehicle.hpp"

namespace rotorloop::diagnose {
namespace {

// A second of flight at its measurements, with a model that holds the load on a string already.
identify::Identification with_slung_load_in_the_model() {
  model_true::FlightSettings s;
  s.duration_s = 2.0;
  identify::Identification r;
  r.flights.push_back(estimate::make_grid(model_true::fly({}, s).record, {}));
  host::TermList terms;
  terms.add(*host::find_term("slung_load"));
  r.fit.values.push_back(estimate::model_values(model_true::vehicle_of({}), terms));
  r.fit.noise.emplace_back();
  r.fit.states.push_back(estimate::guess_states(r.flights[0], r.fit.values[0]));
  return r;
}

TEST(MemoryScan, RefusesByNameATermThatTheModelCannotTakeUpInsteadOfScanningWithValuesOfAnother) {
  const identify::Identification r = with_slung_load_in_the_model();
  for (const int threads : {1, 2}) {
    std::string said;
    try {
      (void)scan_dynamic_term(r, *host::find_term("slung_load"), threads);
    } catch (const Error& e) {
      said = e.what();
    }
    EXPECT_THAT(said, testing::AllOf(testing::HasSubstr("slung_load"), testing::HasSubstr("--without"))) << threads << " threads";
  }
}

}  // namespace
}  // namespace rotorloop::diagnose
