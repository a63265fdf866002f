// Numbers without a library: long division by a constant, and digits of a text.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "firmware/core/node/division.hpp"
#include "firmware/core/node/text_line.hpp"

namespace rotorloop::firmware {
namespace {

TEST(Division, GivesWhatTheProcessorsLongDivisionGives) {
  std::uint64_t n = 1;
  for (int i = 0; i < 20'000; ++i) {
    n = n * 6364136223846793005u + 1442695040888963407u;
    const std::uint64_t value = n >> (n % 64);
    for (const std::uint32_t by : {1u, 3u, 1000u, 400'000u, 1'000'000u, 1u << 20u}) {
      const Division d = divide(value, by);
      ASSERT_EQ(d.quotient, static_cast<std::uint32_t>(value / by)) << value << " / " << by;
      ASSERT_EQ(d.rest, value % by) << value << " % " << by;
    }
  }
}

std::string written(std::int32_t v) {
  const TextLine line = TextLine().add(v);
  const auto text = line.text().view();
  return {text.begin(), text.end()};
}

TEST(TextLine, WritesEveryLengthOfNumberWithoutLeadingZeros) {
  for (const std::int32_t v : {0, 7, 10, 99, 100, 65'535, 1'000'000'000, 2'147'483'647, -1, -2'147'483'647})
    EXPECT_EQ(written(v), std::to_string(v));
}

TEST(TextLine, WritesAnAddressInEightHexadecimalDigits) {
  const TextLine line = TextLine("at ").add_hex(0x0800A1F4);
  const auto text = line.text().view();
  EXPECT_EQ(std::string(text.begin(), text.end()), "at 0800a1f4");
}

}  // namespace
}  // namespace rotorloop::firmware
