// Division of microseconds, 64 bits, by a constant: three divisions of the processor instead of a library's long one, with the same result.
#pragma once
#include <cstdint>

namespace rotorloop::firmware {

struct Division {
  std::uint32_t quotient = 0;  // its lower 32 bits
  std::uint32_t rest = 0;
};

// `by`: 1 to 2^20, so that a rest and twelve more bits fit a word.
constexpr Division divide(std::uint64_t n, std::uint32_t by) {
  const auto low = static_cast<std::uint32_t>(n);
  Division d{0, static_cast<std::uint32_t>(n >> 32u) % by};
  const auto take = [&](std::uint32_t bits, std::uint32_t next) {
    const std::uint32_t part = d.rest << bits | next;
    d = {d.quotient << bits | part / by, part % by};
  };
  take(12, low >> 20u);
  take(12, low >> 8u & 0xFFFu);
  take(8, low & 0xFFu);
  return d;
}
static_assert(divide(~std::uint64_t{0}, 1'000'000).rest == ~std::uint64_t{0} % 1'000'000 &&
              divide(~std::uint64_t{0}, 1000).quotient == static_cast<std::uint32_t>(~std::uint64_t{0} / 1000));

}  // namespace rotorloop::firmware
