// Registers in the order and with the widths that target.xml gives them (gdb manual, "ARM Features").
#pragma once
#include <cstdint>
#include <string>

#include "sim/mcu/core/core.hpp"

namespace rotorloop::mcu::gdb {

std::string target_xml();
uint32_t register_count();
uint32_t register_bytes(uint32_t n);  // 4; 8 for D0 to D15
uint64_t read_register(const Core& core, uint32_t n);
void write_register(Core& core, uint32_t n, uint64_t value);

}  // namespace rotorloop::mcu::gdb
