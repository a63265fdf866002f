// Scenario files: what is read, and the text of every refusal (a pilot reads these at the field).
#include "bench/hil/flight/scenario.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::hil {
namespace {
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kGood = R"(format = 1
name = "paper: horizontal"
plant = "plant.toml"
vehicle = "vehicle.toml"
seeds = [1, 2, 3]
variants = ["pd_ff", "pd_ff_drag", "pd_ff_thrust_drag"]
[controller]
gains = "gains.toml"
[[flight]]
name = "horizontal"
trajectory = "horizontal.toml"
[[flight]]
name = "vertical"
trajectory = "vertical.toml"
)";

class ScenarioFile : public ::testing::Test {
 protected:
  ScenarioFile() {
    for (const auto* f : {"plant.toml", "vehicle.toml", "gains.toml", "horizontal.toml", "vertical.toml"}) folder_.write(f, "format = 1\n");
  }
  Scenario read(const std::string& text) { return read_scenario(folder_.write("scenario.toml", text)); }
  std::string error(const std::string& text) {
    return test::error_of([&] { read(text); });
  }
  // kGood with one part replaced.
  static std::string with(const std::string& from, const std::string& to) {
    std::string s = kGood;
    const auto at = s.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return s.replace(at, from.size(), to);
  }
  test::TempFolder folder_;
};

TEST_F(ScenarioFile, MinimalFileGetsTheReferenceDefaults) {
  const auto s = read(kGood);
  EXPECT_EQ(s.name, "paper: horizontal");
  EXPECT_THAT(s.seeds, ElementsAre(1, 2, 3));
  EXPECT_THAT(s.variants, ElementsAre(Variant::pd_ff, Variant::pd_ff_drag, Variant::pd_ff_thrust_drag));
  ASSERT_EQ(s.flights.size(), 2u);
  EXPECT_EQ(s.flights[1].name, "vertical");
  EXPECT_EQ(s.flights[1].trajectory.filename(), "vertical.toml");
  EXPECT_EQ(s.bus.esc, "virtual:");
  EXPECT_EQ(s.esc.kind[3], EscKind::native);
  EXPECT_EQ(s.esc.fast_channel_Hz, 1000);
  EXPECT_EQ(s.airframe_Hz, 2000);
  EXPECT_THAT(ablation_texts(s.ablation), IsEmpty());
  EXPECT_THAT(s.faults, IsEmpty());
}

TEST_F(ScenarioFile, LimitsMayBeOneTableOrAListAndNameAnAxis) {
  const auto s = read(std::string(kGood) + R"([limits]
mean_tracking_error_cm = [
  { flight = "horizontal", variant = "pd_ff_thrust_drag", max = 4.0 },
  { flight = "vertical", variant = "pd_ff", max = 2.0, axis = "z" } ]
reduction_percent = { flight = "vertical", from = "pd_ff", to = "pd_ff_thrust_drag", min = 60, axis = "z" }
bus_load_percent = { max = 70 }
)");
  ASSERT_EQ(s.limits.error.size(), 2u);
  EXPECT_EQ(s.limits.error[0].axis, ErrorAxis::norm_3d);
  EXPECT_EQ(s.limits.error[1].axis, ErrorAxis::z);
  EXPECT_DOUBLE_EQ(s.limits.error[1].max_cm, 2.0);
  ASSERT_EQ(s.limits.reduction.size(), 1u);
  EXPECT_EQ(s.limits.reduction[0].to, Variant::pd_ff_thrust_drag);
  ASSERT_EQ(s.limits.bus_load.size(), 1u);
  EXPECT_FALSE(s.limits.bus_load[0].bus.has_value());
}

TEST_F(ScenarioFile, FaultsNameARotorOrABus) {
  const auto s = read(std::string(kGood) + R"([[fault]]
kind = "esc_silent"
at_s = 6.0
target = 2
flight = "vertical"
[[fault]]
kind = "frame_drop"
at_s = 1.5
duration_s = 0.25
target = "state"
probability = 0.1
)");
  ASSERT_EQ(s.faults.size(), 2u);
  EXPECT_EQ(s.faults[0].rotor, 2);
  EXPECT_EQ(s.faults[0].duration_s, 0.0);
  EXPECT_EQ(s.faults[0].flight, "vertical");
  EXPECT_EQ(s.faults[1].bus, BusName::state);
  EXPECT_DOUBLE_EQ(s.faults[1].probability, 0.1);
}

TEST_F(ScenarioFile, EveryAblationIsSaidInASentence) {
  const auto s =
      read(std::string(kGood) +
           "[esc]\nkind = \"lag\"\n[ablation]\nlatency_compensation = false\ndrift = false\nbus = \"direct\"\nesc_lag_s = 0.03\n");
  EXPECT_THAT(ablation_texts(s.ablation), ElementsAre(HasSubstr("latency compensation is off"), HasSubstr("drift is off"),
                                                      HasSubstr("no ESC bus"), HasSubstr("0.03 s")));
}

TEST_F(ScenarioFile, MissingFile) {
  EXPECT_THAT(test::error_of([] { read_scenario("no/such.toml"); }), HasSubstr("no/such.toml: error: no such file"));
}
TEST_F(ScenarioFile, UnknownKeyNamesItsLine) {
  EXPECT_THAT(error(with("vehicle = ", "vehicel = \"x\"\nvehicle = ")), HasSubstr("scenario.toml:4: error: unknown key \"vehicel\""));
}
TEST_F(ScenarioFile, UnknownKeyInsideALimitIsFound) {
  EXPECT_THAT(error(std::string(kGood) + "[limits]\nbus_load_percent = { max = 70, bsu = \"esc\" }\n"),
              HasSubstr("unknown key \"limits.bus_load_percent.bsu\""));
}
TEST_F(ScenarioFile, FormatOfAnotherVersion) {
  EXPECT_THAT(error(with("format = 1", "format = 2")), HasSubstr("scenario.toml:1: error: format = 2 is not known here; known: 1"));
}
TEST_F(ScenarioFile, PlantThatDoesNotExistShowsWhereItWasSought) {
  EXPECT_THAT(error(with("plant.toml", "plants/x.toml")),
              AllOf(HasSubstr("scenario.toml:3: error: plant = \"plants/x.toml\": no such file"),
                    HasSubstr("relative to the folder of this file")));
}
TEST_F(ScenarioFile, MissingGains) {
  EXPECT_THAT(error(with("gains = \"gains.toml\"\n", "")), HasSubstr("key \"controller.gains\" is missing"));
}
TEST_F(ScenarioFile, EmptySeeds) {
  EXPECT_THAT(error(with("[1, 2, 3]", "[]")),
              AllOf(HasSubstr("scenario.toml:5: error: seeds is an empty list"), HasSubstr("seeds = [1, 2, 3]")));
}
TEST_F(ScenarioFile, SeedTwice) {
  EXPECT_THAT(error(with("[1, 2, 3]", "[1, 2, 1]")), HasSubstr("scenario.toml:5: error: seeds has 1 twice"));
}
TEST_F(ScenarioFile, NegativeSeed) { EXPECT_THAT(error(with("[1, 2, 3]", "[-1]")), HasSubstr("seeds has -1, outside 0 to 4294967295")); }
TEST_F(ScenarioFile, UnknownVariantListsTheKnownOnes) {
  EXPECT_THAT(error(with("\"pd_ff_drag\"", "\"pdff\"")),
              AllOf(HasSubstr("scenario.toml:6: error: variants has \"pdff\""),
                    HasSubstr("use one of: pd_ff, pd_ff_drag, pd_ff_no_effects, pd_ff_thrust_drag")));
}
TEST_F(ScenarioFile, VariantTwice) { EXPECT_THAT(error(with("\"pd_ff_drag\"", "\"pd_ff\"")), HasSubstr("variants has \"pd_ff\" twice")); }
TEST_F(ScenarioFile, EmptyVariants) {
  EXPECT_THAT(error(with("[\"pd_ff\", \"pd_ff_drag\", \"pd_ff_thrust_drag\"]", "[]")), HasSubstr("variants is an empty list"));
}
TEST_F(ScenarioFile, NoFlight) {
  std::string s = kGood;
  s.resize(s.find("[[flight]]"));
  EXPECT_THAT(error(s), HasSubstr("[[flight]] occurs 0 times"));
}
TEST_F(ScenarioFile, FlightNameTwice) {
  EXPECT_THAT(error(with("\"vertical\"", "\"horizontal\"")),
              HasSubstr("scenario.toml:13: error: flight.name = \"horizontal\" is used twice"));
}
TEST_F(ScenarioFile, FlightNameThatWouldLeaveTheRunFolder) {
  EXPECT_THAT(error(with("\"vertical\"", "\"../x\"")), HasSubstr("flight.name = \"../x\" cannot name a folder"));
}
TEST_F(ScenarioFile, BusBackendThatIsNotBuiltInNamesWhatIs) {
  EXPECT_THAT(
      error(std::string(kGood) + "[bus]\nesc = \"socketcan:can0\"\n"),
      AllOf(HasSubstr("scenario.toml:16: error: bus.esc = \"socketcan:can0\": this bus backend is not built in; built in: virtual:"),
            HasSubstr("set esc = \"virtual:\"")));
}
TEST_F(ScenarioFile, BusBackendThatDoesNotExist) {
  EXPECT_THAT(error(std::string(kGood) + "[bus]\nstate = \"carrier pigeon\"\n"),
              HasSubstr("bus.state = \"carrier pigeon\": not a bus backend"));
}
TEST(ScenarioPace, IsLockstepRealTimeOrANumber) {
  EXPECT_EQ(parse_pace("lockstep"), std::optional(0.0));
  EXPECT_EQ(parse_pace("realtime"), std::optional(1.0));
  EXPECT_EQ(parse_pace("0.25"), std::optional(0.25));
  for (const char* text : {"", "fast", "0", "0.009", "10.1", "1s", "nan"}) EXPECT_EQ(parse_pace(text), std::nullopt) << text;
}
TEST_F(ScenarioFile, PaceThatIsNoneIsRefusedWithWhatWouldBe) {
  EXPECT_THAT(error(std::string(kGood) + "[bus]\npace = \"20\"\n"),
              AllOf(HasSubstr("bus.pace = \"20\" is no pace"),
                    HasSubstr("lockstep, realtime, or seconds of flight per second of real time, 0.01 to 10")));
}
TEST_F(ScenarioFile, EmulatedEscsAreOfAKindOfTheirOwn) {
  const Scenario s = read(std::string(kGood) + "[esc]\nkind = [\"native\", \"native\", \"native\", \"emulated\"]\n");
  EXPECT_EQ(s.esc.kind[2], EscKind::native);
  EXPECT_EQ(s.esc.kind[3], EscKind::emulated);
  EXPECT_TRUE(s.esc.emulated());
}
TEST_F(ScenarioFile, ProgramWithoutAnEmulatedEsc) {
  EXPECT_THAT(error(std::string(kGood) + "[esc]\nelf = \"gains.toml\"\n"),
              AllOf(HasSubstr("esc.elf names a program"), HasSubstr("set kind = \"emulated\"")));
}
TEST_F(ScenarioFile, ProgramThatIsNotThere) {
  EXPECT_THAT(error(std::string(kGood) + "[esc]\nkind = \"emulated\"\nelf = \"nowhere.elf\"\n"),
              HasSubstr("\"nowhere.elf\": no such file"));
}
TEST_F(ScenarioFile, EmulatedEscsWithoutABus) {
  EXPECT_THAT(error(std::string(kGood) + "[esc]\nkind = \"emulated\"\n[ablation]\nbus = \"direct\"\n"),
              HasSubstr("leaves no bus for emulated ESCs"));
}
TEST_F(ScenarioFile, ExternalEscIsRefusedUntilBuiltIn) {
  EXPECT_THAT(error(std::string(kGood) + "[esc]\nkind = \"external\"\n"),
              HasSubstr("esc.kind has \"external\": not built in; built in: native, lag, emulated"));
}
TEST_F(ScenarioFile, UnknownEscKind) {
  EXPECT_THAT(error(std::string(kGood) + "[esc]\nkind = \"magic\"\n"), HasSubstr("esc.kind has \"magic\", which is not known"));
}
TEST_F(ScenarioFile, ThreeEscKinds) {
  EXPECT_THAT(error(std::string(kGood) + "[esc]\nkind = [\"native\", \"native\", \"native\"]\n"),
              HasSubstr("esc.kind has 3 values, expected 4"));
}
TEST_F(ScenarioFile, LagEscWithoutItsTimeConstant) {
  EXPECT_THAT(error(std::string(kGood) + "[esc]\nkind = \"lag\"\n"), AllOf(HasSubstr("needs its time constant"), HasSubstr("esc_lag_s")));
}
TEST_F(ScenarioFile, LagWithoutALagEsc) {
  EXPECT_THAT(error(std::string(kGood) + "[ablation]\nesc_lag_s = 0.02\n"), HasSubstr("no ESC is of kind \"lag\""));
}
TEST_F(ScenarioFile, FastChannelRateThatDoesNotExist) {
  EXPECT_THAT(error(std::string(kGood) + "[esc]\nfast_channel_Hz = 400\n"),
              HasSubstr("esc.fast_channel_Hz = 400 Hz is not a rate of the fast channel"));
}
TEST_F(ScenarioFile, UnknownFaultListsTheKnownOnes) {
  EXPECT_THAT(error(std::string(kGood) + "[[fault]]\nkind = \"gremlin\"\nat_s = 1\ntarget = 1\n"),
              AllOf(HasSubstr("\"gremlin\" is not known"), HasSubstr("esc_silent, node_silent, bus_babble, frame_drop, frame_corrupt")));
}
TEST_F(ScenarioFile, FaultOfAFifthRotor) {
  EXPECT_THAT(error(std::string(kGood) + "[[fault]]\nkind = \"esc_silent\"\nat_s = 1\ntarget = 5\n"),
              HasSubstr("target = 5 is outside 1 to 4"));
}
TEST_F(ScenarioFile, BusFaultWithoutABus) {
  EXPECT_THAT(error(std::string(kGood) + "[[fault]]\nkind = \"bus_babble\"\nat_s = 1\n"), HasSubstr("target\" is missing"));
}
TEST_F(ScenarioFile, FaultBeforeTheStart) {
  EXPECT_THAT(error(std::string(kGood) + "[[fault]]\nkind = \"esc_silent\"\nat_s = -1\ntarget = 1\n"),
              HasSubstr("at_s = -1 s is outside 0 to 3600 s"));
}
TEST_F(ScenarioFile, ProbabilityOfARotorFaultIsAnUnknownKey) {
  EXPECT_THAT(error(std::string(kGood) + "[[fault]]\nkind = \"esc_silent\"\nat_s = 1\ntarget = 1\nprobability = 0.5\n"),
              HasSubstr("unknown key \"fault.probability\""));
}
TEST_F(ScenarioFile, LimitOfAFlightThatIsNotFlown) {
  EXPECT_THAT(error(std::string(kGood) + "[limits]\nmean_tracking_error_cm = { flight = \"diagonal\", variant = \"pd_ff\", max = 4 }\n"),
              AllOf(HasSubstr("scenario.toml:16: error: flight = \"diagonal\" is not a flight of this scenario"),
                    HasSubstr("use one of: horizontal, vertical")));
}
TEST_F(ScenarioFile, LimitOfAVariantThatIsNotFlown) {
  EXPECT_THAT(error(with("\"pd_ff_drag\", ", "") +
                    "[limits]\nmean_tracking_error_cm = { flight = \"vertical\", variant = \"pd_ff_drag\", max = 4 }\n"),
              HasSubstr("variant = \"pd_ff_drag\" is not flown by this scenario"));
}
TEST_F(ScenarioFile, ReductionToItself) {
  EXPECT_THAT(
      error(std::string(kGood) + "[limits]\nreduction_percent = { flight = \"vertical\", from = \"pd_ff\", to = \"pd_ff\", min = 4 }\n"),
      HasSubstr("is always 0 %"));
}
TEST_F(ScenarioFile, ReductionBeyondHundredPercent) {
  EXPECT_THAT(error(std::string(kGood) +
                    "[limits]\nreduction_percent = { flight = \"vertical\", from = \"pd_ff\", to = \"pd_ff_drag\", min = 101 }\n"),
              HasSubstr("min = 101 % is outside -1000 to 100 %"));
}
TEST_F(ScenarioFile, TwoLimitsForTheSameFigure) {
  EXPECT_THAT(error(std::string(kGood) + "[limits]\nbus_load_percent = [{ max = 70 }, { max = 60 }]\n"),
              HasSubstr("two limits for the load of the same bus"));
}
TEST_F(ScenarioFile, BusLoadAboveHundredPercent) {
  EXPECT_THAT(error(std::string(kGood) + "[limits]\nbus_load_percent = { max = 170 }\n"), HasSubstr("max = 170 % is outside 1 to 100 %"));
}
TEST_F(ScenarioFile, AirframeRateThatDoesNotFitTheOtherRates) {
  EXPECT_THAT(error(std::string(kGood) + "[step]\nairframe_Hz = 3000\n"), HasSubstr("step.airframe_Hz = 3000 Hz does not divide"));
}
TEST_F(ScenarioFile, DirectBusLeavesNothingForAFaultToStrike) {
  EXPECT_THAT(error(std::string(kGood) + "[[fault]]\nkind = \"bus_babble\"\nat_s = 1\ntarget = \"esc\"\n[ablation]\nbus = \"direct\"\n"),
              HasSubstr("leaves no bus for the [[fault]] entries"));
}
TEST_F(ScenarioFile, NotToml) { EXPECT_THAT(error("format = = 1\n"), HasSubstr("scenario.toml:1: error: not valid TOML")); }

TEST(SeedsArgument, CountListAndRanges) {
  EXPECT_THAT(parse_seeds("3"), ElementsAre(1, 2, 3));
  EXPECT_THAT(parse_seeds("7,"), ElementsAre(7));
  EXPECT_THAT(parse_seeds("4,1,7..9"), ElementsAre(4, 1, 7, 8, 9));
}
TEST(SeedsArgument, RefusalsNameTheArgumentAndTheForm) {
  for (const auto& [text, what] : std::vector<std::pair<std::string, std::string>>{{"", "\"\" is not a seed"},
                                                                                   {"abc", "\"abc\" is not a seed"},
                                                                                   {"0", "no seed at all"},
                                                                                   {"1,1", "seed 1 is given twice"},
                                                                                   {"9..7", "9..7 runs backwards"},
                                                                                   {"0..99999999", "more than 10000 seeds"},
                                                                                   {"1,,2", "\"\" is not a seed"},
                                                                                   {"-3", "\"-3\" is not a seed"},
                                                                                   {"99999999999,", "outside 0 to 4294967295"}})
    EXPECT_THAT(test::error_of([&] { parse_seeds(text); }), AllOf(HasSubstr("--seeds: error: "), HasSubstr(what), HasSubstr("1,4,7..9")))
        << text;
}
TEST(VariantsArgument, NamesOrRefusal) {
  EXPECT_THAT(parse_variants("pd_ff_drag,pd_ff"), ElementsAre(Variant::pd_ff_drag, Variant::pd_ff));
  EXPECT_THAT(test::error_of([] { parse_variants("pd"); }), HasSubstr("--variants: error: \"pd\" is not a controller variant"));
  EXPECT_THAT(test::error_of([] { parse_variants("pd_ff,pd_ff"); }), HasSubstr("given twice"));
}

}  // namespace
}  // namespace rotorloop::hil
