#include "sim/mcu/g431/cordic.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/elementary.hpp"

namespace rotorloop::mcu::g431 {
namespace {

constexpr uint32_t CSR = 0x00, WDATA = 0x04, RDATA = 0x08;
constexpr Register kRegisters[] = {{CSR, "CSR", 0x50, 0x007F07FF}, {WDATA, "WDATA", 0, 0}, {RDATA, "RDATA", 0, 0}};
constexpr double kPi = 3.14159265358979323846, kOne = 2147483648.0;

double from_q31(uint32_t bits) { return static_cast<double>(static_cast<int32_t>(bits)) / kOne; }
uint32_t to_q31(double value) {
  const double scaled = std::floor(value * kOne + 0.5);
  return static_cast<uint32_t>(static_cast<int32_t>(std::clamp(scaled, -kOne, kOne - 1.0)));
}

}  // namespace

Cordic::Cordic(Wires& wires) : RegisterBlock(wires, "CORDIC", 0x40020C00, 0x400, kRegisters, {0x48, 3}) { RegisterBlock::reset(true); }

// Scale factors 2^-n of arguments and results: RM0440, 17.3.2.
void Cordic::calculate() {
  const double x = from_q31(s.more.argument1), y = from_q31(s.more.argument2);
  const double n = static_cast<double>(1u << field(CSR, 8, 3));
  double first = 0.0, second = 0.0;
  switch (field(CSR, 0, 4)) {
    case 0:
      first = y * cos_exact(kPi * x);
      second = y * sin_exact(kPi * x);
      break;
    case 1:
      first = y * sin_exact(kPi * x);
      second = y * cos_exact(kPi * x);
      break;
    case 2:
      first = atan2_exact(y, x) / kPi;
      second = std::sqrt(x * x + y * y);
      break;
    case 3:
      first = std::sqrt(x * x + y * y);
      second = atan2_exact(y, x) / kPi;
      break;
    case 4:
      first = atan2_exact(x * n, 1.0) / kPi / n;
      break;
    case 5:
    case 6: {
      const double grow = exp_exact(x * n), shrink = exp_exact(-x * n);
      first = (field(CSR, 0, 4) == 5 ? grow + shrink : grow - shrink) / 2.0 / n;
      second = (field(CSR, 0, 4) == 5 ? grow - shrink : grow + shrink) / 2.0 / n;
      break;
    }
    case 7:
      first = log_exact((1.0 + x * n) / (1.0 - x * n)) / 2.0 / n;
      break;
    case 8:
      first = log_exact(std::max(x * n, 1e-12)) / (2.0 * n);
      break;
    case 9:
      first = std::sqrt(std::max(0.0, x * n)) / n;
      break;
    default:
      wires_.refuse("FUNC 10 to 15 are reserved");
  }
  const bool half = bit(CSR, 21), two = bit(CSR, 19) && !half;
  const uint32_t a = to_q31(first), b = to_q31(second);
  s.more.result = {half ? (a >> 16) | (b & 0xFFFF0000u) : a, b};
  s.more.left = two ? 2 : 1;
  s.more.written = 0;
  s.more.ready_at = wires_.now() + field(CSR, 4, 4) + 1;  // four iterations a cycle
}

uint64_t Cordic::next_event() const {
  const bool wanted = bit(CSR, 16) || bit(CSR, 17) || bit(CSR, 18);
  return wanted && s.more.ready_at > wires_.now() ? s.more.ready_at : kNever;
}

void Cordic::advance(uint64_t) { follow(); }

uint32_t Cordic::read(uint32_t offset) {
  CordicMore& m = s.more;
  const bool ready = m.left != 0 && wires_.now() >= m.ready_at;
  if (offset == CSR) return reg(CSR) | (ready ? 1u << 31 : 0);
  if (offset != RDATA) return 0;
  if (m.left != 0 && !ready) wires_.stall(m.ready_at - wires_.now());  // the read waits for the result
  const uint32_t value = m.result[m.left == 1 && bit(CSR, 19) && !bit(CSR, 21) ? 1 : 0];
  if (m.left != 0) --m.left;
  follow();
  return value;
}

void Cordic::write(uint32_t offset, uint32_t value, uint32_t mask) {
  CordicMore& m = s.more;
  if (offset == CSR) {
    keep(CSR, value, mask);
    m.written = 0;
  } else if (offset == WDATA) {
    if (bit(CSR, 22)) {
      m.argument1 = value << 16;
      m.argument2 = value & 0xFFFF0000u;
      calculate();
    } else {
      (m.written == 0 ? m.argument1 : m.argument2) = value;
      if (++m.written > field(CSR, 20, 1)) calculate();
    }
  }
  follow();
}

void Cordic::follow() {
  const bool ready = s.more.left != 0 && wires_.now() >= s.more.ready_at;
  interrupt(100, bit(CSR, 16) && ready);
  wires_.set_dma_request(112, bit(CSR, 17) && ready);
  wires_.set_dma_request(113, bit(CSR, 18) && s.more.left == 0);
}

}  // namespace rotorloop::mcu::g431
