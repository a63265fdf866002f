// DMA1 and DMA2 with six channels each, and the multiplexer that gives them their requests (RM0440, 12, 13).
#pragma once
#include "sim/mcu/g431/block.hpp"

namespace rotorloop::mcu::g431 {

struct DmamuxMore {
  std::array<uint64_t, 2> high{};  // requests held at the moment
};

class Dmamux : public RegisterBlock<0x148, DmamuxMore> {
 public:
  explicit Dmamux(Wires& wires);
  void reset(bool power_up) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void on_dma_request(uint32_t request, bool high);
  uint32_t request_of(uint32_t channel) const { return field(4 * channel, 0, 7); }
  bool held(uint32_t request) const { return (s.more.high[request >> 6] >> (request & 63) & 1) != 0; }
};

struct DmaMore {
  std::array<uint32_t, 6> reload{}, from{}, to{};  // count and addresses at the start; `from` is the peripheral's
  std::array<uint16_t, 6> pulses{};                // requests that wait
  uint64_t free_at = 0;                            // when the next transfer can be
};

class Dma : public RegisterBlock<0x80, DmaMore> {
 public:
  Dma(Wires& wires, const Dmamux& mux, uint32_t number);
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void advance(uint64_t cycle) override;
  uint64_t next_event() const override;
  void on_dma_request(uint32_t request, bool pulse);

 private:
  int ready() const;  // the channel that is next, or -1
  void transfer(uint32_t channel);
  void follow();
  const Dmamux& mux_;
  const uint32_t first_channel_;
};

}  // namespace rotorloop::mcu::g431
