// Fetches, loads and stores that take the long way: bus, MPU, alignment, private peripheral bus.
#include <algorithm>

#include "sim/mcu/core/core.hpp"
#include "sim/mcu/core/decode.hpp"
#include "sim/mcu/core/handlers.hpp"

namespace rotorloop::mcu {
namespace {

// The default memory map (B3.1): Device and Strongly-ordered memory takes no unaligned access.
bool is_device(uint32_t address) {
  const uint32_t block = address >> 29;
  return block == 2 || block == 5 || block == 6 || block == 7;
}

bool is_private_bus(uint32_t address) { return address >> 20 == 0xE00; }

}  // namespace

bool Core::raw_access(uint32_t address, uint32_t bytes, uint32_t& value, bool write) {
  MemoryRegion& region = memories_->at(address);
  uint8_t* here = detail::inside(region, address, bytes);
  if (here == nullptr || (write && !region.writable)) {
    if (is_system_register(address) && (write ? write_system(address, bytes, value) : read_system(address, bytes, value))) return true;
    return write ? bus_->write(address, bytes, value) : bus_->read(address, bytes, value);
  }
  if (write) {
    std::memcpy(here, &value, bytes);
    if (region.holds_code(address)) forget_decoded(address);
  } else {
    value = 0;
    std::memcpy(&value, here, bytes);
    if (region.behind_flash_port) wait_for_flash_data(address);
  }
  return true;
}

// Vectors are read beside the stacking, whose cycles cover them.
bool Core::read_vector(uint32_t address, uint32_t& value) {
  const uint8_t* here = detail::inside(memories_->at(address), address, 4);
  if (here == nullptr) return bus_->read(address, 4, value);
  std::memcpy(&value, here, 4);
  return true;
}

bool Core::slow_access(const Op& op, uint32_t address, uint32_t bytes, uint32_t& value, bool write, bool as_privileged) {
  const Access kind = write ? Access::write : Access::read;
  if ((address & (bytes - 1)) != 0 && ((state.scb.ccr & 8) != 0 || is_device(address))) {
    usage_fault(op, 1u << 24);  // UNALIGNED
    return false;
  }
  const bool in_one = (address & (bytes - 1)) == 0;  // a word that is aligned lies in one region
  if (!mpu_allows(address, kind, as_privileged) || (!in_one && !mpu_allows(address + bytes - 1, kind, as_privileged))) {
    memory_fault(op, address, kind);
    return false;
  }
  if (is_private_bus(address) && !as_privileged && address != 0xE000EF00) {
    bus_fault(op, address, kind);
    return false;
  }
  tell_watches(address, bytes, kind);
  if (write) value &= bytes == 4 ? ~0u : (1u << (8 * bytes)) - 1;
  if (raw_access(address, bytes, value, write)) return true;
  // A store is buffered: its fault comes after it, and without an address. Not so in the private bus, or with the buffer disabled.
  if (write && !is_private_bus(address) && (state.scb.actlr & 2) == 0 && execution_priority() >= 0) {
    pend_imprecise_bus_fault();
    return true;
  }
  if ((state.scb.ccr & 0x100) != 0 && execution_priority() < 0) {  // BFHFNMIGN
    if (!write) value = 0;
    return true;
  }
  bus_fault(op, address, kind);
  return false;
}

bool Core::access_unprivileged(const Op& op, uint32_t address, uint32_t bytes, uint32_t& value, bool write) {
  return slow_access(op, address, bytes, value, write, false);
}

bool Core::fetch16(const Op& op, uint32_t address, uint32_t& value) {
  if (!mpu_allows(address, Access::fetch, privileged())) {
    memory_fault(op, address, Access::fetch);
    return false;
  }
  MemoryRegion& region = memories_->at(address);
  const uint8_t* here = detail::inside(region, address, 2);
  if (here == nullptr) {
    bus_fault(op, address, Access::fetch);
    return false;
  }
  if (!region.holds_code(address) || !region.holds_code(address - 3)) {  // a word that begins three bytes before reaches in
    const uint32_t from = std::max(address, region.base + 3) - 3, to = address + 2;
    const bool first = region.code_bytes == 0;
    const uint32_t end = first ? to : std::max(to, region.code_from + region.code_bytes);
    region.code_from = first ? from : std::min(from, region.code_from);
    region.code_bytes = end - region.code_from;
  }
  tell_watches(address, 2, Access::fetch);
  uint16_t halfword = 0;
  std::memcpy(&halfword, here, 2);
  value = halfword;
  return true;
}

void Core::decode_at(uint32_t pc) {
  Op op;
  op.bytes = 0;  // a fetch that fails returns to where it was
  op.tag = context_ | pc;
  state.it_of_instruction = state.it;
  uint32_t first = 0, second = 0;
  if (!fetch16(op, pc, first)) return;
  op.bytes = 2;
  if (first >> 11 >= 0x1D) {
    op.bytes = 0;
    if (!fetch16(op, pc + 2, second)) return;
    decode32(op, first, second, pc);
  } else {
    decode16(op, first, pc, (op.tag & kTagInIt) != 0);
  }
  op.last_word = (pc + op.bytes - 2) >> 3;
  slot(pc) = op;
}

}  // namespace rotorloop::mcu
