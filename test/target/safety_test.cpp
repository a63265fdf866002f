// What becomes of the gates when something fails under the program of the ST B-G431B-ESC1: injected on the emulated chip while it turns a
// motor at 3 000 rpm. Prints the rows of docs/acceptance/silicon_safety.md.
//   safety_test ELF [googletest options]
#include <gtest/gtest.h>

#include <filesystem>

#include "test/target/safety_rows.hpp"

namespace rotorloop::safety {
namespace {

constexpr std::uint32_t kTim1 = 0x40012C00, kAdc1 = 0x50000000, kAdc2 = 0x50000100, kNvic = 0xE000E100, kRcc = 0x40021000;
constexpr std::uint32_t kSample = 16 + 18, kCan = 16 + 21;
constexpr std::uint16_t kLoop = 0xE7FE, kUndefined = 0xDE00, kLoad = 0x6800 /* ldr r0, [r0] */, kStore = 0x6000 /* str r0, [r0] */;
constexpr std::uint32_t kNowhereAtAll = 0x6000'0000, kErasedFlash = 0x0801'E000;

void freeze(Bench& b, std::uint32_t in) {
  b.until_in(in);
  b.patch(kLoop);
}
void crash(Bench& b, std::uint32_t in) {
  b.until_in(in);
  b.patch(kUndefined);
}
void jump(Bench& b, std::uint32_t to) {
  b.until_in(0);
  b.core().r[kPc] = to;
  b.bus.chip.core().restored();
}
void access(Bench& b, std::uint16_t instruction, std::uint32_t address) {
  b.until_in(0);
  b.core().r[0] = address;
  b.patch(instruction);
}
void stack_at(Bench& b, std::uint32_t address) {
  b.until_in(0);
  b.core().r[kSp] = address;
  b.bus.chip.core().restored();
}
void hold(Bench& b, std::uint32_t pin, double V) {
  b.watch.stuck_pin = pin;
  b.watch.stuck_V = V;
}
void damage(Bench& b, std::uint32_t address, TornWord how) {
  b.bus.chip.blocks().flash.damage(address, how);
  b.bus.chip.core().restored();
}
std::uint32_t symbol(const std::string& part) {
  for (const ElfSymbol& s : read_elf(program()).symbols)
    if (s.name.find(part) != std::string::npos) return s.address;
  ADD_FAILURE() << "no symbol with " << part;
  return kErasedFlash;
}

constexpr double kInterrupt_us = 2000.0, kLoop_us = 100'000.0, kFault_us = 10.0, kCrystal_us = 1000.0, kPoll_us = 300.0;

const std::vector<Injection> kSamplesStop = {
    {"sample interrupt stuck in a loop", kInterrupt_us, Then::restarts, [](Bench& b) { freeze(b, kSample); }},
    {"all interrupts masked (PRIMASK)", kInterrupt_us, Then::restarts,
     [](Bench& b) {
       b.until_in(0);
       b.core().primask = 1;
       b.bus.chip.core().restored();
     }},
    {"interrupts masked by priority (BASEPRI)", kInterrupt_us, Then::restarts,
     [](Bench& b) {
       b.until_in(0);
       b.core().basepri = 0x10;
       b.bus.chip.core().restored();
     }},
    {"sample interrupt disabled in the NVIC", kInterrupt_us, Then::restarts, [](Bench& b) { b.poke(kNvic + 0x80, 1u << 18); }},
    {"sample interrupt disabled in the ADC", kInterrupt_us, Then::restarts, [](Bench& b) { b.poke(kAdc1 + 0x04, 0); }},
    {"trigger of the samples lost (TRGO)", kInterrupt_us, Then::restarts, [](Bench& b) { b.clear_bits(kTim1 + 0x04, 7u << 4); }},
    {"trigger of the zeros lost (TRGO2)", 0, Then::goes_on, [](Bench& b) { b.clear_bits(kTim1 + 0x04, 0xFu << 20); }},
    {"injected conversions stopped (JADSTP)", kInterrupt_us, Then::restarts, [](Bench& b) { b.poke(kAdc1 + 0x08, 1u << 5 | 1u << 28); }},
    {"clock of the ADCs off", kInterrupt_us, Then::restarts, [](Bench& b) { b.clear_bits(kRcc + 0x4C, 1u << 13); }},
    {"PWM counter stands still", kInterrupt_us, Then::restarts, [](Bench& b) { b.clear_bits(kTim1, 1); }},
};

const std::vector<Injection> kLoopStops = {
    {"main loop stuck", kLoop_us, Then::restarts, [](Bench& b) { freeze(b, 0); }},
    {"CAN interrupt stuck", kLoop_us, Then::restarts, [](Bench& b) { freeze(b, kCan); }},
};

const std::vector<Injection> kFaults = {
    {"undefined instruction in the main loop", kFault_us, Then::restarts, [](Bench& b) { crash(b, 0); }},
    {"undefined instruction in the sample interrupt", kFault_us, Then::restarts, [](Bench& b) { crash(b, kSample); }},
    {"undefined instruction in the CAN interrupt", 45.0, Then::restarts, [](Bench& b) { crash(b, kCan); }},
    {"jump to 0", kFault_us, Then::restarts, [](Bench& b) { jump(b, 0); }},
    {"jump to where nothing is", kFault_us, Then::restarts, [](Bench& b) { jump(b, kNowhereAtAll); }},
    {"jump into erased flash", kFault_us, Then::restarts, [](Bench& b) { jump(b, kErasedFlash); }},
    {"read through null", kFault_us, Then::restarts, [](Bench& b) { access(b, kLoad, 0); }},
    {"write through null", kFault_us, Then::restarts, [](Bench& b) { access(b, kStore, 0); }},
    {"write to where nothing is", kFault_us, Then::restarts, [](Bench& b) { access(b, kStore, kNowhereAtAll); }},
    {"stack overflow", kFault_us, Then::restarts, [](Bench& b) { stack_at(b, 0x2000'0108); }},
    {"stack pointer shows nowhere", kFault_us, Then::restarts, [](Bench& b) { stack_at(b, kNowhereAtAll); }},
    {"vector of the sample interrupt is 0", kFault_us, Then::restarts,
     [](Bench& b) {
       b.until_in(0);
       b.poke(b.core().scb.vtor + 4 * kSample, 0);
     },
     true, true},
    {"vector of the sample interrupt shows nowhere", kFault_us, Then::restarts,
     [](Bench& b) {
       b.until_in(0);
       b.poke(b.core().scb.vtor + 4 * kSample, kNowhereAtAll + 1);
     },
     true, true},
    {"whole vector table shows nowhere (lock-up)", kInterrupt_us, Then::restarts,
     [](Bench& b) {
       b.until_in(0);
       b.poke(0xE000ED08, kNowhereAtAll);
     }},
    {"interrupt without a handler (TIM3)", kFault_us, Then::restarts,
     [](Bench& b) {
       b.until_in(0);
       b.poke(kNvic, 1u << 29);
       b.bus.chip.core().pulse_interrupt(29);
     }},
    {"NMI without a reason", kFault_us, Then::restarts,
     [](Bench& b) {
       b.until_in(0);
       b.bus.chip.core().raise_nmi();
     }},
    {"double ECC error in code of the main loop", kPoll_us, Then::safe,
     [](Bench& b) { damage(b, symbol("EscNode::poll("), TornWord::double_error); }},
    {"corrected ECC error in code of the main loop", 0, Then::goes_on,
     [](Bench& b) { damage(b, symbol("EscNode::poll("), TornWord::single_error); }},
};

const std::vector<Injection> kSupplyAndClock = {
    {"crystal stops", kCrystal_us, Then::restarts, [](Bench& b) { b.bus.chip.set_signal(Signal::clock_failed, true); }},
    {"reset by the pin, rotor turning", kFault_us, Then::restarts,
     [](Bench& b) {
       b.until_in(0);
       b.bus.chip.reset_chip(kPinReset);
       b.clear_bits(kTim1 + 0x0C, 0);  // an access, at whose end the reset comes
     }},
    {"reset asked for by software, rotor turning", kFault_us, Then::restarts, [](Bench& b) { b.poke(0xE000ED0C, 0x05FA0004); }},
    {"supply of the chip gone and back, rotor turning", kFault_us, Then::goes_on, [](Bench& b) { b.power_up(); }},
};

const std::vector<Injection> kSensors = {
    {"amplifier of U dead (0 V)", 0, Then::safe, [](Bench& b) { hold(b, 1, 0.0); }},
    {"amplifier of U at its rail (3.3 V)", 0, Then::safe, [](Bench& b) { hold(b, 1, 3.3 / 16.0); }},
    {"current of U stuck at its zero", 0, Then::safe, [](Bench& b) { hold(b, 1, 2.057 / 16.0); }},
    {"amplifier of V dead (0 V)", 0, Then::safe, [](Bench& b) { hold(b, 7, 0.0); }},
    {"amplifier of V at its rail (3.3 V)", 0, Then::safe, [](Bench& b) { hold(b, 7, 3.3 / 16.0); }},
    {"amplifier of W dead (0 V)", 0, Then::safe, [](Bench& b) { hold(b, 16, 0.0); }},
    {"bus voltage reads 0 V", 5000.0, Then::stops, [](Bench& b) { hold(b, 0, 0.0); }},
    {"bus voltage reads full scale", 100.0, Then::stops, [](Bench& b) { hold(b, 0, 3.3); }},
    {"thermistor reads 120 degC (3.2 V)", 0, Then::stops, [](Bench& b) { hold(b, 30, 3.2); }},
    {"thermistor open (3.3 V)", 0, Then::goes_on, [](Bench& b) { hold(b, 30, 3.3); }},
    {"thermistor shorted (0 V)", 0, Then::goes_on, [](Bench& b) { hold(b, 30, 0.0); }},
};

TEST(InjectedFailure, SamplesThatStopOpenTheBridgeWithin2ms) { run(kSamplesStop, 900 * kMs); }
TEST(InjectedFailure, ALoopThatStopsOpensTheBridgeWithin100ms) { run(kLoopStops, 900 * kMs); }
TEST(InjectedFailure, FaultsOpenTheBridgeWithin10usOfTheException) { run(kFaults, 900 * kMs); }
TEST(InjectedFailure, ResetsAndClocksWhileTheRotorTurns) { run(kSupplyAndClock, 900 * kMs); }
TEST(InjectedFailure, SensorsThatLie) { run(kSensors, 400 * kMs); }

}  // namespace
}  // namespace rotorloop::safety

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  if (argc != 2) {
    std::fprintf(stderr, "usage: safety_test ELF\n");
    return 2;
  }
  rotorloop::safety::program() = argv[1];
  if (!std::filesystem::is_regular_file(argv[1])) {
    std::printf("skipped: 10 tests; the program was not built\n");
    return 77;
  }
  return RUN_ALL_TESTS();
}
