// `rotorloop mcu run`: programs on the emulated chip, and what they did.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "cli/bus/live_options.hpp"
#include "cli/ending/stop_signals.hpp"
#include "cli/mcu/mcu_commands.hpp"
#include "cli/mcu/mcu_machine.hpp"
#include "host/base/error.hpp"
#include "sim/mcu/gdb/chip_target.hpp"
#include "sim/mcu/gdb/server.hpp"

namespace rotorloop::cli {
namespace {

using Json = nlohmann::ordered_json;
using namespace mcu;
using namespace mcu::g431;

constexpr int kProgramFailed = 4;

std::vector<ElfFile> read_programs(const RunArguments& o) {
  std::vector<ElfFile> files;
  for (const auto& path : o.files) {
    files.push_back(read_elf(path));
    check_sections(files.back(), stm32g431_memories());
    vector_table(files.back(), stm32g431_memories());
  }
  check_overlap(files);
  return files;
}

std::string place(const std::vector<ElfFile>& files, uint32_t address) {
  for (const ElfFile& f : files)
    if (f.symbol_at(address) != nullptr) return fmt::format("{:#010x} {}", address, f.place(address));
  return fmt::format("{:#010x}", address);
}

// Frames of a live bus in and out, at the times at which the chip has got to.
void exchange(TimedBus& live, Chip& chip, McuMachine& m) {
  m.bus.set_now(std::max(m.bus.now_ns(), static_cast<int64_t>(chip.time_s() * 1e9)));
  bool heard = false;
  for (; const auto frame = live.receive(); heard = true) m.outside->send(frame->frame);
  // The controller hears each frame at its own end: not all of them at the program's next access, when its FIFOs hold three.
  if (heard) chip.reschedule(chip.blocks().fdcan);
  while (const auto frame = m.outside->receive()) live.send(frame->frame);
}

End run_on_bus(const RunArguments& o, Chip& chip, McuMachine& m) {
  LiveOptions options;
  options.for_s = o.for_s / o.pace;
  options.for_given = true;
  const auto live = open_live(options, o.bus, "--bus");
  TimedBus* const alone = live.get();
  const int64_t begun_ns = live->now_ns();
  End end = End::at_cycle;
  run_live({&alone, 1}, options, [&]() -> std::optional<int64_t> {
    const double wanted_s = std::min(o.for_s, static_cast<double>(live->now_ns() - begun_ns) * 1e-9 * o.pace);
    exchange(*live, chip, m);
    // A machine that is too slow falls behind instead of rushing.
    end = m.run_until(std::min(wanted_s, chip.time_s() + 0.05));
    exchange(*live, chip, m);
    if (end != End::at_cycle || chip.time_s() >= o.for_s) return std::nullopt;
    return live->now_ns() + 500'000;
  });
  return end;
}

// The chip in the hands of a debugger, with board and motor going on as its cycles do.
class MachineTarget : public gdb::ChipTarget {
 public:
  MachineTarget(Chip& chip, McuMachine& machine) : ChipTarget(chip), chip_(chip), machine_(machine), start_(chip.core().state.scb.vtor) {}
  void reset() override {
    chip_.power_up();
    chip_.core().reset(start_);
  }
  gdb::Halt run_for(uint64_t cycles) override { return halt(machine_.run_until(chip_.time_s_at(chip_.cycle() + cycles))); }

 private:
  Chip& chip_;
  McuMachine& machine_;
  uint32_t start_;  // where its vectors were when it came up
};

// Until the debugger is through: detached, the program runs on; killed or gone, the run is over.
End run_with_debugger(const RunArguments& o, Chip& chip, McuMachine& m) {
  const StopSignals signals;
  gdb::Server server(static_cast<uint16_t>(o.gdb_port));
  fmt::print(stderr, "waiting for a debugger: target remote 127.0.0.1:{}\n", server.port());
  MachineTarget target(chip, m);
  const bool detached = server.serve(target, [&] { return signals.asked(); });
  return detached ? m.run_until(o.for_s) : End::at_cycle;
}

Json interrupts_json(const CoreState& s) {
  Json rows = Json::array();
  for (uint32_t n = 2; n < kExceptions; ++n) {
    const Served& v = s.served[n];
    if (v.count == 0) continue;
    rows.push_back({{"exception", exception_name(n)},
                    {"count", v.count},
                    {"mean_cycles", static_cast<double>(v.cycles) / static_cast<double>(v.count)},
                    {"mean_zero_wait_cycles", static_cast<double>(v.cycles - v.waits) / static_cast<double>(v.count)},
                    {"longest_cycles", v.longest_cycles},
                    {"longest_zero_wait_cycles", v.longest_cycles - v.longest_waits}});
  }
  return rows;
}

Json report(const std::vector<ElfFile>& files, Chip& chip, McuMachine& m, End end) {
  const CoreState& s = chip.core().state;
  const StackDepth stack = stack_depth(chip, files);
  constexpr double kRpm = 30.0 / std::numbers::pi;
  const PortCounters& frames = m.outside->counters();
  return {{"end", end == End::at_cycle    ? "time"
                  : end == End::refused   ? "refused"
                  : end == End::locked_up ? "locked_up"
                                          : "breakpoint"},
          {"time_s", chip.time_s()},
          {"hclk_Hz", chip.clocks().hclk_Hz},
          {"cycles", s.cycle},
          {"flash_wait_cycles", s.flash_waits},
          {"instructions", s.instructions},
          {"interrupts", interrupts_json(s)},
          {"stack_bytes", stack.used_bytes},
          {"stack_room_bytes", stack.size_bytes},
          {"cfsr", s.scb.cfsr},
          {"hfsr", s.scb.hfsr},
          {"resets", chip.resets()},
          {"refused", chip.refused_count()},
          {"unclocked", chip.unclocked_count()},
          {"frames_sent", frames.received},
          {"frames_heard", frames.sent},
          {"uart_bytes", m.uart_bytes},
          {"motor_rpm", m.drive().omega_rad_s() * kRpm},
          {"fastest_rpm", m.fastest_rad_s() * kRpm},
          {"both_gates_on", m.both_on()}};
}

void print(const Json& r) {
  const auto row = [](const char* name, const std::string& value) { fmt::print("  {:<22} {}\n", name, value); };
  fmt::print("run\n");
  row("time", fmt::format("{:.6f} s, at the end {:.3f} MHz", r["time_s"].get<double>(), r["hclk_Hz"].get<double>() * 1e-6));
  row("instructions", fmt::format("{} in {} cycles, {} of them waits for flash", r["instructions"].get<uint64_t>(),
                                  r["cycles"].get<uint64_t>(), r["flash_wait_cycles"].get<uint64_t>()));
  row("stack", fmt::format("{} of {} bytes", r["stack_bytes"].get<uint32_t>(), r["stack_room_bytes"].get<uint32_t>()));
  row("faults",
      fmt::format("CFSR {:#x}, HFSR {:#x}, {} resets", r["cfsr"].get<uint32_t>(), r["hfsr"].get<uint32_t>(), r["resets"].get<uint64_t>()));
  row("accesses refused", fmt::format("{}; to blocks without clock: {}", r["refused"].get<uint64_t>(), r["unclocked"].get<uint64_t>()));
  row("frames", fmt::format("{} sent, {} heard", r["frames_sent"].get<uint64_t>(), r["frames_heard"].get<uint64_t>()));
  row("serial line", fmt::format("{} bytes", r["uart_bytes"].get<uint64_t>()));
  row("motor", fmt::format("{:.0f} rpm at the end, {:.0f} at most; both gates of a leg asked for {} times", r["motor_rpm"].get<double>(),
                           r["fastest_rpm"].get<double>(), r["both_gates_on"].get<uint64_t>()));
  if (r["interrupts"].empty()) return;
  fmt::print("  {:<22} {:>9} {:>20} {:>20}\n", "interrupt, in cycles", "count", "mean (zero wait)", "longest (zero wait)");
  for (const Json& v : r["interrupts"])
    fmt::print("  {:<22} {:>9} {:>11.0f} ({:>6.0f}) {:>11} ({:>6})\n", v["exception"].get<std::string>(), v["count"].get<uint64_t>(),
               v["mean_cycles"].get<double>(), v["mean_zero_wait_cycles"].get<double>(), v["longest_cycles"].get<uint64_t>(),
               v["longest_zero_wait_cycles"].get<uint64_t>());
}

// Registers, callers as far as return addresses on the stack tell, and the last instructions.
void print_failure(const std::vector<ElfFile>& files, Chip& chip, End end) {
  const CoreState& s = chip.core().state;
  if (end == End::refused) fmt::print(stderr, "error: {}\n", text(chip.refused()));
  if (end == End::locked_up) fmt::print(stderr, "error: the core is locked up: a fault in a handler of faults\n");
  if (end == End::breakpoint) fmt::print(stderr, "error: a BKPT instruction without a debugger\n");
  fmt::print(stderr, "  at {}\n", place(files, s.r[kPc]));
  for (uint32_t n = 0; n < 16; ++n) fmt::print(stderr, "{}r{:<2} {:08x}{}", n % 4 == 0 ? "  " : "  ", n, s.r[n], n % 4 == 3 ? "\n" : "");
  fmt::print(stderr, "  xpsr {:08x}  CFSR {:08x}  HFSR {:08x}  MMFAR {:08x}  BFAR {:08x}\n  called from\n    {}\n", chip.core().xpsr(),
             s.scb.cfsr, s.scb.hfsr, s.scb.mmfar, s.scb.bfar, place(files, s.r[kLr] & ~1u));
  int shown = 0;
  for (uint32_t at = s.r[kSp]; shown < 12 && at < s.r[kSp] + 1024 && chip.memory(at, 4) != nullptr; at += 4) {
    uint32_t word = 0;
    std::memcpy(&word, chip.memory(at, 4), 4);
    if ((word & 1) == 0) continue;
    for (const ElfFile& f : files)
      if (const ElfSymbol* symbol = f.symbol_at(word & ~1u); symbol != nullptr && symbol->function && word - 1 != symbol->address) {
        fmt::print(stderr, "    {}\n", place(files, word & ~1u));
        ++shown;
      }
  }
  fmt::print(stderr, "  last instructions\n");
  const uint64_t last = s.instructions;
  for (uint64_t n = last > 32 ? last - 32 : 0; n < last; ++n) fmt::print(stderr, "    {}\n", place(files, s.recent[n & 31]));
}

int run(RunArguments o) {
  if (!(o.for_s > 0.0 && o.for_s <= 3600.0))
    throw Error({"--for", fmt::format("{} s is out of range: above 0 to 3600 s", o.for_s), "", "give the chip's time in seconds"});
  if (o.pace_text != "max") {
    char* rest = nullptr;
    o.pace = std::strtod(o.pace_text.c_str(), &rest);
    if (*rest != 0 || !(o.pace >= 0.001 && o.pace <= 100.0))
      throw Error({"--pace", "\"" + o.pace_text + "\" is out of range: 0.001 to 100, or max", "", "1 is real time"});
    if (o.bus.empty())
      throw Error({"--pace", "without --bus there is no clock to keep to", "", "leave it out: the run is as fast as it can"});
  }
  if (o.gdb_port >= 0 && !o.bus.empty())
    throw Error({"--gdb", "not together with --bus: time stands still while a debugger holds the chip", "", "leave one of both out"});
  const std::vector<ElfFile> files = read_programs(o);
  Clocks crystals;
  crystals.hse_Hz = read_board(TomlFile::read(o.board)).crystal_Hz;
  Chip chip(0x4E45'3339'3233'5000u + o.seed, crystals);
  McuMachine machine(o, files, chip);
  const End end = o.gdb_port >= 0 ? run_with_debugger(o, chip, machine)
                  : o.bus.empty() ? machine.run_until(o.for_s)
                                  : run_on_bus(o, chip, machine);
  const Json r = report(files, chip, machine, end);
  if (end != End::at_cycle) print_failure(files, chip, end);
  if (o.json)
    fmt::print("{}\n", r.dump(2));
  else
    print(r);
  return end == End::at_cycle ? 0 : kProgramFailed;
}

}  // namespace

void add_mcu_run(CLI::App& mcu_group, int& exit_code) {
  auto o = std::make_shared<RunArguments>();
  CLI::App* c = mcu_group.add_subcommand("run", "runs programs on an STM32G431 in software, on a board with motor, supply and bus");
  c->add_option("elf", o->files, "programs as the linker wrote them; a bootloader and an application are two files")->required();
  c->add_option("--pins", o->board, "file of the board: what is at which pin")->capture_default_str();
  c->add_option("--motor", o->motor, "motor file")->capture_default_str();
  c->add_option("--supply", o->supply_V, "V at the board")->capture_default_str()->check(CLI::Range(0.0, 100.0));
  c->add_option("--load", o->load_N_m_s2, "torque of the shaft over speed squared, N m s^2")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  c->add_option("--bus", o->bus, std::string(kBusHelp) + "; without it nobody acknowledges");
  c->add_option("--uart", o->uart, "file for the bytes of all serial lines, or - for the terminal");
  c->add_option("--press", o->presses, "button@T: pressed for 0.1 s at T seconds");
  c->add_option("--pulse", o->pulses, "US@T: from T seconds on pulses of US microseconds at 400 Hz at the RC input");
  c->add_option("--for", o->for_s, "seconds of the chip")->capture_default_str();
  c->add_option("--pace", o->pace_text, "seconds of the chip per second, with --bus (1 there unless said); max without")
      ->capture_default_str();
  c->add_option("--trace", o->trace, "file: every pin that the chip drives, as a value change dump (VCD)");
  c->add_option("--gdb", o->gdb_port, "port of this machine at which gdb finds the chip; 0: any that is free")->check(CLI::Range(0, 65535));
  c->add_option("--seed", o->seed, "of noise and of the chip's identity")->capture_default_str();
  c->add_flag("--json", o->json, "the table for programs");
  c->add_flag("--lenient", o->lenient, "accesses that the chip does not have read 0 and are counted, instead of ending the run");
  c->footer(
      "Exit code 4: the program locked up or did what the chip does not have; registers, callers and the last instructions are on stderr.\n"
      "What is modelled, and how sure: docs/mcu.md. Nothing of it is proof of silicon.\n"
      "Examples:\n"
      "  rotorloop mcu run esc.elf --for 2\n"
      "  rotorloop mcu run esc.elf --gdb 3333            # and beside it: gdb-multiarch esc.elf -ex 'target remote :3333'\n"
      "  rotorloop mcu run bootloader.elf esc.elf --bus mcast:0 --for 20    # and beside it: rotorloop esc list --bus mcast:0");
  c->callback([o, &exit_code] { exit_code = run(*o); });
}

}  // namespace rotorloop::cli
