// An FDCAN1 at 1 Mbit/s on the virtual bus, beside two other nodes.
#pragma once
#include "host/bus/frame_bits.hpp"
#include "sim/mcu/g431/fdcan/virtual_bus_medium.hpp"
#include "test/unit/sim/mcu/g431/bench.hpp"

namespace rotorloop::mcu::g431::testing {

inline constexpr uint32_t kCan = 0x40006400, kRam = 0x4000A400, kTx = kRam + 0x278, kRx0 = kRam + 0x0B0, kRx1 = kRam + 0x188,
                          kEvents = kRam + 0x260;
inline constexpr uint32_t TEST = kCan + 0x10, CCCR = kCan + 0x18, NBTP = kCan + 0x1C, TSCC = kCan + 0x20, TSCV = kCan + 0x24,
                          ECR = kCan + 0x40, PSR = kCan + 0x44, IR = kCan + 0x50, IE = kCan + 0x54, ILS = kCan + 0x58, ILE = kCan + 0x5C,
                          RXGFC = kCan + 0x80, XIDAM = kCan + 0x84, HPMS = kCan + 0x88, RXF0S = kCan + 0x90, RXF0A = kCan + 0x94,
                          RXF1S = kCan + 0x98, TXBC = kCan + 0xC0, TXFQS = kCan + 0xC4, TXBRP = kCan + 0xC8, TXBAR = kCan + 0xCC,
                          TXBCR = kCan + 0xD0, TXBTO = kCan + 0xD4, TXBCF = kCan + 0xD8, TXBTIE = kCan + 0xDC, TXEFS = kCan + 0xE4,
                          TXEFA = kCan + 0xE8;
inline constexpr uint32_t kTiming = 9u << 16 | 13u << 8 | 1u;  // by 10, 1 + 14 + 2 quanta: 1 Mbit/s at 170 MHz

inline CanFrame frame(uint32_t id, std::initializer_list<uint8_t> bytes = {}, bool extended = false) {
  CanFrame f{.id = id, .extended = extended, .length = static_cast<uint8_t>(bytes.size()), .data = {}};
  std::copy(bytes.begin(), bytes.end(), f.data.begin());
  return f;
}

inline std::vector<sim::BusFault> alone() {
  return {{.kind = sim::BusFaultKind::unplugged, .port = 1, .at_ns = 0}, {.kind = sim::BusFaultKind::unplugged, .port = 2, .at_ns = 0}};
}

class CanBench : public Bench {
 public:
  explicit CanBench(std::vector<sim::BusFault> faults = {}) : bus({.faults = std::move(faults)}), medium(bus, chip.blocks().fdcan, true) {
    other = &bus.attach({.name = "other"});
    bus.attach({.name = "a third, which acknowledges"});
    bus.set_tap([this](const sim::BusEvent& e) { on_bus.push_back(e); });
    run_at_170_MHz();
    write(kRcc + 0x88, 2u << 24);  // kernel clock: PCLK1
    configure([] {});
  }
  // In INIT and CCE, then on the bus.
  template <class Registers>
  void configure(Registers&& registers, uint32_t modes = 0, uint32_t timing = kTiming) {
    write(CCCR, 1);
    write(CCCR, 3);
    write(NBTP, timing);
    write(CCCR, 3 | modes);
    registers();
    write(CCCR, modes);
    run_us(20);
  }
  void put(uint32_t buffer, const CanFrame& f, uint32_t second = 0) {
    const uint32_t at = kTx + 72 * buffer;
    write(at, f.extended ? 1u << 30 | f.id : f.id << 18);
    write(at + 4, uint32_t{f.length} << 16 | second);
    for (uint32_t i = 0; i < f.length; i += 4)
      write(at + 8 + i, f.data[i] | uint32_t{f.data[i + 1]} << 8 | uint32_t{f.data[i + 2]} << 16 | uint32_t{f.data[i + 3]} << 24);
  }
  void send(uint32_t buffer, const CanFrame& f, uint32_t second = 0) {
    put(buffer, f, second);
    write(TXBAR, 1u << buffer);
  }
  int64_t now_ns() { return std::llround(chip.time_s() * 1e9); }
  void hear(const CanFrame& f) {
    bus.set_now(std::max(bus.now_ns(), now_ns()));
    other->send(f);
    bus.has_frame(bus.now_ns());
    read(CCCR);
    run_us(200);
  }
  std::vector<uint32_t> ids() const {
    std::vector<uint32_t> out;
    for (const auto& e : on_bus)
      if (!e.error) out.push_back(e.frame.id);
    return out;
  }

  sim::VirtualBus bus;
  VirtualBusMedium medium;
  CanBus* other = nullptr;
  std::vector<sim::BusEvent> on_bus;
};

}  // namespace rotorloop::mcu::g431::testing
