// How fast a program runs on emulated chips with board, drive and bus, as `rotorloop mcu run` joins them: chips in turn, a millisecond
// each. Prints CPU time, instructions and a digest of RAM, registers, times and every change at a pin, which tells whether two builds of
// the emulation compute the same.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <memory>
#include <vector>

#include "sim/drive/boards.hpp"
#include "sim/mcu/board/esc_board.hpp"
#include "sim/mcu/elf/program.hpp"
#include "sim/mcu/g431/blocks.hpp"
#include "sim/mcu/g431/fdcan/virtual_bus_medium.hpp"

namespace {

using namespace rotorloop;
using namespace rotorloop::mcu;
using namespace rotorloop::mcu::g431;

sim::DriveParameters drive_of(const BoardPins& pins) {
  sim::DriveParameters d;
  const sim::BoardStage* stage = sim::find_board_stage(pins.stage);
  d.inverter = stage->inverter;
  d.sensing = stage->sensing;
  d.thermal = stage->thermal;
  return d;
}

class Digest {
 public:
  void add(const void* data, size_t bytes) {
    for (const auto* at = static_cast<const unsigned char*>(data); bytes-- > 0; ++at) value_ = (value_ ^ *at) * 0x100000001B3u;
  }
  uint64_t value() const { return value_; }

 private:
  uint64_t value_ = 0xCBF29CE484222325u;  // FNV-1a
};

class Machine : public EscBoard {
 public:
  Machine(const BoardPins& pins, const ElfFile& file, Chip& chip, uint64_t seed)
      : EscBoard(pins, drive_of(pins), chip, seed), bus_({}), chip_(chip), medium_(bus_, chip.blocks().fdcan, true) {
    bus_.attach({.name = "outside"});
    chip.power_up(0xA5);
    for (const ElfSection& s : file.sections)
      if (uint8_t* to = s.bytes.empty() ? nullptr : chip.memory(s.load_address, static_cast<uint32_t>(s.bytes.size())))
        std::memcpy(to, s.bytes.data(), s.bytes.size());
    chip.core().reset(vector_table(file, stm32g431_memories()).address);
    press(false);
    drive().set_bus_V(14.8);
  }
  void on_pin(uint32_t pin, bool driven, bool high) override {
    EscBoard::on_pin(pin, driven, high);
    const uint64_t change[] = {chip_.now(), pin, driven, high};
    pins_seen.add(change, sizeof change);
  }
  Digest pins_seen;

 private:
  sim::VirtualBus bus_;
  Chip& chip_;
  VirtualBusMedium medium_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3 || argc > 4) {
    std::fprintf(stderr, "usage: bench_mcu_board ELF SECONDS [CHIPS]\n");
    return 2;
  }
  const double for_s = std::atof(argv[2]);
  const size_t count = argc > 3 ? static_cast<size_t>(std::atoi(argv[3])) : 1;
  const ElfFile file = read_elf(argv[1]);
  const BoardPins pins = read_board(TomlFile::read("vehicles/boards/b_g431b_esc1.toml"));
  Clocks crystals;
  crystals.hse_Hz = pins.crystal_Hz;
  std::vector<std::unique_ptr<Chip>> chips;
  std::vector<std::unique_ptr<Machine>> machines;
  for (size_t n = 0; n < count; ++n) {
    chips.push_back(std::make_unique<Chip>(0x4E45'3339'3233'5001u + n, crystals));
    machines.push_back(std::make_unique<Machine>(pins, file, *chips[n], n + 1));
  }
  const std::clock_t begun = std::clock();
  for (double t = 0.0; t < for_s; t += 1e-3)
    for (size_t n = 0; n < count; ++n) {
      Chip& chip = *chips[n];
      while (chip.time_s() < t + 1e-3) {
        if (const End end = chip.run_until(chip.cycle_at(t + 1e-3) + 1); end != End::at_cycle) {
          std::fprintf(stderr, "error: the program ended at %.6f s: %s\n", chip.time_s(), text(chip.refused()).c_str());
          return 4;
        }
      }
      machines[n]->advance();
    }
  const double cpu_s = static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC;
  Digest state;
  uint64_t instructions = 0;
  for (size_t n = 0; n < count; ++n) {
    const CoreState& core = chips[n]->core().state;
    const uint64_t seen[] = {machines[n]->pins_seen.value(), core.cycle, core.flash_waits, core.instructions};
    const double speed_rad_s = machines[n]->drive().omega_rad_s();
    state.add(seen, sizeof seen);
    state.add(&speed_rad_s, sizeof speed_rad_s);
    state.add(core.r.data(), sizeof core.r);
    state.add(core.s.data(), sizeof core.s);
    state.add(core.served.data(), sizeof core.served);
    state.add(chips[n]->ram().data(), chips[n]->ram().size());
    instructions += core.instructions;
  }
  std::printf(
      "{\"chips\": %zu, \"time_s\": %g, \"cpu_s\": %.3f, \"times_real_time\": %.3f, \"instructions\": %llu, \"million_per_s\": %.1f, "
      "\"digest\": \"%016llx\"}\n",
      count, for_s, cpu_s, for_s / cpu_s, static_cast<unsigned long long>(instructions), static_cast<double>(instructions) / cpu_s * 1e-6,
      static_cast<unsigned long long>(state.value()));
  return 0;
}
