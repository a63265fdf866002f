// The [esc] section: absent it is today's drive; what a board cannot take is refused with the reason.
#include "sim/plant/assemble.hpp"
#include "test/unit/sim/plant/bad_input.hpp"

namespace rotorloop::sim {
namespace {
using ::testing::AllOf;
using ::testing::HasSubstr;

std::string message_of_esc(const std::string& from, const std::string& to, const std::string& line_of = "") {
  return test::message_after(
      "quad_7in/plant.toml", from, to, [](const TomlFile& f) { return read_plant(f); }, line_of);
}

TEST(PlantEsc, WithoutTheSectionTheBoardIsIdealAndTheLimitThatOfTheReferenceDrive) {
  const PlantFile p = read_plant(std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "vehicles/reference_plant.toml");
  EXPECT_FALSE(p.esc.given);
  EXPECT_FALSE(p.esc.typical);
  EXPECT_EQ(p.esc.stage->name, "b_g431b_esc1");
  EXPECT_EQ(p.esc.knowledge, EscKnowledge::motor_file);
  EXPECT_EQ(p.esc.phase_current_limit_A, 40.0);
}
TEST(PlantEsc, ShippedVehiclesFlyDrawnBoardsWithDataSheetParameters) {
  const PlantFile p = read_plant(std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "vehicles/quad_17in/plant.toml");
  EXPECT_TRUE(p.esc.typical);
  EXPECT_TRUE(p.esc.own_clock);
  EXPECT_EQ(p.esc.knowledge, EscKnowledge::data_sheet);
  const SharedRotors rotors = read_rotors(p);
  EXPECT_EQ(drive_parameters(p, *rotors[0], 0).inverter.pwm_Hz, 24000.0);  // high_voltage_14s_120a
}
TEST(PlantEsc, BatteryBeyondThePowerStageIsRefusedWithTheStageThatTakesIt) {
  EXPECT_THAT(message_of_esc("cells = 6", "cells = 8"),
              AllOf(HasSubstr("battery.cells = 8 is outside 3 to 6 cells of the ESCs' power stage b_g431b_esc1"),
                    HasSubstr("high_voltage_14s_120a")));
  EXPECT_THAT(message_of_esc("cells = 6", "cells = 2"), HasSubstr("small_2s_15a"));
}
TEST(PlantEsc, CurrentLimitBeyondTheShuntsIsRefusedWithTheirRange) {
  EXPECT_THAT(message_of_esc("phase_current_limit_A = 40.0", "phase_current_limit_A = 60.0"),
              AllOf(HasSubstr("60"), HasSubstr("45"), HasSubstr("A")));
}
TEST(PlantEsc, OwnClockOfAnIdealBoardIsRefused) {
  EXPECT_THAT(message_of_esc("board = \"typical\"", "board = \"ideal\"", "clock = \"own\""), HasSubstr("board = \"typical\""));
}
TEST(PlantEsc, ParametersThatAreNeitherAWordNorAFileAreRefusedByName) {
  EXPECT_THAT(message_of_esc("parameters = \"data_sheet\"", "parameters = \"datasheet\""), HasSubstr("datasheet"));
}

PlantFile with_fault(const std::string& table) {
  const std::string folder = std::string(ROTORLOOP_SOURCE_DIR) + "/vehicles/";
  return read_plant(
      TomlFile::parse(test::shipped("reference_plant.toml") + "\n[[drive_fault]]\n" + table, folder + "reference_plant.toml"));
}
std::string fault_message(const std::string& table) {
  try {
    (void)with_fault(table);
  } catch (const Error& e) {
    return e.what();
  }
  return "(no error)";
}

TEST(PlantDriveFault, ReachesTheDriveOfItsRotorAlone) {
  const PlantFile p = with_fault("rotor = 3\nkind = \"low_fet_open\"\nphase = \"v\"\nat_s = 3.5\nduration_s = 0.25\n");
  const SharedRotors rotors = read_rotors(p);
  EXPECT_TRUE(drive_parameters(p, *rotors[1], 1).faults.empty());
  const auto faults = drive_parameters(p, *rotors[2], 2).faults;
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].kind, DriveFaultKind::low_fet_open);
  EXPECT_EQ(faults[0].phase, 1);
  EXPECT_EQ(faults[0].from_s, 3.5);
  EXPECT_EQ(faults[0].until_s, 3.75);
}
TEST(PlantDriveFault, LackingOrUnknownWordsAreRefusedByName) {
  EXPECT_THAT(fault_message("rotor = 1\nkind = \"phase_open\"\nat_s = 3\n"), HasSubstr("phase"));
  EXPECT_THAT(fault_message("rotor = 5\nkind = \"rotor_lock\"\nat_s = 3\n"), HasSubstr("rotor"));
  EXPECT_THAT(fault_message("rotor = 1\nkind = \"fire\"\nat_s = 3\n"), HasSubstr("weak_magnets"));
  EXPECT_THAT(fault_message("rotor = 1\nkind = \"weak_magnets\"\nflux_left = 2\nat_s = 3\n"), HasSubstr("flux_left"));
}

}  // namespace
}  // namespace rotorloop::sim
