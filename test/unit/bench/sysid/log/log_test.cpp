// Flight logs: exact text, same bytes each time, what is read is what was written, and the size promise.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "bench/sysid/log/log_reader.hpp"
#include "bench/sysid/log/log_writer.hpp"
#include "host/base/random.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::log {
namespace {
using ::testing::AllOf;
using ::testing::HasSubstr;

std::string fixed(double v, int decimals) {
  char text[64];
  return {text, write_fixed(text, v, decimals)};
}

TEST(WriteFixed, RoundsHalfAwayFromZeroAndDropsTrailingZeros) {
  EXPECT_EQ(fixed(1.5, 0), "2");
  EXPECT_EQ(fixed(-1.5, 0), "-2");
  EXPECT_EQ(fixed(0.25, 1), "0.3");
  EXPECT_EQ(fixed(12.0, 3), "12");
  EXPECT_EQ(fixed(12.340, 3), "12.34");
  EXPECT_EQ(fixed(0.001, 3), "0.001");
  EXPECT_EQ(fixed(-0.05, 2), "-0.05");
  EXPECT_EQ(fixed(9.9996, 3), "10");
}
TEST(WriteFixed, BothZerosAndWhatRoundsToThemAreOneText) {
  EXPECT_EQ(fixed(0.0, 3), "0");
  EXPECT_EQ(fixed(-0.0, 3), "0");
  EXPECT_EQ(fixed(-0.0004, 3), "0");
}
TEST(WriteFixed, NotANumberIsAnEmptyCellAndHugeValuesKeepTheirValue) {
  EXPECT_EQ(fixed(kEmpty, 3), "");
  EXPECT_EQ(fixed(1e20, 3), "1e+20");
  EXPECT_EQ(fixed(-HUGE_VAL, 3), "-inf");
  EXPECT_EQ(std::strtod(fixed(-1.7976931348623157e308, 9).c_str(), nullptr), -1.7976931348623157e308);
}
TEST(WriteFixed, ReadsBackWithinHalfAnUnitOfTheLastDigit) {
  const RandomStream random(1, 2);
  for (std::uint64_t i = 0; i < 20000; ++i) {
    const int decimals = static_cast<int>(random.bits(i) % 10);
    const double v = random.gaussian(i) * std::pow(10.0, static_cast<double>(random.bits(i + 1) % 6));
    const double back = std::strtod(fixed(v, decimals).c_str(), nullptr);
    EXPECT_LE(std::fabs(back - v), 0.5000001 * std::pow(10.0, -decimals) + 1e-15 * std::fabs(v)) << v << " with " << decimals;
  }
}

FlightRow flight_row(std::uint64_t k) {
  const RandomStream random(7, 1);
  std::uint64_t n = 1000 * k;
  const auto g = [&](double scale) { return scale * random.gaussian(n++); };
  const auto g3 = [&](double s) { return Cells3{g(s), g(s), g(s)}; };
  const auto g4 = [&](double s) { return Cells4{g(s), g(s), g(s), g(s)}; };
  const auto speed = [&] { return Cells4{937 + g(150), 937 + g(150), 937 + g(150), 937 + g(150)}; };
  FlightRow r;
  r.t_s = static_cast<double>(k) * 1e-3;
  if (k % 5 == 0) {
    r.pose_t_s = r.t_s - 0.0151234;
    r.p_W_m = g3(5);
    r.q_WS = g4(0.5);
    r.v_W_m_s = g3(4);
  }
  r.omega_rad_s = speed();
  r.omega_cmd_rad_s = speed();
  r.i_q_A = g4(12);
  r.bus_V = 15.2 + g(0.2);
  r.bus_A = 22 + g(5);
  r.gyro_B_rad_s = g3(2);
  r.accel_B_m_s2 = g3(10);
  r.est_p_W_m = g3(5);
  r.est_v_W_m_s = g3(4);
  r.est_q_WB = g4(0.5);
  r.sp_p_W_m = g3(5);
  r.sp_v_W_m_s = g3(4);
  r.sp_a_W_m_s2 = g3(6);
  r.sp_yaw_rad = g(1);
  r.thrust_cmd_N = 7 + g(2);
  r.torque_cmd_B_N_m = g3(0.05);
  r.control_limiter = 0;
  return r;
}

TruthRow truth_row(std::uint64_t k) {
  const auto f = flight_row(k + 1'000'000);
  TruthRow r;
  r.t_s = static_cast<double>(k) * 1e-3;
  r.p_W_m = f.est_p_W_m;
  r.v_W_m_s = f.est_v_W_m_s;
  r.q_WB = f.est_q_WB;
  r.w_B_rad_s = f.gyro_B_rad_s;
  r.omega_rad_s = f.omega_rad_s;
  r.thrust_N = {1.7, 1.812345, 1.9, 2.1};
  r.shaft_torque_N_m = {0.027123, 0.0281, 0.03, 0.02};
  r.esc_limiter = {0, 0, 1, 4};
  r.bus_A = f.bus_A;
  if (k % 10 == 0) {
    r.load_esc_percent = 61.32;
    r.load_state_percent = 33.87;
  }
  return r;
}

const LogHeader kHeader{{"vehicle", "reference"}, {"pole_pairs", "7"}, {"start_utc", std::string(kVirtualEpochUtc)}};

TEST(FlightLog, FirstLineHeaderAndColumnNamesFollowTheContract) {
  test::TempFolder f;
  FlightLogWriter w(f.path() / "flight.csv", kHeader);
  FlightRow r;
  r.t_s = 0.001;
  r.bus_V = 16.25;
  w.write(r);
  w.close();
  const auto text = test::read_text(f.path() / "flight.csv");
  EXPECT_TRUE(
      text.starts_with("# rotorloop flight log 1\n# vehicle: reference\n# pole_pairs: 7\n# start_utc: "
                       "1970-01-01T00:00:00Z\nt[s],pose_t[s],p_x[m],p_y[m],p_z[m],q_w[1],"));
  for (const auto* name : {",v_x[m/s],", ",omega_1[rad/s],", ",omega_cmd_4[rad/s],", ",i_q_1[A],", ",bus[V],bus[A],", ",gyro_x[rad/s],",
                           ",accel_z[m/s2],", ",est_p_x[m],", ",sp_p_x[m],", ",sp_v_y[m/s],", ",sp_a_z[m/s2],", ",sp_yaw[rad],"})
    EXPECT_THAT(text, HasSubstr(name));
  const auto header = text.substr(text.find("t[s],"), text.rfind('\n', text.size() - 2) - text.find("t[s],"));
  const auto row = text.substr(text.rfind('\n', text.size() - 2) + 1);
  EXPECT_EQ(std::count(row.begin(), row.end(), ','), std::count(header.begin(), header.end(), ','));
  EXPECT_TRUE(row.starts_with("0.001,,"));
  EXPECT_THAT(text, HasSubstr(",16.25,"));
  EXPECT_EQ(text.find('\r'), std::string::npos);
}

TEST(FlightLog, ReadsBackWhatWasWrittenWithEmptyCellsAsNotANumber) {
  test::TempFolder f;
  {
    FlightLogWriter w(f.path() / "flight.csv", kHeader);
    for (std::uint64_t k = 0; k < 100; ++k) w.write(flight_row(k));
    w.close();
  }
  const auto log = read_log(f.path() / "flight.csv");
  ASSERT_EQ(log.rows, 100u);
  EXPECT_EQ(log.header.at("pole_pairs"), "7");
  for (std::uint64_t k = 0; k < 100; ++k) {
    const auto r = flight_row(k);
    EXPECT_NEAR(log.column("t[s]")[k], r.t_s, 1e-9);
    EXPECT_NEAR(log.column("omega_cmd_3[rad/s]")[k], r.omega_cmd_rad_s[2], 0.0051);
    EXPECT_NEAR(log.column("bus[V]")[k], r.bus_V, 0.00051);
    EXPECT_NEAR(log.column("bus[A]")[k], r.bus_A, 0.00051);
    EXPECT_EQ(log.column("control_limiter[1]")[k], 0.0);
    EXPECT_EQ(std::isnan(log.column("p_y[m]")[k]), k % 5 != 0);
    if (k % 5 == 0) {
      EXPECT_NEAR(log.column("q_z[1]")[k], r.q_WS[3], 5.1e-7);
    }
  }
}

TEST(FlightLog, KeepsOnlyWantedColumns) {
  test::TempFolder f;
  {
    TruthLogWriter w(f.path() / "truth.csv", {});
    w.write(truth_row(3));
    w.close();
  }
  const auto log = read_log(f.path() / "truth.csv", {"true_p_z[m]", "no_such[1]"});
  EXPECT_EQ(log.columns.size(), 1u);
  EXPECT_TRUE(log.has("true_p_z[m]"));
  EXPECT_NEAR(log.column("true_p_z[m]")[0], truth_row(3).p_W_m[2], 5.1e-7);
}

TEST(FlightLog, SameRowsGiveTheSameBytesAndTheHashOfTheFile) {
  test::TempFolder f;
  std::string hashes[2];
  for (int i : {0, 1}) {
    FlightLogWriter w(f.path() / (std::to_string(i) + ".csv"), kHeader);
    for (std::uint64_t k = 0; k < 5000; ++k) w.write(flight_row(k));  // several buffers
    hashes[i] = w.close();
    EXPECT_EQ(w.bytes(), std::filesystem::file_size(f.path() / (std::to_string(i) + ".csv")));
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], sha256_file(f.path() / "0.csv"));
}

TEST(FlightLog, SixtySecondsOfFlightAndTruthAtOneKilohertzStayBelowFortyMegabytes) {
  test::TempFolder f;
  FlightLogWriter flight(f.path() / "flight.csv", kHeader);
  TruthLogWriter truth(f.path() / "truth.csv", kHeader);
  constexpr std::uint64_t kRows = 6000;  // a tenth of the minute; rows do not depend on each other
  for (std::uint64_t k = 0; k < kRows; ++k) {
    flight.write(flight_row(k + 54'000));  // at its end, where times are longest
    truth.write(truth_row(k + 54'000));
  }
  flight.close();
  truth.close();
  EXPECT_LT(10 * (flight.bytes() + truth.bytes()), 40'000'000u);
}

TEST(FlightLog, FolderThatDoesNotExistIsAnErrorThatNamesTheFile) {
  EXPECT_THAT(test::error_of([] { FlightLogWriter w("/no/such/folder/flight.csv", {}); }, ExitCode::device),
              HasSubstr("/no/such/folder/flight.csv: error: cannot be written: No such file"));
}

TEST(FlightLog, FullDiskIsReportedWhenClosing) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full on this system";
  FlightLogWriter w("/dev/full", {});
  w.write(flight_row(0));
  EXPECT_THAT(test::error_of([&] { w.close(); }, ExitCode::device),
              AllOf(HasSubstr("No space left"), HasSubstr("likely: the disk is full")));
}

TEST(LogReader, RefusalsNameFileLineAndReason) {
  test::TempFolder f;
  const auto error = [&](const std::string& text) {
    const auto p = f.write("x.csv", text);
    return test::error_of([&] { read_log(p); }, ExitCode::data_quality);
  };
  EXPECT_THAT(error("t,x\n1,2\n"), HasSubstr("x.csv:1: error: is not a rotorloop log"));
  EXPECT_THAT(error("# rotorloop flight log 2\nt[s]\n"), HasSubstr("x.csv:1: error: is not a rotorloop log of a known format"));
  EXPECT_THAT(error("# rotorloop flight log 1\n# a: b\n"), HasSubstr("has no row of column names"));
  EXPECT_THAT(error("# rotorloop flight log 1\nt[s],x[m]\n1,2\n1\n"), HasSubstr("x.csv:4: error: has 1 cells, the header has 2"));
  EXPECT_THAT(error("# rotorloop flight log 1\nt[s],x[m]\n1,2,3\n"), HasSubstr("x.csv:3: error: has 3 cells, the header has 2"));
  EXPECT_THAT(error("# rotorloop flight log 1\nt[s],x[m]\n1,2..3\n"),
              HasSubstr("x.csv:3: error: \"2..3\" in column \"x[m]\" is not a number"));
  EXPECT_THAT(error("# rotorloop flight log 1\nt[s],t[s]\n"), HasSubstr("has the column \"t[s]\" twice"));
  const auto p = f.write("y.csv", "# rotorloop flight log 1\nt[s]\n1\n");
  EXPECT_THAT(test::error_of([&] { read_log(p).column("p_x[m]"); }, ExitCode::data_quality),
              AllOf(HasSubstr("has no column \"p_x[m]\""), HasSubstr("columns it has: t[s]")));
}

TEST(LogReader, LineEndsAndMarksOfOtherSystemsChangeNothing) {
  test::TempFolder f;
  const auto p = f.write("x.csv", "\xEF\xBB\xBF# rotorloop flight log 1\r\n# flight: a\r\nt[s],x[m]\r\n1,2.5\r\n2,\r\n");
  const auto log = read_log(p);
  EXPECT_EQ(log.header.at("flight"), "a");
  EXPECT_EQ(log.rows, 2u);
  EXPECT_EQ(log.column("x[m]")[0], 2.5);
  EXPECT_TRUE(std::isnan(log.column("x[m]")[1]));
}

TEST(LogReader, SeparatorsOfASpreadsheetAreNamed) {
  test::TempFolder f;
  const auto error = [&](const std::string& text) {
    const auto p = f.write("x.csv", text);
    return test::error_of([&] { read_log(p); }, ExitCode::data_quality);
  };
  EXPECT_THAT(error("# rotorloop flight log 1\nt[s];x[m]\n0,5;1,5\n"), HasSubstr("x.csv:2: error: has \";\" between its columns"));
  EXPECT_THAT(error("# rotorloop flight log 1\nt[s],x[m]\n0,5,1,5\n"), HasSubstr("decimals with a comma"));
}

TEST(LogReader, LastLineThatWasCutOffIsAnErrorOrLeftOutAndTold) {
  test::TempFolder f;
  for (const char* cut : {"2", "2,1e", "2,3,"}) {
    const auto path = f.write("x.csv", std::string("# rotorloop flight log 1\nt[s],x[m]\n1,2\n") + cut);
    EXPECT_THAT(test::error_of([&] { read_log(path); }, ExitCode::data_quality), HasSubstr("x.csv:4: error:")) << cut;
    const auto log = read_log(path, {}, CutEnd::left_out);
    EXPECT_EQ(log.rows, 1u) << cut;
    EXPECT_EQ(log.column("t[s]").size(), 1u) << cut;
    EXPECT_EQ(log.column("x[m]").size(), 1u) << cut;
    EXPECT_THAT(log.notes, testing::ElementsAre("x.csv: line 4 was cut off and is left out")) << cut;
  }
}

}  // namespace
}  // namespace rotorloop::log
