#include "sim/esc/emulated_esc.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/error.hpp"
#include "sim/esc/drawn_drive.hpp"
#include "sim/mcu/board/esc_board.hpp"
#include "sim/mcu/g431/blocks.hpp"
#include "sim/mcu/g431/fdcan/virtual_bus_medium.hpp"

namespace rotorloop::sim {
namespace {

using mcu::g431::Chip;
using mcu::g431::Clocks;

constexpr std::ptrdiff_t kStartBytes = 8;                      // stack pointer and reset vector
constexpr std::uint8_t kUnwritten = 0xA5;                      // RAM at power-up: the chip promises nothing
constexpr std::uint64_t kUniqueId = 0x0031'3656'524C'4F00ull;  // of its ESC in the lowest byte, as the information page has it

double clock_share(const NativeEscConfig& c, const TypicalDrive& drawn) {
  return c.typical_board && c.own_clock ? 1.0 + 1e-6 * drawn.clock_ppm : 1.0;
}

Clocks crystals(std::uint32_t crystal_Hz, double share) {
  Clocks clocks;
  clocks.hse_Hz = static_cast<std::uint32_t>(std::llround(crystal_Hz * share));
  return clocks;
}

// A chip without a bootloader: what each reset takes from the start of the flash is the stack pointer and the entry of the application.
void start_without_bootloader(std::vector<std::uint8_t>& flash, std::uint32_t vector_table) {
  const auto first = flash.begin(), table = first + (vector_table - mcu::g431::kFlashBase);
  const bool erased = std::all_of(first, first + kStartBytes, [](std::uint8_t b) { return b == 0xFF; });
  if (erased) std::copy_n(table, kStartBytes, first);
}

}  // namespace

struct EmulatedEsc::Impl {
  Impl(const EscProgram& program, const NativeEscConfig& config, VirtualBus& bus, const std::string& port)
      : name(port),
        drawn(drawn_drive(config, *find_board_stage(program.pins.stage))),
        chip(kUniqueId + config.module, crystals(program.pins.crystal_Hz, clock_share(config, drawn))),
        board(program.pins, drawn.drive, chip, esc_stream(config, kNoiseStream).bits(0)),
        medium(bus, chip.blocks().fdcan, false, port) {
    // Edges of the gates are late by what drivers and FETs add; the program sets only the chip's own dead time.
    board.set_dead_time_added_s(drawn.drive.inverter.dead_time_s - config.drive.inverter.dead_time_s);
    board.drive().motor().set_angle(initial_angle_rad(config));
    board.drive().set_bus_V(config.bus_V);
    std::vector<std::uint8_t> flash = program.flash;
    store_parameters(flash, config.firmware);
    start_without_bootloader(flash, program.vector_table);
    std::copy(flash.begin(), flash.end(), chip.memory(mcu::g431::kFlashBase, static_cast<std::uint32_t>(flash.size())));
    chip.ignore_lock_up = true;  // the watchdog ends it, as on the board
    start();
    const double late_s = config.typical_board && config.own_clock ? drawn.pwm_phase / kCurrentLoop_Hz : 0.0;
    chip.stall(chip.cycle_at(late_s));
  }

  void start() {
    chip.power_up(kUnwritten);
    board.press(false);
  }

  void run_until(std::int64_t time_ns) {
    const std::uint64_t cycle = chip.cycle_at(static_cast<double>(time_ns) * 1e-9);
    if (!powered) {
      if (cycle > chip.cycle()) chip.stall(cycle - chip.cycle());
    } else if (const mcu::g431::End end = chip.run_until(cycle); end != mcu::g431::End::at_cycle) {
      throw Error({name, "its program did what the chip refuses: " + mcu::g431::text(chip.refused()), "",
                   "run it alone with rotorloop mcu run ELF; docs/mcu.md says what is emulated"},
                  ExitCode::verdict);
    }
    board.advance();
  }

  double drive_s_since(std::uint64_t cycle) const { return static_cast<double>(board.last().end_cycle - cycle) / chip.clocks().hclk_Hz; }

  std::string name;
  TypicalDrive drawn;
  Chip chip;
  mcu::EscBoard board;
  mcu::g431::VirtualBusMedium medium;
  bool powered = true;
  double coupled_omega_rad_s = 0.0, coupled_energy_J = 0.0;
  std::uint64_t coupled_cycle = 0;
};

EmulatedEsc::EmulatedEsc(const EscProgram& program, const NativeEscConfig& config, VirtualBus& bus, const std::string& name)
    : impl_(std::make_unique<Impl>(program, config, bus, name)) {}
EmulatedEsc::~EmulatedEsc() = default;
EmulatedEsc::EmulatedEsc(EmulatedEsc&&) noexcept = default;

void EmulatedEsc::step_together(std::span<EmulatedEsc* const> escs, VirtualBus& bus, std::int64_t until_ns) {
  for (;;) {
    // The bus has moved: each controller may have heard of a frame.
    for (EmulatedEsc* esc : escs) esc->impl_->chip.reschedule(esc->impl_->chip.blocks().fdcan);
    const std::int64_t slot_ns = std::min(until_ns, std::max(bus.next_event_ns(), bus.now_ns() + 1));
    for (EmulatedEsc* esc : escs) esc->impl_->run_until(slot_ns);
    if (slot_ns == until_ns) return;
    bus.advance_to(slot_ns);
  }
}

void EmulatedEsc::set_power(bool on) {
  if (on == impl_->powered) return;
  impl_->powered = on;
  impl_->start();
}

void EmulatedEsc::couple(double load_torque_N_m, double bus_V) {
  couple_quadratic(load_coefficient_N_m_s2(load_torque_N_m, omega_rad_s()), bus_V);
}

void EmulatedEsc::couple_quadratic(double load_N_m_s2, double bus_V) {
  Impl& m = *impl_;
  m.board.drive().set_load({load_N_m_s2, 0.0});
  m.board.drive().set_bus_V(bus_V);
  m.coupled_omega_rad_s = omega_rad_s();
  m.coupled_energy_J = bus_energy_J();
  m.coupled_cycle = m.board.last().end_cycle;
}

double EmulatedEsc::omega_rad_s() const { return drive().omega_rad_s(); }

double EmulatedEsc::shaft_acceleration_rad_s2() const {
  const double passed_s = impl_->drive_s_since(impl_->coupled_cycle);
  return passed_s > 0.0 ? (omega_rad_s() - impl_->coupled_omega_rad_s) / passed_s : 0.0;
}

double EmulatedEsc::bus_current_A() const {
  const double passed_s = impl_->drive_s_since(impl_->coupled_cycle);
  if (passed_s <= 0.0 || drive().bus_V() <= 0.0) return 0.0;
  return (bus_energy_J() - impl_->coupled_energy_J) / (passed_s * drive().bus_V());
}

double EmulatedEsc::bus_energy_J() const { return impl_->board.bus_energy_J(); }

double EmulatedEsc::pwm_phase() const {
  const Impl& m = *impl_;
  const double crest_s = m.chip.time_s() - static_cast<double>(m.chip.cycle() - m.board.last().end_cycle) / m.chip.clocks().hclk_Hz;
  const double turns = crest_s * kCurrentLoop_Hz;
  return turns - std::floor(turns);
}

Drive& EmulatedEsc::drive() { return impl_->board.drive(); }
const Drive& EmulatedEsc::drive() const { return impl_->board.drive(); }

// What can be seen from outside of the chip.
firmware::Telemetry EmulatedEsc::telemetry() const {
  const Impl& m = *impl_;
  firmware::Telemetry t;
  t.state = m.board.switching() ? firmware::MotorState::running : firmware::MotorState::off;
  t.speed_rad_s = static_cast<float>(omega_rad_s());
  t.bus_V = static_cast<float>(drive().bus_V());
  t.bus_A = static_cast<float>(bus_current_A());
  return t;
}

EmulatedCounters EmulatedEsc::counters() const {
  Impl& m = *impl_;
  return {m.chip.core().state.instructions, m.chip.resets(), m.board.both_on()};
}

}  // namespace rotorloop::sim
