// ADC1 and ADC2 (RM0440, 21): calibration, regular and injected sequences with the queue of contexts, watchdogs, alignment, DMA.
#pragma once
#include "sim/mcu/g431/analogue.hpp"

namespace rotorloop::mcu::g431 {

class AdcCommon : public RegisterBlock<0x10, Nothing> {
 public:
  explicit AdcCommon(Wires& wires);
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  double clock_Hz() const;  // of the converters; 0: none chosen
};

struct AdcMore {
  enum class Kind : uint8_t { none, regular, injected };
  std::array<uint32_t, 2> queue{};  // contexts of JSQR, the active one first
  uint32_t queued = 0;
  Kind converting = Kind::none, interrupted = Kind::none;
  bool sampled = false, injected_under_way = false, regular_under_way = false;
  uint8_t rank = 0, injected_rank = 0, discontinuous = 0;
  uint16_t raw = 0;
  uint64_t sampled_at = kNever, converted_at = kNever, ready_at = kNever, calibrated_at = kNever;
};

class Adc : public RegisterBlock<0x100, AdcMore> {
 public:
  Adc(Wires& wires, uint32_t number, const AdcCommon& common, const Opamp& opamp);
  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void advance(uint64_t cycle) override;
  uint64_t next_event() const override;
  bool listens(Signal signal) const override;
  void on_signal(Signal signal, bool high) override;

 private:
  using Kind = AdcMore::Kind;
  uint64_t in_cycles(double adc_cycles) const;
  void write_cr(uint32_t value);
  void write_jsqr(uint32_t value);
  void stop(Kind kind);
  void start_regular();
  void start_injected();
  void begin(Kind kind);
  void sample();
  void finish();
  void finish_regular(uint32_t data);
  void finish_injected(uint32_t data);
  uint32_t regular_channel() const;
  uint32_t injected_channel() const;
  uint32_t channel() const { return s.more.converting == Kind::injected ? injected_channel() : regular_channel(); }
  uint32_t jsqr() const { return s.more.queued != 0 ? s.more.queue[0] : 0; }
  uint32_t oversampling() const;
  uint32_t data(uint32_t raw) const;
  void watch(uint32_t raw);
  void follow();

  const uint32_t number_;
  const AdcCommon& common_;
  const AnalogueInputs inputs_;
};

}  // namespace rotorloop::mcu::g431
