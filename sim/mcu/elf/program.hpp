// Does a program fit a chip: every section inside of a memory, an entry in flash, a vector table with a stack pointer, no two files on one
// address. What does not fit is refused with file, address and remedy.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "sim/mcu/elf/elf_file.hpp"

namespace rotorloop::mcu {

struct ProgramMemory {
  std::string name;
  uint32_t base = 0, size_bytes = 0;
  bool flash = false;  // keeps its bytes without power; others hold the stack
  bool holds(uint32_t address, uint32_t bytes) const { return address >= base && uint64_t{address - base} + bytes <= size_bytes; }
};

// STM32G431xB: flash of 128 KB, SRAM1 and SRAM2 with CCM behind them in one piece, and CCM again where code runs without wait states.
// Source: RM0440, section 2.2 (memory organization), DS12589.
std::span<const ProgramMemory> stm32g431_memories();

struct VectorTable {
  uint32_t address = 0;
  uint32_t stack_pointer = 0;
  std::vector<uint32_t> vectors;  // from exception 1 (reset) on
};

// Throws Error: a section outside of all memories, bytes whose place at power-up is none, entry outside of flash.
void check_sections(const ElfFile& file, std::span<const ProgramMemory> memories);
// The table in the section called .isr_vector or .vectors, at the start of one whose second word is the entry, or else at the lowest flash
// address of the file. Throws Error: no stack pointer in its first word, or a reset vector that is no Thumb address in a memory.
VectorTable vector_table(const ElfFile& file, std::span<const ProgramMemory> memories);
// Throws Error: two files want the same bytes (as a bootloader and an application must not).
void check_overlap(std::span<const ElfFile> files);

// What is at an exception number: "SysTick", "interrupt 21".
std::string exception_name(uint32_t exception);

}  // namespace rotorloop::mcu
