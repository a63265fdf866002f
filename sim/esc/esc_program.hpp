// The ELF of an ESC's program, checked against the board that it is to run on, and that board's pins.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "firmware/core/interface.hpp"
#include "firmware/update/image.hpp"
#include "sim/mcu/board/board_file.hpp"

namespace rotorloop::sim {

struct EscProgram {
  std::filesystem::path elf;
  mcu::BoardPins pins;
  std::vector<std::uint8_t> flash;  // 128 KB as a debugger leaves them; erased where the ELF has nothing
  std::uint32_t vector_table = 0;
  firmware::ImageHeader image;  // as its header says

  std::string text() const;  // "b_g431b_esc1.elf 0.1, commit 1234abcd, CRC 0011223344556677"
};

// Throws Error (ExitCode::usage) with what was found: no ELF, not for this chip, another layout of the flash, no vector table behind the
// header, header missing or damaged, image of another board, bytes that do not fit its CRC.
EscProgram read_esc_program(const std::filesystem::path& elf, const std::filesystem::path& board);

// Parameters into the two pages of a flash image, by the store of the firmware: what an ESC has after set, save and a restart.
void store_parameters(std::vector<std::uint8_t>& flash, const firmware::Parameters& parameters);

}  // namespace rotorloop::sim
