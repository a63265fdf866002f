// One chip with the linked bootloader, and the tool beside it that hears what it says.
#pragma once
#include "firmware/boot/bootloader.hpp"
#include "test/target/boot_chip.hpp"

namespace rotorloop::boot_chip {

inline constexpr std::int64_t kMs = 1'000'000, kSecond = 1000 * kMs;

class Bench {
 public:
  explicit Bench(std::vector<sim::BusFault> faults = {}, std::uint64_t seed = 1, const std::string& program = boot_elf)
      : bus(program, std::move(faults), seed), tool(bus) {
    tool.on<protocols::LogMessage>([this](const protocols::LogMessage& m, std::uint8_t) {
      said.emplace_back(m.text.items.begin(), m.text.items.begin() + m.text.count);
    });
  }
  void power_up() {
    bus.end = End::at_cycle;
    bus.chip.power_up(0xA5);
    bus.board.press(false);
  }
  bool heard(const std::string& text) const { return std::find(said.begin(), said.end(), text) != said.end(); }
  std::uint16_t vendor_status() const {
    const auto seen = tool.nodes().find(kNode);
    return seen == tool.nodes().end() ? std::uint16_t{0} : seen->second.status.vendor_status;
  }
  bool run_for(std::int64_t most_ns, const std::function<bool()>& done) { return tool.run_until(bus.now_ns() + most_ns, done); }

  BootChip bus;
  tools::ToolNode tool;
  std::vector<std::string> said;
};

}  // namespace rotorloop::boot_chip
