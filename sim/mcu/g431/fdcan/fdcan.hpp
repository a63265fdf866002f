// FDCAN1 with its message RAM (RM0440, 44): classic frames on a bus that times every bit. Where the manual is silent: Bosch's M_CAN.
#pragma once
#include <array>

#include "sim/mcu/g431/block.hpp"
#include "sim/world/bus_controller.hpp"

namespace rotorloop::mcu::g431 {

// The wire as the controller reaches it (board/ joins it to a virtual bus).
class CanMedium {
 public:
  virtual ~CanMedium() = default;
  virtual void advance_to(int64_t time_ns) = 0;  // tells the controller every start and end up to then; nothing, where others move the bus
  virtual int64_t next_event_ns() const = 0;     // a lower bound of the next start or end, if nobody sends before
  virtual void has_frame(int64_t since_ns) = 0;  // ready_ns() became earlier
};

// 848 bytes at 0x4000A400; words only. Its layout is fixed (44.3.3); what it holds after power-up is not defined, here zero.
class MessageRam : public RegisterBlock<848, Nothing> {
 public:
  explicit MessageRam(Wires& wires);
  void reset(bool power_up) override {
    if (power_up) s = State{};
  }
  uint32_t widths() const override { return 0b100; }
  uint32_t& word(uint32_t offset) { return reg(offset); }
};

struct FdcanMore {
  struct Fifo {
    uint8_t get = 0, fill = 0;
    uint8_t put() const { return static_cast<uint8_t>((get + fill) % 3); }
  };
  std::array<Fifo, 2> rx{};
  Fifo events;
  uint8_t tx_get = 0, tx_fill = 0;                                // in FIFO mode
  std::array<int64_t, 3> asked_ns{};                              // when each transmit buffer was asked for
  uint32_t pending = 0, sent = 0, cancelled = 0, cancelling = 0;  // TXBRP, TXBTO, TXBCF, cancellations that wait for the end of the frame
  int32_t offered = -1;                                           // buffer with which it took part in the arbitration
  int32_t transmit_errors = 0, receive_errors = 0;
  uint8_t logged_errors = 0, last_error = 7;
  bool bus_off = false, sending = false, hearing = false, init_reads_back = true;
  int32_t recovery_left = 0;      // sequences of 11 recessive bits until it may take part again
  int64_t recessive_from_ns = 0;  // … of which the next begins here
  int64_t suspended_until_ns = 0;
  int64_t loop_end_ns = 0;    // internal loop back: end of the frame that is being sent; 0: none
  int64_t stamp_zero_ns = 0;  // when the time-stamp counter was 0
  CanFrame frame{};           // what it offered
};

class Fdcan : public RegisterBlock<0x104, FdcanMore>, public sim::BusController {
 public:
  Fdcan(Wires& wires, MessageRam& ram);
  // The wire that it hangs on; none: requests stay pending. It outlives the chip.
  void connect(CanMedium* medium) { medium_ = medium; }
  double bit_ns() const;  // of the bit timing registers; 0: no kernel clock

  void reset(bool power_up) override;
  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void advance(uint64_t cycle) override;
  uint64_t next_event() const override;

  // BusController
  int64_t ready_ns() const override;
  const CanFrame* offer(int64_t time_ns) override;
  void on_start(int64_t time_ns, bool own) override;
  void on_end(const sim::FrameEnd& end) override;
  bool acknowledges(int64_t time_ns) const override;
  bool takes_own_acknowledge() const override { return loops_back(); }
  bool passive() const override { return !s.more.bus_off && (s.more.transmit_errors > 127 || s.more.receive_errors > 127); }
  bool in_time(int64_t bit_ns) const override;

 private:
  bool configurable() const;  // CCE and INIT: protected registers may be written
  bool started() const;
  bool loops_back() const;
  bool sends_frames() const;
  int64_t now_ns() const;
  int64_t time_ns(uint64_t cycle) const;
  int64_t bits_ns(int64_t bits) const;
  uint16_t time_stamp(int64_t time_ns) const;

  void write_cccr(uint32_t value);
  void stop();   // INIT, by software or bus-off
  void begin();  // INIT cleared
  void clear_by_cce();
  void ask_for(uint32_t buffers);
  void cancel(uint32_t buffers);
  void acknowledge(uint32_t fifo, uint32_t index);
  uint32_t transmit_status() const;
  uint32_t fifo_status(const FdcanMore::Fifo& fifo, bool lost) const;
  uint32_t error_status();
  void flag(uint32_t interrupts);
  void update_lines();

  int best_buffer(int64_t time_ns) const;
  CanFrame frame_of(uint32_t buffer) const;
  int64_t first_request_ns() const;
  const CanFrame* offer_at(int64_t time_ns);
  bool queue_mode() const;
  void finish_request(uint32_t buffer, bool was_sent);
  void sent(const sim::FrameEnd& end);
  void not_sent(uint32_t buffer);
  void record_event(uint32_t buffer, int64_t start_ns);
  void take_in(const CanFrame& frame, int64_t start_ns);
  void count_error(bool transmitting, bool acknowledge_missing, uint8_t code);
  void follow_errors(int32_t transmit_before, int32_t receive_before);
  void hear_recessive(int64_t until_ns);
  void run_internal_loop(int64_t until_ns);

  // Filters (fdcan_filter.cpp)
  struct Match {
    uint8_t action = 0;  // as SFEC and EFEC; 3: rejected
    uint8_t filter = 0;
    bool none = false;  // by what the global filter says of identifiers that no filter names
  };
  Match match(const CanFrame& frame);
  Match match_standard(uint32_t id);
  Match match_extended(uint32_t id);
  bool store(uint32_t fifo, const CanFrame& frame, const Match& match, int64_t start_ns);

  MessageRam& ram_;
  CanMedium* medium_ = nullptr;
};

}  // namespace rotorloop::mcu::g431
