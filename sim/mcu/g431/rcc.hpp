// Reset and clock control (RM0440, 7): oscillators with their ready flags, PLL, prescalers, clock gates, reset causes.
#pragma once
#include "sim/mcu/g431/block.hpp"
#include "sim/mcu/g431/system.hpp"

namespace rotorloop::mcu::g431 {

// Causes of a reset in RCC_CSR.
inline constexpr uint32_t kOptionReset = 1u << 25, kPinReset = 1u << 26, kBrownOutReset = 1u << 27, kSoftwareReset = 1u << 28,
                          kIwdgReset = 1u << 29, kWwdgReset = 1u << 30, kLowPowerReset = 1u << 31;

struct RccMore {
  uint64_t hsi_ready = kNever, hse_ready = kNever, pll_ready = kNever, lsi_ready = kNever, lse_ready = kNever, hsi48_ready = kNever;
};

class Rcc : public RegisterBlock<0xA0, RccMore> {
 public:
  Rcc(Wires& wires, const Pwr& pwr);
  void reset(bool power_up) override;
  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void advance(uint64_t cycle) override;
  uint64_t next_event() const override;
  bool listens(Signal signal) const override { return signal == Signal::clock_failed; }
  void on_signal(Signal, bool high) override;

  bool clocked(const Gate& g) const { return g.offset == 0 || bit(g.offset, g.bit); }
  void add_reset_cause(uint32_t flags);

 private:
  uint64_t in_us(double us) const;
  void write_cr(uint32_t value, uint32_t mask);
  void follow();  // the clock tree as the registers and ready flags make it
  uint32_t pll_vco_Hz() const;
  uint32_t source_Hz(uint32_t sw) const;
  const Pwr& pwr_;
};

}  // namespace rotorloop::mcu::g431
