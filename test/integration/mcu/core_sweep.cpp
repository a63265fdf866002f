#include <algorithm>
#include <cstdio>
#include <thread>

#include "test/integration/mcu/plain_chip.hpp"

namespace rotorloop::plain_board {
namespace {

constexpr std::uint64_t kRunning = 24'000;  // 1 s: self-test, start and a first step are over

struct Loop {
  explicit Loop(const std::vector<std::uint8_t>& image) : chip(image), drive(board_drive(), {1, 7}) {
    r.stop_mode = 1;
    drive.set_bus_V(15.2);
    drive.set_load({3e-8, 0.0});
    chip.power_up(r);
  }
  void begin() {
    measure(drive, period, r);
    order(0, static_cast<double>(period) / kSample_Hz, r);
    in_force = r.compare;
    chip.put(r);
  }
  void end() {
    r = chip.get();
    move(drive, in_force, r);
    ++period;
    const double moved[] = {drive.omega_rad_s(), drive.motor().current_A().alpha, drive.bus_energy_J()};
    add(&r, sizeof r);
    add(moved, sizeof moved);
  }
  void step() {
    begin();
    chip.sample();
    end();
  }
  void become(const Loop& other) {
    chip.become(other.chip);
    drive = other.drive;
    r = other.r;
    in_force = other.in_force;
    period = other.period;
    digest = other.digest;
  }

  ChipSide chip;
  sim::Drive drive;
  Registers r;
  std::array<std::uint16_t, 3> in_force{};
  std::uint64_t period = 0, digest = 0xCBF29CE484222325u;  // FNV-1a of all registers and of the drive

 private:
  void add(const void* data, std::size_t bytes) {
    for (const auto* at = static_cast<const unsigned char*>(data); bytes-- > 0; ++at) digest = (digest ^ *at) * 0x100000001B3u;
  }
};

// Not compared, as the interrupt itself changes them: counts of instructions, exceptions and waits, caches of the flash and last addresses,
// where the last FP frame was, RAM between the variables and the stack.
bool same(Loop& a, Loop& b) {
  const mcu::CoreState &x = a.chip.core().state, &y = b.chip.core().state;
  const std::uint32_t sp = x.r[mcu::kSp] - kRam;
  return a.digest == b.digest && x.r == y.r && x.s == y.s && x.fpscr == y.fpscr && a.chip.core().xpsr() == b.chip.core().xpsr() &&
         x.cycle == y.cycle && x.control == y.control && std::equal(a.chip.ram(), a.chip.ram() + 0x6000, b.chip.ram()) &&
         std::equal(a.chip.ram() + sp, a.chip.ram() + 0x8000, b.chip.ram() + sp);
}

// From a snapshot with a motor that runs: the interrupt at each instruction of a sample period, and a period more behind it.
int sweep_period(const std::vector<std::uint8_t>& image, const Loop& running) {
  Loop with(image), without(image), straight(image);
  straight.become(running);
  straight.step();
  straight.step();
  without.become(running);
  without.begin();
  const std::uint64_t begun = without.chip.core().cycle();
  without.chip.core().pulse_interrupt(0);
  int places = 0, differ = 0;
  for (; !without.chip.core().state.sleeping || without.chip.core().cycle() == begun; ++places) {
    with.become(without);
    with.chip.core().pulse_interrupt(1);
    with.chip.finish(begun);
    with.end();
    with.step();
    const bool taken = with.chip.core().state.served[mcu::kFirstInterrupt + 1].count == 1;
    if (!taken || !same(straight, with)) ++differ;
    without.chip.core().run_until(without.chip.core().cycle() + 1);
  }
  std::printf("interrupt at %d places of a sample period: %d differ\n", places, differ);
  return places > 1000 && differ == 0 ? 0 : 1;
}

std::uint64_t run(const std::vector<std::uint8_t>& image, std::uint64_t periods) {
  Loop loop(image);
  while (loop.period < periods) loop.step();
  return loop.digest;
}

// Into another chip and another drive every 37 periods, that is at all kinds of places of the main loop's work.
std::uint64_t run_with_restores(const std::vector<std::uint8_t>& image, std::uint64_t periods) {
  Loop one(image), two(image);
  while (one.period < periods) {
    one.step();
    if (one.period % 37 != 0) continue;
    two.become(one);
    two.step();
    one.become(two);
  }
  return one.digest;
}

}  // namespace

int sweep(const std::vector<std::uint8_t>& image) {
  Loop running(image);
  while (running.period < kRunning) running.step();
  const bool turns = running.drive.omega_rad_s() > 300.0;
  const int swept = sweep_period(image, running);
  std::array<std::uint64_t, 4> digests{};
  digests[0] = run(image, kRunning);
  digests[1] = run_with_restores(image, kRunning);
  std::thread beside([&] { digests[2] = run(image, kRunning); });
  digests[3] = run(image, kRunning);
  beside.join();
  const bool equal = std::count(digests.begin(), digests.end(), running.digest) == 4;
  std::printf(
      "%llu periods, five runs (one with restores into another chip and drive, two in threads side by side): %s, motor %.1f rad/s\n",
      static_cast<unsigned long long>(kRunning), equal ? "the same bytes" : "DIFFERENT", running.drive.omega_rad_s());
  return swept == 0 && equal && turns ? 0 : 1;
}

}  // namespace rotorloop::plain_board
