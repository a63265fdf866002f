// The firmware core built for the chip (plain_program.cpp), in closed loop with a drive, beside the same core built for the host, which
// gets the same counts: what both do with the bridge and report has to be equal bit for bit in every sample period.
//
//   mcu_core_loop IMAGE PERIODS     prints a line of JSON; exit code 1: a difference, or something of a round did not happen
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <vector>

#include "sim/drive/boards.hpp"
#include "sim/drive/drive.hpp"
#include "sim/mcu/core/core.hpp"
#include "test/integration/mcu/plain_esc.hpp"

namespace {

using namespace rotorloop;
using firmware::Mode;
using firmware::MotorState;
using plain_board::PlainEsc;
using plain_board::Registers;

constexpr std::uint32_t kFlash = 0x08000000, kRam = 0x20000000, kPeriod_cycles = 7083, kRound = 360'000;  // 15 s
constexpr std::uint64_t kMotorPart = 96'000;  // of a round: all but the commissioning
constexpr double kSample_Hz = 24'000.0;

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
    run();
  }
  void put(const Registers& r) { std::memcpy(ram_.data(), &r, sizeof r); }
  Registers get() const {
    Registers r;
    std::memcpy(static_cast<void*>(&r), ram_.data(), sizeof r);
    return r;
  }
  void sample() {
    core_.pulse_interrupt(0);
    run();
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
  // Until it sleeps again.
  void run() {
    core_.run_until(core_.cycle() + kPeriod_cycles);
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
  Mode mode;
  float value;
  firmware::CommissioningTask task = firmware::CommissioningTask::off;
};

void order(std::uint32_t round, double at_s, Registers& r) {
  const float more = 40.0f * static_cast<float>(round);
  const Moment plan[] = {{0.0, Mode::off, 0.0f},
                         {0.4, Mode::speed, 500.0f + more},
                         {1.0, Mode::speed, 1100.0f - more},
                         {1.2, Mode::speed, 300.0f},
                         {1.4, Mode::speed, 900.0f + more},
                         {1.6, Mode::off, 0.0f},
                         {1.62, Mode::speed, 700.0f},
                         {2.1, Mode::duty, 0.45f},
                         {2.3, Mode::current, 3.0f + 0.1f * more},
                         {2.5, Mode::speed, -500.0f},
                         {3.1, Mode::off, 0.0f},
                         {3.7, Mode::speed, 600.0f},
                         {4.2, Mode::off, 0.0f},
                         {5.5, Mode::off, 0.0f, firmware::CommissioningTask::all}};
  for (const Moment& m : plan) {
    if (at_s < m.from_s) break;
    r.mode = static_cast<std::uint32_t>(m.mode);
    r.value = m.value;
    r.task = static_cast<std::uint32_t>(m.task);
  }
}

sim::DriveParameters board_drive() {
  sim::DriveParameters d;
  const sim::BoardStage& stage = sim::board_stages()[0];
  d.inverter = stage.inverter;
  d.sensing = stage.sensing;
  d.thermal = stage.thermal;
  return d;
}

struct Seen {
  unsigned long long periods = 0, differ = 0, states = 0, tripped = 0, tested = 0, commissioned = 0;
};

void look(Seen& seen, const Registers& r) {
  seen.states |= 1ull << r.state;
  if ((r.report[0] & 0xFF) == static_cast<std::uint32_t>(firmware::Fault::overvoltage)) ++seen.tripped;
  if ((r.report[0] >> 24 & 0xF) == static_cast<std::uint32_t>(firmware::SelfTest::passed)) ++seen.tested;
  if ((r.report[9] >> 8 & 0xFF) == static_cast<std::uint32_t>(firmware::CommissioningEnd::done)) ++seen.commissioned;
}

void round_of(std::uint32_t round, std::uint64_t periods, ChipSide& chip, Seen& seen) {
  Registers r;
  r.stop_mode = (round + 1) % 3;
  sim::Drive drive(board_drive(), {round + 1, 7}, 0.3 * round);
  drive.set_load({3e-8, 0.0});
  chip.power_up(r);
  const auto native = std::make_unique<PlainEsc>(r);
  Registers host = r;
  for (std::uint64_t n = 0; n < kRound && seen.periods < periods; ++n, ++seen.periods) {
    const double at_s = static_cast<double>(n) / kSample_Hz;
    drive.set_bus_V(at_s >= 1.9 && at_s < 1.902 ? 30.0 : 15.2);  // over-voltage: the trip
    const sim::AdcReading adc = drive.sample();
    r.phase = adc.phase;
    r.bus = adc.bus;
    r.temperature = adc.temperature;
    r.unloaded = drive.sample_unloaded();
    r.now_us = static_cast<std::uint32_t>(n * 125 / 3);
    order(round, at_s, r);
    const std::array<std::uint16_t, 3> in_force = r.compare;
    Registers native_now = r;
    native_now.state = host.state;
    native_now.report = host.report;
    native_now.polls = host.polls;
    host = native_now;
    native->on_sample(host);
    native->poll(host);
    chip.put(r);
    chip.sample();
    r = chip.get();
    if (!(r == host) && ++seen.differ <= 3)
      std::fprintf(stderr, "round %u differs in period %llu, %.6f s\n", round, static_cast<unsigned long long>(n), at_s);
    look(seen, r);
    const sim::PwmCommand pwm{in_force, static_cast<std::uint16_t>(firmware::FakeBoard::kPwmTop), r.bridge != 0,
                              static_cast<std::uint8_t>(r.gates)};
    for (std::uint32_t k = 0; k < firmware::FakeBoard::kPwmPeriodsPerSample; ++k) drive.step(pwm);
  }
}

bool everything_happened(const Seen& seen) {
  bool all = seen.tripped != 0 && seen.tested != 0 && (seen.commissioned != 0 || seen.periods <= kMotorPart);
  for (const MotorState s : {MotorState::off, MotorState::align, MotorState::ramp, MotorState::running, MotorState::fault,
                             MotorState::handover, MotorState::catching, MotorState::stopping, MotorState::holding})
    all = all && (seen.states >> static_cast<unsigned>(s) & 1) != 0;
  return all;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 3) return 2;
  std::vector<std::uint8_t> image(0x20000);
  std::FILE* file = std::fopen(arguments[1], "rb");
  if (file == nullptr) return 2;
  image.resize(std::fread(image.data(), 1, image.size(), file));
  std::fclose(file);
  const std::uint64_t periods = std::strtoull(arguments[2], nullptr, 10);
  ChipSide chip(image);
  Seen seen;
  for (std::uint32_t round = 0; seen.periods < periods && chip.alive(); ++round) round_of(round, periods, chip, seen);
  const bool complete = everything_happened(seen);
  std::printf(
      "%llu periods, %llu differ; %s: states %#llx, %llu periods with the trip, %llu after a self-test passed, %llu after a commissioning; "
      "%llu instructions, %u times longer than a period%s\n",
      seen.periods, seen.differ, complete ? "complete" : "not complete", seen.states, seen.tripped, seen.tested, seen.commissioned,
      static_cast<unsigned long long>(chip.instructions()), chip.late, chip.alive() ? "" : "; the chip has stopped");
  return seen.differ == 0 && complete && chip.alive() && seen.periods == periods ? 0 : 1;
}
