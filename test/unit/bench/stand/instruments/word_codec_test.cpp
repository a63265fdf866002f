// Numbers against the bytes on the wire, written out by hand (IEEE 754 and two's complement).
#include "bench/stand/instruments/word_codec.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

namespace rotorloop::modbus {
namespace {

struct WireCase {
  WordType type;
  WordOrder order;
  double value;
  std::array<std::uint16_t, 4> words;
};

// 123456.0f is 0x47F12000, the number that the float helpers of libmodbus 3.1.6 write in one order and read in another.
constexpr std::array kWireCases{
    WireCase{WordType::u16, WordOrder::ABCD, 0x1234, {0x1234}},
    WireCase{WordType::u16, WordOrder::CDAB, 0x1234, {0x1234}},
    WireCase{WordType::u16, WordOrder::BADC, 0x1234, {0x3412}},
    WireCase{WordType::u16, WordOrder::DCBA, 0x1234, {0x3412}},
    WireCase{WordType::s16, WordOrder::ABCD, -2.0, {0xFFFE}},
    WireCase{WordType::s16, WordOrder::DCBA, -2.0, {0xFEFF}},
    WireCase{WordType::u32, WordOrder::ABCD, 0x12345678, {0x1234, 0x5678}},
    WireCase{WordType::u32, WordOrder::CDAB, 0x12345678, {0x5678, 0x1234}},
    WireCase{WordType::u32, WordOrder::BADC, 0x12345678, {0x3412, 0x7856}},
    WireCase{WordType::u32, WordOrder::DCBA, 0x12345678, {0x7856, 0x3412}},
    WireCase{WordType::s32, WordOrder::ABCD, -100000.0, {0xFFFE, 0x7960}},
    WireCase{WordType::s32, WordOrder::CDAB, -100000.0, {0x7960, 0xFFFE}},
    WireCase{WordType::s32, WordOrder::BADC, -100000.0, {0xFEFF, 0x6079}},
    WireCase{WordType::s32, WordOrder::DCBA, -100000.0, {0x6079, 0xFEFF}},
    WireCase{WordType::f32, WordOrder::ABCD, 123456.0, {0x47F1, 0x2000}},
    WireCase{WordType::f32, WordOrder::CDAB, 123456.0, {0x2000, 0x47F1}},
    WireCase{WordType::f32, WordOrder::BADC, 123456.0, {0xF147, 0x0020}},
    WireCase{WordType::f32, WordOrder::DCBA, 123456.0, {0x0020, 0xF147}},
    WireCase{WordType::u64, WordOrder::ABCD, 0x0001020304050607, {0x0001, 0x0203, 0x0405, 0x0607}},
    WireCase{WordType::u64, WordOrder::CDAB, 0x0001020304050607, {0x0607, 0x0405, 0x0203, 0x0001}},
    WireCase{WordType::u64, WordOrder::BADC, 0x0001020304050607, {0x0100, 0x0302, 0x0504, 0x0706}},
    WireCase{WordType::u64, WordOrder::DCBA, 0x0001020304050607, {0x0706, 0x0504, 0x0302, 0x0100}},
    WireCase{WordType::f64, WordOrder::ABCD, -0.15625, {0xBFC4, 0x0000, 0x0000, 0x0000}},
    WireCase{WordType::f64, WordOrder::CDAB, -0.15625, {0x0000, 0x0000, 0x0000, 0xBFC4}},
    WireCase{WordType::f64, WordOrder::BADC, -0.15625, {0xC4BF, 0x0000, 0x0000, 0x0000}},
    WireCase{WordType::f64, WordOrder::DCBA, -0.15625, {0x0000, 0x0000, 0x0000, 0xC4BF}},
};

TEST(WordCodec, EveryTypeInEveryOrderReadsAndWritesTheBytesThatTheStandardsGive) {
  for (const WireCase& c : kWireCases) {
    SCOPED_TRACE(std::string(name(c.type)) + " " + std::string(name(c.order)));
    const std::span<const std::uint16_t> words(c.words.data(), register_count(c.type));
    EXPECT_EQ(to_number(assemble(words, c.order), c.type), c.value);
    std::array<std::uint16_t, 4> written{};
    const auto bits = to_bits(c.value, c.type);
    ASSERT_TRUE(bits);
    spread(*bits, c.order, std::span(written.data(), register_count(c.type)));
    EXPECT_EQ(written, c.words);
  }
}

TEST(WordCodec, WhatATypeCannotHoldHasNoBits) {
  EXPECT_FALSE(to_bits(65536.0, WordType::u16));
  EXPECT_FALSE(to_bits(-1.0, WordType::u32));
  EXPECT_FALSE(to_bits(32768.0, WordType::s16));
  EXPECT_FALSE(to_bits(std::nan(""), WordType::s32));
  EXPECT_FALSE(to_bits(1e39, WordType::f32));
  EXPECT_FALSE(to_bits(0x1p64, WordType::u64));
}

TEST(WordCodec, TheEndsOfEachRangeAreHeld) {
  EXPECT_EQ(to_bits(65535.0, WordType::u16), 0xFFFFu);
  EXPECT_EQ(to_bits(-32768.0, WordType::s16), 0x8000u);
  EXPECT_EQ(to_bits(-2147483648.0, WordType::s32), 0x80000000u);
  EXPECT_EQ(to_bits(4294967295.0, WordType::u32), 0xFFFFFFFFu);
  EXPECT_EQ(to_bits(static_cast<double>(std::numeric_limits<float>::max()), WordType::f32), 0x7F7FFFFFu);
}

}  // namespace
}  // namespace rotorloop::modbus
