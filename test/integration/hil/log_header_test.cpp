// What a flight's files and figures take from the flight computer's and the plant's settings, and not from defaults.
#include <gtest/gtest.h>

#include <atomic>

#include "bench/hil/flight/flight.hpp"
#include "bench/sysid/log/log_reader.hpp"
#include "test/integration/hil/short_flight.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::test {
namespace {

std::string logged_pole_pairs(const hil::Scenario& scenario, const hil::Inputs& inputs, const TempFolder& folder) {
  const std::atomic<bool> at_once = true;
  const hil::FlightRequest q{.flight = 0, .variant = host::Variant::pd_ff_thrust_drag, .seed = 1, .folder = folder.path()};
  hil::fly(scenario, inputs, q, nullptr, nullptr, &at_once);
  return log::read_log(folder.path() / "flight.csv").header.at("pole_pairs");
}

TEST(FlightLogHeader, NamesThePolePairsOfThePlantsMotors7Or6OrThoseOfEachRotor) {
  const TempFolder folder;
  const hil::Scenario scenario = hil::read_scenario(shipped("scenarios/paper.toml"));
  hil::Inputs inputs = hil::read_inputs(scenario);
  EXPECT_EQ(logged_pole_pairs(scenario, inputs, folder), "7");
  for (auto& r : inputs.plant.rotors) r.motor.pole_pairs = 6;
  EXPECT_EQ(logged_pole_pairs(scenario, inputs, folder), "6");
  inputs.plant.rotors[2].motor.pole_pairs = 7;
  EXPECT_EQ(logged_pole_pairs(scenario, inputs, folder), "6 6 7 6");
}

TEST(FlightDuration, GrowsBy1sWhenTheTrajectoryBegins1sLater) {
  hil::LoopConfig config = short_flight_config(1);
  const double before_s = hil::flight_duration_s(config, short_trajectory());
  config.computer.start_us += 1'000'000;
  EXPECT_NEAR(hil::flight_duration_s(config, short_trajectory()) - before_s, 1.0, 1e-9);
}

}  // namespace
}  // namespace rotorloop::test
