// Failures beside the processor: the bus, the flash with its parameters, the supply while it starts and saves, and bits that flip.
#include <algorithm>
#include <cstdlib>

#include "host/base/random.hpp"
#include "host/tools/parameters.hpp"
#include "test/target/safety_rows.hpp"

namespace rotorloop::safety {
namespace {

constexpr std::int64_t kFault_ns = 2000 * kMs, kFaultLasts_ns = 400 * kMs;
constexpr double kSilence_us = 252'000.0;  // 250 ms after the last set-point, and the frame that was on its way
constexpr int kEscPort = 1;                // the tool attaches first (boot_chip.hpp)

int count_of(const char* variable, int otherwise) {
  const char* const text = std::getenv(variable);
  return text != nullptr ? std::atoi(text) : otherwise;
}

sim::BusFault fault(sim::BusFaultKind kind, int port) {
  return {.kind = kind, .port = port, .at_ns = kFault_ns, .duration_ns = kFaultLasts_ns};
}

// The bus fails at 2 s for 400 ms; the sender goes on all the time.
void expect_on_bus(const Injection& row, const sim::BusFault& f) {
  SCOPED_TRACE(row.what);
  const auto seen = in_a_fork([&] {
    Bench b(program(), {f});
    b.tool.run_until(kFault_ns, [&] { return b.operational(); });
    b.command(kFault_ns - b.tool.now_ns());
    return judge(b, row, kFaultLasts_ns + 900 * kMs);
  });
  ASSERT_TRUE(seen);
  expect(row, *seen);
}

constexpr auto nothing = [](Bench&) {};

TEST(FailureOfTheBus, SetPointsThatStopOpenTheBridgeWithin252ms) {
  run({{"set-points stop", kSilence_us, Then::stops, nothing, false}}, 400 * kMs);
}
TEST(FailureOfTheBus, ABusThatIsGoneOpensTheBridgeWithin252msAndBackItTurnsAgain) {
  expect_on_bus({"CAN unplugged for 400 ms", kSilence_us, Then::goes_on, nothing}, fault(sim::BusFaultKind::unplugged, kEscPort));
}
TEST(FailureOfTheBus, ANodeOfAnotherBitRateThatDestroysAllFramesOpensTheBridgeWithin252ms) {
  expect_on_bus({"node of another bit rate for 400 ms", kSilence_us, Then::goes_on, nothing},
                fault(sim::BusFaultKind::corrupt, sim::kEveryPort));
}
TEST(FailureOfTheBus, ABabblingNodeOpensTheBridgeWithin252ms) {
  expect_on_bus({"node babbles for 400 ms", kSilence_us, Then::goes_on, nothing}, fault(sim::BusFaultKind::extra_traffic, sim::kEveryPort));
}
// It hears the others between its recoveries, and its motor obeys.
TEST(FailureOfTheBus, BusOffOfItsOwnFramesAloneIsLeftByItself) {
  expect_on_bus({"bus-off, own frames destroyed for 400 ms", 0, Then::goes_on, nothing}, fault(sim::BusFaultKind::corrupt, kEscPort));
}

void damage_parameters(Bench& b, TornWord how) {
  for (std::uint32_t page = kParameterPage; page < kParameterPage + 2; ++page)
    for (std::uint32_t word = 2; word < 6; ++word) b.bus.chip.blocks().flash.damage(kFlashBase + page * kPage + 8 * word, how);
  b.poke(0xE000ED0C, 0x05FA0004);
}

TEST(FailureOfTheFlash, ParametersThatCannotBeReadTurnNothing) {
  run({{"double ECC errors in both parameter pages, reset", 10.0, Then::safe,
        [](Bench& b) { damage_parameters(b, TornWord::double_error); }},
       {"corrected ECC errors in both parameter pages, reset", 10.0, Then::restarts,
        [](Bench& b) { damage_parameters(b, TornWord::single_error); }}},
      900 * kMs);
}

// Power goes at instants all over the start: no gate is on then, and no high side was on for long: the self-test has the low
// sides alone on for milliseconds. The next start is whole.
TEST(FailureOfTheSupply, AtAnyInstantOfTheStartLeavesNoGateOnAndTheNextStartIsWhole) {
  const int instants = count_of("ROTORLOOP_SAFETY_CASES", 50);
  constexpr std::int64_t kStart_ns = 60 * kMs;
  struct Cut {
    int gates_after, longest_over_2ms, not_operational;
  };
  const auto cut = in_a_fork([&] {
    Bench b(program());
    Cut c{};
    for (int n = 0; n < instants; ++n) {
      b.power_up();
      b.watch.begin();
      b.tool.run_for(kStart_ns * (n + 1) / instants);
      c.longest_over_2ms += b.watch.longest_on_s(kHighSides) > 2e-3;
      b.power_up();
      c.gates_after += b.watch.gates() != 0;
    }
    b.tool.run_for(900 * kMs);
    c.not_operational = !b.operational();
    return c;
  });
  ASSERT_TRUE(cut);
  std::printf("| power lost at %d instants of the start | %d with a gate on then, %d with a high side on for longer than 2 ms before |\n",
              instants, cut->gates_after, cut->longest_over_2ms);
  EXPECT_EQ(cut->gates_after, 0);
  EXPECT_EQ(cut->longest_over_2ms, 0);
  EXPECT_EQ(cut->not_operational, 0);
}

// Standing, with a parameter changed that is not yet saved.
void change_a_parameter(Bench& b) {
  b.tool.run_until(3000 * kMs, [&] { return b.operational(); });
  const auto p = tools::read_parameter(b.tool, kNode, "status_Hz");
  tools::set_parameter(b.tool, kNode, p, tools::parse_value(p, "77", "status_Hz"));
}

// The save is cut off at its n-th erase or word, which is left in one of four ways: what the next start has of the parameter.
int after_a_cut_save(Bench& b, std::uint32_t operation, TornWord leaves) {
  b.bus.chip.blocks().flash.cut_power_at(operation, leaves);
  b.tool.request<protocols::ParamExecuteOpcode, protocols::ParamExecuteOpcodeResponse>(
      kNode, {.opcode = protocols::ParamExecuteOpcode::kSave}, [](const auto&) {}, {.attempts = 1});
  b.tool.run_until(b.tool.now_ns() + 300 * kMs, [&] { return b.bus.end != End::at_cycle; });
  if (b.bus.end != End::stopped) return -1;
  b.bus.end = End::at_cycle;
  b.power_up();
  if (b.watch.gates() != 0) return -2;
  b.tool.run_for(100 * kMs);
  return std::stoi(tools::value_text(tools::read_parameter(b.tool, kNode, "status_Hz").value));
}

TEST(FailureOfTheSupply, WhileItSavesLeavesTheOldParametersOrTheNew) {
  Bench b(program());
  change_a_parameter(b);
  const auto operations = in_a_fork([&] {
    const std::uint32_t before = b.bus.chip.blocks().flash.operations();
    tools::execute(b.tool, kNode, tools::ParameterOrder::save);
    return b.bus.chip.blocks().flash.operations() - before;
  });
  ASSERT_TRUE(operations);
  int old = 0, saved = 0;
  for (const std::uint32_t operation : {1u, 2u, *operations / 2, *operations - 1, *operations}) {
    for (const TornWord leaves : {TornWord::untouched, TornWord::all_ones, TornWord::single_error, TornWord::double_error}) {
      const int value = in_a_fork([&] { return after_a_cut_save(b, operation, leaves); }).value_or(-3);
      EXPECT_TRUE(value == 50 || value == 77) << value << " after operation " << operation << ", left " << static_cast<int>(leaves);
      old += value == 50;
      saved += value == 77;
    }
  }
  std::printf("| power lost at 5 of the %u operations of a save, 4 states each | %d start with the old parameters, %d with the new |\n",
              *operations, old, saved);
}

// One bit of RAM, or of a register whose block has a clock.
void flip_a_bit(Bench& b, const RandomStream& random, std::uint64_t n) {
  Chip& chip = b.bus.chip;
  chip.lenient = true;
  const auto below = [&](std::uint64_t draw, std::uint64_t most) { return static_cast<std::uint32_t>(random.bits(8 * n + draw) % most); };
  const std::uint32_t bit = 1u << below(1, 32);
  if (below(0, 2) == 0) {
    const std::uint32_t at = kSramBase + 4 * below(2, chip.ram().size() / 4);
    std::uint32_t value = 0;
    std::memcpy(&value, chip.memory(at, 4), 4);
    value ^= bit;
    std::memcpy(chip.memory(at, 4), &value, 4);
    chip.core().restored();
    return;
  }
  std::vector<Block*> live;
  for (Block* block : chip.all())
    if (!block->registers.empty() && chip.blocks().rcc.clocked(block->gate)) live.push_back(block);
  const Block& block = *live[below(3, live.size())];
  const std::uint32_t at = block.base + block.registers[below(4, block.registers.size())].offset;
  std::uint32_t value = 0;
  if (chip.read(at, 4, value)) chip.write(at, 4, value ^ bit);
}

TEST(FailureOfABit, NoFlippedBitTurnsOnAGateForLongerThan2msWithoutASetPoint) {
  const int flips = count_of("ROTORLOOP_SAFETY_CASES", 50);
  const RandomStream random(39, 1);
  struct Flips {
    int on, restarted;
  };
  const auto bad = in_a_fork([&] {
    Bench b(program());
    b.tool.run_until(3000 * kMs, [&] { return b.operational(); });
    Flips f{};
    for (int n = 0; n < flips; ++n) {
      const auto one = in_a_fork([&] {
        flip_a_bit(b, random, static_cast<std::uint64_t>(n));
        b.watch.begin();
        b.tool.run_for(20 * kMs);
        return Flips{b.watch.longest_on_s(kAllSides) > 2e-3, b.bus.chip.resets() != 0};
      });
      if (!one || one->on != 0) std::printf("flip %d: a gate stays on\n", n);
      f.on += !one || one->on != 0;
      f.restarted += one && one->restarted != 0;
    }
    return f;
  });
  ASSERT_TRUE(bad);
  std::printf("| %d random bits of RAM and registers flipped, standing | %d with a gate on for longer than 2 ms; %d restarted |\n", flips,
              bad->on, bad->restarted);
  EXPECT_EQ(bad->on, 0);
}

}  // namespace
}  // namespace rotorloop::safety
