// System configuration with the voltage reference buffer (RM0440, 10, 23), and the interrupts of pins and comparators (EXTI, 15).
#pragma once
#include "sim/mcu/g431/block.hpp"

namespace rotorloop::mcu::g431 {

class Syscfg : public RegisterBlock<0x38, Nothing> {
 public:
  explicit Syscfg(Wires& wires);
  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  uint32_t port_of(uint32_t line) const { return field(0x08 + 4 * (line / 4), 4 * (line & 3), 4); }
};

class Exti : public RegisterBlock<0x38, Nothing> {
 public:
  Exti(Wires& wires, const Syscfg& syscfg);
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  bool listens(Signal signal) const override;
  void on_signal(Signal signal, bool high) override;

 private:
  void edge(uint32_t line, bool high);
  void follow();
  const Syscfg& syscfg_;
};

}  // namespace rotorloop::mcu::g431
