// A chip with programs in it, a board, a bus: what `rotorloop mcu run` runs.
#pragma once
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/mcu/board/esc_board.hpp"
#include "sim/mcu/elf/program.hpp"
#include "sim/mcu/g431/blocks.hpp"
#include "sim/mcu/g431/fdcan/virtual_bus_medium.hpp"
#include "sim/world/virtual_bus.hpp"

namespace rotorloop::cli {

struct RunArguments {
  std::vector<std::filesystem::path> files;
  std::filesystem::path board = "vehicles/boards/b_g431b_esc1.toml", motor = "vehicles/motors/2306_2300kv.toml", trace;
  double supply_V = 14.8, load_N_m_s2 = 0.0, for_s = 1.0, pace = 1.0;
  std::string bus, uart, pace_text = "max";
  std::vector<std::string> presses, pulses;
  std::uint64_t seed = 1;
  int gdb_port = -1;  // -1: no debugger
  bool json = false, lenient = false;
};

class McuMachine : public mcu::EscBoard {
 public:
  McuMachine(const RunArguments& o, const std::vector<mcu::ElfFile>& files, mcu::g431::Chip& chip);
  ~McuMachine() override;
  // In slices, so that what happens outside of the chip happens in time. End: why it stopped before.
  mcu::g431::End run_until(double time_s);

  void on_uart(uint32_t number, uint8_t byte) override;
  void on_pin(uint32_t pin, bool driven, bool high) override;

  sim::VirtualBus bus;
  CanBus* outside = nullptr;  // the port through which frames of a live bus come and go
  std::uint64_t uart_bytes = 0;

 private:
  struct Event {  // a level at an input of the board
    double at_s = 0.0;
    bool press = false, high = false;
  };
  void plan(const RunArguments& o);
  void begin_trace(const RunArguments& o);

  mcu::g431::Chip& chip_;
  mcu::g431::VirtualBusMedium medium_;
  std::vector<Event> events_;  // by time
  size_t next_event_ = 0;
  std::FILE* uart_ = nullptr;
  std::FILE* trace_ = nullptr;
};

// Where a program's stack began and how deep it went: bytes below its first value that are no longer as they were at power-up.
struct StackDepth {
  uint32_t used_bytes = 0, size_bytes = 0;
};
StackDepth stack_depth(mcu::g431::Chip& chip, const std::vector<mcu::ElfFile>& files);

}  // namespace rotorloop::cli
