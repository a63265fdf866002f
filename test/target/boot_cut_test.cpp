// Power cuts on the emulated chip with the linked programs. A run without a cut is followed up to each operation of the flash; there a
// process of its own loses power in that operation, comes up again, and has to be on the bus at once with the old image, the new one, or as
// a node that waits; then it goes on. Once its flash, with what ECC says of each word, is that of an update without a cut at the end of a
// page, it is known how it ends: a chip without power has no other memory, and from the end of every page a power-up is followed to the end
// of the next.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdio>
#include <cstdlib>

#include "host/tools/parameters.hpp"
#include "test/target/boot_bench.hpp"
#include "test/target/boot_programs.hpp"
#include "test/target/in_a_fork.hpp"

namespace rotorloop::boot_chip {
namespace {

constexpr std::array kKinds{TornWord::untouched, TornWord::all_ones, TornWord::single_error, TornWord::double_error};
constexpr std::int64_t kStep_ns = 200'000;  // two words at most

bool by_script() { return std::getenv("ROTORLOOP_BOOT_WHOLE") != nullptr; }

// What is left without power: bytes, and the words that are not what they seem to be.
struct Contents {
  std::vector<std::uint8_t> bytes;
  std::vector<std::byte> spoilt;
};
std::span<const std::byte> spoilt_words(Chip& chip) {
  return chip.blocks().flash.state().last(sizeof(FlashMore) - offsetof(FlashMore, corrected));
}
Contents contents(Chip& chip) {
  const auto bytes = chip.flash();
  const auto spoilt = spoilt_words(chip);
  return {{bytes.begin(), bytes.end()}, {spoilt.begin(), spoilt.end()}};
}
bool has(Chip& chip, const Contents& c) {
  return std::memcmp(chip.flash().data(), c.bytes.data(), c.bytes.size()) == 0 && std::ranges::equal(spoilt_words(chip), c.spoilt);
}

// An update that begins with the old image and a job in the record. Its operations: the CRC of the new image into the record; of each page
// the erase, its words (of the first page without the first word) and its mark in the record; the first word; the erase of the record.
class CutUpdate {
 public:
  explicit CutUpdate(std::vector<std::uint8_t> image) : wanted(std::move(image)) {
    for (std::uint32_t at = 0; at < wanted.size(); at += kPage) {
      erases.push_back(++operations);
      operations += std::min<std::uint32_t>(kPage, (static_cast<std::uint32_t>(wanted.size()) - at + 7) / 8 * 8) / 8 - (at == 0 ? 1 : 0);
      page_ends.push_back(++operations);
    }
    operations += 2;
    erases.push_back(operations);
  }
  struct Running {
    explicit Running(const CutUpdate& u) : updates(bench.tool, u.wanted) {
      bench.bus.install(u.old);
      bench.bus.write_job();
    }
    std::uint32_t done() { return bench.bus.chip.blocks().flash.operations(); }
    // Up to `most` from now on; false: not within that time.
    template <class Condition>
    bool step_until(std::int64_t most_ns, const Condition& condition) {
      const std::int64_t end_ns = bench.bus.now_ns() + most_ns;
      while (!condition()) {
        if (bench.bus.now_ns() >= end_ns || bench.bus.end != End::at_cycle) return false;
        bench.tool.run_for(kStep_ns);
      }
      return true;
    }
    Bench bench;
    tools::FirmwareUpdates updates;
  };

  // Without a cut: what the flash has at the end of each page. False: it has other operations than those.
  bool follow() {
    Running r(*this);
    r.bench.power_up();
    for (const std::uint32_t end : page_ends) {
      if (!r.step_until(kSecond, [&] { return r.done() >= end; }) || r.done() != end) return false;
      at_page_end.push_back(contents(r.bench.bus.chip));
    }
    return r.step_until(2 * kSecond, [&] { return r.bench.bus.in_application(); }) && r.bench.bus.holds(wanted) && r.done() == operations;
  }
  // The end of the page to whose marks in the record the flash has come.
  bool at_end_of_a_page(Chip& chip) const {
    const std::uint8_t* const marks = &chip.flash()[kRecordPage * kPage + 32 * 8];
    std::size_t n = 0;
    while (n < at_page_end.size() && marks[8 * n] != 0xFF) ++n;
    return n > 0 && has(chip, at_page_end[n - 1]);
  }

  const std::vector<std::uint8_t> old = image_of(lives(), 1000), wanted;
  std::uint32_t operations = 1;
  std::vector<std::uint32_t> erases, page_ends;  // by number of the operation, from 1
  std::vector<Contents> at_page_end;
};

enum class After : std::uint8_t { old_image, new_image, waits, not_cut, silent, half_an_image, stuck };
constexpr std::array kAfterTexts{
    "old image", "new image", "waits", "the operation never came", "is not on the bus", "half an image would start", "does not go on"};

// The tool begins anew with the chip: one that heard it a moment ago takes its first question for a repetition, which costs a second.
After cut_and_go_on(CutUpdate::Running& r, const CutUpdate& u, std::uint32_t operation, TornWord leaves) {
  BootChip& bus = r.bench.bus;
  bus.chip.blocks().flash.cut_power_at(operation - r.done(), leaves);
  r.bench.run_for(kSecond, [&] { return bus.end != End::at_cycle; });
  if (bus.end != End::stopped) return After::not_cut;
  r.bench.power_up();
  tools::ToolNode tool(bus);
  tools::FirmwareUpdates updates(tool, u.wanted);
  if (!tool.run_until(bus.now_ns() + 500 * kMs, [&] { return tool.nodes().contains(kNode); })) return After::silent;
  const bool starts = tool.nodes().at(kNode).status.vendor_status == firmware::kWaiting;
  if (starts && !bus.holds(u.old) && !bus.holds(u.wanted)) return After::half_an_image;
  const After after = bus.holds(u.wanted) ? After::new_image : starts ? After::old_image : After::waits;
  updates.start(kNode);
  for (const std::int64_t end_ns = bus.now_ns() + 10 * kSecond; bus.now_ns() < end_ns; tool.run_for(kStep_ns), updates.step())
    if (u.at_end_of_a_page(bus.chip) || (bus.in_application() && bus.holds(u.wanted))) return after;
  return After::stuck;
}

// Each of these operations by four kinds of torn word.
void cut_all(CutUpdate& u, const std::vector<std::uint32_t>& operations) {
  ASSERT_TRUE(u.follow()) << "the update has other operations than those that the test names";
  CutUpdate::Running r(u);
  r.bench.power_up();
  std::array<int, kAfterTexts.size()> ends{};
  for (const std::uint32_t operation : operations) {
    ASSERT_TRUE(r.step_until(2 * kSecond, [&] { return r.done() + 5 >= operation; }) && r.done() < operation) << "operation " << operation;
    std::vector<Fork<After>> cuts;
    for (const TornWord leaves : kKinds) cuts.emplace_back([&, leaves] { return cut_and_go_on(r, u, operation, leaves); });
    for (auto& cut : cuts) {
      const After after = cut.result().value_or(After::stuck);
      EXPECT_LE(after, After::waits) << "operation " << operation << ", kind " << &cut - cuts.data() << ": "
                                     << kAfterTexts[static_cast<std::size_t>(after)];
      ++ends[static_cast<std::size_t>(after)];
    }
    if (testing::Test::HasFailure()) return;
  }
  for (std::size_t n = 0; n < u.at_page_end.size(); ++n) {
    CutUpdate::Running from(u);
    std::ranges::copy(u.at_page_end[n].bytes, from.bench.bus.chip.flash().begin());
    from.bench.power_up();
    const bool last = n + 1 == u.at_page_end.size();
    EXPECT_TRUE(from.step_until(2 * kSecond,
                                [&] {
                                  return last ? from.bench.bus.in_application() && from.bench.bus.holds(u.wanted)
                                              : has(from.bench.bus.chip, u.at_page_end[n + 1]);
                                }))
        << "power-up at the end of page " << n;
  }
  std::printf("%zu cuts among %u operations, %zu pages: old image %d, new image %d, waiting %d; all go on to the new image\n",
              4 * operations.size(), u.operations, u.page_ends.size(), ends[0], ends[1], ends[2]);
}

TEST(BootCutOnChip, PowerCutsInAnUpdateOf3KbLeaveTheOldImageTheNewOneOrANodeThatGoesOn) {
  CutUpdate u(image_of(lives(), 3000));
  // Record, first page with its first words, marks, the second page, the last words, the first word and the end of the record.
  std::vector<std::uint32_t> operations{1, 2, 3, 4, 66, 130, 194, 257, 258, 259, 260, 300, 325, 350, 400, 442, 443, 444, 445};
  ASSERT_EQ(operations.back(), u.operations);
  cut_all(u, operations);
}

TEST(BootCutOnChipByScript, PowerCutsInEveryEraseAndEvery64thWordOf90KbLeaveTheOldImageTheNewOneOrANodeThatGoesOn) {
  if (!by_script()) GTEST_SKIP() << "give ROTORLOOP_BOOT_WHOLE=1";
  CutUpdate u(application_image());
  std::vector<std::uint32_t> operations = u.erases;
  for (std::uint32_t n = 64; n < u.operations; n += 64) operations.push_back(n);
  operations.insert(operations.end(), {1, u.page_ends.front(), u.page_ends.back(), u.operations - 1});
  std::ranges::sort(operations);
  operations.erase(std::ranges::unique(operations).begin(), operations.end());
  cut_all(u, operations);
}

// The program of this repository on the bus, started by the bootloader.
class RunningProgram {
 public:
  RunningProgram() {
    bench.bus.install(application_image());
    bench.power_up();
  }
  bool answers() { return answers(bench.tool); }
  // Under way to operation n of those to come. What it says afterwards: "" when it is not on the bus again with its id.
  std::string after_cut(std::uint32_t operation, TornWord leaves) {
    auto& flash = bench.bus.chip.blocks().flash;
    flash.cut_power_at(operation, leaves);
    bench.run_for(kSecond, [&] { return bench.bus.end != End::at_cycle; });
    if (bench.bus.end != End::stopped) return "not cut";
    bench.power_up();
    tools::ToolNode tool(bench.bus);  // anew, as in cut_and_go_on()
    const bool waits = tool.run_until(bench.bus.now_ns() + 500 * kMs, [&] { return tool.nodes().contains(kNode); }) &&
                       tool.nodes().at(kNode).status.vendor_status == firmware::kWaiting;
    return waits && answers(tool) ? tools::value_text(tools::read_parameter(tool, kNode, "status_Hz").value) : "";
  }
  Bench bench;

 private:
  bool answers(tools::ToolNode& tool) {
    return tool.run_until(bench.bus.now_ns() + 2 * kSecond, [&] {
      const auto seen = tool.nodes().find(kNode);
      return bench.bus.in_application() && seen != tool.nodes().end() && seen->second.status.mode == protocols::NodeMode::operational;
    });
  }
};

// Each of the first `count` operations, or some of them, by four kinds of torn word.
void cut_program(RunningProgram& p, std::uint32_t count, const char* what, const std::vector<std::string>& good) {
  using Text = std::array<char, 16>;
  int made = 0;
  for (std::uint32_t operation = 1; operation <= count; ++operation) {
    if (!by_script() && operation > 2 && operation != count) continue;
    std::vector<Fork<Text>> cuts;
    for (const TornWord leaves : kKinds) {
      cuts.emplace_back([&, leaves] {
        Text out{};
        p.after_cut(operation, leaves).copy(out.data(), out.size() - 1);
        return out;
      });
    }
    for (auto& cut : cuts) {
      const std::string rate = cut.result().value_or(Text{"no end"}).data();
      EXPECT_TRUE(std::ranges::find(good, rate) != good.end())
          << what << ", operation " << operation << ", kind " << &cut - cuts.data() << ": \"" << rate << '"';
      ++made;
    }
  }
  std::printf("%d cuts among %u operations of %s: on the bus under its id each time, then the program\n", made, count, what);
}

TEST(BootCutOnChip, PowerCutsWhileTheProgramSavesItsParametersLeaveItsIdAndTheOldValuesOrTheNew) {
  RunningProgram p;
  ASSERT_TRUE(p.answers());
  const auto rate = tools::read_parameter(p.bench.tool, kNode, "status_Hz");
  tools::set_parameter(p.bench.tool, kNode, rate, tools::parse_value(rate, "77", "status_Hz"));
  auto& flash = p.bench.bus.chip.blocks().flash;
  const auto count = in_a_fork([&] {
    const std::uint32_t before = flash.operations();
    tools::execute(p.bench.tool, kNode, tools::ParameterOrder::save);
    return flash.operations() - before;
  });
  ASSERT_TRUE(count && *count > 10);
  p.bench.tool.request<protocols::ParamExecuteOpcode, protocols::ParamExecuteOpcodeResponse>(
      kNode, {.opcode = protocols::ParamExecuteOpcode::kSave}, [](const auto&) {}, {.attempts = 1});
  cut_program(p, *count, "a save of the parameters", {"50", "77"});
}

TEST(BootCutOnChip, PowerCutsWhileTheProgramKeepsTheRecordOfAFaultLeaveItOnTheBus) {
  RunningProgram p;
  std::fill_n(&p.bench.bus.chip.flash()[61 * kPage], kPage, std::uint8_t{0});  // full: the page is erased first
  ASSERT_TRUE(p.answers());
  p.bench.bus.chip.core().state.r[kPc] = 0x6000'0000;  // where nothing is: a fault
  p.bench.bus.chip.core().restored();
  auto& flash = p.bench.bus.chip.blocks().flash;
  const auto resets = p.bench.bus.chip.resets();
  const std::uint32_t before = flash.operations();
  ASSERT_TRUE(p.bench.run_for(kSecond, [&] { return p.bench.bus.chip.resets() >= resets + 2; })) << "into the bootloader, into the program";
  ASSERT_EQ(flash.operations(), before);
  const auto count = in_a_fork([&] {
    p.answers();
    return flash.operations() - before;
  });
  ASSERT_EQ(count, 6u) << "an erase and five words";
  cut_program(p, *count, "the record of a fault", {"50"});
}

}  // namespace
}  // namespace rotorloop::boot_chip
