#include "sim/mcu/board/board_file.hpp"

#include <charconv>

#include "host/base/error.hpp"

namespace rotorloop::mcu {
namespace {

uint32_t pin_of(const std::string& text, const TomlTable& table, std::string_view key) {
  uint32_t number = 16;
  const bool port = text.size() >= 3 && text[0] == 'P' && text[1] >= 'A' && text[1] <= 'G';
  if (port) std::from_chars(text.data() + 2, text.data() + text.size(), number);
  if (number > 15)
    throw Error({table.where(key), std::string(key) + " = \"" + text + "\" is no pin: PA0 to PG15", "",
                 "write port and number as the data sheet has them, for example \"PA8\""});
  return 16 * static_cast<uint32_t>(text[1] - 'A') + number;
}

std::array<uint32_t, 3> three(const TomlTable& table, std::string_view key) {
  const std::vector<std::string> texts = table.texts(key);
  if (texts.size() != 3)
    throw Error(
        {table.where(key), std::string(key) + " has " + std::to_string(texts.size()) + " pins, not 3", "", "one each for U, V and W"});
  return {pin_of(texts[0], table, key), pin_of(texts[1], table, key), pin_of(texts[2], table, key)};
}

uint32_t one(const TomlTable& table, std::string_view key) { return table.has(key) ? pin_of(table.text(key), table, key) : kNoPin; }

}  // namespace

BoardPins read_board(const TomlFile& file) {
  file.format({1});
  const TomlTable root = file.root(), gates = root.table("gates"), shunts = root.table("shunts"), analogue = root.table("analogue"),
                  digital = root.table("digital");
  BoardPins b;
  b.name = file.path().stem().generic_string();
  b.stage = root.text("stage");
  b.crystal_Hz = static_cast<uint32_t>(root.integer("crystal_Hz", 0, 48'000'000));
  b.high = three(gates, "high");
  b.low = three(gates, "low");
  b.shunt_plus = three(shunts, "plus");
  b.amplified = three(shunts, "amplified");
  b.bus = one(analogue, "bus");
  b.temperature = one(analogue, "temperature");
  b.potentiometer = one(analogue, "potentiometer");
  b.button = one(digital, "button");
  b.led = one(digital, "led");
  b.pwm_input = one(digital, "pwm_input");
  b.can_rx = one(digital, "can_rx");
  b.can_tx = one(digital, "can_tx");
  b.can_shutdown = one(digital, "can_shutdown");
  b.can_termination = one(digital, "can_termination");
  file.refuse_unknown_keys();
  return b;
}

std::string pin_name(uint32_t pin) { return std::string("P") + static_cast<char>('A' + pin / 16) + std::to_string(pin % 16); }

}  // namespace rotorloop::mcu
