// The flash interface (RM0440, 3, one bank of 64 pages): keys and locks, erase, 64-bit programming, protection, option bytes, ECC. Words
// that a power cut left torn are made by tests.
#pragma once
#include <bitset>

#include "sim/mcu/g431/block.hpp"

namespace rotorloop::mcu::g431 {

// What a cut in the middle of an operation leaves of a double word.
enum class TornWord : uint8_t {
  untouched,     // as before
  all_ones,      // reads as erased and is not: programming it fails
  single_error,  // reads right, corrected
  double_error,  // reads as neither old nor new, with NMI
};

struct FlashMore {
  uint8_t key_step = 0, option_step = 0, power_down_step = 0;  // keys that came in order
  bool locked_out = false, options_locked_out = false;         // a wrong key: until the next reset
  uint32_t first_word = 0, first_address = 0;                  // of a double word, until the second comes
  bool has_first = false;
  uint64_t done_at = kNever;  // BSY until then
  bool interrupt_at_end = false;
  uint32_t operations = 0, cut_at = 0;  // programmed words and erased pages so far; the one that loses power (0: none)
  TornWord cut_leaves = TornWord::untouched;
  std::bitset<128 * 1024 / 8> corrected, broken, not_blank;  // by double word: one wrong bit, two, all ones but not erased
};

class Flash : public RegisterBlock<0x74, FlashMore> {
 public:
  explicit Flash(Wires& wires);
  void reset(bool power_up) override;
  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void advance(uint64_t cycle) override;
  uint64_t next_event() const override { return s.more.done_at; }
  uint32_t widths() const override { return 0b100; }

  // A store to flash or information memory, at its address there or at the boot alias.
  void store(uint32_t address, uint32_t bytes, uint32_t value);
  // A load or fetch of a byte in flash: waits while the bank is busy, and finds what ECC finds.
  void loaded(uint32_t address);
  bool watches_loads() const { return busy() || s.more.corrected.any() || s.more.broken.any(); }

  // For tests: the n-th operation from now on (1: the next) loses power, the run stops there, and its word or page is left so.
  void cut_power_at(uint32_t operation, TornWord leaves) {
    s.more.cut_at = s.more.operations + operation;
    s.more.cut_leaves = leaves;
  }
  uint32_t operations() const { return s.more.operations; }  // programmed words and erased pages so far
  // For tests: what a double word has become in the years.
  void damage(uint32_t address, TornWord how);

 private:
  bool busy() const { return s.more.done_at != kNever; }
  void unlock(uint8_t& step, bool& locked_out, uint32_t value, const uint32_t (&keys)[2], uint32_t register_offset, uint32_t lock_bit);
  void write_cr(uint32_t value);
  void fail(uint32_t flags);
  void erase(uint32_t first_page, uint32_t pages);
  void program(uint32_t address, uint32_t low, uint32_t high);
  void tear(uint32_t first_offset, uint32_t bytes, uint64_t wanted, TornWord how);
  bool power_is_cut();
  void start(double us);
  void wait();
  bool is_protected(uint32_t page) const;
  void load_options();
  void store_options();
  void update_line();
};

}  // namespace rotorloop::mcu::g431
