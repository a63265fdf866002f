#include "sim/mcu/elf/program.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <iterator>

#include "host/base/error.hpp"

namespace rotorloop::mcu {
namespace {

constexpr uint32_t kMostVectors = 16 + 102;  // exceptions and interrupts of the STM32G4 (RM0440, table 97)

[[noreturn]] void refuse(const ElfFile& file, std::string what, std::string remedy) {
  throw Error({file.path.generic_string(), std::move(what), "", std::move(remedy)});
}

const ProgramMemory* memory_with(std::span<const ProgramMemory> memories, uint32_t address, uint32_t bytes) {
  const auto m = std::ranges::find_if(memories, [&](const ProgramMemory& x) { return x.holds(address, bytes); });
  return m == memories.end() ? nullptr : &*m;
}

std::string list(std::span<const ProgramMemory> memories) {
  std::string text;
  for (const ProgramMemory& m : memories)
    text += fmt::format("{}{} {:#010x} to {:#010x}", text.empty() ? "" : ", ", m.name, m.base, m.base + m.size_bytes - 1);
  return text;
}

uint32_t word(const ElfSection& section, uint32_t offset) {
  uint32_t value = 0;
  std::memcpy(&value, section.bytes.data() + offset, sizeof value);
  return value;
}

const ElfSection& vector_section(const ElfFile& file, std::span<const ProgramMemory> memories) {
  const ElfSection* lowest = nullptr;
  for (const ElfSection& s : file.sections) {
    const ProgramMemory* memory = memory_with(memories, s.load_address, 1);
    if (s.bytes.size() < 8 || memory == nullptr || !memory->flash) continue;
    // By its name, or as the one whose reset vector is the file's entry: what lies before it in flash may be settings.
    if (s.name == ".isr_vector" || s.name == ".vectors" || (file.entry % 2 == 1 && word(s, 4) == file.entry)) return s;
    if (lowest == nullptr || s.load_address < lowest->load_address) lowest = &s;
  }
  if (lowest == nullptr)
    refuse(file, "has no bytes in flash: nothing to start from", "place the vector table at the start of flash in its linker script");
  return *lowest;
}

}  // namespace

std::span<const ProgramMemory> stm32g431_memories() {
  static const std::array<ProgramMemory, 4> memories{{{"flash", 0x08000000, 0x20000, true},
                                                      {"SRAM", 0x20000000, 0x8000, false},
                                                      {"CCM", 0x10000000, 0x2800, false},
                                                      {"option bytes", 0x1FFF7800, 0x30, true}}};
  return memories;
}

void check_sections(const ElfFile& file, std::span<const ProgramMemory> memories) {
  for (const ElfSection& s : file.sections) {
    const auto loaded = static_cast<uint32_t>(s.bytes.size());
    const bool lost = loaded > 0 && memory_with(memories, s.load_address, loaded) == nullptr;
    if (!lost && memory_with(memories, s.run_address, s.size_bytes) != nullptr) continue;
    const uint32_t address = lost ? s.load_address : s.run_address;
    refuse(file,
           fmt::format("section {} is at {:#010x}, {} bytes: outside of the chip's memories ({})", s.name, address, s.size_bytes,
                       list(memories)),
           "link it for this chip: MEMORY in its linker script has other addresses or sizes");
  }
  const ProgramMemory* start = memory_with(memories, file.entry & ~1u, 2);
  if (start == nullptr || !start->flash)
    refuse(file, fmt::format("its entry is {:#010x}, which is not in flash", file.entry),
           "name the reset handler by ENTRY() in its linker script");
}

VectorTable vector_table(const ElfFile& file, std::span<const ProgramMemory> memories) {
  const ElfSection& section = vector_section(file, memories);
  VectorTable table{section.load_address, word(section, 0), {}};
  const bool in_ram = std::ranges::any_of(memories, [&](const ProgramMemory& m) {
    return !m.flash && table.stack_pointer > m.base && table.stack_pointer - m.base <= m.size_bytes;
  });
  if (!in_ram || table.stack_pointer % 4 != 0)
    refuse(file,
           fmt::format("no stack pointer at {:#010x}, the start of {}: {:#010x} is no multiple of 4 in a RAM", table.address, section.name,
                       table.stack_pointer),
           "put the vector table first: initial stack pointer, then the reset handler");
  const uint32_t reset = word(section, 4);
  if (reset % 2 == 0 || memory_with(memories, reset & ~1u, 2) == nullptr)
    refuse(file,
           fmt::format("its reset vector at {:#010x} is {:#010x}: not the odd address of a Thumb instruction in a memory",
                       table.address + 4, reset),
           "put the reset handler's address into the second word of the vector table");
  const ElfSymbol* symbol = file.symbol_at(table.address);
  const uint32_t named = symbol != nullptr && symbol->address == table.address && symbol->size_bytes > 8 ? symbol->size_bytes : UINT32_MAX;
  const uint32_t end = std::min({named, static_cast<uint32_t>(section.bytes.size()), kMostVectors * 4});
  for (uint32_t offset = 4; offset + 4 <= end; offset += 4) {
    const uint32_t vector = word(section, offset);
    if (vector != 0 && (vector % 2 == 0 || memory_with(memories, vector & ~1u, 2) == nullptr)) break;
    table.vectors.push_back(vector);
  }
  while (table.vectors.back() == 0) table.vectors.pop_back();
  return table;
}

void check_overlap(std::span<const ElfFile> files) {
  for (size_t i = 0; i < files.size(); ++i)
    for (size_t k = 0; k < i; ++k)
      for (const ElfSection& a : files[i].sections)
        for (const ElfSection& b : files[k].sections) {
          const uint64_t first = std::max(a.load_address, b.load_address);
          const uint64_t end = std::min(uint64_t{a.load_address} + a.bytes.size(), uint64_t{b.load_address} + b.bytes.size());
          if (first < end)
            refuse(files[i],
                   fmt::format("section {} and section {} of {} both want {:#010x} to {:#010x}", a.name, b.name,
                               files[k].path.generic_string(), first, end - 1),
                   "link them for different parts of flash (bootloader first, application behind it)");
        }
}

std::string exception_name(uint32_t exception) {
  static constexpr const char* kNames[] = {"",         "reset",    "NMI",      "HardFault", "MemManage", "BusFault",     "UsageFault",
                                           "reserved", "reserved", "reserved", "reserved",  "SVCall",    "DebugMonitor", "reserved",
                                           "PendSV",   "SysTick"};
  return exception < std::size(kNames) ? kNames[exception] : fmt::format("interrupt {}", exception - 16);
}

}  // namespace rotorloop::mcu
