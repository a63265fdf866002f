// The memory protection unit: eight regions with subregions over the default memory map (B3.5).
#include <algorithm>
#include <cstring>

#include "sim/mcu/core/core.hpp"

namespace rotorloop::mcu {
namespace {

constexpr uint32_t kMpuEnable = 1, kHardFaultAndNmi = 2, kPrivilegedDefault = 4;

// Execute never in the default map: peripherals, devices and the system space (B3.1).
bool default_never_executes(uint32_t address) {
  const uint32_t block = address >> 29;
  return block == 2 || block >= 5;
}

// What access permission AP grants (B3.5.5, table B3-15).
bool permits(uint32_t ap, Access kind, bool as_privileged) {
  const bool writes = kind == Access::write;
  switch (ap) {
    case 1:
      return as_privileged;
    case 2:
      return as_privileged || !writes;
    case 3:
      return true;
    case 5:
      return as_privileged && !writes;
    case 6:
    case 7:
      return !writes;
    default:
      return false;
  }
}

bool region_holds(const MpuRegion& region, uint32_t address) {
  const uint32_t bits = (region.rasr >> 1 & 31) + 1;  // the region has 2^bits bytes
  if ((region.rasr & 1) == 0 || bits < 5) return false;
  if (bits < 32 && ((address ^ region.rbar) >> bits) != 0) return false;
  if (bits < 8) return true;  // too small for subregions
  const uint32_t subregion = address >> (bits - 3) & 7;
  return (region.rasr >> (8 + subregion) & 1) == 0;
}

}  // namespace

bool Core::mpu_rule(uint32_t address, Access kind, bool as_privileged) const {
  for (uint32_t i = 8; i-- > 0;) {  // the highest number counts where regions overlap
    const MpuRegion& region = state.mpu.regions[i];
    if (!region_holds(region, address)) continue;
    if (kind == Access::fetch && (region.rasr >> 28 & 1) != 0) return false;
    return permits(region.rasr >> 24 & 7, kind, as_privileged);
  }
  return (state.mpu.ctrl & kPrivilegedDefault) != 0 && as_privileged && !(kind == Access::fetch && default_never_executes(address));
}

bool Core::mpu_allows(uint32_t address, Access kind, bool as_privileged) const {
  const bool never_here = kind == Access::fetch && default_never_executes(address);
  if (never_here && address >> 29 == 7) return false;
  if ((state.mpu.ctrl & kMpuEnable) == 0 || address >> 20 == 0xE00) return !never_here;
  const bool below_faults = state.faultmask != 0 || state.nvic.active.has(kHardFault) || state.nvic.active.has(kNmi);
  if (below_faults && (state.mpu.ctrl & kHardFaultAndNmi) == 0) return !never_here;
  if (as_privileged && (state.mpu.ctrl & kPrivilegedDefault) != 0 && !(address >= checks_.from && address < checks_.to)) return !never_here;
  return mpu_rule(address, kind, as_privileged);
}

// A privileged access outside of all regions has the default map (PRIVDEFENA), which forbids no data: the short way does for it.
void Core::choose_checked() {
  const bool mpu = (state.mpu.ctrl & kMpuEnable) != 0;
  const bool no_default = mpu && ((state.mpu.ctrl & kPrivilegedDefault) == 0 || (state.control & 1) != 0);
  const bool all = no_default || (state.scb.ccr & 8) != 0 || watches_[0] != nullptr || watches_[1] != nullptr;
  if (all == checks_.all && std::memcmp(&checks_.mpu, &state.mpu, sizeof state.mpu) == 0) return;
  checks_ = {state.mpu, all, ~uint64_t{0}, 0};
  for (const MpuRegion& r : state.mpu.regions) {
    if ((r.rasr & 1) == 0) continue;
    const uint64_t bytes = uint64_t{2} << (r.rasr >> 1 & 31), base = r.rbar & ~(bytes - 1);
    checks_.from = std::min(checks_.from, base);
    checks_.to = std::max(checks_.to, base + bytes);
  }
  for (MemoryRegion& memory : memories_->all()) {
    memory.checked_from = memory.base;
    memory.checked_bytes = all ? memory.size_bytes : 0;
    if (all || !mpu) continue;
    uint64_t from = uint64_t{memory.base} + memory.size_bytes, to = memory.base;
    for (const MpuRegion& r : state.mpu.regions) {
      const uint64_t bytes = uint64_t{2} << (r.rasr >> 1 & 31), base = r.rbar & ~(bytes - 1);
      if ((r.rasr & 1) == 0 || base >= uint64_t{memory.base} + memory.size_bytes || base + bytes <= memory.base) continue;
      from = std::min(from, std::max(base, uint64_t{memory.base} + 3) - 3);  // a word that begins up to three bytes before reaches in
      to = std::max(to, base + bytes);
    }
    if (from < to) {
      memory.checked_from = static_cast<uint32_t>(from);

      memory.checked_bytes = static_cast<uint32_t>(std::min(to - from, uint64_t{0xFFFFFFFF}));
    }
  }
}

void Core::privilege_changed() {
  update_context();
  choose_checked();
}

void Core::mpu_changed() {
  context_ += kTagGeneration;
  system_register_changed();
}

bool Core::read_mpu(uint32_t offset, uint32_t& value) const {
  const MpuState& m = state.mpu;
  const uint32_t index = m.rnr & 7;
  switch (offset) {
    case 0x90:
      value = 0x800;
      return true;  // eight regions
    case 0x94:
      value = m.ctrl;
      return true;
    case 0x98:
      value = m.rnr;
      return true;
    case 0x9C:
    case 0xA4:
    case 0xAC:
    case 0xB4:
      value = (m.regions[index].rbar & ~0x1Fu) | index;
      return true;
    case 0xA0:
    case 0xA8:
    case 0xB0:
    case 0xB8:
      value = m.regions[index].rasr;
      return true;
    default:
      return false;
  }
}

bool Core::write_mpu(uint32_t offset, uint32_t value) {
  MpuState& m = state.mpu;
  if (offset == 0x90) return true;
  if (offset > 0xB8) return false;
  if (offset == 0x94) {
    m.ctrl = value & 7;
  } else if (offset == 0x98) {
    m.rnr = value & 0xFF;
  } else if ((offset & 4) != 0) {
    if ((value & 0x10) != 0) m.rnr = value & 15;  // VALID: the number comes with the address
    m.regions[m.rnr & 7].rbar = value & ~0x1Fu;
  } else {
    m.regions[m.rnr & 7].rasr = value;
  }
  mpu_changed();
  return true;
}

}  // namespace rotorloop::mcu
