// Every message is part of the product: the tests hold file, line, key, value, unit, range and remedy.
#include "host/base/toml_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "host/base/error.hpp"

namespace rotorloop {
namespace {
using ::testing::AllOf;
using ::testing::HasSubstr;

std::string message(const std::function<void()>& f) {
  try {
    f();
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::usage);
    return e.what();
  }
  return "(no error)";
}
TomlFile parse(std::string_view text) { return TomlFile::parse(text, "quad.toml"); }

TEST(TomlFile, OutOfRangeNamesFileLineKeyValueUnitRangeAndRemedy) {
  const auto f = parse("format = 1\n[body]\nmass_kg = -3.5\n");
  EXPECT_THAT(
      message([&] {
        f.root().table("body").number("mass_kg", {0.01, 100, "kg"});
      }),
      AllOf(HasSubstr("quad.toml:3: error: body.mass_kg = -3.5 kg is outside 0.01 to 100 kg"), HasSubstr("do:     give mass_kg in kg")));
}
TEST(TomlFile, MissingKeyNamesTheTableAndWhatToWrite) {
  const auto f = parse("format = 1\n[body]\nx = 1\n");
  EXPECT_THAT(message([&] {
                f.root().table("body").number("mass_kg", {0.01, 100, "kg"});
              }),
              AllOf(HasSubstr("quad.toml:2: error: key \"body.mass_kg\" is missing"), HasSubstr("add mass_kg = a number, 0.01 to 100 kg")));
}
TEST(TomlFile, WrongTypeShowsTheValueFound) {
  const auto f = parse("mass_kg = \"heavy\"\n");
  EXPECT_THAT(message([&] {
                f.root().number("mass_kg", {0, 1, "kg"});
              }),
              HasSubstr("quad.toml:1: error: mass_kg = \"heavy\" is a text, expected a number in kg"));
}
TEST(TomlFile, NotANumberIsRefused) {
  const auto f = parse("mass_kg = nan\n");
  EXPECT_THAT(message([&] { f.root().number("mass_kg", {0, 1, "kg"}); }), HasSubstr("is outside"));
}
TEST(TomlFile, AKeyThatNobodyReadIsAnErrorInFileOrder) {
  const auto f = parse("format = 1\n[body]\nmas_kg = 1\nmass_kg = 2\n[zzz]\n");
  (void)f.root().integer("format", 1, 1);
  (void)f.root().table("body").number("mass_kg", {0, 10, "kg"});
  EXPECT_THAT(message([&] { f.refuse_unknown_keys(); }), HasSubstr("quad.toml:3: error: unknown key \"body.mas_kg\""));
}
TEST(TomlFile, AMisspeltKeyIsNamedWithItsLineAndTheOneMeantBeforeThatIsCalledMissing) {
  const auto f = parse("format = 1\n[body]\nx = 1\nmass_g = 800\n[[flights]]\n");
  (void)f.root().integer("format", 1, 1);
  EXPECT_THAT(message([&] {
                f.root().table("body").number("mass_kg", {0, 10, "kg"});
              }),
              AllOf(HasSubstr("quad.toml:4: error: unknown key \"body.mass_g\""), HasSubstr("likely: \"mass_kg\" was meant"),
                    HasSubstr("do:     write mass_kg")));
  EXPECT_THAT(message([&] { f.root().tables("flight", 1, 9); }), HasSubstr("quad.toml:5: error: unknown key \"flights\""));
}
TEST(TomlFile, AKeyThatMayStandForItselfIsNotTakenForAMissingOne) {
  const auto f = parse("k2 = 1\nattitude_kd = 2\n");
  EXPECT_THAT(message([&] { f.root().number("k1", {0, 10, "1"}); }), HasSubstr("key \"k1\" is missing"));
  EXPECT_THAT(message([&] { f.root().number("attitude_kp", {0, 10, "1"}); }), HasSubstr("key \"attitude_kp\" is missing"));
}
TEST(TomlFile, AnUnknownKeyIsComparedWithThoseThatTheReaderKnowsThereOrNot) {
  const auto f = parse("seeds = 1\nvarients = 2\n");
  (void)f.root().integer("seeds", 1, 9);
  (void)f.root().has("variants");
  EXPECT_THAT(message([&] { f.refuse_unknown_keys(); }),
              AllOf(HasSubstr("quad.toml:2: error: unknown key \"varients\""), HasSubstr("\"variants\" was meant")));
}
TEST(TomlFile, SyntaxErrorsCarryTheLine) {
  EXPECT_THAT(message([] { parse("a = 1\nb = = 2\n"); }), HasSubstr("quad.toml:2: error: not valid TOML"));
}
TEST(TomlFile, UnknownFormatIsRefused) {
  const auto f = parse("format = 9\n");
  EXPECT_THAT(message([&] { f.format({1}); }), AllOf(HasSubstr("format = 9 is not known"), HasSubstr("known: 1")));
}
TEST(TomlFile, TablesAreCounted) {
  const auto f = parse("[[rotor]]\na=1\n[[rotor]]\na=2\n");
  EXPECT_EQ(f.root().tables("rotor", 2, 2).size(), 2u);
  EXPECT_THAT(message([&] { f.root().tables("rotor", 4, 4); }), HasSubstr("[[rotor]] occurs 2 times, expected 4"));
}
TEST(TomlFile, ChoicesListTheWords) {
  const auto f = parse("pace = \"fast\"\n");
  EXPECT_THAT(message([&] { f.root().choice("pace", {"lockstep", "realtime"}); }), HasSubstr("use one of: lockstep, realtime"));
  const auto slip = parse("pace = \"locksetp\"\n");
  EXPECT_THAT(message([&] { slip.root().choice("pace", {"lockstep", "realtime"}); }), HasSubstr("did you mean \"lockstep\"? use one of:"));
}
TEST(TomlFile, MissingFileIsNamed) {
  EXPECT_THAT(message([] { TomlFile::read("no/such.toml"); }), HasSubstr("no/such.toml: error: no such file"));
}

}  // namespace
}  // namespace rotorloop
