// The whole chip under a debugger. Reads of registers are reads: they clear what reading clears.
#pragma once
#include <algorithm>

#include "sim/mcu/g431/chip.hpp"
#include "sim/mcu/gdb/target.hpp"

namespace rotorloop::mcu::gdb {

class ChipTarget : public DebugTarget {
 public:
  explicit ChipTarget(g431::Chip& chip) : chip_(chip) {}
  Core& core() override { return chip_.core(); }
  bool read(uint32_t address, std::span<uint8_t> bytes) override {
    const auto size = static_cast<uint32_t>(bytes.size());
    if (const uint8_t* here = chip_.memory(address, size)) {
      std::copy_n(here, size, bytes.begin());
      return true;
    }
    return in_words(address, size, [&](uint32_t at, uint32_t width, uint32_t offset) {
      uint32_t value = 0;
      if (!access(at, width, value, false)) return false;
      std::memcpy(&bytes[offset], &value, width);
      return true;
    });
  }
  bool write(uint32_t address, std::span<const uint8_t> bytes) override {
    const auto size = static_cast<uint32_t>(bytes.size());
    if (uint8_t* here = chip_.memory(address, size)) {
      std::copy(bytes.begin(), bytes.end(), here);
      chip_.core().code_changed(address, size);
      chip_.core().restored();
      return true;
    }
    return in_words(address, size, [&](uint32_t at, uint32_t width, uint32_t offset) {
      uint32_t value = 0;
      std::memcpy(&value, &bytes[offset], width);
      return access(at, width, value, true);
    });
  }
  Halt run_for(uint64_t cycles) override { return halt(chip_.run_until(chip_.cycle() + cycles)); }
  Halt step() override {
    const uint64_t executed = core().state.instructions;
    for (int i = 0; i < 100; ++i) {  // an entry or return takes several
      const Halt h = run_for(1);
      if (h != Halt::none || core().state.instructions != executed || core().state.sleeping) return h;
    }
    return Halt::none;
  }
  void reset() override { chip_.power_up(); }
  std::string message() const override { return g431::text(chip_.refused()); }

 protected:
  static Halt halt(g431::End end) {
    switch (end) {
      case g431::End::refused:
        return Halt::error;
      case g431::End::locked_up:
        return Halt::locked_up;
      case g431::End::breakpoint:
        return Halt::breakpoint;
      case g431::End::stopped:
        return Halt::stopped;
      default:
        return Halt::none;
    }
  }

 private:
  template <class Access>
  static bool in_words(uint32_t address, uint32_t size, Access&& access) {
    for (uint32_t done = 0; done < size;) {
      const uint32_t at = address + done, left = size - done, width = at % 4 == 0 && left >= 4 ? 4 : at % 2 == 0 && left >= 2 ? 2 : 1;
      if (!access(at, width, done)) return false;
      done += width;
    }
    return true;
  }
  // What the chip would refuse a program, it refuses a debugger without ending the run.
  bool access(uint32_t address, uint32_t width, uint32_t& value, bool write) {
    Core& c = core();
    if (c.is_system_register(address)) return write ? c.write_system(address, width, value) : c.read_system(address, width, value);
    const bool lenient = chip_.lenient;
    chip_.lenient = true;
    const uint64_t refused = chip_.refused_count();
    const bool there = write ? chip_.write(address, width, value) : chip_.read(address, width, value);
    chip_.lenient = lenient;
    return there && chip_.refused_count() == refused;
  }

  g431::Chip& chip_;
};

}  // namespace rotorloop::mcu::gdb
