// Recordings of both frame formats: the bytes that other programs expect.
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <string>

#include "host/bus/bus_log.hpp"
#include "host/bus/bus_recorder.hpp"

namespace rotorloop {
namespace {

std::string record(const std::string& ending, std::initializer_list<BusFrame> frames) {
  const std::string path = ::testing::TempDir() + "recording_" + std::to_string(::getpid()) + ending;
  BusRecorder recorder(path, "mcast0");
  std::int64_t time_ns = 1'700'000'000'123'456'000;
  for (const BusFrame& f : frames) recorder.write(time_ns++, f);
  recorder.close();
  return path;
}

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

BusFrame classic() {
  BusFrame f;
  f.id = 0x1401552A;
  f.extended = true;
  f.length = 2;
  f.data[0] = 0x87;
  f.data[1] = 0xC0;
  return f;
}

BusFrame fd() {
  BusFrame f;
  f.id = 0x140;
  f.fd = true;
  f.bit_rate_switch = true;
  f.length = 12;
  return f;
}

TEST(BusRecorder, TextMarksFdFramesByTwoHashesAndTheirFlags) {
  EXPECT_EQ(content(record(".log", {classic(), fd()})),
            "(1700000000.123456) mcast0 1401552A#87C0\n(1700000000.123456) mcast0 140##1000000000000000000000000\n");
}

TEST(BusRecorder, PcapMarksFdFramesAndTheirDataRateInTheFlagsByte) {
  const std::string bytes = content(record(".pcap", {fd()}));
  ASSERT_EQ(bytes.size(), 24u + 16u + 8u + 12u);
  EXPECT_EQ(bytes.substr(40, 6), std::string("\x00\x00\x01\x40\x0C\x05", 6));
}

// The file as a program that is killed leaves it.
TEST(BusRecorder, WhatWasHeardIsOnDiskAfterASecondOfTrafficAtTheLatest) {
  for (const char* ending : {".log", ".pcap"}) {
    const std::string path = ::testing::TempDir() + "killed_" + std::to_string(::getpid()) + ending;
    BusRecorder recorder(path, "mcast0");
    for (std::int64_t k = 0; k < 250; ++k) recorder.write(1'700'000'000'000'000'000 + k * 10'000'000, classic());  // 2.5 s
    EXPECT_GE(read_bus_log(path).frames.size(), 200u) << ending;
  }
}

TEST(BusRecorder, ReadersTakeFramesOfBothFormats) {
  for (const char* ending : {".log", ".pcap"}) {
    const BusLog log = read_bus_log(record(ending, {classic(), fd(), classic()}));
    ASSERT_EQ(log.frames.size(), 3u);
    EXPECT_EQ(log.frames[0].frame, classic());
    EXPECT_EQ(log.frames[1].frame, fd());
  }
}

}  // namespace
}  // namespace rotorloop
