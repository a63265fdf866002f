// A vehicle file that knows what the plant has: the command flies with its [[effect]]s, tracks better than without them, and says
// which of them no controller can use. The same seed with and without.
#include "test/integration/hil/cli_run.hpp"

namespace rotorloop::test {
namespace {

const std::string kSource = ROTORLOOP_SOURCE_DIR;

// The shipped plant and vehicle with more at their ends, both controllers, one shipped trajectory.
void write_case(const std::filesystem::path& folder, const std::string& trajectory, const std::string& plant, const std::string& vehicle) {
  std::filesystem::copy(kSource + "/vehicles", folder / "vehicles", std::filesystem::copy_options::recursive);
  const auto append = [&](const char* file, const std::string& text) {
    write_text(folder / "vehicles" / file, read_text(folder / "vehicles" / file) + text);
  };
  append("reference_plant.toml", plant);
  append("calibrated.toml", vehicle);
  write_text(folder / "case.toml",
             "format = 1\nname = \"case\"\nplant = \"vehicles/reference_plant.toml\"\nvehicle = \"vehicles/calibrated.toml\"\n"
             "seeds = [1]\nvariants = [\"pd_ff_no_effects\", \"pd_ff_thrust_drag\"]\n[controller]\ngains = \"vehicles/gains.toml\"\n"
             "[[flight]]\nname = \"flight\"\ntrajectory = \"" +
                 kSource + "/scenarios/trajectories/" + trajectory + ".toml\"\n");
}

std::string effect_in_plant(const std::string& id, const std::string& values) {
  return "\n[[effect]]\nid = \"" + id + "\"\n" + values + "\n";
}
std::string effect_in_vehicle(const std::string& id, const std::string& parameter, double value) {
  return "\n[[effect]]\nid = \"" + id + "\"\nparameter." + parameter + " = { value = " + std::to_string(value) +
         ", u = 0.0, origin = \"guess\" }\n";
}

struct Flown {
  double without_cm = 0.0, with_cm = 0.0;
  nlohmann::json counters;  // of the flight with effects
};
Flown flown(const ScratchFolder& folder, const char* axis) {
  const auto done = rotorloop_command("hil case.toml -q -j 2 --name run", folder.path());
  EXPECT_EQ(done.exit_code, 0) << done.err;
  Flown out;
  const auto run = result_of(folder / "runs" / "run");
  for (const auto& f : run.at("flights")) {
    EXPECT_EQ(f.at("end"), "completed");
    const bool with = f.at("variant") == "pd_ff_thrust_drag";
    (with ? out.with_cm : out.without_cm) = f.at("error_cm").at(axis);
    if (with) out.counters = f.at("counters");
  }
  for (const char* name : {"control.effects_not_finite", "control.effects_bounded", "control.effects_not_converged"})
    EXPECT_EQ(out.counters.at(name), 0.0) << name;
  return out;
}

TEST(EffectsInControl, GroundEffectInTheVehicleFileSteadiesTheLowHover) {
  const ScratchFolder folder;
  write_case(folder.path(), "low_hover", effect_in_plant("ground_effect_vehicle", "gain = 1.0"),
             effect_in_vehicle("ground_effect_vehicle", "gain", 1.0));
  const Flown f = flown(folder, "mean_z");
  EXPECT_GT(f.without_cm, 1.0);
  EXPECT_LT(f.with_cm, 0.6 * f.without_cm) << f.without_cm << " cm without";
}

TEST(EffectsInControl, ALoadAheadOfTheCentreIsCarriedOnceItsMassAndPlaceAreKnown) {
  const ScratchFolder folder;
  write_case(folder.path(), "low_hover", effect_in_plant("payload_mass", "mass_kg = 0.1\nx_m = 0.03"),
             effect_in_vehicle("payload_mass", "mass_kg", 0.1) + effect_in_vehicle("com_offset", "dx_m", 0.00366));
  const Flown f = flown(folder, "mean_3d");
  EXPECT_GT(f.without_cm, 6.0);
  EXPECT_LT(f.with_cm, 0.3 * f.without_cm) << f.without_cm << " cm without";
}

TEST(EffectsInControl, StrutsThatTakeEightPercentOfTheThrustAreMadeUpFor) {
  const ScratchFolder folder;
  write_case(folder.path(), "low_hover", effect_in_plant("blockage_strut", "loss = 0.08"),
             effect_in_vehicle("blockage_strut", "loss", 0.08));
  const Flown f = flown(folder, "mean_z");
  EXPECT_GT(f.without_cm, 3.0);
  EXPECT_LT(f.with_cm, 0.4 * f.without_cm) << f.without_cm << " cm without";
}

TEST(EffectsInControl, AnEffectOfASensorIsNamedAsNotUsedAndChangesNoFlight) {
  const ScratchFolder folder;
  write_case(folder.path(), "low_hover", "", effect_in_vehicle("pose_scale", "error", 0.02));
  const Flown f = flown(folder, "mean_z");
  EXPECT_EQ(f.with_cm, f.without_cm);
  const auto run = result_of(folder / "runs" / "run");
  ASSERT_EQ(run.at("warnings").size(), 1u);
  EXPECT_NE(run.at("warnings")[0].at("what").get<std::string>().find("pose_scale"), std::string::npos);
}

TEST(EffectsInControl, AParameterOutsideItsBoundsIsRefusedBeforeTheFlight) {
  const ScratchFolder folder;
  write_case(folder.path(), "low_hover", "", effect_in_vehicle("blockage_strut", "loss", 0.5));
  const auto done = rotorloop_command("hil case.toml -q", folder.path());
  EXPECT_EQ(done.exit_code, 2);
  EXPECT_NE(done.err.find("0.5"), std::string::npos) << done.err;
  EXPECT_NE(done.err.find("0.3"), std::string::npos) << done.err;
}

}  // namespace
}  // namespace rotorloop::test
