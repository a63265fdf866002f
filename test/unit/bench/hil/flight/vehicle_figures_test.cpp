// What the ESCs of a vehicle can serve: by the inductance that each was told, and of the one that holds the least.
#include "bench/hil/flight/vehicle_figures.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bench/hil/flight/esc_parameters.hpp"
#include "host/base/error.hpp"

namespace rotorloop::hil {
namespace {
using ::testing::AllOf;
using ::testing::HasSubstr;

class ServableOfAVehicle : public ::testing::Test {
 protected:
  sim::PlantFile plant = sim::read_plant(std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "vehicles/quad_7in/plant.toml");
  sim::SharedRotors rotors = sim::read_rotors(plant);
  // What its ESC i (from 0) is told for a flight, with the seed's errors.
  double known_H(int i) const { return esc_parameters(plant, {}, i, 0.0, 1).inductance_H; }
  sim::ServableLimit servable() const { return vehicle_figures(plant, rotors).servable; }
};

TEST_F(ServableOfAVehicle, IsByTheInductanceOfTheDAxisWhereTheEscsHaveTheMotorFile) {
  plant.esc.knowledge = sim::EscKnowledge::motor_file;
  const sim::ServableLimit l = servable();
  EXPECT_EQ(l.inductance_H, plant.rotors[0].motor.inductance_d_H);
  EXPECT_FLOAT_EQ(static_cast<float>(l.inductance_H), static_cast<float>(known_H(0)));
  EXPECT_EQ(l.limit_A, sim::servable_limit(*plant.esc.stage, plant.rotors[0].motor.inductance_d_H, l.bus_V).limit_A);
}

TEST_F(ServableOfAVehicle, IsByTheInductanceOfTheParameterFileWhereThereIsOne) {
  const double by_sheet_A = servable().limit_A;
  plant.esc.knowledge = sim::EscKnowledge::file;
  plant.esc.file.inductance_H = 0.4 * plant.rotors[0].motor.inductance_d_H;
  const sim::ServableLimit l = servable();
  EXPECT_EQ(l.inductance_H, plant.esc.file.inductance_H);
  EXPECT_FLOAT_EQ(static_cast<float>(l.inductance_H), static_cast<float>(known_H(0)));
  EXPECT_LT(l.limit_A, by_sheet_A - 1.0);
}

TEST_F(ServableOfAVehicle, IsByTheMeanOfDAndQWithoutTheErrorThatASeedDraws) {
  for (const auto& [knowledge, share] : {std::pair{sim::EscKnowledge::data_sheet, 0.2}, std::pair{sim::EscKnowledge::commissioned, 0.05}}) {
    plant.esc.knowledge = knowledge;
    const double mean_H = 0.5 * (plant.rotors[0].motor.inductance_d_H + plant.rotors[0].motor.inductance_q_H);
    EXPECT_EQ(servable().inductance_H, mean_H);
    EXPECT_NEAR(known_H(0), mean_H, share * mean_H);
    EXPECT_NE(known_H(0), mean_H);
  }
}

TEST_F(ServableOfAVehicle, IsThatOfTheRotorWhoseMotorAllowsTheLeastAndNamesIt) {
  EXPECT_EQ(servable().rotor, 0) << "four of one kind";
  EXPECT_THAT(figures_text(vehicle_figures(plant, rotors)), Not(HasSubstr("(rotor")));
  plant.rotors[2].motor.inductance_d_H *= 0.4;
  plant.rotors[2].motor.inductance_q_H *= 0.4;
  const VehicleFigures f = vehicle_figures(plant, rotors);
  EXPECT_EQ(f.servable.rotor, 3);
  EXPECT_THAT(figures_text(f), HasSubstr("on b_g431b_esc1 (rotor 3)"));
  Inputs inputs;
  inputs.plant = plant;
  Scenario scenario;
  scenario.plant = "plant.toml";
  try {
    check_figures(scenario, inputs, f);
    FAIL() << "40 A asked of an ESC that holds less";
  } catch (const Error& e) {
    EXPECT_THAT(e.what(),
                AllOf(HasSubstr("plant.toml"), HasSubstr("esc.phase_current_limit_A = 40 A cannot be served"), HasSubstr("(rotor 3)")));
  }
}

}  // namespace
}  // namespace rotorloop::hil
