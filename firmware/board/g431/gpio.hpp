// Pins (RM0440, section 9). A pin is made what it is by one call; its level is written before its mode, so that none glitches.
#pragma once
#include "firmware/board/g431/register.hpp"

namespace rotorloop::g431 {

struct GpioRegisters {
  Register moder, otyper, ospeedr, pupdr, idr, odr, bsrr, lckr, afr[2], brr;
};
static_assert(offsetof(GpioRegisters, bsrr) == 0x18 && offsetof(GpioRegisters, afr) == 0x20 && offsetof(GpioRegisters, brr) == 0x28);
inline GpioRegisters& gpio_a() { return block<GpioRegisters, 0x48000000>(); }
inline GpioRegisters& gpio_b() { return block<GpioRegisters, 0x48000400>(); }
inline GpioRegisters& gpio_c() { return block<GpioRegisters, 0x48000800>(); }

enum class Port : std::uint8_t { a, b, c };
inline GpioRegisters& gpio(Port port) { return port == Port::a ? gpio_a() : port == Port::b ? gpio_b() : gpio_c(); }

struct Pin {
  Port port;
  std::uint8_t number;
};

enum class Pull : std::uint8_t { none, up, down };
enum class PinMode : std::uint8_t { input, output, alternate, analog };

inline void set_mode(Pin p, PinMode mode) {
  gpio(p.port).moder.change(field(3, 2u * p.number), field(static_cast<std::uint32_t>(mode), 2u * p.number));
}
inline void set_pull(Pin p, Pull pull) {
  gpio(p.port).pupdr.change(field(3, 2u * p.number), field(static_cast<std::uint32_t>(pull), 2u * p.number));
}
inline void write_pin(Pin p, bool high) { gpio(p.port).bsrr.write(bit(p.number + (high ? 0u : 16u))); }
inline bool read_pin(Pin p) { return gpio(p.port).idr.has(bit(p.number)); }

inline void make_output(Pin p, bool high) {
  write_pin(p, high);
  set_mode(p, PinMode::output);
}
inline void make_input(Pin p, Pull pull) {
  set_pull(p, pull);
  set_mode(p, PinMode::input);
}
inline void make_alternate(Pin p, std::uint32_t function) {
  const unsigned at = 4u * (p.number % 8u);
  gpio(p.port).afr[p.number / 8u].change(field(15, at), field(function, at));
  set_mode(p, PinMode::alternate);
}
inline void make_analog(Pin p) { set_mode(p, PinMode::analog); }

}  // namespace rotorloop::g431
