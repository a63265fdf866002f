#include "sim/esc/esc_program.hpp"

#include <fmt/format.h>

#include <cstring>

#include "firmware/core/node/parameter_store.hpp"
#include "firmware/update/application_area.hpp"
#include "host/base/error.hpp"
#include "host/base/toml_file.hpp"
#include "sim/esc/flash_pages.hpp"
#include "sim/mcu/elf/program.hpp"

namespace rotorloop::sim {
namespace {

constexpr std::uint32_t kFlashBase = 0x08000000, kFlashBytes = 128 * 1024, kSramBase = 0x20000000, kSramBytes = 32 * 1024;
constexpr firmware::UpdateLayout kLayout{};
constexpr std::uint32_t kHeaderAt = kFlashBase + kLayout.first_page * FlashPages::kFlashPageBytes;
constexpr std::uint32_t kParameterPage = 62;  // decision 0180
const char* const kRemedy = "build the program of this version with scripts/firmware, and give build/firmware/bin/b_g431b_esc1.elf";

[[noreturn]] void refuse(const EscProgram& p, std::string what) { throw Error({p.elf.generic_string(), std::move(what), "", kRemedy}); }

void load(const mcu::ElfFile& file, EscProgram& p) {
  p.flash.assign(kFlashBytes, 0xFF);
  for (const mcu::ElfSection& s : file.sections) {
    if (s.bytes.empty() || s.load_address < kFlashBase || s.load_address - kFlashBase >= kFlashBytes) continue;
    const std::size_t at = s.load_address - kFlashBase;
    std::memcpy(&p.flash[at], s.bytes.data(), std::min(s.bytes.size(), kFlashBytes - at));
  }
}

void check_header(EscProgram& p) {
  const std::span<const std::uint8_t> head(&p.flash[kHeaderAt - kFlashBase], firmware::kImageFieldBytes);
  const firmware::ImageFault fault = firmware::parse_image(head, p.image);
  if (fault != firmware::ImageFault::none)
    refuse(p, fmt::format("at {:#010x}, where an application begins: {}", kHeaderAt, firmware::image_fault_text(fault)));
  const std::string board(p.image.board.data(), strnlen(p.image.board.data(), p.image.board.size()));
  if (p.image.board != firmware::board_name(p.pins.name.c_str()))
    refuse(p, fmt::format("its header says board \"{}\", this one is \"{}\"", board, p.pins.name));
  FlashPages pages(p.flash, 0);
  if (!firmware::ApplicationArea(pages, kLayout).installed(p.image.board, firmware::kNoKey))
    refuse(p, fmt::format("{} bytes behind its header do not have the CRC {:016x} that it says", p.image.size, p.image.crc));
}

// What a bootloader jumps to; a stub at the start of the flash is for chips that have none.
void check_vectors(EscProgram& p) {
  p.vector_table = kHeaderAt + firmware::kImageHeaderBytes;
  std::array<std::uint32_t, 2> table{};
  std::memcpy(table.data(), &p.flash[p.vector_table - kFlashBase], sizeof table);
  const bool stack = table[0] % 8 == 0 && table[0] > kSramBase && table[0] <= kSramBase + kSramBytes;
  const bool reset = table[1] % 2 == 1 && table[1] >= kHeaderAt && table[1] - kFlashBase < kFlashBytes;
  if (!stack || !reset)
    refuse(p, fmt::format("behind its header, at {:#010x}, there is no vector table: stack pointer {:#010x}, reset vector {:#010x}",
                          p.vector_table, table[0], table[1]));
}

}  // namespace

std::string EscProgram::text() const {
  return fmt::format("{} {}.{}, commit {:08x}, CRC {:016x}", elf.filename().generic_string(), image.major, image.minor, image.vcs_commit,
                     image.crc);
}

EscProgram read_esc_program(const std::filesystem::path& elf, const std::filesystem::path& board) {
  EscProgram p;
  p.elf = elf;
  p.pins = mcu::read_board(TomlFile::read(board));
  const mcu::ElfFile file = mcu::read_elf(elf);
  mcu::check_sections(file, mcu::stm32g431_memories());
  mcu::vector_table(file, mcu::stm32g431_memories());  // refuses a file without any
  load(file, p);
  check_header(p);
  check_vectors(p);
  return p;
}

void store_parameters(std::vector<std::uint8_t>& flash, const firmware::Parameters& parameters) {
  FlashPages pages(flash, kParameterPage);
  if (!firmware::ParameterStore(pages).save(parameters))
    throw Error({"emulated ESC", "its parameters do not fit into the flash", "", "this is a mistake in rotorloop: please report it"});
}

}  // namespace rotorloop::sim
