// A register block of the chip: what every peripheral is to the chip, and what the chip is to a peripheral.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "sim/mcu/g431/clocks.hpp"
#include "sim/mcu/g431/signals.hpp"

namespace rotorloop::mcu::g431 {

inline constexpr uint64_t kNever = ~uint64_t{0};

// One register as the reference manual has it. An access elsewhere is refused by name.
struct Register {
  uint16_t offset;
  const char* name;
  uint32_t reset = 0;
  uint32_t keeps = 0xFFFFFFFF;  // bits that a write leaves as written; flags and keys are the block's own business
};

// Where a block's clock is enabled: offset of the RCC register and bit; offset 0: always on. Its reset is 0x20 below.
struct Gate {
  uint8_t offset = 0, bit = 0;
};

class Block;

// The chip as a block sees it.
class Wires {
 public:
  virtual ~Wires() = default;
  virtual uint64_t now() const = 0;  // cycle of HCLK at which the access or the event happens
  virtual const Clocks& clocks() const = 0;
  virtual double time_s_at(uint64_t cycle) const = 0;  // since power-up, through all changes of clock
  virtual uint64_t cycle_at(double time_s) const = 0;  // the last cycle not after it, if the clock stays as it is
  // The level of this block at an interrupt line of the NVIC; lines that blocks share are high while any of them holds them.
  virtual void set_interrupt(const Block& from, uint32_t line, bool high) = 0;
  virtual void raise_nmi() = 0;
  // Requests by their numbers in DMAMUX (RM0440, table "DMAMUX: assignment of multiplexer inputs"). Held: transfers go on while it is
  // high and the transfer itself lowers it. Pulsed: one transfer.
  virtual void set_dma_request(uint32_t request, bool high) = 0;
  virtual void pulse_dma_request(uint32_t request) = 0;
  virtual void set_signal(Signal signal, bool high) = 0;  // heard by every block whose listens() has it, and by pins
  virtual bool signal(Signal signal) const = 0;
  void pulse(Signal s) {
    set_signal(s, true);
    set_signal(s, false);
  }
  // An access by DMA; false: nothing is there.
  virtual bool bus_read(uint32_t address, uint32_t bytes, uint32_t& value) = 0;
  virtual bool bus_write(uint32_t address, uint32_t bytes, uint32_t value) = 0;
  virtual void pin_changed(uint32_t pin, bool driven, bool high) = 0;  // for GPIO: to whoever is at the pins
  virtual void uart_sent(uint32_t number, uint8_t byte) = 0;           // for USART
  // Volts at an analogue input of the chip: pin = 16 * port + number, port A is 0.
  virtual double pin_V(uint32_t pin) = 0;
  // Ends the access that is being done as an error with the block, register and value; `why` is a literal. Lenient: counted.
  virtual void refuse(const char* why) = 0;
  // The block's own event moved; needed only outside of advance, of an access and of on_signal, which the chip asks after anyway.
  virtual void reschedule(const Block& block) = 0;
  virtual void reset_chip(uint32_t rcc_csr_flag) = 0;  // at the end of the access or event, with its cause in RCC_CSR
  // For RCC: the clock tree as it is from now() on, and the reset of every block behind a gate.
  virtual void change_clocks(const Clocks& clocks) = 0;
  virtual void reset_behind(uint8_t gate_offset, uint32_t bits) = 0;
  // For FLASH: the bytes of flash and of information memory (from kInformationBase), told when changed; cycles in which the core waits.
  virtual std::span<uint8_t> flash() = 0;
  virtual std::span<uint8_t> information() = 0;
  virtual void flash_changed(uint32_t address, uint32_t bytes) = 0;
  virtual void stall(uint64_t cycles) = 0;
  virtual void watch_flash_loads(bool on) = 0;  // Flash::loaded is called for each load, and each fetch that is decoded
  virtual uint32_t program_counter() const = 0;
  virtual void stop_run() = 0;  // Chip::run_until returns End::stopped
  virtual void set_wait_states(uint32_t wait_states) = 0;
};

// Derived blocks keep all that they remember in one trivially copyable struct, handed out by state(): a snapshot is a copy of it. No
// pointer into itself, no heap after construction, no clock of the host, no thread.
class Block {
 public:
  Block(Wires& wires, const char* its_name, uint32_t at, uint32_t bytes, std::span<const Register> its_registers, Gate its_gate = {})
      : name(its_name), base(at), size_bytes(bytes), registers(its_registers), gate(its_gate), wires_(wires), places_(bytes / 4, kNowhere) {
    for (size_t n = registers.size(); n-- > 0;)
      if (registers[n].offset < bytes) places_[registers[n].offset / 4] = static_cast<uint16_t>(n);
  }
  virtual ~Block() = default;
  Block(const Block&) = delete;
  Block& operator=(const Block&) = delete;

  // After power-up and after a reset by RCC. power_up: also what lies in the backup domain.
  virtual void reset(bool power_up) = 0;
  // Called at wires.now() for an offset that `registers` has. A narrower access comes as a word: value is 0 outside of mask, so that
  // "write 1 to clear" reads `reg &= ~value` and "write 0 to clear" `reg &= value | ~mask`.
  virtual uint32_t read(uint32_t offset) = 0;
  virtual void write(uint32_t offset, uint32_t value, uint32_t mask) = 0;
  // A read of these widths in bytes is refused; 0b100 allows words only.
  virtual uint32_t widths() const { return 0b111; }
  // Brings everything up to this cycle, which is never behind the next event.
  virtual void advance(uint64_t /*cycle*/) {}
  // The cycle at which the block does something by itself that others can see: interrupt, request, signal, pin.
  virtual uint64_t next_event() const { return kNever; }
  virtual bool listens(Signal) const { return false; }
  virtual void on_signal(Signal, bool /*high*/) {}
  // Clocks are about to change at now() (time so far was counted with the old ones), and did change.
  virtual void clocks_change() { advance(wires_.now()); }
  virtual void clocks_changed() {}
  virtual std::span<std::byte> state() = 0;

  const Register* find(uint32_t offset) const {  // null: there is no such register
    const uint16_t place = places_[offset / 4];
    return place == kNowhere ? nullptr : &registers[place];
  }

  const char* const name;
  const uint32_t base, size_bytes;
  const std::span<const Register> registers;
  const Gate gate;
  uint32_t order = 0;  // set by the chip: order among events of one cycle

 protected:
  void interrupt(uint32_t line, bool high) { wires_.set_interrupt(*this, line, high); }
  Wires& wires_;

 private:
  static constexpr uint16_t kNowhere = 0xFFFF;
  std::vector<uint16_t> places_;  // of the register at each word
};

// A block whose registers are plain words, with `More` beside them. Registers read as last written in the bits that they keep.
template <uint32_t kBytes, class More>
class RegisterBlock : public Block {
 public:
  using Block::Block;
  void reset(bool /*power_up*/) override {
    s = State{};
    for (const Register& r : registers) reg(r.offset) = r.reset;
  }
  uint32_t read(uint32_t offset) override { return reg(offset); }
  void write(uint32_t offset, uint32_t value, uint32_t mask) override { keep(offset, value, mask); }
  std::span<std::byte> state() override { return std::as_writable_bytes(std::span(&s, 1)); }

 protected:
  struct State {
    std::array<uint32_t, kBytes / 4> words{};
    More more{};
  };
  static_assert(std::is_trivially_copyable_v<State>);
  uint32_t& reg(uint32_t offset) { return s.words[offset / 4]; }
  uint32_t reg(uint32_t offset) const { return s.words[offset / 4]; }
  bool bit(uint32_t offset, uint32_t n) const { return (reg(offset) >> n & 1) != 0; }
  uint32_t field(uint32_t offset, uint32_t at, uint32_t bits) const { return reg(offset) >> at & ((1u << bits) - 1); }
  void keep(uint32_t offset, uint32_t value, uint32_t mask) {
    const Register* r = find(offset);
    if (r != nullptr) reg(offset) = (reg(offset) & ~(r->keeps & mask)) | (value & r->keeps & mask);
  }
  State s;
};

struct Nothing {};

}  // namespace rotorloop::mcu::g431
