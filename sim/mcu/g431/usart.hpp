// USART1 to 3, UART4 and LPUART1 (RM0440, 37, 38), byte by byte: frames take their time, lines are not drawn bit by bit.
#pragma once
#include "sim/mcu/g431/block.hpp"

namespace rotorloop::mcu::g431 {

struct UsartMore {
  std::array<uint16_t, 8> tx{}, rx{};
  uint8_t tx_count = 0, rx_count = 0;
  bool shifting = false;
  uint16_t shift = 0;
  uint64_t sent_at = kNever, idle_at = kNever;
};

class Usart : public RegisterBlock<0x30, UsartMore> {
 public:
  // number: 1 to 3, 4 for UART4, 6 for LPUART1.
  Usart(Wires& wires, uint32_t number);
  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void advance(uint64_t cycle) override;
  uint64_t next_event() const override;
  // A frame came in whole; the caller keeps to the line's speed.
  void receive(uint8_t byte);
  uint64_t frame_cycles() const;  // of one frame; 0: not set up
  bool receiving() const { return (reg(0x00) & 5) == 5; }

 private:
  uint32_t depth() const { return bit(0x00, 29) ? 8 : 1; }
  void next_frame();
  void follow();
  const uint32_t number_;
};

}  // namespace rotorloop::mcu::g431
