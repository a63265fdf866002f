// Parallel addition and subtraction, saturating addition, sums of absolute differences (A4.4.4 to A4.4.7).
#include <algorithm>
#include <cstdlib>

#include "sim/mcu/core/core.hpp"
#include "sim/mcu/core/handlers.hpp"

namespace rotorloop::mcu::exec {
namespace {

// What becomes of the exact sum of one lane.
enum class Lane : uint8_t { modulo, saturated, halved };

struct Lanes {
  bool bytes;
  bool subtracts_low, subtracts_high;  // of each pair of halfwords
  bool exchanged;                      // halfwords of the second operand
};

Lanes lanes_of(uint32_t kind) {
  switch (kind) {
    case 0:
      return {true, false, false, false};
    case 4:
      return {true, true, true, false};
    case 1:
      return {false, false, false, false};
    case 5:
      return {false, true, true, false};
    case 2:
      return {false, true, false, true};
    default:
      return {false, false, true, true};
  }
}

template <bool kSigned>
int32_t lane(uint32_t word, uint32_t bits, uint32_t index) {
  const uint32_t value = word >> (bits * index) & ((1u << bits) - 1);
  if constexpr (!kSigned) return static_cast<int32_t>(value);
  return static_cast<int32_t>(value << (32 - bits)) >> (32 - bits);
}

template <bool kSigned>
int32_t saturated(int32_t sum, uint32_t bits) {
  if constexpr (kSigned) return std::clamp(sum, -(1 << (bits - 1)), (1 << (bits - 1)) - 1);
  return std::clamp(sum, 0, (1 << bits) - 1);
}

// GE of a lane: signed, the result is not negative; unsigned, an addition carried or a subtraction did not borrow.
template <bool kSigned>
bool greater_or_equal(int32_t sum, uint32_t bits, bool subtracts) {
  if constexpr (kSigned) return sum >= 0;
  return subtracts ? sum >= 0 : sum >= 1 << bits;
}

template <bool kSigned, Lane kLane>
void parallel(Core& core, const Op& op) {
  const Lanes lanes = lanes_of(op.kind);
  const uint32_t bits = lanes.bytes ? 8 : 16, count = 32 / bits, n = core.state.r[op.rn];
  const uint32_t m = lanes.exchanged ? core.state.r[op.rm] << 16 | core.state.r[op.rm] >> 16 : core.state.r[op.rm];
  uint32_t result = 0, ge = 0;
  for (uint32_t i = 0; i < count; ++i) {
    const bool subtracts = i == 0 || (lanes.bytes && i < 2) ? lanes.subtracts_low : lanes.subtracts_high;
    const int32_t a = lane<kSigned>(n, bits, i), b = lane<kSigned>(m, bits, i);
    int32_t sum = subtracts ? a - b : a + b;
    if (greater_or_equal<kSigned>(sum, bits, subtracts)) ge |= lanes.bytes ? 1u << i : 3u << (2 * i);
    if constexpr (kLane == Lane::saturated) sum = saturated<kSigned>(sum, bits);
    if constexpr (kLane == Lane::halved) sum >>= 1;
    result |= (static_cast<uint32_t>(sum) & ((1u << bits) - 1)) << (bits * i);
  }
  core.state.r[op.rd] = result;
  if constexpr (kLane == Lane::modulo) core.state.ge = ge;
}

int32_t saturate32(CoreState& s, int64_t value) {
  const int64_t held = std::clamp<int64_t>(value, INT32_MIN, INT32_MAX);
  if (held != value) s.q = 1;
  return static_cast<int32_t>(held);
}

}  // namespace

void signed_parallel(Core& core, const Op& op) { parallel<true, Lane::modulo>(core, op); }
void saturating_parallel(Core& core, const Op& op) { parallel<true, Lane::saturated>(core, op); }
void signed_halving(Core& core, const Op& op) { parallel<true, Lane::halved>(core, op); }
void unsigned_parallel(Core& core, const Op& op) { parallel<false, Lane::modulo>(core, op); }
void unsigned_saturating(Core& core, const Op& op) { parallel<false, Lane::saturated>(core, op); }
void unsigned_halving(Core& core, const Op& op) { parallel<false, Lane::halved>(core, op); }

void saturating_add(Core& core, const Op& op) {
  const auto m = static_cast<int32_t>(core.state.r[op.rm]);
  int64_t n = static_cast<int32_t>(core.state.r[op.rn]);
  if ((op.kind & 1) != 0) n = saturate32(core.state, 2 * n);
  core.state.r[op.rd] = static_cast<uint32_t>(saturate32(core.state, (op.kind & 2) != 0 ? m - n : m + n));
}

void absolute_differences(Core& core, const Op& op) {
  uint32_t sum = core.state.r[op.ra];
  for (uint32_t i = 0; i < 4; ++i)
    sum += static_cast<uint32_t>(std::abs(lane<false>(core.state.r[op.rn], 8, i) - lane<false>(core.state.r[op.rm], 8, i)));
  core.state.r[op.rd] = sum;
}

}  // namespace rotorloop::mcu::exec
