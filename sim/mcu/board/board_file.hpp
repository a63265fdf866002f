// A board as a file says it: which pin of the chip is what.
#pragma once
#include <array>
#include <filesystem>
#include <string>

#include "host/base/toml_file.hpp"

namespace rotorloop::mcu {

inline constexpr uint32_t kNoPin = 255;

// Pins are 16 * port + number, port A is 0.
struct BoardPins {
  std::string name, stage;
  uint32_t crystal_Hz = 0;
  std::array<uint32_t, 3> high{}, low{};              // gates
  std::array<uint32_t, 3> shunt_plus{}, amplified{};  // at an amplifier's plus input, and behind one with the board's network
  uint32_t bus = kNoPin, temperature = kNoPin, potentiometer = kNoPin;
  uint32_t button = kNoPin, led = kNoPin, pwm_input = kNoPin;
  uint32_t can_rx = kNoPin, can_tx = kNoPin, can_shutdown = kNoPin, can_termination = kNoPin;
};

// Throws Error with file, line, key, value, range and remedy.
BoardPins read_board(const TomlFile& file);
std::string pin_name(uint32_t pin);  // "PA8"

}  // namespace rotorloop::mcu
