// Whole runs on the virtual stand, all errors of a real one drawn, with one instrument at fault; and sound ones.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "bench/stand/evaluate/estimate/stand_estimate.hpp"
#include "host/base/text_file.hpp"
#include "test/unit/bench/stand/run/virtual_run.hpp"

namespace rotorloop {
namespace {

using modbus::StandAxis;
using stand_run::RunEnd;
using Readings = virtual_stand::VirtualStandConfig::TrueReading;
using Fault = std::function<double(StandAxis, const Readings&)>;

constexpr double kTop_rad_s = 1400.0;

// Ten holds up to 1400 rad/s and down again, 25 s.
stand_run::SequenceOptions short_staircase() {
  stand_run::SequenceOptions o;
  o.low_rad_s = 500.0;
  o.high_rad_s = kTop_rad_s;
  o.levels = 6;
  o.hold_s = 0.4;
  o.zero_s = 1.0;
  o.idle_s = 1.0;
  return o;
}

struct Outcome {
  std::string stopped;             // what the run said; empty: it ended as planned
  std::vector<std::string> named;  // what an estimate from its folder says is wrong
};

Outcome run_with(std::uint64_t seed, const Fault& fault) {
  const modbus::StandSetup setup = test::virtual_setup();
  virtual_stand::VirtualStandConfig c;
  c.rotor.plant = std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "vehicles/reference_plant.toml";
  c.rotor.seed = c.seed = seed;
  c.errors = virtual_stand::drawn_errors(seed, setup.calibration.full_scale);
  c.errors.sensitivity = {{{1.0, 0.0}, {0.0, 1.0}}};  // that the shipped stand file is calibrated for
  c.shows = fault;
  test::VirtualRun run(setup, c, {"staircase"}, short_staircase(), "instrument_faults");
  run.stand.run(run.session, 120.0);
  if (run.session.trip()) return {stand_run::text(*run.session.trip()), {}};
  if (run.session.end() != RunEnd::done) return {"", {"the run did not end"}};
  write_text_file(run.folder / "run.toml", stand::run_toml(stand_run::facts_of({}, run.esc, run.session)));
  stand::EstimateOptions o;
  o.draws = 50;
  o.seed = seed;
  const stand::StandEstimate e = stand::estimate_stand(stand::read_stand_run(run.folder, {}), o);
  Outcome out{"", e.faults};
  // Wires and bearings of every one of these stands add a torque of 5 to 10 mN m, which is named rightly.
  std::erase_if(out.named, [](const std::string& f) { return f.starts_with("torque has a constant"); });
  return out;
}

// The value of an axis goes through `change`, the others show what they should.
Fault on(StandAxis axis, std::function<double(double value, double omega_rad_s)> change) {
  return [axis, change = std::move(change)](StandAxis asked, const Readings& right) {
    return asked == axis ? change(right(axis), right(StandAxis::rotor_speed)) : right(asked);
  };
}

// From the first time above `from_rad_s` on the value of then.
Fault frozen(StandAxis axis, double from_rad_s) {
  return on(axis, [stood = std::optional<double>(), from_rad_s](double value, double omega_rad_s) mutable {
    if (!stood && omega_rad_s > from_rad_s) stood = value;
    return stood.value_or(value);
  });
}

Fault exchanged(StandAxis a, StandAxis b) {
  return [a, b](StandAxis asked, const Readings& right) { return right(asked == a ? b : asked == b ? a : asked); };
}

struct Case {
  std::string name;
  Fault fault;
};

std::vector<Case> cases() {
  // What the instrument shows at half of the highest thrust of the plan, beyond its range (of the wire: 20 N, 0.5 N m, 60 A).
  struct Channel {
    StandAxis axis;
    double half, overload;
  };
  const Channel moving[] = {{StandAxis::thrust, 1.9, 25.0}, {StandAxis::torque, 0.028, 0.6}, {StandAxis::current, 2.0, 60.0}};
  std::vector<Case> out;
  for (const Channel& c : moving) {
    const std::string axis(modbus::name(c.axis));
    out.push_back({"frozen " + axis, frozen(c.axis, 900.0)});
    out.push_back({"frozen from rest " + axis, frozen(c.axis, -1.0)});
    out.push_back({"clipped " + axis, on(c.axis, [=](double v, double) { return std::clamp(v, -c.half, c.half); })});
    out.push_back({"overloaded " + axis, on(c.axis, [=](double v, double w) { return w > 900.0 ? c.overload : v; })});
  }
  out.push_back({"frozen rotor speed", frozen(StandAxis::rotor_speed, 900.0)});
  out.push_back({"clipped rotor speed", on(StandAxis::rotor_speed, [](double v, double) { return std::min(v, 1000.0); })});
  for (const StandAxis axis : {StandAxis::thrust, StandAxis::torque, StandAxis::voltage, StandAxis::current, StandAxis::rotor_speed})
    for (const double factor : {0.1, 10.0})
      out.push_back({fmt::format("{} times {}", modbus::name(axis), factor), on(axis, [=](double v, double) { return factor * v; })});
  out.push_back({"exchanged thrust and torque", exchanged(StandAxis::thrust, StandAxis::torque)});
  out.push_back({"exchanged voltage and current", exchanged(StandAxis::voltage, StandAxis::current)});
  return out;
}

TEST(InstrumentFaults, FrozenClippedOverloadedMisscaledAndExchangedInstrumentsStopTheRunOrAreNamed) {
  std::uint64_t seed = 4000;
  for (const Case& c : cases()) {
    const Outcome o = run_with(++seed, c.fault);
    fmt::print("{:<32} {}\n", c.name, !o.stopped.empty() ? "stopped: " + o.stopped : o.named.empty() ? "-" : "named: " + o.named[0]);
    EXPECT_TRUE(!o.stopped.empty() || !o.named.empty()) << c.name;
  }
}

TEST(InstrumentFaults, OfAHundredSoundRunsNoneIsStoppedAndNothingIsNamed) {
  for (std::uint64_t seed = 5001; seed <= 5100; ++seed) {
    const Outcome o = run_with(seed, {});
    EXPECT_EQ(o.stopped, "") << seed;
    EXPECT_TRUE(o.named.empty()) << seed << " " << o.named[0];
  }
}

}  // namespace
}  // namespace rotorloop
