// The firmware core built for the chip (plain_program.cpp), in closed loop with a drive, beside the same core built for the host, which
// gets the same counts: what both do with the bridge and report has to be equal bit for bit in every sample period.
//
//   mcu_core_loop IMAGE PERIODS     prints a line; exit code 1: a difference, or something of a round did not happen
//   mcu_core_loop IMAGE sweep       core_sweep.cpp
#include <cstdio>
#include <cstdlib>
#include <memory>

#include "test/integration/mcu/plain_chip.hpp"

namespace {

using namespace rotorloop;
using namespace rotorloop::plain_board;
using firmware::MotorState;

constexpr std::uint64_t kRound = 360'000;     // 15 s
constexpr std::uint64_t kMotorPart = 96'000;  // of a round: all but the commissioning

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
    measure(drive, n, r);
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
    move(drive, in_force, r);
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
  if (std::strcmp(arguments[2], "sweep") == 0) return sweep(image);
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
