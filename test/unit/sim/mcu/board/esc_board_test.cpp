// The chip's gates move the drive, and the drive's samples are what its converters read. HCLK is 170 MHz.
#include "sim/mcu/board/esc_board.hpp"

#include "sim/mcu/g431/timer_registers.hpp"
#include "test/unit/sim/mcu/g431/bench.hpp"

namespace rotorloop::mcu::g431::testing {
namespace {

using namespace tim;
constexpr uint32_t kTim1 = 0x40012C00, kAdc1 = 0x50000000, kTop = 3541;  // 24 kHz
constexpr uint32_t kDeadTime = 136;                                      // 800 ns

BoardPins pins() {
  BoardPins b;
  b.stage = "b_g431b_esc1";
  b.high = {8, 9, 10};
  b.low = {45, 12, 31};
  b.shunt_plus = {1, 7, 16};
  b.amplified = {2, 6, 17};
  b.bus = 0;
  b.temperature = 30;
  return b;
}

class McuBoard : public ::testing::Test {
 protected:
  McuBoard() {
    b.run_at_170_MHz();
    board.drive().set_bus_V(14.8);
    for (const auto& [pin, af] : {std::pair{8u, 6u}, {9u, 6u}, {10u, 6u}, {45u, 4u}, {12u, 6u}, {31u, 4u}}) alternate(pin, af);
    b.write(kTim1 + ARR, kTop);
    b.write(kTim1 + CCMR1, 0x6868);
    b.write(kTim1 + CCMR2, 0x68);
    b.write(kTim1 + CCER, 0x555);
    b.write(kTim1 + BDTR, MOE | OSSI | OSSR | 0x80 | (kDeadTime / 2 - 64));
    compares({kTop / 2, kTop / 2, kTop / 2});
  }
  void alternate(uint32_t pin, uint32_t af) {
    const uint32_t port = 0x48000000 + 0x400 * (pin / 16), n = pin % 16, afr = port + (n < 8 ? 0x20 : 0x24);
    b.write(afr, (b.read(afr) & ~(15u << 4 * (n & 7))) | af << 4 * (n & 7));
    b.write(port, (b.read(port) & ~(3u << 2 * n)) | 2u << 2 * n);
  }
  void compares(std::array<uint32_t, 3> c) {
    for (uint32_t k = 0; k < 3; ++k) b.write(kTim1 + CCR1 + 4 * k, c[k]);
  }
  void start(uint32_t repetition) {
    b.write(kTim1 + RCR, repetition);
    b.write(kTim1 + EGR, 1);
    b.write(kTim1 + CR1, CEN | ARPE | 3u << 5);
  }
  // To the cycle after a crest.
  void run_to_crest() {
    const uint64_t last = board.last().end_cycle;
    while (board.last().end_cycle == last) b.run_cycles(20);
  }
  double duty(size_t phase) const { return static_cast<double>(board.last().pwm.compare[phase]) / board.last().pwm.top; }
  Bench b;
  EscBoard board{pins(), sim::DriveParameters{}, b.chip, 1};
};

TEST_F(McuBoard, ComparesOverTheReloadValueAreTheDrivesDutyExactlyAndTheDeadTimeIsThatOfTheGates) {
  compares({1000, 2001, 3000});
  start(0);
  for (int n = 0; n < 4; ++n) run_to_crest();
  EXPECT_TRUE(board.switching());
  EXPECT_EQ(board.last().pwm.gates, sim::kAllGates);
  EXPECT_EQ(duty(0), 1000.0 / kTop);
  EXPECT_EQ(duty(1), 2001.0 / kTop);
  EXPECT_EQ(duty(2), 3000.0 / kTop);
  EXPECT_NEAR(board.last().dead_time_s, 800e-9, 1e-12);
  EXPECT_NEAR(board.drive().parameters().inverter.pwm_Hz, 170e6 / (2 * kTop), 1e-6);
}

TEST_F(McuBoard, AComparePreloadedAtTheTroughHoldsForHalfOfThePeriodInWhichItChanged) {
  start(1);  // updates at the trough only
  for (int n = 0; n < 4; ++n) run_to_crest();
  compares({1000, 1770, 1770});
  run_to_crest();  // the trough within this period loads it
  EXPECT_NEAR(duty(0), (1770.0 + 1000.0) / 2 / kTop, 2.0 / kTop);
  run_to_crest();
  EXPECT_EQ(duty(0), 1000.0 / kTop);
}

TEST_F(McuBoard, WithoutTheMainOutputEnableNoGateIsDriven) {
  start(0);
  for (int n = 0; n < 3; ++n) run_to_crest();
  b.clear(kTim1 + BDTR, MOE);
  run_to_crest();
  run_to_crest();
  EXPECT_FALSE(board.switching());
  EXPECT_EQ(board.last().pwm.gates, sim::kNoGates);
}

TEST_F(McuBoard, AnAmplifiersCountsAtTheCrestAreThoseOfTheDrivesOwnSampleAndZeroCurrentIsMidScale) {
  start(0);
  b.write(0x40010300, 1u | 2u << 5 | 3u << 14 | 1u << 8);  // OPAMP1: PA1, gain 16, to ADC1 channel 13
  b.write(0x50000308, 1u << 16 | 2u << 16);
  b.write(kAdc1 + 0x08, 1u << 28);
  b.write(kAdc1 + 0x08, 1u << 28 | 1);
  b.run_us(5);
  b.write(kAdc1 + 0x30, 13u << 6);
  for (int n = 0; n < 3; ++n) run_to_crest();
  b.write(kAdc1 + 0x08, 4);
  b.run_us(2);
  EXPECT_NEAR(b.read(kAdc1 + 0x40), 2553, 12) << "2.057 V";
}

TEST_F(McuBoard, UnequalDutiesDriveACurrentAndTheMotorTurnsToTheVectorAndStops) {
  compares({1900, 1700, 1700});
  start(0);
  for (int n = 0; n < 2400; ++n) run_to_crest();  // 0.1 s
  const sim::PhaseCurrents i = board.drive().phase_currents_A();
  EXPECT_GT(i.u, 1.5) << "0.56 V less the dead time, over 64 mohm";
  EXPECT_NEAR(i.v, -i.u / 2, 0.1 * i.u);
  EXPECT_LT(std::abs(board.drive().omega_rad_s()), 5.0) << "held by the standing vector";
}

TEST_F(McuBoard, BothGatesOfALegAtOnceAreCountedAndHeldOffByTheDriver) {
  board.on_pin(8, true, true);
  board.on_pin(45, true, true);
  EXPECT_EQ(board.both_on(), 1u);
}

TEST(McuBoardFile, TheShippedBoardReadsAndAPinThatIsNoneIsRefusedByItsKey) {
  const std::string good = R"(format = 1
stage = "b_g431b_esc1"
crystal_Hz = 8000000
[gates]
high = ["PA8", "PA9", "PA10"]
low = ["PC13", "PA12", "PB15"]
[shunts]
plus = ["PA1", "PA7", "PB0"]
amplified = ["PA2", "PA6", "PB1"]
[analogue]
bus = "PA0"
[digital]
button = "PC10"
)";
  const BoardPins b = read_board(TomlFile::parse(good, "board.toml"));
  EXPECT_EQ(b.low[0], 45u);
  EXPECT_EQ(b.button, 42u);
  EXPECT_EQ(pin_name(b.low[2]), "PB15");
  std::string bad = good;
  bad.replace(bad.find("PC10"), 4, "PX10");
  try {
    read_board(TomlFile::parse(bad, "board.toml"));
    FAIL() << "accepted";
  } catch (const std::exception& e) {
    EXPECT_NE(std::string(e.what()).find("PX10"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace rotorloop::mcu::g431::testing
