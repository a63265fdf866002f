// The scan for dynamic terms on measured flights: with a load on a cable, and of the same kind of vehicle without.
#include "bench/sysid/diagnose/dynamic_term_scan.hpp"
#include "test/unit/bench/sysid/identify/payload_flights.hpp"

namespace rotorloop::diagnose {
namespace {

// The residual of the vehicle without a load has the shape of a load's pull, and of a load on a string of about this length.
TEST(SlungLoadMeasured, StandsOutOfThePayloadFlightsAtItsLengthAndNotOfTheBareOnes) {
  if (!identify::MeasuredSet::present()) GTEST_SKIP() << "ROTORLOOP_DATA is not set: IMRC's payload flights are not scanned";
  const host::VehicleFile v = identify::vehicle_without_load();
  identify::print("bare", identify::bare_fit());
  const identify::Identification without =
      identify::identify(identify::checked(identify::kPayload, identify::kFlights), v, identify::knowing(v));
  identify::print("payload without a load in the model", without);
  const host::Term& term = *host::find_term("slung_load");
  const auto loaded = scan_dynamic_term(without, term, 2), bare = scan_dynamic_term(identify::bare_fit(), term, 2);
  for (const auto* points : {&loaded, &bare}) {
    for (std::size_t i = 0; i < 5; ++i) {
      const ScanPoint& p = (*points)[i];
      fmt::print("  {:.2f} g on {:.2f} m, damping {:.2f}, drag {:.2f}: {:.1f} % of the residual\n", 1e3 * p.parameters[0], p.parameters[1],
                 p.parameters[2], p.parameters[3], 100.0 * p.gain);
    }
  }
  EXPECT_GT(loaded.front().gain, 5.0 * bare.front().gain);
  EXPECT_NEAR(loaded.front().parameters[1], identify::kSwing_m, 0.1);
}

}  // namespace
}  // namespace rotorloop::diagnose
