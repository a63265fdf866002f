// USART2, transmit only (RM0440, section 37): a line to whoever has a terminal on the debugger's port. Never waited for.
#pragma once
#include <array>
#include <cstdint>

#include "firmware/board/g431/rcc.hpp"
#include "firmware/board/g431/register.hpp"

namespace rotorloop::g431 {

struct UsartRegisters {
  Register cr1, cr2, cr3, brr, gtpr, rtor, rqr, isr, icr, rdr, tdr, presc;
};
static_assert(offsetof(UsartRegisters, brr) == 0x0C && offsetof(UsartRegisters, isr) == 0x1C && offsetof(UsartRegisters, tdr) == 0x28);
inline UsartRegisters& usart2() { return block<UsartRegisters, 0x40004400>(); }

inline constexpr std::uint32_t kUart_Bd = 115'200;

class TextOut {
 public:
  void start() {
    rcc().apb1enr1.set(rcc_bits::kUsart2);
    usart2().brr.write(kCore_Hz / kUart_Bd);
    usart2().cr1.write(bit(3) | bit(0));
  }
  // What does not fit the buffer is dropped.
  void put(char c) {
    if (written_ - read_ < buffer_.size()) buffer_[written_++ % buffer_.size()] = c;
  }
  void put(const char* text) {
    for (; *text != '\0'; ++text) put(*text);
  }
  void put_hex(std::uint32_t v) {
    for (unsigned at = 32; at != 0; at -= 4) put("0123456789abcdef"[v >> (at - 4) & 15u]);
  }
  // Each turn of the main loop.
  void poll() {
    if (read_ != written_ && usart2().isr.has(bit(7))) usart2().tdr.write(static_cast<std::uint8_t>(buffer_[read_++ % buffer_.size()]));
  }

 private:
  std::array<char, 128> buffer_{};
  std::uint32_t read_ = 0, written_ = 0;
};

}  // namespace rotorloop::g431
