// An STM32G431 around the core: memories, register blocks, and the loop that gives each its time. The caller owns time.
#pragma once
#include <array>
#include <bitset>
#include <memory>
#include <string>
#include <vector>

#include "sim/mcu/core/core.hpp"
#include "sim/mcu/g431/block.hpp"
#include "sim/mcu/g431/due.hpp"
#include "sim/mcu/g431/gpio.hpp"
#include "sim/mcu/g431/memory_map.hpp"

namespace rotorloop::mcu::g431 {

struct Blocks;

inline constexpr uint32_t kInterrupts = 102;

// An access that the chip refuses: what the program did wrong, or what is not built.
struct Refused {
  const char* block = "";  // "" where no block is
  const char* reg = "";
  const char* why = "";
  uint32_t address = 0, bytes = 0, value = 0, pc = 0;
  bool write = false;
  uint64_t cycle = 0;
};
std::string text(const Refused& refused);  // one line, numbers in hex

// What a board hears of the chip and answers to it.
class Pins {
 public:
  virtual ~Pins() = default;
  // A pin that the chip drives changed, or is let go. pin = 16 * port + number.
  virtual void on_pin(uint32_t /*pin*/, bool /*driven*/, bool /*high*/) {}
  virtual void on_uart(uint32_t /*number*/, uint8_t /*byte*/) {}  // a frame left the chip: USART1 to 3, 4 UART4, 6 LPUART1
  virtual void on_signal(Signal, bool /*high*/) {}                // of those in heard()
  virtual bool heard(Signal) const { return false; }
  virtual double pin_V(uint32_t /*pin*/) { return 0.0; }
};

enum class End : uint8_t { at_cycle, refused, locked_up, breakpoint, stopped };

class Chip : public Bus, public Wires, private AccessWatch {
 public:
  explicit Chip(uint64_t unique_id = 0x4E45'3339'3233'5001, const Clocks& crystals = {});
  ~Chip() override;

  // Power-up: RAM holds `ram` everywhere (the chip promises nothing), flash stays.
  void power_up(uint8_t ram = 0);
  // Runs until core cycle `cycle` (or past it by the rest of one instruction), or until something ends it.
  End run_until(uint64_t cycle);
  void request_stop() { stop_run(); }  // from Pins: run_until returns End::stopped
  uint64_t cycle() const { return core_.cycle(); }
  double time_s() const { return time_s_at(now()); }

  // Plain data of the whole chip; restore takes what snapshot gave, of any chip of this kind.
  std::vector<std::byte> snapshot() const;
  void restore(std::span<const std::byte> snapshot);

  bool lenient = false;  // refused accesses read 0, do nothing, and are counted
  bool ignore_lock_up = false;
  Pins* pins = nullptr;
  const Refused& refused() const { return refused_; }  // the last one
  uint64_t refused_count() const { return counts_.refused; }
  uint64_t unclocked_count() const { return counts_.unclocked; }  // accesses to a block whose clock is off: read 0, do nothing
  uint64_t resets() const { return counts_.resets; }
  Core& core() { return core_; }
  Blocks& blocks() { return *blocks_; }
  std::span<Block* const> all() const { return all_; }
  uint8_t* memory(uint32_t address, uint32_t bytes);  // null where no plain memory is
  const std::vector<uint8_t>& ram() const { return ram_; }

  // Bus
  bool read(uint32_t address, uint32_t bytes, uint32_t& value) override;
  bool write(uint32_t address, uint32_t bytes, uint32_t value) override;
  // Wires
  uint64_t now() const override { return now_; }
  const Clocks& clocks() const override { return time_.clocks; }
  double time_s_at(uint64_t cycle) const override;
  uint64_t cycle_at(double time_s) const override;
  void set_interrupt(const Block& from, uint32_t line, bool high) override;
  void raise_nmi() override { core_.raise_nmi(); }
  void set_dma_request(uint32_t request, bool high) override;
  void pulse_dma_request(uint32_t request) override;
  void set_signal(Signal signal, bool high) override;
  bool signal(Signal signal) const override { return levels_[index(signal)]; }
  bool bus_read(uint32_t address, uint32_t bytes, uint32_t& value) override;
  bool bus_write(uint32_t address, uint32_t bytes, uint32_t value) override;
  double pin_V(uint32_t pin) override { return pins != nullptr ? pins->pin_V(pin) : 0.0; }
  void refuse(const char* why) override;
  void reschedule(const Block& block) override;
  void reset_chip(uint32_t rcc_csr_flag) override { reset_flags_ |= rcc_csr_flag; }
  void change_clocks(const Clocks& clocks) override;
  void reset_behind(uint8_t gate_offset, uint32_t bits) override;
  std::span<uint8_t> flash() override { return flash_; }
  std::span<uint8_t> information() override { return information_; }
  void flash_changed(uint32_t address, uint32_t bytes) override;
  void stall(uint64_t cycles) override { core_.state.cycle += cycles; }
  void watch_flash_loads(bool on) override { core_.watch(Watcher::chip, on ? this : nullptr); }
  uint32_t program_counter() const override { return core_.state.r[kPc]; }
  void stop_run() override {
    stop_asked_ = true;
    core_.stop_at(0);
  }
  void set_wait_states(uint32_t wait_states) override { core_.set_clocking(Clocking::flash, wait_states); }
  void uart_sent(uint32_t number, uint8_t byte) override {
    if (pins != nullptr) pins->on_uart(number, byte);
  }
  void set_pin(uint32_t pin, Level level);  // from outside
  void pin_changed(uint32_t pin, bool driven, bool high) override {
    if (pins != nullptr) pins->on_pin(pin, driven, high);
  }

 private:
  // Time by the clock of the moment; cycles before it were told with others.
  struct Time {
    Clocks clocks;
    uint64_t from_cycle = 0;
    double from_s = 0.0;
  };
  struct Counts {
    uint64_t refused = 0, unclocked = 0, resets = 0;
  };
  struct Levels {
    std::array<uint64_t, kInterrupts> held{};  // by which blocks each interrupt line is high
  };
  void on_access(uint32_t address, uint32_t bytes, Access kind) override;
  MemoryMap& map();
  void fill_information(uint64_t unique_id);
  void ask_all();               // every block for its next event
  void settle(uint64_t cycle);  // all events up to it, in the order of their cycles, then of the blocks
  Block* at(uint32_t address) const;
  bool access(uint32_t address, uint32_t bytes, uint32_t& value, bool write, bool settle_first);
  void reset(uint32_t rcc_csr_flags, bool power_up);
  bool refuse_access(const char* block, const char* reg, const char* why);
  template <class Visit>
  void visit_state(Visit&& visit) const;

  std::vector<uint8_t> flash_, ram_, information_;
  MemoryMap memories_;
  Core core_;
  std::unique_ptr<Blocks> blocks_;
  std::vector<Block*> all_;
  Due due_;
  std::vector<Block*> pages_;                   // by 256 bytes: APB and AHB1, then AHB2
  std::vector<std::vector<Block*>> listeners_;  // by signal
  std::bitset<static_cast<size_t>(Signal::count)> levels_, heard_;
  Levels lines_;
  Time time_;
  Counts counts_;
  Refused doing_, refused_;  // the access that is being done, and the last refused
  uint64_t now_ = 0, next_due_ = kNever;
  uint32_t reset_flags_ = 0;
  bool access_refused_ = false, ended_ = false, stop_asked_ = false;
};

}  // namespace rotorloop::mcu::g431
