#include "sim/mcu/g431/gpio.hpp"

namespace rotorloop::mcu::g431 {
namespace {

constexpr uint32_t MODER = 0x00, OTYPER = 0x04, PUPDR = 0x0C, IDR = 0x10, ODR = 0x14, BSRR = 0x18, AFRL = 0x20, AFRH = 0x24, BRR = 0x28;
#define RL_PORT(A_MODE, A_SPEED, A_PULL)                                                                                               \
  {                                                                                                                                    \
    {MODER, "MODER", A_MODE}, {OTYPER, "OTYPER", 0, 0xFFFF}, {0x08, "OSPEEDR", A_SPEED}, {PUPDR, "PUPDR", A_PULL}, {IDR, "IDR", 0, 0}, \
        {ODR, "ODR", 0, 0xFFFF}, {BSRR, "BSRR", 0, 0}, {0x1C, "LCKR", 0, 0x1FFFF}, {AFRL, "AFRL"}, {AFRH, "AFRH"}, {BRR, "BRR", 0, 0}, \
  }
constexpr Register kPortA[] = RL_PORT(0xABFFFFFF, 0x0C000000, 0x64000000);
constexpr Register kPortB[] = RL_PORT(0xFFFFFEBF, 0x000000C0, 0x00000100);
constexpr Register kPort[] = RL_PORT(0xFFFFFFFF, 0, 0);
constexpr const char* kNames[] = {"GPIOA", "GPIOB", "GPIOC", "GPIOD", "GPIOE", "GPIOF", "GPIOG"};

struct Function {
  uint8_t pin, af;
  Signal out, in, is_input;  // is_input: high while a timer has its channel as an input
};
constexpr Function ch(uint32_t pin, uint32_t af, uint32_t timer, uint32_t n) {
  return {static_cast<uint8_t>(pin), static_cast<uint8_t>(af), timer_signal(timer, TimerWire::ch1) + (n - 1),
          timer_signal(timer, TimerWire::ti1) + (n - 1), timer_signal(timer, TimerWire::input1) + (n - 1)};
}
constexpr Function chn(uint32_t pin, uint32_t af, uint32_t timer, uint32_t n) {
  return {static_cast<uint8_t>(pin), static_cast<uint8_t>(af), timer_signal(timer, TimerWire::ch1n) + (n - 1), Signal::none, Signal::none};
}
constexpr Function in(uint32_t pin, uint32_t af, uint32_t timer, TimerWire wire) {
  return {static_cast<uint8_t>(pin), static_cast<uint8_t>(af), Signal::none, timer_signal(timer, wire), Signal::none};
}
constexpr Function out(uint32_t pin, uint32_t af, Signal s) {
  return {static_cast<uint8_t>(pin), static_cast<uint8_t>(af), s, Signal::none, Signal::none};
}
constexpr Function in(uint32_t pin, uint32_t af, Signal s) {
  return {static_cast<uint8_t>(pin), static_cast<uint8_t>(af), Signal::none, s, Signal::none};
}
constexpr uint32_t A = 0, B = 16, C = 32, F = 80, G = 96;
constexpr TimerWire bkin = TimerWire::bkin, bkin2 = TimerWire::bkin2, etr = TimerWire::etr;
constexpr Signal u1 = Signal::usart1_tx, u2 = Signal::usart2_tx, u3 = Signal::usart3_tx, u4 = Signal::uart4_tx, lp = Signal::lpuart1_tx;

// DS12589, table of alternate functions: those that this chip's built blocks have.
// clang-format off
constexpr Function kFunctions[] = {
    ch(A + 0, 1, 2, 1), in(A + 0, 9, 8, bkin), in(A + 0, 10, 8, etr), in(A + 0, 14, 2, etr), ch(A + 1, 1, 2, 2), chn(A + 1, 9, 15, 1),
    ch(A + 2, 1, 2, 3), out(A + 2, 7, u2), ch(A + 2, 9, 15, 1), out(A + 2, 12, lp), ch(A + 3, 1, 2, 4), in(A + 3, 7, u2 + 1),
    ch(A + 3, 9, 15, 2), in(A + 3, 12, lp + 1), ch(A + 4, 2, 3, 2), ch(A + 5, 1, 2, 1), in(A + 5, 2, 2, etr), ch(A + 6, 1, 16, 1),
    ch(A + 6, 2, 3, 1), in(A + 6, 4, 8, bkin), in(A + 6, 6, 1, bkin), ch(A + 7, 1, 17, 1), ch(A + 7, 2, 3, 2), chn(A + 7, 4, 8, 1),
    chn(A + 7, 6, 1, 1), out(A + 8, 0, Signal::mco), ch(A + 8, 6, 1, 1), in(A + 8, 10, 4, etr), ch(A + 9, 6, 1, 2), out(A + 9, 7, u1),
    in(A + 9, 9, 15, bkin), ch(A + 9, 10, 2, 3), in(A + 10, 1, 17, bkin), ch(A + 10, 6, 1, 3), in(A + 10, 7, u1 + 1),
    ch(A + 10, 10, 2, 4), in(A + 10, 11, 8, bkin), chn(A + 11, 6, 1, 1), in(A + 11, 9, Signal::fdcan1_rx), ch(A + 11, 10, 4, 1),
    ch(A + 11, 11, 1, 4), in(A + 11, 12, 1, bkin2), ch(A + 12, 1, 16, 1), chn(A + 12, 6, 1, 2), out(A + 12, 9, Signal::fdcan1_tx),
    ch(A + 12, 10, 4, 2), in(A + 12, 11, 1, etr), chn(A + 13, 1, 16, 1), ch(A + 13, 10, 4, 3), ch(A + 14, 5, 8, 2),
    in(A + 14, 6, 1, bkin), out(A + 14, 7, u2), ch(A + 15, 1, 2, 1), ch(A + 15, 2, 8, 1), in(A + 15, 7, u2 + 1), in(A + 15, 9, 1, bkin),
    in(A + 15, 14, 2, etr), ch(B + 0, 2, 3, 3), chn(B + 0, 4, 8, 2), chn(B + 0, 6, 1, 2), ch(B + 1, 2, 3, 4), chn(B + 1, 4, 8, 3),
    chn(B + 1, 6, 1, 3), ch(B + 3, 1, 2, 2), in(B + 3, 2, 4, etr), chn(B + 3, 4, 8, 1), out(B + 3, 7, u2), in(B + 3, 10, 3, etr),
    ch(B + 4, 1, 16, 1), ch(B + 4, 2, 3, 1), chn(B + 4, 4, 8, 2), in(B + 4, 7, u2 + 1), in(B + 4, 10, 17, bkin), in(B + 5, 1, 16, bkin),
    ch(B + 5, 2, 3, 2), chn(B + 5, 3, 8, 3), ch(B + 5, 10, 17, 1), chn(B + 6, 1, 16, 1), ch(B + 6, 2, 4, 1), ch(B + 6, 5, 8, 1),
    in(B + 6, 6, 8, etr), out(B + 6, 7, u1), in(B + 6, 10, 8, bkin2), chn(B + 7, 1, 17, 1), ch(B + 7, 2, 4, 2), in(B + 7, 5, 8, bkin),
    in(B + 7, 7, u1 + 1), ch(B + 7, 10, 3, 4), ch(B + 8, 1, 16, 1), ch(B + 8, 2, 4, 3), in(B + 8, 7, u3 + 1),
    in(B + 8, 9, Signal::fdcan1_rx), ch(B + 8, 10, 8, 2), in(B + 8, 12, 1, bkin), ch(B + 9, 1, 17, 1), ch(B + 9, 2, 4, 4),
    out(B + 9, 7, u3), out(B + 9, 9, Signal::fdcan1_tx), ch(B + 9, 10, 8, 3), chn(B + 9, 12, 1, 3), ch(B + 10, 1, 2, 3),
    out(B + 10, 7, u3), in(B + 10, 8, lp + 1), in(B + 10, 12, 1, bkin), ch(B + 11, 1, 2, 4), in(B + 11, 7, u3 + 1), out(B + 11, 8, lp),
    in(B + 12, 6, 1, bkin), chn(B + 13, 6, 1, 1), ch(B + 14, 1, 15, 1), chn(B + 14, 6, 1, 2), ch(B + 15, 1, 15, 2),
    chn(B + 15, 2, 15, 1), chn(B + 15, 4, 1, 3), ch(C + 0, 2, 1, 1), ch(C + 1, 2, 1, 2), ch(C + 2, 2, 1, 3), ch(C + 3, 2, 1, 4),
    in(C + 3, 6, 1, bkin2), in(C + 4, 2, 1, etr), out(C + 4, 7, u1), in(C + 5, 2, 15, bkin), chn(C + 5, 6, 1, 4), in(C + 5, 7, u1 + 1),
    ch(C + 6, 2, 3, 1), ch(C + 6, 4, 8, 1), ch(C + 7, 2, 3, 2), ch(C + 7, 4, 8, 2), ch(C + 8, 2, 3, 3), ch(C + 8, 4, 8, 3),
    ch(C + 9, 2, 3, 4), ch(C + 9, 4, 8, 4), in(C + 9, 5, 8, bkin2), chn(C + 10, 4, 8, 1), out(C + 10, 5, u4), out(C + 10, 7, u3),
    chn(C + 11, 4, 8, 2), in(C + 11, 5, u4 + 1), in(C + 11, 7, u3 + 1), chn(C + 12, 4, 8, 3), in(C + 13, 2, 1, bkin),
    chn(C + 13, 4, 1, 1), chn(C + 13, 6, 8, 4), chn(F + 0, 6, 1, 3), out(G + 10, 0, Signal::mco),
};
// clang-format on
static_assert(std::size(kFunctions) < 256);

uint8_t function_of(uint32_t pin, uint32_t af) {
  for (uint32_t n = 0; n < std::size(kFunctions); ++n)
    if (kFunctions[n].pin == pin && kFunctions[n].af == af) return static_cast<uint8_t>(n + 1);
  return 0;
}

}  // namespace

Gpio::Gpio(Wires& wires, uint32_t port)
    : RegisterBlock(wires, kNames[port], 0x48000000 + 0x400 * port, 0x400,
                    port == 0   ? std::span<const Register>(kPortA)
                    : port == 1 ? std::span<const Register>(kPortB)
                                : std::span<const Register>(kPort),
                    {0x4C, static_cast<uint8_t>(port)}),
      port_(port) {
  RegisterBlock::reset(true);
}

// What is outside of the chip stays as it is.
void Gpio::reset(bool power_up) {
  const GpioMore before = s.more;
  RegisterBlock::reset(power_up);
  s.more.external = before.external;
  s.more.driven = before.driven;
  s.more.driven_high = before.driven_high;
  s.more.seen = before.seen;
  for (uint32_t n = 0; n < 16; ++n) follow(n);
}

bool Gpio::carries(uint32_t n, Signal signal) const {
  const uint8_t f = s.more.function[n];
  return f != 0 && field(MODER, 2 * n, 2) == 2 && (kFunctions[f - 1].out == signal || kFunctions[f - 1].in == signal);
}

bool Gpio::listens(Signal signal) const {
  for (const Function& f : kFunctions)
    if (f.pin / 16 == port_ && signal != Signal::none && (f.out == signal || f.is_input == signal)) return true;
  return false;
}

void Gpio::on_signal(Signal signal, bool) {
  for (uint32_t n = 0; n < 16; ++n)
    if (const uint8_t f = s.more.function[n]; f != 0 && (kFunctions[f - 1].out == signal || kFunctions[f - 1].is_input == signal))
      follow(n);
}

void Gpio::set_external(uint32_t n, Level level) {
  s.more.external[n] = level;
  follow(n);
}

// What the chip does at a pin, what its input sees, and who hears of it.
void Gpio::follow(uint32_t n) {
  GpioMore& m = s.more;
  const uint32_t mode = field(MODER, 2 * n, 2), pull = field(PUPDR, 2 * n, 2);
  const auto mask = static_cast<uint16_t>(1u << n);
  const Function* f = mode == 2 && m.function[n] != 0 ? &kFunctions[m.function[n] - 1] : nullptr;
  bool driven = mode == 1, high = bit(ODR, n);
  if (f != nullptr && f->out != Signal::none) {
    driven = f->is_input == Signal::none || !wires_.signal(f->is_input);
    high = wires_.signal(f->out);
  }
  if (driven && high && bit(OTYPER, n)) driven = false;  // open drain
  const bool outside = m.external[n] == Level::high || (m.external[n] == Level::open && pull == 1);
  const bool seen = mode != 3 && (driven && m.external[n] == Level::open ? high : driven ? high && outside : outside);
  const bool drives_now = (m.driven & mask) != 0, high_now = (m.driven_high & mask) != 0;
  if (driven != drives_now || (driven && high != high_now)) {
    m.driven = static_cast<uint16_t>(driven ? m.driven | mask : m.driven & ~mask);
    m.driven_high = static_cast<uint16_t>(high ? m.driven_high | mask : m.driven_high & ~mask);
    wires_.pin_changed(16 * port_ + n, driven, high);
  }
  m.seen = static_cast<uint16_t>(seen ? m.seen | mask : m.seen & ~mask);
  wires_.set_signal(Signal::pin0 + (16 * port_ + n), seen);
  if (f != nullptr && f->in != Signal::none && !driven) wires_.set_signal(f->in, seen);
}

uint32_t Gpio::read(uint32_t offset) { return offset == IDR ? s.more.seen : reg(offset); }

void Gpio::write(uint32_t offset, uint32_t value, uint32_t mask) {
  const uint32_t odr = reg(ODR);
  switch (offset) {
    case BSRR:  // set wins over reset
      reg(ODR) = ((odr & ~(value >> 16)) | value) & 0xFFFF;
      break;
    case BRR:
      reg(ODR) = odr & ~value;
      break;
    default:
      keep(offset, value, mask);
  }
  if (offset == AFRL || offset == AFRH || offset == MODER)
    for (uint32_t n = 0; n < 16; ++n) s.more.function[n] = function_of(16 * port_ + n, field(n < 8 ? AFRL : AFRH, 4 * (n & 7), 4));
  const bool one = offset == BSRR || offset == BRR || offset == ODR;
  const uint32_t changed = one ? odr ^ reg(ODR) : 0xFFFF;
  for (uint32_t n = 0; n < 16; ++n)
    if ((changed >> n & 1) != 0) follow(n);
}

}  // namespace rotorloop::mcu::g431
