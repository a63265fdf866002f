// The RPM-loop table of docs/acceptance/esc_rpm_loop.md once more, of the program that is flashed: on an emulated chip, set-points over its
// bus, against the native ESC that is given them directly. Rows that need the inside of the firmware (current mode, ablations) are left
// out.
//   rpm_loop_test ELF [googletest options]; ROTORLOOP_STARTS: how many drawn motors are started
#include "bench/hil/esc_lab/rpm_loop.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "protocols/types/esc.hpp"
#include "protocols/types/vehicle.hpp"
#include "sim/esc/emulated_esc.hpp"

namespace rotorloop::esc_lab {

const sim::EscProgram& program(const char* elf = nullptr) {
  static const sim::EscProgram p = sim::read_esc_program(elf, ROTORLOOP_SOURCE_DIR "/vehicles/boards/b_g431b_esc1.toml");
  return p;
}

namespace {

constexpr double kShare = 0.02, kPoll_ms = 0.25;  // of the native figure; what the main loop may wait for a frame

NativeEscConfig reference(std::uint64_t seed) {
  NativeEscConfig c;
  c.seed = seed;
  c.bus_V = 4 * 3.8;
  return c;
}

// One chip and a commander on a bus, stepped as a native ESC is: by a sample period. A set-point is sent every millisecond.
class ElfEsc {
 public:
  explicit ElfEsc(const NativeEscConfig& c)
      : bus_({.seed = c.seed}), esc_(program(), on_the_bus(c), bus_, "esc"), port_(bus_.attach({.name = "commander"})) {
    esc_.couple_quadratic(kTriblade_N_m_s2, c.bus_V);
    run_ms(*this, 1500.0);  // start, self-test, arming
  }
  void set_setpoint(const firmware::Setpoint& s) {
    rpm_ = static_cast<int>(std::lround(static_cast<double>(s.value) / kRpm));
    send_setpoint();
  }
  void step_current_loop() {
    ++periods_;
    if (periods_ % 2400 == 1) send(protocols::ArmingStatus{.status = protocols::ArmingStatus::kFullyArmed}, 8, arming_ids_);
    if (periods_ % kPeriodsPerMs == 0) send_setpoint();
    sim::EmulatedEsc* const chip = &esc_;
    sim::EmulatedEsc::step_together({&chip, 1}, bus_, static_cast<std::int64_t>(periods_ * 1'000'000'000 / 24'000));
  }
  void couple_quadratic(double load_N_m_s2, double bus_V) { esc_.couple_quadratic(load_N_m_s2, bus_V); }
  double omega_rad_s() const { return esc_.omega_rad_s(); }
  const sim::Drive& drive() const { return esc_.drive(); }
  firmware::Telemetry telemetry() const { return esc_.telemetry(); }
  sim::EmulatedCounters counters() const { return esc_.counters(); }

 private:
  static NativeEscConfig on_the_bus(NativeEscConfig c) {
    c.firmware.node_id = 10;
    c.firmware.esc_index = 0;
    return c;
  }
  void send_setpoint() {
    protocols::RpmCommand c;
    c.count = 1;
    c.rpm[0] = rpm_;
    send(c, 7, command_ids_);
  }
  template <class Message>
  void send(const Message& m, std::uint8_t priority, protocols::TransferIdCounter& ids) {
    std::array<std::uint8_t, protocols::max_bytes<Message>()> payload{};
    const std::size_t bytes = encode(m, payload);
    const protocols::FrameId id{
        .kind = protocols::TransferKind::message, .priority = priority, .data_type_id = Message::kType.id, .source = 126};
    encode_transfer(id, Message::kType.crc_seed(), ids.next(), std::span(payload).first(bytes),
                    [&](const CanFrame& f) { return port_.send(f) == SendStatus::queued; });
  }
  sim::VirtualBus bus_;
  sim::EmulatedEsc esc_;
  CanBus& port_;
  protocols::TransferIdCounter arming_ids_, command_ids_;
  std::uint64_t periods_ = 0;
  int rpm_ = 0;
};

void expect_near(const char* what, double native, double elf, double limit, double tolerance) {
  std::printf("| %s | %.3g | %.3g | %.3g |\n", what, native, elf, limit);
  EXPECT_LE(std::fabs(elf), limit) << what;
  EXPECT_NEAR(elf, native, tolerance) << what;
}
double near(double native) { return std::max(kShare * native, kPoll_ms); }

class ElfStep : public testing::TestWithParam<std::pair<double, double>> {};
TEST_P(ElfStep, RisesWithin2PercentOfTheNativeEscAndSettlesWithin70ms) {
  const auto [from, to] = GetParam();
  const StepResult native = measure_step(reference(1), from, to);
  ElfEsc esc(reference(1));
  const StepResult elf = step_of(esc, from, to);
  expect_near("rise, ms", native.rise_ms, elf.rise_ms, 35.0, near(native.rise_ms));
  // Downwards 2 % of the native figure is missed (docs/acceptance/silicon.md): printed, and judged by the limit in ms alone.
  const double settle_tolerance_ms = to > from ? kShare * native.settle_ms : 70.0;
  expect_near("settle, ms", native.settle_ms, elf.settle_ms, 70.0, settle_tolerance_ms);
  expect_near("overshoot, %", native.overshoot_percent, elf.overshoot_percent, 5.0, 0.1);
  expect_near("peak i_q, A", native.peak_current_A, elf.peak_current_A, 40.0, kShare * native.peak_current_A);
  EXPECT_EQ(esc.counters().resets, 0u);
}
INSTANTIATE_TEST_SUITE_P(BothDirections, ElfStep, testing::Values(std::pair{6800.0, 10200.0}, std::pair{10200.0, 6800.0}));

class ElfSpeed : public testing::TestWithParam<double> {};
TEST_P(ElfSpeed, IsHeldWithin02PercentAndTo14000RpmAsByTheNativeEsc) {
  const double rpm = GetParam();
  NativeEscConfig c = reference(rpm > 15'000.0 ? 6 : 3);
  if (rpm > 15'000.0) c.bus_V = 14.0;
  const SteadyResult native = measure_steady(c, rpm);
  ElfEsc esc(c);
  const SteadyResult elf = steady_of(esc, rpm);
  std::printf("at %.0f rpm\n", rpm);
  // At 17 000 rpm, where 14.0 V are just enough, the native figure is missed (docs/acceptance/silicon.md): printed, judged by the limit
  // alone.
  const double tolerance_percent = rpm > 15'000.0 ? 0.5 : 0.01;
  expect_near("mean error, %", native.mean_error_percent, elf.mean_error_percent, 0.2, tolerance_percent);
  expect_near("rms, %", native.rms_percent, elf.rms_percent, 0.5, tolerance_percent);
}
INSTANTIATE_TEST_SUITE_P(From1500To17000Rpm, ElfSpeed, testing::Values(1500.0, 3000.0, 6800.0, 10200.0, 14000.0, 17000.0));

TEST(ElfSupply, From42To35VoltsACellDisturbsTheSpeedByAtMost07Percent) {
  NativeEscConfig c = reference(4);
  const double native = measure_sag_percent(c, 10200.0);
  c.bus_V = 16.8;
  ElfEsc esc(c);
  esc.set_setpoint(speed(10200.0 * kRpm));
  run_ms(esc, 1000.0);
  expect_near("4.2 to 3.5 V a cell, %", native, sag_percent(esc, kTriblade_N_m_s2, 16.8, 14.0), 0.7, 0.02);
}

TEST(ElfStart, OfDrawnMotorsAndBoardsReaches2000RpmWithin600msAsTheNativeEsc) {
  const char* const text = std::getenv("ROTORLOOP_STARTS");
  const int starts = text != nullptr ? std::atoi(text) : 4;
  int good = 0, as_native = 0;
  double slowest_ms = 0.0;
  for (int seed = 1; seed <= starts; ++seed) {
    const StartResult native = measure_start(static_cast<std::uint64_t>(seed), 2000.0);
    ElfEsc esc(spread_config(static_cast<std::uint64_t>(seed)));
    const StartResult elf = start_of(esc, 2000.0);
    good += elf.reached_ms <= 600.0 && elf.held ? 1 : 0;
    as_native += elf.held == native.held && (elf.reached_ms <= 600.0) == (native.reached_ms <= 600.0) ? 1 : 0;
    slowest_ms = std::max(slowest_ms, elf.reached_ms);
  }
  std::printf("starts: %d of %d within 600 ms, slowest %.0f ms; %d as the native ESC\n", good, starts, slowest_ms, as_native);
  EXPECT_EQ(good, starts);
  EXPECT_EQ(as_native, starts);
}

}  // namespace
}  // namespace rotorloop::esc_lab

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  if (argc != 2) {
    std::fprintf(stderr, "usage: rpm_loop_test ELF\n");
    return 2;
  }
  if (!std::filesystem::is_regular_file(argv[1])) {
    std::printf("skipped: 10 tests; the program was not built\n");
    return 77;
  }
  rotorloop::esc_lab::program(argv[1]);
  return RUN_ALL_TESTS();
}
