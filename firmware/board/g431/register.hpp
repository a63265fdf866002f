// A register of the chip, and where a block of them is. On the chip a block is at its address; on a host it is plain memory, and a test may
// hear each access through register_hook, so that the order of writes can be recorded and ready flags answered.
#pragma once
#include <cstddef>
#include <cstdint>

namespace rotorloop::g431 {

class Register;
#ifndef __arm__
struct RegisterHook {
  void* self = nullptr;
  void (*reads)(void*, const Register&) = nullptr;  // before the value is taken
  void (*written)(void*, const Register&, std::uint32_t) = nullptr;
};
inline RegisterHook register_hook;
#endif

// Each access is inlined at every optimisation: code that runs from RAM while the flash works calls nothing.
class Register {
 public:
  [[gnu::always_inline]] std::uint32_t read() const {
#ifndef __arm__
    if (register_hook.reads != nullptr) register_hook.reads(register_hook.self, *this);
#endif
    return value_;
  }
  [[gnu::always_inline]] void write(std::uint32_t value) {
    value_ = value;
#ifndef __arm__
    if (register_hook.written != nullptr) register_hook.written(register_hook.self, *this, value);
#endif
  }
  [[gnu::always_inline]] void set(std::uint32_t bits) { write(read() | bits); }
  [[gnu::always_inline]] void clear(std::uint32_t bits) { write(read() & ~bits); }
  [[gnu::always_inline]] void change(std::uint32_t mask, std::uint32_t bits) { write((read() & ~mask) | bits); }
  [[gnu::always_inline]] bool has(std::uint32_t bits) const { return (read() & bits) == bits; }

  // The test's side: what hardware would put there.
  void hardware(std::uint32_t value) { value_ = value; }
  std::uint32_t peek() const { return value_; }

 private:
  std::uint32_t volatile value_ = 0;
};
static_assert(sizeof(Register) == 4);

template <std::size_t kWords>
struct Reserved {
  std::uint32_t words[kWords];
};

#ifdef __arm__
template <class Block, std::uint32_t kAddress>
Block& block() {
  return *reinterpret_cast<Block*>(kAddress);
}
#else
template <class Block, std::uint32_t kAddress>
Block& block() {
  static Block plain{};
  return plain;
}
#endif

constexpr std::uint32_t bit(unsigned n) { return 1u << n; }
constexpr std::uint32_t field(std::uint32_t value, unsigned at) { return value << at; }

// Until a flag is as wanted, but not for ever: hardware that never answers must not keep the gates waiting. False: it did not.
template <class Done>
bool wait_for(Done&& done, std::uint32_t tries) {
  for (; tries != 0; --tries) {
    if (done()) return true;
  }
  return false;
}

}  // namespace rotorloop::g431
