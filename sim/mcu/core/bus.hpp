// What the core sees of the chip around it: plain memories that it reaches itself, and a bus for everything else.
#pragma once
#include <array>
#include <cstdint>

namespace rotorloop::mcu {

// Everything that is no plain memory: registers of peripherals, writes to flash, addresses where nothing is. All values are little endian
// and right aligned. Called in the order of the program, with Core::cycle() at the end of the instruction's own cost.
class Bus {
 public:
  virtual ~Bus() = default;
  // bytes: 1, 2 or 4; the address may be unaligned only outside of Device memory. False: bus fault.
  virtual bool read(uint32_t address, uint32_t bytes, uint32_t& value) = 0;
  virtual bool write(uint32_t address, uint32_t bytes, uint32_t value) = 0;
};

// A memory that loads and fetches reach without the bus. The bytes belong to the caller and outlive the core.
struct MemoryRegion {
  uint8_t* bytes = nullptr;
  uint32_t base = 0;
  uint32_t size_bytes = 0;
  bool writable = false;           // false: stores go to the bus (flash)
  bool behind_flash_port = false;  // fetches and loads wait as the flash does (flash_timing.hpp)
  // Loads and stores that begin here are checked one by one; a store that begins here may change what is decoded: set by the core.
  uint32_t checked_from = 0, checked_bytes = 0;
  uint32_t code_from = 0, code_bytes = 0;
  bool holds_code(uint32_t address) const { return address - code_from < code_bytes; }
};

// At most one memory in each block of 16 MB: a load finds it with one look. Two memories that lie beside each other (SRAM and the second
// address of CCM) are one array of the caller.
class MemoryMap {
 public:
  // False, and nothing is changed: the block has a memory already, or the region leaves its block of 16 MB.
  bool add(const MemoryRegion& region) {
    MemoryRegion& place = regions_[region.base >> 24];
    const bool one_block = region.size_bytes > 0 && ((region.base ^ (region.base + (region.size_bytes - 1))) >> 24) == 0;
    if (place.size_bytes != 0 || !one_block || region.bytes == nullptr) return false;
    place = region;
    return true;
  }
  MemoryRegion& at(uint32_t address) { return regions_[address >> 24]; }
  std::array<MemoryRegion, 256>& all() { return regions_; }

 private:
  std::array<MemoryRegion, 256> regions_{};
};

}  // namespace rotorloop::mcu
