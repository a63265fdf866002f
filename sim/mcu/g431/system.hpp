// Small blocks: power control, backup domain (RTC as a clock, TAMP's registers), debug identity, CRC (RM0440, 6, 35, 36, 47, 16).
#pragma once
#include "sim/mcu/g431/block.hpp"

namespace rotorloop::mcu::g431 {

class Pwr : public RegisterBlock<0x84, Nothing> {
 public:
  explicit Pwr(Wires& wires);
  uint32_t read(uint32_t offset) override;
  bool backup_writable() const { return bit(0x00, 8); }  // DBP
  bool boost() const { return !bit(0x80, 8); }
};

class Tamp : public RegisterBlock<0x140, Nothing> {
 public:
  Tamp(Wires& wires, const Pwr& pwr);
  void reset(bool power_up) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;

 private:
  const Pwr& pwr_;
};

struct RtcMore {
  uint64_t second_at = 0;  // cycle at which the second of TR began
  uint8_t keys = 0;
};
class Rtc : public RegisterBlock<0x60, RtcMore> {
 public:
  Rtc(Wires& wires, const Pwr& pwr);
  void reset(bool power_up) override;
  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void advance(uint64_t cycle) override;

 private:
  void next_second();
  uint64_t second_cycles() const;
  const Pwr& pwr_;
};

class Dbgmcu : public RegisterBlock<0x14, Nothing> {
 public:
  explicit Dbgmcu(Wires& wires);
};

class Crc : public RegisterBlock<0x18, Nothing> {
 public:
  explicit Crc(Wires& wires);
  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;

 private:
  uint32_t size() const;  // bits of the polynomial
  void add(uint32_t value, uint32_t bits);
};

}  // namespace rotorloop::mcu::g431
