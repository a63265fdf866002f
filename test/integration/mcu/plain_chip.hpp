// The emulated core with the program of plain_program.cpp, and a drive behind its registers.
#pragma once
#include <cstring>
#include <string>
#include <vector>

#include "sim/drive/boards.hpp"
#include "sim/drive/drive.hpp"
#include "sim/mcu/core/core.hpp"
#include "test/integration/mcu/plain_esc.hpp"

namespace rotorloop::plain_board {

inline constexpr std::uint32_t kFlash = 0x08000000, kRam = 0x20000000, kPeriod_cycles = 7083;
inline constexpr double kSample_Hz = 24'000.0;

class NoBus : public mcu::Bus {
  bool read(std::uint32_t, std::uint32_t, std::uint32_t&) override { return false; }
  bool write(std::uint32_t, std::uint32_t, std::uint32_t) override { return false; }
};

// The core with the program, and its registers in RAM.
class ChipSide {
 public:
  explicit ChipSide(const std::vector<std::uint8_t>& image) : flash_(image), ram_(0x8000), core_(map(), bus_, 131072) {
    flash_.resize(0x20000, 0xFF);
    memories_.at(kFlash).bytes = flash_.data();
  }
  void power_up(const Registers& r) {
    std::fill(ram_.begin(), ram_.end(), std::uint8_t{0});
    put(r);
    core_.reset(kFlash);
    run(core_.cycle());
  }
  void put(const Registers& r) { std::memcpy(ram_.data(), &r, sizeof r); }
  Registers get() const {
    Registers r;
    std::memcpy(static_cast<void*>(&r), ram_.data(), sizeof r);
    return r;
  }
  void sample() {
    core_.pulse_interrupt(0);
    run(core_.cycle());
  }
  // From now on until it sleeps again, the period that began at this cycle over.
  void finish(std::uint64_t begun_cycle) { run(begun_cycle); }
  mcu::Core& core() { return core_; }
  std::uint8_t* ram() { return ram_.data(); }
  // All that the other remembers.
  void become(const ChipSide& other) {
    ram_ = other.ram_;
    core_.state = other.core_.state;
    core_.restored();
  }
  std::uint64_t instructions() const { return core_.state.instructions; }
  bool alive() const { return !core_.state.locked_up && core_.state.served[mcu::kHardFault].count == 0; }
  unsigned late = 0;  // sample periods whose interrupt and main loop took longer than one

 private:
  mcu::MemoryMap& map() {
    memories_.add({ram_.data(), kRam, static_cast<std::uint32_t>(ram_.size()), true, false, false});
    memories_.add({flash_.data(), kFlash, 0x20000, false, true, false});
    return memories_;
  }
  void run(std::uint64_t begun_cycle) {
    core_.run_until(begun_cycle + kPeriod_cycles);
    if (core_.state.sleeping) return;
    ++late;
    for (int n = 0; n < 100 && !core_.state.sleeping && alive(); ++n) core_.run_until(core_.cycle() + kPeriod_cycles);
  }

  std::vector<std::uint8_t> flash_, ram_;
  NoBus bus_;
  mcu::MemoryMap memories_;
  mcu::Core core_;
};

// What is ordered in a sample period of a round, and what happens to the supply. Values vary with the number of the round.
struct Moment {
  double from_s;
  firmware::Mode mode;
  float value;
  firmware::CommissioningTask task = firmware::CommissioningTask::off;
};

inline void order(std::uint32_t round, double at_s, Registers& r) {
  const float more = 40.0f * static_cast<float>(round);
  const Moment plan[] = {{0.0, firmware::Mode::off, 0.0f},
                         {0.4, firmware::Mode::speed, 500.0f + more},
                         {1.0, firmware::Mode::speed, 1100.0f - more},
                         {1.2, firmware::Mode::speed, 300.0f},
                         {1.4, firmware::Mode::speed, 900.0f + more},
                         {1.6, firmware::Mode::off, 0.0f},
                         {1.62, firmware::Mode::speed, 700.0f},
                         {2.1, firmware::Mode::duty, 0.45f},
                         {2.3, firmware::Mode::current, 3.0f + 0.1f * more},
                         {2.5, firmware::Mode::speed, -500.0f},
                         {3.1, firmware::Mode::off, 0.0f},
                         {3.7, firmware::Mode::speed, 600.0f},
                         {4.2, firmware::Mode::off, 0.0f},
                         {5.5, firmware::Mode::off, 0.0f, firmware::CommissioningTask::all}};
  for (const Moment& m : plan) {
    if (at_s < m.from_s) break;
    r.mode = static_cast<std::uint32_t>(m.mode);
    r.value = m.value;
    r.task = static_cast<std::uint32_t>(m.task);
  }
}

inline sim::DriveParameters board_drive() {
  sim::DriveParameters d;
  const sim::BoardStage& stage = sim::board_stages()[0];
  d.inverter = stage.inverter;
  d.sensing = stage.sensing;
  d.thermal = stage.thermal;
  return d;
}

// What a sample period begins with.
inline void measure(sim::Drive& drive, std::uint64_t period, Registers& r) {
  const sim::AdcReading adc = drive.sample();
  r.phase = adc.phase;
  r.bus = adc.bus;
  r.temperature = adc.temperature;
  r.unloaded = drive.sample_unloaded();
  r.now_us = static_cast<std::uint32_t>(period * 125 / 3);
}

// And what it ends with: compares of the period before are in force, gates are as they are now.
inline void move(sim::Drive& drive, const std::array<std::uint16_t, 3>& in_force, const Registers& r) {
  const sim::PwmCommand pwm{in_force, static_cast<std::uint16_t>(firmware::FakeBoard::kPwmTop), r.bridge != 0,
                            static_cast<std::uint8_t>(r.gates)};
  for (std::uint32_t k = 0; k < firmware::FakeBoard::kPwmPeriodsPerSample; ++k) drive.step(pwm);
}

// An interrupt at every instruction of a sample period, and the same bytes in five runs, two threads and after restores: 0 where all hold.
int sweep(const std::vector<std::uint8_t>& image);

}  // namespace rotorloop::plain_board
