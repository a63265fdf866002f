// ELF files as a linker would write them, right or wrong, for tests.
#pragma once
#include <unistd.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace rotorloop::mcu::testing {

struct SectionBytes {
  std::string name;
  uint32_t address = 0, load_address = 0;
  std::vector<uint8_t> bytes;
  uint32_t cleared_bytes = 0;  // of .bss
  uint32_t flags = 6;          // takes memory, holds code
};
struct SymbolBytes {
  std::string name;
  uint32_t address = 0, size = 0;
  uint8_t info = 0x12;  // global function
};

class ElfBytes {
 public:
  uint16_t machine = 40, type = 2;
  uint8_t bits = 1, order = 1;
  uint32_t entry = 0x08000009;
  std::vector<SectionBytes> sections;
  std::vector<SymbolBytes> symbols;

  std::vector<uint8_t> bytes() const {
    std::vector<uint8_t> names(1), text(1), symbol_table(16), body, headers(40), programs;
    const auto name = [](std::vector<uint8_t>& pool, const std::string& s) {
      const auto at = static_cast<uint32_t>(pool.size());
      pool.insert(pool.end(), s.begin(), s.end());
      pool.push_back(0);
      return at;
    };
    const auto words = [](std::vector<uint8_t>& to, std::initializer_list<uint32_t> values) {
      for (const uint32_t v : values)
        for (int i = 0; i < 4; ++i) to.push_back(static_cast<uint8_t>(v >> 8 * i));
    };
    const auto body_at = static_cast<uint32_t>(52 + 32 * sections.size());
    for (const SectionBytes& s : sections) {
      const auto offset = static_cast<uint32_t>(body_at + body.size()), size = static_cast<uint32_t>(s.bytes.size());
      words(headers, {name(names, s.name), size > 0 ? 1u : 8u, s.flags, s.address, offset, size + s.cleared_bytes, 0, 0, 4, 0});
      words(programs, {1, offset, s.address, s.load_address, size, size + s.cleared_bytes, 5, 4});
      body.insert(body.end(), s.bytes.begin(), s.bytes.end());
    }
    for (const SymbolBytes& s : symbols) {
      words(symbol_table, {name(text, s.name), s.address, s.size});
      symbol_table.insert(symbol_table.end(), {s.info, 0, static_cast<uint8_t>((s.info & 15) == 4 ? 0xF1 : 1), 0});
    }
    const auto count = static_cast<uint32_t>(sections.size());
    const auto add = [&](const std::vector<uint8_t>& part, const char* called, uint32_t kind, uint32_t link) {
      words(headers, {name(names, called), kind, 0, 0, static_cast<uint32_t>(body_at + body.size()), static_cast<uint32_t>(part.size()),
                      link, 0, 4, 16});
      body.insert(body.end(), part.begin(), part.end());
    };
    add(symbol_table, ".symtab", 2, count + 2);
    add(text, ".strtab", 3, 0);
    const uint32_t own_name = name(names, ".shstrtab");
    words(headers, {own_name, 3, 0, 0, static_cast<uint32_t>(body_at + body.size()), static_cast<uint32_t>(names.size()), 0, 0, 1, 0});
    body.insert(body.end(), names.begin(), names.end());
    std::vector<uint8_t> file{0x7F, 'E', 'L', 'F', bits, order, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    words(file, {type | uint32_t{machine} << 16, 1, entry, 52, static_cast<uint32_t>(body_at + body.size()), 0x05000400, 52 | 32u << 16,
                 count | 40u << 16, (count + 4) | (count + 3) << 16});
    file.insert(file.end(), programs.begin(), programs.end());
    file.insert(file.end(), body.begin(), body.end());
    file.insert(file.end(), headers.begin(), headers.end());
    return file;
  }
};

// Words of a vector table, then `NOP`s.
inline std::vector<uint8_t> little_endian(std::initializer_list<uint32_t> words) {
  std::vector<uint8_t> bytes;
  for (const uint32_t w : words)
    for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<uint8_t>(w >> 8 * i));
  return bytes;
}

class FileOnDisk {
 public:
  FileOnDisk(const std::string& name, const std::vector<uint8_t>& bytes)
      : path(std::filesystem::temp_directory_path() / ("rotorloop_elf_" + std::to_string(getpid()) + "_" + name)) {
    std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  ~FileOnDisk() { std::filesystem::remove(path); }
  FileOnDisk(const FileOnDisk&) = delete;
  FileOnDisk& operator=(const FileOnDisk&) = delete;
  std::filesystem::path path;
};

}  // namespace rotorloop::mcu::testing
