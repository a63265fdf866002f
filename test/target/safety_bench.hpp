// The linked program on the emulated chip with a motor that it turns, and what an injected failure does to the gates. The bench is brought
// to 3 000 rpm once; each failure then has a process of its own, a fork, which is a snapshot of chip, motor and bus alike.
#pragma once
#include <numbers>

#include "protocols/types.hpp"
#include "test/target/boot_chip.hpp"
#include "test/target/in_a_fork.hpp"

namespace rotorloop::safety {

using namespace boot_chip;
inline constexpr std::int64_t kMs = 1'000'000;
inline constexpr int kRpm = 3000;
inline constexpr unsigned kHighSides = 0x07, kAllSides = 0x3F;  // bits of U, V, W; low sides behind them

// Between board and chip: sees the gates, and can hold the volts at a pin.
class GateWatch : public Pins {
 public:
  GateWatch(Chip& chip, EscBoard& board, const BoardPins& pins) : chip_(chip), board_(board), pins_(pins) { chip.pins = this; }
  void on_pin(std::uint32_t pin, bool driven, bool high) override {
    for (std::uint32_t k = 0; k < 3; ++k) {
      if (pin == pins_.high[k]) turn(k, driven && high);
      if (pin == pins_.low[k]) turn(3 + k, driven && high);
    }
    board_.on_pin(pin, driven, high);
  }
  void on_signal(Signal signal, bool high) override { board_.on_signal(signal, high); }
  bool heard(Signal signal) const override { return board_.heard(signal); }
  double pin_V(std::uint32_t pin) override {
    const double V = board_.pin_V(pin);
    return pin == stuck_pin ? stuck_V : V;
  }

  double now_s() const { return chip_.time_s_at(std::max(chip_.now(), chip_.cycle())); }  // between instructions, events may lie behind
  unsigned gates() const { return gates_; }
  double low_since_s() const { return gates_ == 0 ? low_since_s_ : 1e9; }
  // From now on: the first time from which all six gates stayed low for longer than two PWM periods, and how long each was on.
  void begin() {
    begun_s_ = now_s();
    quiet_s_ = -1.0;
    longest_on_s_.fill(0.0);
    on_since_s_.fill(begun_s_);
    if (gates_ == 0) low_since_s_ = begun_s_;
  }
  double quiet_after_s() {
    note_quiet(now_s());
    return quiet_s_ < 0.0 ? 1e9 : quiet_s_ - begun_s_;
  }
  // The longest of these.
  double longest_on_s(unsigned of_gates) const {
    double longest_s = 0.0;
    for (unsigned n = 0; n < 6; ++n) {
      if ((of_gates >> n & 1u) == 0) continue;
      longest_s = std::max({longest_s, longest_on_s_[n], (gates_ >> n & 1u) != 0 ? now_s() - on_since_s_[n] : 0.0});
    }
    return longest_s;
  }

  std::uint32_t stuck_pin = kNoPin;
  double stuck_V = 0.0;

 private:
  static constexpr double kQuiet_s = 50e-6;  // a PWM period is 20.8 us
  void note_quiet(double until_s) {
    if (quiet_s_ < 0.0 && gates_ == 0 && until_s - low_since_s_ > kQuiet_s) quiet_s_ = low_since_s_;
  }
  void turn(unsigned n, bool on) {
    if (on == ((gates_ >> n & 1u) != 0)) return;
    const double t = chip_.time_s_at(chip_.now());
    if (on) {
      note_quiet(t);
      on_since_s_[n] = t;
    } else {
      longest_on_s_[n] = std::max(longest_on_s_[n], t - on_since_s_[n]);
    }
    gates_ ^= 1u << n;
    if (gates_ == 0) low_since_s_ = t;
  }

  Chip& chip_;
  EscBoard& board_;
  const BoardPins pins_;
  unsigned gates_ = 0;
  double begun_s_ = 0.0, low_since_s_ = 0.0, quiet_s_ = -1.0;
  std::array<double, 6> on_since_s_{}, longest_on_s_{};
};

class Bench {
 public:
  explicit Bench(const std::string& elf, std::vector<sim::BusFault> faults = {}) : bus(elf, std::move(faults)), tool(bus) {
    const std::uint32_t table = kArea + firmware::kImageHeaderBytes;
    std::copy_n(bus.chip.memory(table, 8), 8, bus.chip.memory(kFlashBase, 8));  // no bootloader: every reset enters the application
    firmware::Parameters p;
    p.node_id = kNode;
    p.esc_index = 0;
    ProgrammedFlash pages(bus.chip, kParameterPage);
    firmware::ParameterStore(pages).save(p);
    bus.board.drive().set_load({p.load_N_m_s2, 0.0});
    bus.chip.ignore_lock_up = true;
    power_up();
  }
  void power_up() {
    bus.chip.power_up(0xA5);
    bus.board.press(false);
  }
  // Arming ten times a second and a set-point every 10 ms.
  void command(std::int64_t duration_ns, int rpm = kRpm) {
    for (const std::int64_t end_ns = tool.now_ns() + duration_ns; tool.now_ns() < end_ns;) {
      set_point(rpm);
      pass(std::min(10 * kMs, end_ns - tool.now_ns()));
    }
  }
  void set_point(int rpm) {
    protocols::RpmCommand c;
    c.count = 1;
    c.rpm[0] = rpm;
    if (commands_++ % 10 == 0) tool.broadcast(protocols::ArmingStatus{.status = protocols::ArmingStatus::kFullyArmed}, 8);
    tool.broadcast(c, 7);
  }
  // A failure of the processor is over after a reset: what was patched is as it was.
  void pass(std::int64_t duration_ns) {
    for (const std::int64_t end_ns = tool.now_ns() + duration_ns; tool.now_ns() < end_ns;) {
      tool.run_for(std::min(kMs, end_ns - tool.now_ns()));
      if (patched_ && bus.chip.resets() != patched_->resets) {
        write_instruction(patched_->at, patched_->before);
        patched_.reset();
      }
    }
  }
  bool operational() const {
    const auto n = tool.nodes().find(kNode);
    return n != tool.nodes().end() && n->second.status.mode == protocols::NodeMode::operational;
  }
  double rpm() const { return bus.board.drive().omega_rad_s() * 30.0 / std::numbers::pi; }

  CoreState& core() { return bus.chip.core().state; }
  // Until the core is in this exception (0: the main loop, awake), at an instruction that stands alone.
  void until_in(std::uint32_t exception) {
    for (int i = 0; i < 3'000'000; ++i) {
      const CoreState& s = core();
      if (s.ipsr == exception && s.it == 0 && !s.sleeping && s.phase == Phase::running && (exception != 0 || i > 1000)) return;
      bus.run_to_cycle(bus.chip.cycle() + 1);
    }
  }
  // Until the core takes an NMI or the exception of a fault, and how long that takes; nothing when none comes within 100 us.
  std::optional<double> until_fault_us() {
    const double from_s = watch.now_s();
    while (core().ipsr < kNmi || core().ipsr > kUsageFault) {
      if (watch.now_s() - from_s > 100e-6) return std::nullopt;
      bus.run_to_cycle(bus.chip.cycle() + 1);
    }
    return 1e6 * (watch.now_s() - from_s);
  }
  // This instruction in place of the next one; what is in the cache of the flash goes with it.
  void patch(std::uint16_t instruction) {
    const std::uint32_t pc = core().r[kPc];
    patched_ = Patched{pc, 0, bus.chip.resets()};
    std::memcpy(&patched_->before, bus.chip.memory(pc, 2), 2);
    write_instruction(pc, instruction);
  }
  void poke(std::uint32_t address, std::uint32_t value) {
    if (std::uint8_t* at = bus.chip.memory(address, 4))
      std::memcpy(at, &value, 4);
    else if (!bus.chip.core().is_system_register(address))
      bus.chip.write(address, 4, value);
    else
      bus.chip.core().write_system(address, 4, value);
    bus.chip.core().restored();
  }
  void clear_bits(std::uint32_t address, std::uint32_t bits) {
    std::uint32_t value = 0;
    bus.chip.read(address, 4, value);
    poke(address, value & ~bits);
  }

  BootChip bus;
  GateWatch watch{bus.chip, bus.board, read_board(TomlFile::read(ROTORLOOP_SOURCE_DIR "/vehicles/boards/b_g431b_esc1.toml"))};
  tools::ToolNode tool;

 private:
  struct Patched {
    std::uint32_t at;
    std::uint16_t before;
    std::uint64_t resets;
  };
  void write_instruction(std::uint32_t at, std::uint16_t instruction) {
    std::memcpy(bus.chip.memory(at, 2), &instruction, 2);
    bus.chip.core().code_changed(at, 2);
    bus.chip.core().restored();
  }
  std::uint64_t commands_ = 0;
  std::optional<Patched> patched_;
};

}  // namespace rotorloop::safety
