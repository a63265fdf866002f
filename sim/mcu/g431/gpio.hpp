// A port of 16 pins (RM0440, 9): modes, pulls, alternate functions; levels from outside come through set_external.
#pragma once
#include "sim/mcu/g431/block.hpp"

namespace rotorloop::mcu::g431 {

enum class Level : uint8_t { open, low, high };

struct GpioMore {
  uint16_t driven = 0, driven_high = 0, seen = 0;  // what the chip does at each pin, and what its inputs see
  std::array<Level, 16> external{};
  std::array<uint8_t, 16> function{};  // row of the table of alternate functions, 1 up; 0: none
};

class Gpio : public RegisterBlock<0x2C, GpioMore> {
 public:
  Gpio(Wires& wires, uint32_t port);
  void reset(bool power_up) override;
  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  bool listens(Signal signal) const override;
  void on_signal(Signal signal, bool high) override;

  void set_external(uint32_t n, Level level);
  bool level(uint32_t n) const { return (s.more.seen >> n & 1) != 0; }
  bool driven(uint32_t n) const { return (s.more.driven >> n & 1) != 0; }
  bool is_analogue(uint32_t n) const { return field(0x00, 2 * n, 2) == 3; }
  // Whether this signal is what the pin carries.
  bool carries(uint32_t n, Signal signal) const;

 private:
  void follow(uint32_t n);
  const uint32_t port_;
};

}  // namespace rotorloop::mcu::g431
