// The handshake with a controller in another process: what one end writes is what the other end reads, to the bit.
#include "bench/hil/controllers/handshake.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "bench/hil/controllers/external.hpp"
#include "host/base/error.hpp"

namespace rotorloop::hil {
namespace {

using testing::HasSubstr;

std::string line_of(std::string text) {
  EXPECT_EQ(text.find('\n'), text.size() - 1) << "one line, ended once";
  text.pop_back();
  return text;
}

TEST(Handshake, StepCrossesToTheBitIncludingNegativeZeroAndTheSmallestNumber) {
  rotorloop_controller_input in{};
  in.size = sizeof in;
  in.phase = ROTORLOOP_PHASE_FLYING;
  in.step = 12'345;
  in.t_s = 12.345;
  in.gyro_B_rad_s[0] = -0.0;
  in.gyro_B_rad_s[1] = std::numeric_limits<double>::denorm_min();
  in.gyro_B_rad_s[2] = 0.1 + 0.2;
  in.accel_B_m_s2[2] = 9.80665;
  in.pose_new = 1;
  in.estimate_q_WB[0] = std::nextafter(1.0, 0.0);
  in.setpoint_p_W_m[0] = -1e20;
  in.bus_V = 16.0;
  rotorloop_controller_input back{};
  ASSERT_EQ(parse_input(line_of(input_line(in)), back), "");
  EXPECT_EQ(std::memcmp(&in, &back, sizeof in), 0);
}

TEST(Handshake, AnswerCrossesToTheBit) {
  rotorloop_controller_output out = empty_output();
  out.limiters = 5;
  for (int i = 0; i < 4; ++i) out.omega_rad_s[i] = 900.0 + i / 3.0;
  out.torque_B_N_m[1] = -0.0;
  rotorloop_controller_output back{};
  ASSERT_EQ(parse_output(line_of(output_line(7, out)), 7, back), "");
  EXPECT_EQ(std::memcmp(out.omega_rad_s, back.omega_rad_s, sizeof out.omega_rad_s), 0);
  EXPECT_TRUE(std::signbit(back.torque_B_N_m[1]));
  EXPECT_EQ(back.limiters, 5u);
  EXPECT_TRUE(std::isnan(back.thrust_N));
}

TEST(Handshake, NumbersThatAreNoneArriveAsNotANumber) {
  rotorloop_controller_output out{};
  ASSERT_EQ(parse_output(R"({"step":1,"thrust_N":NaN,"q_WB":[1,-Infinity,null,"x"],"w_B_rad_s":null})", 1, out), "");
  EXPECT_TRUE(std::isnan(out.thrust_N));
  EXPECT_EQ(out.q_WB[0], 1.0);
  for (int i = 1; i < 4; ++i) EXPECT_TRUE(std::isnan(out.q_WB[i]));
  EXPECT_TRUE(std::isnan(out.w_B_rad_s[0]));
}

TEST(Handshake, WhatIsLeftOutOfAnAnswerIsZeroWhereItIsFeedForwardAndNotANumberWhereItIsNeeded) {
  rotorloop_controller_output out{};
  ASSERT_EQ(parse_output(R"({"step":0,"p_W_m":[1,2,3],"yaw_rad":0.5})", 0, out), "");
  EXPECT_EQ(out.v_W_m_s[1], 0.0);
  EXPECT_EQ(out.yaw_rate_rad_s, 0.0);
  EXPECT_TRUE(std::isnan(out.omega_rad_s[3]));
}

TEST(Handshake, EveryWrongAnswerIsNamed) {
  rotorloop_controller_output out{};
  EXPECT_THAT(parse_output("hello", 1, out), HasSubstr("no JSON object: \"hello\""));
  EXPECT_THAT(parse_output("{}", 1, out), HasSubstr("without the number of its step"));
  EXPECT_EQ(parse_output(R"({"step":3})", 4, out), "answered step 3 where step 4 was asked");
  EXPECT_EQ(parse_output(R"({"step":1,"omega_rad_s":[1,2,3]})", 1, out), "omega_rad_s is no list of 4 numbers");
  EXPECT_EQ(parse_output(R"({"step":1,"thrust_N":"much"})", 1, out), "thrust_N is no number");
  EXPECT_EQ(parse_output(R"({"step":1,"limiters":64})", 1, out), "limiters = 64, allowed 0 to 63");
}

TEST(Handshake, FirstAnswerSaysLevelRateAndStart) {
  HandshakeHello h;
  ASSERT_EQ(parse_hello(line_of(hello_line({.level = ROTORLOOP_LEVEL_ATTITUDE, .every = 5, .own_estimate = true, .start_s = 8.0})), h), "");
  EXPECT_EQ(h.level, ROTORLOOP_LEVEL_ATTITUDE);
  EXPECT_EQ(h.every, 5u);
  EXPECT_TRUE(h.own_estimate);
  EXPECT_EQ(h.start_s, 8.0);
}

TEST(Handshake, AnotherVersionIsRefusedWithBothNumbers) {
  HandshakeHello h;
  EXPECT_EQ(parse_hello(R"({"rotorloop_controller":2,"level":"attitude"})", h), "handshake version 2, here version 1");
  HandshakeSetup s;
  EXPECT_EQ(parse_setup(R"({"rotorloop_controller":9})", s), "handshake version 9, here version 1");
  EXPECT_THAT(parse_hello(R"({"level":"attitude"})", h), HasSubstr("rotorloop_controller"));
}

TEST(Handshake, FirstAnswerOutOfRangeIsRefusedWithTheRange) {
  HandshakeHello h;
  EXPECT_THAT(parse_hello(R"({"rotorloop_controller":1,"level":"thrust"})", h), HasSubstr("use position, attitude or rotor_speed"));
  EXPECT_EQ(parse_hello(R"({"rotorloop_controller":1,"level":"position","every":0})", h), "every = 0, allowed 1 to 100");
  EXPECT_THAT(parse_hello(R"({"rotorloop_controller":1,"level":"position","start_s":-1})", h), HasSubstr("allowed 0 to 120 s"));
  EXPECT_EQ(parse_hello(R"({"error":"create() returned null"})", h), "create() returned null");
}

TEST(ExternalController, NameComesFromTheFileOrIsGivenBeforeAnEqualsSign) {
  EXPECT_EQ(parse_controller("fly-it --fast").name, "fly-it");
  EXPECT_EQ(parse_controller("mine=python3 fly.py --gain=3").name, "mine");
  EXPECT_EQ(parse_controller("mine=python3 fly.py --gain=3").command, "python3 fly.py --gain=3");
  EXPECT_EQ(parse_controller("/usr/bin/env").name, "env");
}

TEST(ExternalController, ALibraryThatIsNotThereAndANameOfOursAreRefused) {
  EXPECT_THROW(parse_controller("./no_such.so"), Error);
  EXPECT_THROW(parse_controller("pd_ff=python3 fly.py"), Error);
  EXPECT_THROW(parse_controller(""), Error);
}

}  // namespace
}  // namespace rotorloop::hil
