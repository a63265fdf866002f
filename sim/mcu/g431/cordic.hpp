// The CORDIC unit (RM0440, 17). Results are the exact functions, rounded: more than the iterations of the chip give.
#pragma once
#include "sim/mcu/g431/block.hpp"

namespace rotorloop::mcu::g431 {

struct CordicMore {
  uint32_t argument1 = 0, argument2 = 0x7FFFFFFF;  // q31
  std::array<uint32_t, 2> result{};
  uint8_t written = 0, left = 0;  // words of arguments so far, of results still to be read
  uint64_t ready_at = 0;
};

class Cordic : public RegisterBlock<0x0C, CordicMore> {
 public:
  explicit Cordic(Wires& wires);
  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void advance(uint64_t cycle) override;
  uint64_t next_event() const override;

 private:
  void calculate();
  void follow();
};

}  // namespace rotorloop::mcu::g431
