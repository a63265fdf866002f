// The two watchdogs (RM0440, 42, 43).
#pragma once
#include <algorithm>

#include "sim/mcu/g431/block.hpp"

namespace rotorloop::mcu::g431 {

struct IwdgMore {
  bool started = false, open = false;
  uint64_t reset_at = kNever, updated_at = 0;  // cycles; the end of the last update of PR, RLR or WINR
  uint64_t ticks_left = 0;                     // while clocks change
};
class Iwdg : public RegisterBlock<0x14, IwdgMore> {
 public:
  explicit Iwdg(Wires& wires);
  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void advance(uint64_t cycle) override;
  uint64_t next_event() const override { return s.more.reset_at; }
  void clocks_change() override;
  void clocks_changed() override;

 private:
  void reload();
  uint32_t counter() const;
};

struct WwdgMore {
  uint64_t started_at = 0;  // cycle at which the counter had `from`
  uint32_t from = 0x7F;
};
class Wwdg : public RegisterBlock<0x0C, WwdgMore> {
 public:
  explicit Wwdg(Wires& wires);
  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void advance(uint64_t cycle) override;
  uint64_t next_event() const override;
  void clocks_change() override;

 private:
  uint64_t step() const;
  uint32_t counter(uint64_t cycle) const;
};

}  // namespace rotorloop::mcu::g431
