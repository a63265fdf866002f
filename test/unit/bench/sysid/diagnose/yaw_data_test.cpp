// Yaw of a measured vehicle: what the drag torque of rotors does not explain is the reaction to their acceleration, and a flight that had
// no part in it agrees. IDSIA's nano-drone, whose two fast squares turn about z as quick as it can. docs/acceptance/diagnose_measured.md.
#include <fmt/format.h>

#include <algorithm>

#include "bench/sysid/diagnose/diagnose.hpp"
#include "bench/sysid/identify/held_out.hpp"
#include "bench/sysid/log/check/checks.hpp"
#include "test/unit/bench/sysid/identify/measured_fit.hpp"

namespace rotorloop::diagnose {
namespace {

const identify::MeasuredSet kSet{"idsia_nanodrone_cf21bl"};

identify::FlightToFit checked(const std::string& stem) {
  log::CheckedFlight c = log::check_flight(kSet.flight(stem), host::to_model(kSet.vehicle()));
  c.throw_if_refused();
  return {.record = c.flight, .role = identify::FlightRole::any, .segments = c.segments};
}

TEST(MeasuredYaw, ReactionToRotorAccelerationIsFoundWithItsShareOfTheInertiaAndExplains85PercentOfAnotherFlight) {
  if (!identify::MeasuredSet::present()) GTEST_SKIP() << "ROTORLOOP_DATA is not set: IDSIA's yaw is not diagnosed";
  DiagnoseOptions o;
  o.identify.grid = {.rate_Hz = 50.0, .longest_substep_s = 1e-2, .use_gyro = true};
  // The streams of each run are off against each other by its own 5 to 25 ms.
  o.identify.wishes = {.free = {"rotor_delay"}, .hold = {"body.mass", "pose_sensor", "pose_delay"}, .per_flight = {"rotor_delay"}};
  o.identify.fit.noise = {.rounds = 16, .tolerance = 0.05, .per_flight = true};
  o.identify.fit.max_iterations = 80;
  o.identify.fit.tolerance = 0.02;
  o.identify.fit.threads = 2;
  o.max_effects = 1;
  o.placebos = 20;
  const DiagnosisRun run = diagnose({.fitted = {checked("square_20251017_run2"), checked("square_20251017_run3")}}, kSet.vehicle(), o);
  ASSERT_EQ(run.diagnosis.added.size(), 1u);
  const AddedEffect& a = run.diagnosis.added.front();
  EXPECT_EQ(a.id, "rotor_inertia_reaction");
  EXPECT_TRUE(a.aliases.empty());
  EXPECT_GT(a.evidence.wald, 10.0 * run.diagnosis.rounds.front().placebos.wald);
  // Yaw determines J_r and J_z only as far as the vehicle file does, their ratio to a few per cent.
  const auto firm = std::find_if(a.ratios.begin(), a.ratios.end(), [](const NamedValue& r) { return r.name == "J_r_kg_m2 / I_zz"; });
  ASSERT_NE(firm, a.ratios.end());
  const double ratio = firm->value;
  EXPECT_NEAR(ratio, 1.07e-3, 0.15 * 1.07e-3);  // by regression on all the set's flights
  EXPECT_LT(firm->u, 0.05 * ratio);

  // The multisine turns about z in its last fifteen seconds.
  estimate::GridOptions late = o.identify.grid;
  late.from_s = 45.0;
  const identify::WrenchBand band{.from_Hz = 1.0, .to_Hz = 10.0};
  const identify::WrenchComparison c =
      identify::score_models({checked("multisine_20251017_run1")}, run.before, run.after, late, band).wrench;
  fmt::print("J_r/J_z {:.3e}; yaw explained {:.3f} -> {:.3f}, aligned {:.3f} -> {:.3f} at {:+.1f} ms\n", ratio,
             c.before.back().explained[5], c.after.back().explained[5], c.before_aligned.back().explained[5],
             c.after_aligned.back().explained[5], 1e3 * c.after_aligned.front().delay_s);
  EXPECT_GT(c.after_aligned.back().explained[5], 0.85);
  EXPECT_LT(c.before_aligned.back().explained[5], 0.4);
}

}  // namespace
}  // namespace rotorloop::diagnose
