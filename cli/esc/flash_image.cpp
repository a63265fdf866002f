#include "cli/esc/flash_image.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "firmware/update/image.hpp"
#include "host/base/error.hpp"
#include "sim/mcu/elf/elf_file.hpp"

namespace rotorloop::cli {
namespace {

constexpr std::string_view kElfMagic =
    "\x7f"
    "ELF";

bool begins_with_header(const mcu::ElfSection& s) {
  firmware::ImageHeader h;
  return firmware::parse_image(s.bytes, h) == firmware::ImageFault::none && h.size < 16u << 20;  // far beyond any ESC
}

}  // namespace

bool is_elf(std::span<const std::uint8_t> bytes) {
  return bytes.size() > kElfMagic.size() && std::equal(kElfMagic.begin(), kElfMagic.end(), bytes.begin());
}

std::vector<std::uint8_t> image_of_elf(const std::filesystem::path& path) {
  const mcu::ElfFile elf = mcu::read_elf(path);
  const auto header = std::find_if(elf.sections.begin(), elf.sections.end(), begins_with_header);
  if (header == elf.sections.end())
    throw Error({path.generic_string(), "this ELF has no image header", "it is a bootloader, or was built without scripts/firmware",
                 "make an image: arm-none-eabi-objcopy -O binary FILE.elf FILE.bin, then rotorloop image create FILE.bin -o FILE.rlf "
                 "--version 1.0 --key KEY.pem"});
  firmware::ImageHeader h;
  firmware::parse_image(header->bytes, h);
  const std::uint64_t begin = header->load_address, end = begin + firmware::kImageHeaderBytes + h.size;
  std::vector<std::uint8_t> image(end - begin, 0xFF);
  for (const mcu::ElfSection& s : elf.sections) {
    if (s.bytes.empty() || s.load_address < begin || s.load_address + s.bytes.size() > end) continue;
    std::copy(s.bytes.begin(), s.bytes.end(), image.begin() + static_cast<std::ptrdiff_t>(s.load_address - begin));
  }
  return image;
}

tools::ImageFacts image_facts(std::span<const std::uint8_t> image, const std::string& name) {
  tools::ImageFacts facts;
  firmware::ImageHeader h;
  const firmware::ImageFault fault = firmware::parse_image(image, h);
  if (fault == firmware::ImageFault::none) {
    protocols::Crc64 crc;
    const auto payload = image.subspan(std::min<std::size_t>(firmware::kImageHeaderBytes, image.size()));
    crc.add(payload.first(std::min<std::size_t>(h.size, payload.size())));
    if (payload.size() < h.size)
      throw Error({name, fmt::format("the image ends after {} of {} bytes", payload.size(), h.size), "the file was cut",
                   "make or download it again"});
    if (crc.value() != h.crc)
      throw Error({name, firmware::image_fault_text(firmware::ImageFault::damaged), "", "make or download it again"});
    const std::string_view board(h.board.data(), h.board.size());
    facts.board = board.substr(0, board.find('\0'));
    facts.version = fmt::format("{}.{}", h.major, h.minor);
    facts.security_version = h.security_version;
    facts.crc = h.crc;
    return facts;
  }
  if (fault != firmware::ImageFault::not_an_image) throw Error({name, firmware::image_fault_text(fault), "", "make or download it again"});
  constexpr std::string_view kDescriptor = "APDesc00";
  const auto at = std::search(image.begin(), image.end(), kDescriptor.begin(), kDescriptor.end());
  if (image.end() - at < 16) return facts;
  std::uint64_t crc = 0;
  for (int i = 0; i < 8; ++i) crc |= static_cast<std::uint64_t>(at[8 + i]) << (8 * i);
  facts.crc = crc;
  return facts;
}

}  // namespace rotorloop::cli
