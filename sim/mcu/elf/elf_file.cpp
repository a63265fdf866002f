#include "sim/mcu/elf/elf_file.hpp"

#include <cxxabi.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <span>

#include "host/base/error.hpp"

namespace rotorloop::mcu {
namespace {

// Elf32_Ehdr, Elf32_Phdr, Elf32_Shdr and Elf32_Sym, field by field.
struct Header {
  uint8_t identification[16];
  uint16_t type, machine;
  uint32_t version, entry, program_headers, section_headers, flags;
  uint16_t header_bytes, program_header_bytes, program_header_count, section_header_bytes, section_header_count, name_section;
};
struct ProgramHeader {
  uint32_t type, offset, run_address, load_address, file_bytes, memory_bytes, flags, alignment;
};
struct SectionHeader {
  uint32_t name, type, flags, address, offset, size, link, info, alignment, entry_bytes;
};
struct Symbol {
  uint32_t name, value, size;
  uint8_t info, other;
  uint16_t section;
};
static_assert(sizeof(Header) == 52 && sizeof(ProgramHeader) == 32 && sizeof(SectionHeader) == 40 && sizeof(Symbol) == 16);

constexpr uint16_t kExecutable = 2, kArm = 40;
constexpr uint32_t kLoad = 1, kExecuteFlag = 1, kWriteFlag = 2;
constexpr uint32_t kSymbolTable = 2, kNoBits = 8, kAllocated = 2, kWritableSection = 1, kExecutableSection = 4;
constexpr uint8_t kObject = 1, kFunction = 2, kFile = 4;

class Reader {
 public:
  explicit Reader(const std::filesystem::path& path) : path_(path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) refuse("cannot be read", "give the .elf file that the linker wrote");
    bytes_.assign(std::istreambuf_iterator<char>(file), {});
    if (bytes_.size() < 4 || std::memcmp(bytes_.data(), "\177ELF", 4) != 0)
      refuse("is no ELF file", "give the .elf that the linker wrote, not a .bin or .hex made of it");
    header_ = at<Header>(0);
    check_header();
  }

  ElfFile read() {
    ElfFile file{path_, header_.entry, {}, {}};
    programs_ = table<ProgramHeader>(header_.program_headers, header_.program_header_count);
    sections_ = table<SectionHeader>(header_.section_headers, header_.section_header_count);
    read_sections(file);
    if (file.sections.empty()) read_segments(file);
    if (file.sections.empty()) refuse("has nothing to load", "link it with a linker script that places code in flash");
    for (const SectionHeader& s : sections_)
      if (s.type == kSymbolTable) read_symbols(s, file);
    std::ranges::stable_sort(file.sections, {}, &ElfSection::run_address);
    std::ranges::stable_sort(file.symbols, {}, &ElfSymbol::address);
    return file;
  }

 private:
  [[noreturn]] void refuse(std::string what, std::string remedy) const {
    throw Error({path_.generic_string(), std::move(what), "", std::move(remedy)});
  }

  void check_header() const {
    const uint8_t bits = header_.identification[4], order = header_.identification[5];
    if (header_.machine != kArm)
      refuse(fmt::format("is not for ARM (machine {} of its header, ARM is 40)", header_.machine),
             "build it with a compiler for the chip, as arm-none-eabi-gcc");
    if (bits != 1 || order != 1) refuse("is not 32 bits, little endian", "build it for a Cortex-M4: -mcpu=cortex-m4 -mthumb");
    if (header_.type != kExecutable)
      refuse(fmt::format("is not linked (type {} of its header, a program is 2)", header_.type),
             "link it; an object file has no addresses yet");
  }

  std::span<const uint8_t> part(uint64_t offset, uint64_t size) const {
    if (offset + size > bytes_.size())
      refuse(fmt::format("is cut short: {} bytes, and it speaks of bytes {} to {}", bytes_.size(), offset, offset + size),
             "copy it again from where it was built");
    return std::span(bytes_).subspan(offset, size);
  }
  template <class T>
  T at(uint64_t offset) const {
    T value;
    std::memcpy(&value, part(offset, sizeof value).data(), sizeof value);
    return value;
  }
  template <class T>
  std::vector<T> table(uint64_t offset, uint32_t count) const {
    std::vector<T> rows(count);
    if (count > 0) std::memcpy(rows.data(), part(offset, count * sizeof(T)).data(), count * sizeof(T));
    return rows;
  }
  std::string text(const SectionHeader& names, uint32_t offset) const {
    const auto all = part(names.offset, names.size);
    if (offset >= all.size()) return "";
    const auto* first = reinterpret_cast<const char*>(all.data()) + offset;
    return {first, strnlen(first, all.size() - offset)};
  }
  std::vector<uint8_t> copy(uint64_t offset, uint64_t size) const {
    const auto from = part(offset, size);
    return {from.begin(), from.end()};
  }

  // Segments may begin with the headers of the file itself, which no linker script asked for: sections say what is meant.
  void read_sections(ElfFile& file) const {
    for (const SectionHeader& s : sections_) {
      if ((s.flags & kAllocated) == 0 || s.size == 0) continue;
      const bool loaded = s.type != kNoBits;
      ElfSection section{text(sections_.at(header_.name_section), s.name),
                         s.address,
                         s.address,
                         s.size,
                         {},
                         (s.flags & kExecutableSection) != 0,
                         (s.flags & kWritableSection) != 0};
      if (loaded) section.bytes = copy(s.offset, s.size);
      for (const ProgramHeader& p : programs_)
        if (loaded && p.type == kLoad && s.address - p.run_address < p.file_bytes)
          section.load_address = p.load_address + (s.address - p.run_address);
      file.sections.push_back(std::move(section));
    }
  }

  void read_segments(ElfFile& file) const {
    for (const ProgramHeader& p : programs_) {
      if (p.type != kLoad || p.memory_bytes == 0) continue;
      file.sections.push_back({fmt::format("segment {:#010x}", p.run_address), p.load_address, p.run_address, p.memory_bytes,
                               copy(p.offset, p.file_bytes), (p.flags & kExecuteFlag) != 0, (p.flags & kWriteFlag) != 0});
    }
  }

  void read_symbols(const SectionHeader& symbols, ElfFile& file) const {
    const SectionHeader& names = sections_.at(std::min<size_t>(symbols.link, sections_.size() - 1));
    std::string source;
    for (const Symbol& s : table<Symbol>(symbols.offset, symbols.size / sizeof(Symbol))) {
      const uint8_t type = s.info & 15;
      if (type == kFile) source = text(names, s.name);
      if ((type != kFunction && type != kObject) || s.size == 0 || s.section == 0) continue;
      const bool local = s.info >> 4 == 0, function = type == kFunction;
      file.symbols.push_back({function ? s.value & ~1u : s.value, s.size, demangled(text(names, s.name)), local ? source : "", function});
    }
  }

  static std::string demangled(const std::string& name) {
    int status = 0;
    const std::unique_ptr<char, void (*)(void*)> readable(abi::__cxa_demangle(name.c_str(), nullptr, nullptr, &status), std::free);
    return status == 0 && name.starts_with("_Z") ? readable.get() : name;
  }

  std::filesystem::path path_;
  std::vector<uint8_t> bytes_;
  Header header_{};
  std::vector<ProgramHeader> programs_;
  std::vector<SectionHeader> sections_;
};

}  // namespace

const ElfSymbol* ElfFile::symbol_at(uint32_t address) const {
  auto after = std::ranges::upper_bound(symbols, address, {}, &ElfSymbol::address);
  const ElfSymbol* found = nullptr;
  // Symbols may lie inside of others (a label in assembly): the nearest one that reaches so far.
  while (after != symbols.begin() && found == nullptr) {
    --after;
    if (address - after->address < after->size_bytes) found = &*after;
    if (address - after->address > 0x10000) break;
  }
  return found;
}

std::string ElfFile::place(uint32_t address) const {
  const ElfSymbol* symbol = symbol_at(address & ~1u);
  if (symbol == nullptr) return fmt::format("{:#010x}", address);
  const uint32_t inside = (address & ~1u) - symbol->address;
  return inside == 0 ? symbol->name : fmt::format("{} + {:#x}", symbol->name, inside);
}

ElfFile read_elf(const std::filesystem::path& path) { return Reader(path).read(); }

}  // namespace rotorloop::mcu
