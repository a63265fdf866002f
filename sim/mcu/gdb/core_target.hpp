// The core with plain memories, without a chip.
#pragma once
#include <algorithm>

#include "sim/mcu/gdb/target.hpp"

namespace rotorloop::mcu::gdb {

inline Halt halt_of(Stopped stopped) {
  return stopped == Stopped::locked_up ? Halt::locked_up : stopped == Stopped::breakpoint ? Halt::breakpoint : Halt::none;
}

class CoreTarget : public DebugTarget {
 public:
  CoreTarget(Core& its_core, MemoryMap& memories, uint32_t vector_table) : core_(its_core), memories_(memories), vectors_(vector_table) {}
  Core& core() override { return core_; }
  bool read(uint32_t address, std::span<uint8_t> bytes) override {
    const uint8_t* here = place(address, bytes.size());
    if (here != nullptr) std::copy_n(here, bytes.size(), bytes.begin());
    return here != nullptr || system(address, bytes);
  }
  bool write(uint32_t address, std::span<const uint8_t> bytes) override {
    uint8_t* here = place(address, bytes.size());
    if (here == nullptr) return false;
    std::copy(bytes.begin(), bytes.end(), here);
    core_.code_changed(address, static_cast<uint32_t>(bytes.size()));
    return true;
  }
  Halt run_for(uint64_t cycles) override { return halt_of(core_.run_until(core_.cycle() + cycles)); }
  Halt step() override { return halt_of(core_.step()); }
  void reset() override { core_.reset(vectors_); }

 private:
  uint8_t* place(uint32_t address, size_t bytes) {
    const MemoryRegion& region = memories_.at(address);
    return detail::inside(region, address, static_cast<uint32_t>(bytes));
  }
  bool system(uint32_t address, std::span<uint8_t> bytes) {
    uint32_t value = 0;
    const auto size = static_cast<uint32_t>(bytes.size());
    if ((size != 1 && size != 2 && size != 4) || !core_.is_system_register(address) || !core_.read_system(address, size, value))
      return false;
    std::memcpy(bytes.data(), &value, size);
    return true;
  }

  Core& core_;
  MemoryMap& memories_;
  uint32_t vectors_;
};

}  // namespace rotorloop::mcu::gdb
