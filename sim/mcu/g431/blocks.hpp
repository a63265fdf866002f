// Every register block that is built, in the order in which events of one cycle are taken; and what is not built, by name.
#pragma once
#include <span>

#include "sim/mcu/g431/fdcan.hpp"
#include "sim/mcu/g431/rcc.hpp"

namespace rotorloop::mcu::g431 {

struct Blocks {
  explicit Blocks(Wires& w) : rcc(w), message_ram(w), fdcan(w, message_ram) {}
  template <class Visit>
  void visit(Visit&& visit) {
    visit(rcc);
    visit(message_ram);
    visit(fdcan);
  }

  Rcc rcc;
  MessageRam message_ram;
  Fdcan fdcan;
};

struct NotBuilt {
  const char* name;
  uint32_t base, size_bytes;
};
std::span<const NotBuilt> not_built();

}  // namespace rotorloop::mcu::g431
