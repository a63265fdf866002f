// Measured coefficients: what is read, what is refused.
#include "bench/propeller/measured.hpp"

#include "test/unit/bench/propeller/fixtures.hpp"

namespace rotorloop::propeller {
namespace {
using namespace fixtures;
using ::testing::AllOf;
using ::testing::HasSubstr;

std::string static_message(const std::string& from, const std::string& to) {
  return message([&] { read_uiuc_static(TextFile::parse(replaced(kStatic, from, to), "static.txt")); });
}
std::string sweep_message(const std::string& from, const std::string& to) {
  return message([&] { read_uiuc_sweep(TextFile::parse(replaced(kSweep, from, to), "sweep.txt"), 5000.0); });
}

TEST(UiucStatic, RowsCarryRotorSpeedAndNoAdvance) {
  const auto rows = read_uiuc_static(TextFile::parse(with_carriage_returns(kStatic), "static.txt"));
  ASSERT_EQ(rows.size(), 4u);
  EXPECT_EQ(rows[1].rpm, 3000.0);
  EXPECT_EQ(rows[1].j, 0.0);
  EXPECT_EQ(rows[1].ct, 0.122);
  EXPECT_EQ(rows[1].cp, 0.093);
}
TEST(UiucSweep, RowsCarryTheRotorSpeedOfTheFileName) {
  const auto rows = read_uiuc_sweep(TextFile::parse(kSweep, "sweep.txt"), 5000.0);
  ASSERT_EQ(rows.size(), 4u);
  EXPECT_EQ(rows[3].rpm, 5000.0);
  EXPECT_EQ(rows[3].j, 0.9);
  EXPECT_EQ(rows[3].ct, -0.004);
}
TEST(UiucStatic, RotorSpeedInRevolutionsPerSecondIsRefused) {
  EXPECT_THAT(static_message("1500 ", "25   "), AllOf(HasSubstr("static.txt:2"), HasSubstr("RPM = 25 is outside"), HasSubstr("rev/min")));
}
TEST(UiucStatic, RepeatedRotorSpeedIsRefused) { EXPECT_THAT(static_message("4500", "3000"), HasSubstr("does not exceed")); }
TEST(UiucStatic, ThrustInNewtonIsRefused) { EXPECT_THAT(static_message("0.122", "1.220"), HasSubstr("CT = 1.22 is outside")); }
TEST(UiucStatic, SweepInPlaceOfStaticRowsIsRefused) {
  EXPECT_THAT(message([] { read_uiuc_static(TextFile::parse(kSweep, "x")); }), HasSubstr("expected \"RPM CT CP\""));
}
TEST(UiucStatic, FileCutOffIsRefused) {
  EXPECT_THAT(static_message("4500  0.125 0.090\n6000  0.126 0.089\n", ""), HasSubstr("2 rows, expected at least 4"));
}
TEST(UiucSweep, SwappedThrustAndPowerAreRefusedByTheEfficiency) {
  EXPECT_THAT(sweep_message("0.110  0.085", "0.085  0.110"), AllOf(HasSubstr("sweep.txt:2"), HasSubstr("is not J CT / CP")));
}
TEST(UiucSweep, ExtraColumnIsRefused) { EXPECT_THAT(sweep_message("eta", "eta V"), HasSubstr("expected \"J CT CP eta\"")); }
TEST(UiucSweep, NotANumberIsRefused) { EXPECT_THAT(sweep_message("0.058", "NaN"), HasSubstr("CP = \"NaN\" is not a finite number")); }
TEST(UiucSweep, EmptyFileIsRefused) {
  EXPECT_THAT(message([] { read_uiuc_sweep(TextFile::parse("\n\n", "x"), 5000.0); }), HasSubstr("the file is empty"));
}

}  // namespace
}  // namespace rotorloop::propeller
