// What an ELF file for a microcontroller says: bytes and their addresses, and the names of functions. Layout of the file: TIS ELF 1.2 and
// "ELF for the Arm Architecture" (IHI 0044).
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace rotorloop::mcu {

// One section that takes memory of the chip.
struct ElfSection {
  std::string name;
  uint32_t load_address = 0;   // where its bytes lie at power-up
  uint32_t run_address = 0;    // where the program has it; start-up code copies where the two differ
  uint32_t size_bytes = 0;     // at run_address
  std::vector<uint8_t> bytes;  // empty: nothing is loaded (.bss, the stack)
  bool executable = false, writable = false;
};

struct ElfSymbol {
  uint32_t address = 0;  // of a function: without the bit that says Thumb
  uint32_t size_bytes = 0;
  std::string name;         // demangled
  std::string source_file;  // of static functions only, as the file says no more; may be empty
  bool function = false;
};

struct ElfFile {
  std::filesystem::path path;
  uint32_t entry = 0;                // as in the file: bit 0 says Thumb
  std::vector<ElfSection> sections;  // by run address
  std::vector<ElfSymbol> symbols;    // functions and objects with a size, by address

  // The function or object that holds an address; null: none.
  const ElfSymbol* symbol_at(uint32_t address) const;
  // "name + 0x12", or the address where no symbol holds it.
  std::string place(uint32_t address) const;
};

// Throws Error (ExitCode::usage): cannot be read, no ELF, not 32 bits little endian, not for ARM, not an executable, cut short.
ElfFile read_elf(const std::filesystem::path& path);

}  // namespace rotorloop::mcu
