// The timers (RM0440, 28 to 31): one counter with up to six compares, the same for TIM1 to TIM17; a table says what each of them has.
#pragma once
#include "sim/mcu/g431/block.hpp"

namespace rotorloop::mcu::g431 {

struct TimerKind {
  uint8_t number;
  const char* name;
  uint32_t base;
  Gate gate;
  bool apb2;
  uint8_t channels;       // with a compare register at a pin
  uint8_t complementary;  // of them with a second output
  bool wide;              // counts in 32 bits
  bool advanced;          // centre-aligned, slave mode … and for TIM1 and TIM8 channels 5 and 6
  bool slave, breaks;
  uint8_t irq_break, irq_update, irq_trigger, irq_compare;
  uint8_t dma_compare, dma_update, dma_trigger, dma_com;  // 0: none
};
std::span<const TimerKind> timer_kinds();

// What beside the registers a timer remembers. Counts are those of its own clock, behind the prescaler.
struct TimerMore {
  uint64_t tick_at = 0;                                                   // cycle at which the counter took its value
  uint32_t counter = 0, prescaler = 0, reload = 0xFFFF, repetitions = 0;  // those that work, behind the preload
  uint32_t ccer = 0;
  uint32_t outputs = 0;           // a bit for each channel that compares
  uint64_t cycles_of_a_tick = 1;  // of the clock before the prescaler
  std::array<uint32_t, 6> compare{}, mode{};
  std::array<bool, 6> reference{};
  std::array<bool, 8> wanted{}, output{};  // outputs 1 to 4, then complementary 1 to 4; wanted: without dead time
  std::array<uint64_t, 8> rise_at{kNever, kNever, kNever, kNever, kNever, kNever, kNever, kNever};
  uint64_t next_rise = kNever;        // the least of them
  std::array<uint8_t, 4> captures{};  // edges counted by the input prescaler
  std::array<bool, 4> input{};
  bool down = false, gate_open = false, trigger = false, cleared = false, break_in = false, break2_in = false;
  uint8_t burst = 0;
  uint8_t lines = 0;  // levels at the interrupt lines as last told; 0: not yet told
};

class Timer : public RegisterBlock<0x400, TimerMore> {
 public:
  Timer(Wires& wires, const TimerKind& kind);
  void reset(bool power_up) override;
  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void advance(uint64_t cycle) override;
  uint64_t next_event() const override;
  bool listens(Signal signal) const override;
  void on_signal(Signal signal, bool high) override;
  void clocks_changed() override;
  uint32_t frequency_Hz() const;  // of one tick
  bool counts_down() const { return s.more.down; }

 private:
  Signal wire(TimerWire w) const { return first_wire_ + static_cast<uint32_t>(w); }
  Signal wire(TimerWire w, uint32_t by) const { return wire(w) + by; }
  bool running() const;
  bool counts_by_itself() const;
  bool centred() const { return field(0x00, 5, 2) != 0; }
  uint32_t top() const { return kind_.wide ? 0xFFFFFFFFu : 0xFFFFu; }
  uint64_t tick() const { return s.more.cycles_of_a_tick * (s.more.prescaler + 1); }
  bool seen_at_once() const;
  uint64_t ticks_to_boundary() const;
  uint64_t ticks_to_event() const;  // a boundary or a compare
  bool is_output(uint32_t channel) const { return (s.more.outputs >> channel & 1) != 0; }
  void choose_outputs();
  // Counting (timer.cpp)
  void step(uint64_t ticks);
  void boundary();
  void update();
  void update_event(bool by_software);
  void match(uint32_t channel, bool while_down);
  void raise(uint32_t sr_bit);
  void request_dma(uint32_t request);
  void interrupts();
  void write_cr1(uint32_t value, uint32_t mask);
  void generate(uint32_t value);
  void load_compares(bool all);
  uint32_t burst_register() const { return 4 * (field(0x3DC, 0, 5) + s.more.burst); }
  // Inputs (timer_input.cpp)
  void input_changed(uint32_t channel, bool high);
  void capture(uint32_t channel);
  void trigger_level(bool high);
  void triggered();
  void count_edge(bool down);
  Signal trigger_source() const;
  Signal input_source(uint32_t channel) const;
  Signal etr_source() const;
  bool takes_edge(uint32_t channel, bool high) const;
  void follow_breaks();
  void break_now(uint32_t sr_bit);
  bool break_level(uint32_t af, uint32_t enable, uint32_t polarity) const;
  // Outputs (timer_output.cpp)
  // Besides the number of a channel that matches: outputs follow in any case, or only where a reference changed.
  static constexpr uint32_t kAll = 6, kWhatChanged = 7;
  void follow_references(uint32_t matched = kAll);
  bool compare_reference(uint32_t channel, bool matched) const;
  void follow_outputs();
  void set_output(uint32_t output, bool high);
  void want(uint32_t output, bool high, uint64_t delay);
  void rise_at(uint32_t output, uint64_t cycle);
  uint64_t dead_time(uint32_t dtg) const;
  void trigger_out(uint32_t event);
  void com_event();
  void follow_preload(bool com = false);

  const TimerKind kind_;
  const Signal first_wire_;
};

}  // namespace rotorloop::mcu::g431
