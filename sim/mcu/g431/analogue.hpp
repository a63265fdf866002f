// Operational amplifiers, comparators and DACs (RM0440, 22, 24, 25), and what volts the ADCs see at their channels.
#pragma once
#include "sim/mcu/g431/block.hpp"

namespace rotorloop::mcu::g431 {

inline constexpr double kReference_V = 3.3;

struct DacMore {
  std::array<uint16_t, 2> out{};  // what the converters give, behind the holding registers
};
class Dac : public RegisterBlock<0x64, DacMore> {
 public:
  Dac(Wires& wires, uint32_t number);
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  uint32_t read(uint32_t offset) override;
  bool listens(Signal signal) const override;
  void on_signal(Signal signal, bool high) override;
  double out_V(uint32_t channel) const;

 private:
  void load(uint32_t channel);
  const uint32_t number_;
};

class Opamp : public RegisterBlock<0x24, Nothing> {
 public:
  Opamp(Wires& wires, const Dac& dac3);
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  // amplifier 0 to 2
  bool enabled(uint32_t n) const { return bit(4 * n, 0); }
  bool drives_pin(uint32_t n) const { return enabled(n) && !bit(4 * n, 8); }
  double out_V(uint32_t n) const;

 private:
  const Dac& dac3_;
};

struct CompMore {
  uint8_t high = 0;
};
class Comp : public RegisterBlock<0x10, CompMore> {
 public:
  Comp(Wires& wires, const Dac& dac1, const Dac& dac3);
  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  bool listens(Signal signal) const override;
  void on_signal(Signal, bool) override { follow(); }
  // Volts at pins or of a DAC changed: outputs follow.
  void follow();

 private:
  double minus_V(uint32_t n) const;
  bool blanked(uint32_t n) const;
  const Dac &dac1_, &dac3_;
};

// Volts at channel 0 to 18 of ADC1 or ADC2.
struct AnalogueInputs {
  const Opamp& opamp;
  Wires& wires;
  double channel_V(uint32_t adc, uint32_t channel) const;
};

}  // namespace rotorloop::mcu::g431
