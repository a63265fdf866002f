// One slip in one of the shipped input files at a time: the command refuses before it flies, with exit code 2 and a message that
// names file, line, key, value, unit or range, and what to do. The line is found here, not typed in.
#include <gtest/gtest.h>

#include <algorithm>
#include <ostream>
#include <vector>

#include "test/integration/hil/cli_run.hpp"

namespace rotorloop::test {
namespace {

// The files a run reads, by their place in the copied folder.
constexpr const char *kScenario = "scenarios/short.toml", *kPlant = "vehicles/reference_plant.toml", *kVehicle = "vehicles/calibrated.toml",
                     *kGains = "vehicles/gains.toml", *kTrajectory = "scenarios/trajectories/climb.toml",
                     *kBlade = "vehicles/blades/triblade_5in.toml", *kMotor = "vehicles/motors/2306_2300kv.toml";

// `from` is replaced once; the message has to name the line on which `to` then stands. An empty `from` appends `to`.
struct Slip {
  const char* name;
  const char* file;
  std::string from, to;
  std::vector<std::string> says;
  bool names_line = true;
};
std::ostream& operator<<(std::ostream& out, const Slip& s) { return out << s.name; }

class BadInput : public testing::TestWithParam<Slip> {};

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  if (from.empty()) return text + to;
  const auto at = text.find(from);
  if (at == std::string::npos) throw std::runtime_error("the shipped file has no \"" + from + "\"");
  return text.replace(at, from.size(), to);
}

// Of the first line of `to`; of its last one when `to` adds a table, whose last line is the slip.
long line_of(const std::string& text, const std::string& to) {
  const auto last = to.find_last_not_of('\n');
  const auto begin = text.find(to);
  const auto newline = to.rfind('\n', last);
  const auto at = begin + (newline == std::string::npos ? 0 : newline + 1);
  return 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
}

void copy_inputs(const ScratchFolder& folder) {
  const std::filesystem::path source = ROTORLOOP_SOURCE_DIR;
  std::filesystem::copy(source / "vehicles", folder / "vehicles", std::filesystem::copy_options::recursive);
  write_text(folder / kTrajectory, kShortClimb);
  write_text(folder / kScenario,
             "format = 1\nname = \"short\"\nplant = \"../vehicles/reference_plant.toml\"\nvehicle = \"../vehicles/calibrated.toml\"\n"
             "seeds = [1]\nvariants = [\"pd_ff_thrust_drag\"]\n[controller]\ngains = \"../vehicles/gains.toml\"\n"
             "[[flight]]\nname = \"climb\"\ntrajectory = \"trajectories/climb.toml\"\n");
}

TEST_P(BadInput, IsRefusedWithPlaceValueAndRemedy) {
  const Slip& slip = GetParam();
  const ScratchFolder folder;
  copy_inputs(folder);
  const std::string broken = replaced(read_text(folder / slip.file), slip.from, slip.to);
  write_text(folder / slip.file, broken);
  const auto done = rotorloop_command(std::string("hil ") + kScenario + " --jobs 1", folder.path());
  EXPECT_EQ(done.exit_code, 2) << done.err;
  EXPECT_EQ(done.out, "");
  std::string place = std::filesystem::path(slip.file).filename().string();
  if (slip.names_line) place += ":" + std::to_string(line_of(broken, slip.to)) + ": error: ";
  EXPECT_NE(done.err.find(place), std::string::npos) << "expected " << place << " in\n" << done.err;
  for (const std::string& part : slip.says) EXPECT_NE(done.err.find(part), std::string::npos) << "expected " << part << " in\n" << done.err;
  EXPECT_NE(done.err.find("\n  do:     "), std::string::npos) << done.err;
  EXPECT_LE(std::count(done.err.begin(), done.err.end(), '\n'), 4) << "one message:\n" << done.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "runs")) << "a run folder was left behind";
}

// The table means something only if the unbroken copy passes.
TEST(GoodInput, TheCopiedFilesFly) {
  const ScratchFolder folder;
  copy_inputs(folder);
  const auto done = rotorloop_command(std::string("hil ") + kScenario + " -q", folder.path());
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(done.err, "");
  EXPECT_NE(done.out.find("verdict: pass"), std::string::npos) << done.out;
}

const std::vector<Slip> kScenarioSlips{
    {"NewerFormat", kScenario, "format = 1", "format = 2", {"format = 2 is not known here; known: 1", "matching rotorloop"}},
    {"NegativeSeed", kScenario, "seeds = [1]", "seeds = [-1]", {"seeds has -1", "0 to 4294967295"}},
    {"SeedTwice", kScenario, "seeds = [1]", "seeds = [3, 3]", {"seeds has 3 twice"}},
    {"NoSeed", kScenario, "seeds = [1]", "seeds = []", {"seeds is an empty list", "seeds = [1, 2, 3]"}},
    {"UnknownVariant",
     kScenario,
     "\"pd_ff_thrust_drag\"",
     "\"lqr\"",
     {"\"lqr\"", "pd_ff, pd_ff_drag, pd_ff_no_effects, pd_ff_thrust_drag"}},
    {"MissingVehicle", kScenario, "calibrated.toml", "nowhere.toml", {"vehicle = \"../vehicles/nowhere.toml\": no such file"}},
    {"FlightNameIsAPath", kScenario, "name = \"climb\"", "name = \"../climb\"", {"flight.name = \"../climb\"", "letters, digits"}},
    {"RealHardwareBus",
     kScenario,
     "",
     "[bus]\nesc = \"socketcan:can0\"\n",
     {"bus.esc = \"socketcan:can0\"", "not built in; built in: virtual:"}},
    {"NotABus", kScenario, "", "[bus]\nstate = \"ethernet\"\n", {"bus.state = \"ethernet\": not a bus backend", "virtual:"}},
    {"PaceThatIsNone",
     kScenario,
     "",
     "[bus]\npace = \"20\"\n",
     {"bus.pace = \"20\" is no pace", "lockstep, realtime, or seconds of flight"}},
    {"ProgramIsMissing", kScenario, "", "[esc]\nkind = \"emulated\"\nelf = \"nowhere.elf\"\n", {"\"nowhere.elf\": no such file"}},
    {"ThreeEscKinds", kScenario, "", "[esc]\nkind = [\"native\", \"native\", \"native\"]\n", {"esc.kind has 3 values, expected 4"}},
    {"OddFastChannelRate", kScenario, "", "[esc]\nfast_channel_Hz = 300\n", {"esc.fast_channel_Hz = 300 Hz", "250, 500 or 1000"}},
    {"LagWithoutTimeConstant", kScenario, "", "[esc]\nkind = \"lag\"\n", {"needs its time constant", "esc_lag_s", "0.001 to 1 s"}, false},
    {"FaultOfRotorFive",
     kScenario,
     "",
     "[[fault]]\nkind = \"esc_silent\"\nat_s = 3\ntarget = 5\n",
     {"fault[1].target = 5 is outside 1 to 4"}},
    {"UnknownFault",
     kScenario,
     "",
     "[[fault]]\nat_s = 3\ntarget = 1\nkind = \"lightning\"\n",
     {"\"lightning\" is not known", "esc_silent"}},
    {"FaultProbabilityInPercent",
     kScenario,
     "",
     "[[fault]]\nkind = \"frame_drop\"\ntarget = \"esc\"\nat_s = 3\nprobability = 50\n",
     {"fault[1].probability = 50 is outside 0 to 1"}},
    {"FaultOfUnknownFlight",
     kScenario,
     "",
     "[[fault]]\nkind = \"esc_silent\"\ntarget = 1\nat_s = 3\nflight = \"dive\"\n",
     {"flight = \"dive\" is not a flight", "use one of: climb"}},
    {"OddAirframeRate", kScenario, "", "[step]\nairframe_Hz = 3000\n", {"step.airframe_Hz = 3000 Hz", "1000, 2000, 4000 or 8000"}},
    {"LimitOfVariantNotFlown",
     kScenario,
     "",
     "[limits]\nmean_tracking_error_cm = { flight = \"climb\", variant = \"pd_ff\", max = 1 }\n",
     {"\"pd_ff\" is not flown"}},
};

const std::vector<Slip> kVehicleSlips{
    {"MassInGrams", kPlant, "mass_kg = 0.682", "mass_kg = 682", {"body.mass_kg = 682 kg is outside 0.01 to 100 kg"}},
    {"InertiaThatNoBodyHas",
     kPlant,
     "inertia_kg_m2 = [2.41e-3, 3.42e-3, 5.22e-3",
     "inertia_kg_m2 = [2.41e-3, 3.42e-3, 5.22e-2",
     {"principal moments", "kg m^2", "sum of the other two"}},
    {"InertiaInGramsMillimetres",
     kPlant,
     "inertia_kg_m2 = [2.41e-3, 3.42e-3, 5.22e-3",
     "inertia_kg_m2 = [2.41e-9, 3.42e-9, 5.22e-9",
     {"radius of gyration"}},
    {"RotorsSwapped",
     kPlant,
     "position_m = [0.0885, -0.0885, 0.02]",
     "position_m = [-0.0885, 0.0885, 0.02]",
     {"rotor[1].position_m", "is not front-right", "1 front-right, 2 rear-left"}},
    {"SpinReversed", kPlant, "spin = 1 ", "spin = -1 ", {"rotor[1].spin = -1, expected 1"}},
    {"BladeFileMissing", kPlant, "blades/triblade_5in.toml", "blades/none.toml", {"rotor[1].blade = \"blades/none.toml\": no such file"}},
    {"UnknownPlantEffect", kPlant, "id = \"gyroscopic\"", "id = \"coriolis\"", {"effect \"coriolis\" is not known", "gyroscopic"}},
    {"PlantEffectTwice",
     kPlant,
     "id = \"gyroscopic\"",
     "id = \"rotor_inertia_reaction\"",
     {"\"rotor_inertia_reaction\" is switched on twice", "one entry"},
     false},
    {"BatteryInMilliampereHours",
     kPlant,
     "capacity_Ah = 1.5",
     "capacity_Ah = 1500",
     {"battery.capacity_Ah = 1500 Ah is outside 0.05 to 100 Ah"}},
    {"ChargeInPercent", kPlant, "state_of_charge = 0.9", "state_of_charge = 90", {"state_of_charge = 90 is outside 0 to 1"}},
    {"AirDensityNotFinite", kPlant, "density_kg_m3 = 1.2", "density_kg_m3 = nan", {"air.density_kg_m3 = nan", "0.01 to 5 kg/m^3"}},
    {"MisspeltPlantKey", kPlant, "cells = 4", "cells = 4\ncels = 4", {"unknown key \"battery.cels\"", "docs/files.md"}},
    {"LatencyInMilliseconds", kPlant, "latency_s = 0.015", "latency_s = 15", {"sensors.pose.latency_s = 15 s is outside 0 to 1 s"}},
    {"QuaternionNotOfLengthOne",
     kPlant,
     "quaternion_wxyz = [1, 0, 0, 0]",
     "quaternion_wxyz = [1, 0.5, 0, 0]",
     {"has the length 1.118", "normalise"}},
    {"ThrustPerRpm", kVehicle, "k1_N_s2 = { value = 2.", "k1_N_s2 = { value = 0.02", {"figure of merit", "credible is 0.3 to 0.85"}},
    {"WindowBackwards",
     kVehicle,
     "rpm_window = [5000, 15000]",
     "rpm_window = [15000, 5000]",
     {"rpm_window = 15000 to 5000 RPM is empty", "lower speed first"}},
    {"UnknownOrigin", kVehicle, "origin = \"cad\"", "origin = \"hearsay\"", {"\"hearsay\"", "cad", "stand", "flight", "guess"}},
    {"UncertaintyMissing",
     kVehicle,
     "mass_kg = { value = 0.682, u = 0.001,",
     "mass_kg = { value = 0.682,",
     {"\"body.mass_kg.u\" is missing"}},
    {"UnknownEffectInTheVehicleFile",
     kVehicle,
     "[provenance]",
     "[[effect]]\nid = \"coriolis\"\n[provenance]",
     {"effect \"coriolis\" is not in the catalogue", "use one of:"},
     false},
    {"NegativeMass", kVehicle, "mass_kg = { value = 0.682", "mass_kg = { value = -0.682", {"-0.682 kg is outside"}},
    {"TiltOfAWall", kGains, "tilt_max_deg = 65.0", "tilt_max_deg = 90.0", {"limits.tilt_max_deg = 90 deg is outside 5 to 85 deg"}},
    {"LoopsNotSeparated",
     kGains,
     "frequency_rad_s = 20.0",
     "frequency_rad_s = 10.0",
     {"roll_pitch.frequency_rad_s = 10 rad/s is less than 4 times horizontal.frequency_rad_s = 3.4 rad/s", "raise roll_pitch"}},
    {"SpeedLimitsSwapped",
     kGains,
     "omega_min_rad_s = 250.0",
     "omega_min_rad_s = 2500.0",
     {"is not below limits.omega_max_rad_s = 1780.2 rad/s"}},
    {"GainAsText", kGains, "damping = 0.8", "damping = \"0.8\"", {"horizontal.damping = \"0.8\" is a text, expected a number"}},
    {"JumpBetweenSegments",
     kTrajectory,
     "z_m = [3]",
     "z_m = [3.1]",
     {"position of z_m jumps from 3 m to 3.1 m between segments 2 and 3", "0.0001 m"}},
    {"OrderAboveSeven", kTrajectory, "-0.15625]", "-0.15625, 1e-3]", {"z_m has order 8, the highest is 7"}},
    {"StartsInMotion", kTrajectory, "x_m = [0]", "x_m = [0, 1]", {"x_m"}},
    {"DurationZero", kTrajectory, "duration_s = 2", "duration_s = 0.0", {"duration_s = 0 s is outside 0.001 to 3600 s"}},
    {"BladeRadiusInMillimetres", kBlade, "radius_m = 0.0635", "radius_m = 63.5", {"radius_m = 63.5 m is outside 0.01 to 2 m"}},
    {"StationsNotAscending", kBlade, "r_m = 0.0127", "r_m = 0.0070", {"r_m = 0.007 m does not exceed that of the station before, 0.008 m"}},
    {"UnknownPolar", kBlade, "polar = \"naca4410\"", "polar = \"naca9999\"", {"polar \"naca9999\" not found"}},
    {"ResistanceInMilliohm",
     kMotor,
     "resistance_ohm = 0.06",
     "resistance_ohm = 60",
     {"resistance_ohm = 60 ohm is outside 0.001 to 10 ohm"}},
    {"PolesForPolePairs", kMotor, "pole_pairs = 7", "pole_pairs = 42", {"pole_pairs = 42 is outside 1 to 30"}},
    {"InductancesExchanged", kMotor, "d = 15e-6, q = 18e-6", "d = 18e-6, q = 15e-6", {"saliency 0.83 is outside 1 to 3"}},
    {"FluxInMilliweber",
     kMotor,
     "flux_linkage_Wb = 3.42e-4",
     "flux_linkage_Wb = 0.342",
     {"flux_linkage_Wb = 0.342 Wb is outside 1e-05 to 0.1 Wb"}},
};

const auto kName = [](const auto& slip) { return std::string(slip.param.name); };
INSTANTIATE_TEST_SUITE_P(Scenario, BadInput, testing::ValuesIn(kScenarioSlips), kName);
INSTANTIATE_TEST_SUITE_P(VehicleFiles, BadInput, testing::ValuesIn(kVehicleSlips), kName);

}  // namespace
}  // namespace rotorloop::test
