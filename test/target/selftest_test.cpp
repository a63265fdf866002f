// The image for the first power-up of a board, on the emulated STM32G431: what it says of a sound board, and of one with a fault.
//   selftest_test ELF [googletest options]
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "host/bus/frame_bits.hpp"
#include "test/target/boot_chip.hpp"

namespace rotorloop::selftest {

std::string& program() {  // path of the ELF
  static std::string path;
  return path;
}

namespace {

using namespace boot_chip;
using Names = std::set<std::string>;
constexpr std::uint8_t kSelfTestNode = 100;
constexpr std::uint32_t kPulled[3]{0x04, 0x24, 0x1B};  // PA4, PC4, PB11: nodes of the phases
constexpr std::uint32_t kGpioA = 0x48000000, kTim1 = 0x40012C00, kFlashAcr = 0x40022000, kAhb2Enable = 0x4002104C, kFdcan = 0x40006400;

// Between board and chip: the serial line, the nodes of the phases behind drivers and FETs, and pins whose volts are held.
class Stage : public Pins {
 public:
  Stage(Chip& chip, EscBoard& board, const BoardPins& pins) : chip_(chip), board_(board), pins_(pins) { chip.pins = this; }
  void on_pin(std::uint32_t pin, bool driven, bool high) override {
    for (std::size_t k = 0; k < 3; ++k) {
      if (pin == pins_.high[k] && (driven && high) != high_[k]) {
        high_[k] = driven && high;
        high_since_s_[k] = now_s();
      }
      if (pin == pins_.low[k]) low_[k] = driven && high;
    }
    board_.on_pin(pin, driven, high);
  }
  void on_uart(std::uint32_t, std::uint8_t byte) override {
    if (byte != '\r' && byte != '\n') line_ += static_cast<char>(byte);
    if (byte != '\n') return;
    lines.push_back(line_);
    line_.clear();
  }
  void on_signal(Signal signal, bool high) override { board_.on_signal(signal, high); }
  bool heard(Signal signal) const override { return board_.heard(signal); }
  double pin_V(std::uint32_t pin) override {
    const double V = board_.pin_V(pin);
    if (const auto held = held_V.find(pin); held != held_V.end()) return held->second;
    for (std::size_t k = 0; k < 3; ++k) {
      if (pin == kPulled[k]) return node_V(k);
    }
    return V;
  }

  std::vector<std::string> lines;
  std::map<std::uint32_t, double> held_V;
  std::array<bool, 6> dead_driver{};           // bits of high and low sides that never turn on
  std::array<double, 3> bootstrap_s{1, 1, 1};  // for how long a high side stays on

 private:
  double now_s() const { return chip_.time_s_at(chip_.now()); }
  // Behind 10 k and the clamp to the chip's supply. A node that floats is in the middle.
  double node_V(std::size_t k) const {
    const bool high = high_[k] && !dead_driver[k] && now_s() - high_since_s_[k] < bootstrap_s[k];
    if (high) return 3.3;
    return low_[k] && !dead_driver[3 + k] ? 0.0 : 1.2;
  }
  Chip& chip_;
  EscBoard& board_;
  const BoardPins pins_;
  std::string line_;
  std::array<bool, 3> high_{}, low_{};
  std::array<double, 3> high_since_s_{};
};

// A board on the bench: 12 V, room temperature, option bytes as they should be, another node on the bus.
class FirstPower {
 public:
  explicit FirstPower(std::vector<sim::BusFault> faults = {})
      : bus(program(), std::move(faults)),
        stage(bus.chip, bus.board, read_board(TomlFile::read(ROTORLOOP_SOURCE_DIR "/vehicles/boards/b_g431b_esc1.toml"))),
        tool(bus) {
    std::copy_n(bus.chip.memory(kArea + firmware::kImageHeaderBytes, 8), 8, bus.chip.memory(kFlashBase, 8));
    store_options(0x0010'0355'FFEF'FCAA);
    bus.board.drive().set_bus_V(12.0);
    bus.chip.power_up(0xA5);
    bus.board.press(false);
    tool.on<protocols::LogMessage>(
        [this](const protocols::LogMessage& m, std::uint8_t) { heard.emplace_back(m.text.view().begin(), m.text.view().end()); });
  }
  void store_options(std::uint64_t word) { std::memcpy(bus.chip.memory(0x1FFF7800, 8), &word, 8); }
  std::uint32_t address(const std::string& part) {
    for (const ElfSymbol& s : read_elf(program()).symbols) {
      if (s.name.find(part) != std::string::npos) return s.address & ~1u;
    }
    ADD_FAILURE() << "no symbol with " << part;
    return 0;
  }
  // As software does before it writes what is protected.
  void configure_can() {
    poke(kFdcan + 0x18, 0, 1);
    poke(kFdcan + 0x18, 0, 2);
  }
  // To the first instruction of a function of the program, before what it does.
  void run_to(const std::string& function) {
    const std::uint32_t at = address(function);
    for (int i = 0; i < 20'000'000 && bus.chip.core().state.r[kPc] != at; ++i) bus.run_to_cycle(bus.chip.cycle() + 1);
    ASSERT_EQ(bus.chip.core().state.r[kPc], at) << function << " is never called";
  }
  std::uint32_t peek(std::uint32_t address) {
    std::uint32_t value = 0;
    bus.chip.read(address, 4, value);
    return value;
  }
  void poke(std::uint32_t address, std::uint32_t value) { bus.chip.write(address, 4, value); }
  void poke(std::uint32_t address, std::uint32_t clear, std::uint32_t set) { poke(address, (peek(address) & ~clear) | set); }

  // Until the line of this check is out: the next check begins 1 ms later.
  void run_past(const std::string& check) {
    const auto told = [&] { return !stage.lines.empty() && stage.lines.back().find('"' + check + '"') != std::string::npos; };
    for (int i = 0; i < 80'000 && !told(); ++i) tool.run_for(250'000);
    ASSERT_TRUE(told()) << stage.lines.size() << " lines, the last " << (stage.lines.empty() ? "" : stage.lines.back());
  }
  // Until the last line is out.
  void run() {
    run_past("failed");
    tool.run_for(20'000'000);
    EXPECT_EQ(bus.end, End::at_cycle) << text(bus.chip.refused());
    for (const std::string& line : stage.lines) {
      std::printf("%s\n", line.c_str());
      const nlohmann::json j = nlohmann::json::parse(line);
      EXPECT_EQ(j["ok"], j["value"] >= j["low"] && j["value"] <= j["high"]) << line;
      EXPECT_TRUE(said.emplace(j["check"], j).second) << "twice: " << line;
      if (!j["ok"]) failed.insert(j["check"]);
    }
  }
  int value(const std::string& check) { return said.at(check)["value"]; }
  // Of the next NodeStatus: how many checks failed.
  int vendor_status() {
    tool.run_for(1'050'000'000);
    return tool.nodes().at(kSelfTestNode).status.vendor_status;
  }

  BootChip bus;
  Stage stage;
  tools::ToolNode tool;
  std::vector<std::string> heard;  // over the bus
  std::map<std::string, nlohmann::json> said;
  Names failed;
};

const Names kOfGates{"gate_high_u", "gate_high_v", "gate_high_w", "gate_low_u", "gate_low_v", "gate_low_w"};

TEST(SelfTest, ASoundBoardPassesEveryCheckWithTheSameLinesOverSerialLineAndBus) {
  FirstPower b;
  b.run();
  EXPECT_EQ(b.failed, Names{});
  EXPECT_EQ(b.vendor_status(), 0);
  EXPECT_EQ(b.said.size(), 38u);
  EXPECT_EQ(b.heard, b.stage.lines);
  EXPECT_TRUE(b.bus.board.led());
  EXPECT_EQ(b.bus.board.both_on(), 0u);
  EXPECT_LT(b.bus.board.fastest_rad_s(), 1.0);
}

TEST(SelfTest, TheFrameOfTheLoopBackHasTheBitsThatAreCountedOn) {
  const CanFrame frame{.id = 0x15555555, .extended = true, .length = 8, .data = {0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55}};
  EXPECT_EQ(frame_bits(frame) + kIntermissionBits, 131);
}

TEST(SelfTest, EachSensorDriverAndSettingThatIsWrongIsNamedByItsLineAndNoOther) {
  FirstPower b;
  b.store_options(0x0010'0755'FFEF'F8AA);  // as delivered
  const std::uint16_t reference = 1500;
  std::memcpy(b.bus.chip.memory(0x1FFF75AA, 2), &reference, 2);
  b.stage.held_V = {{30, 0.9}, {0, 0.8}, {1, 0.20}, {7, 0.0}, {16, 0.06}};
  b.stage.dead_driver[0] = b.stage.dead_driver[4] = true;
  b.stage.bootstrap_s[2] = 1e-3;
  b.bus.chip.power_up(0xA5);
  b.bus.board.press(true);
  b.run_past("can_acknowledged");
  b.poke(kFlashAcr, 15, 3);
  b.poke(0x40007080, 0, 1u << 8);  // PWR_CR5: no boost
  b.run_past("gate_low_w");
  b.poke(kTim1, 0, 1u << 8);  // CKD: twice the dead time
  b.run_past("bootstrap_v");
  b.poke(kTim1 + 4, 7u << 4, 0);                              // the trigger of the samples
  b.bus.chip.core().write_system(0xE0001000, 4, 0x40000000);  // the counter of cycles stands
  b.run();
  EXPECT_EQ(b.failed, (Names{"wait_states", "boost",       "brown_out",   "button",      "vrefint",     "ntc",          "vbus",
                             "zero_u",      "zero_v",      "zero_w",      "dead_time_u", "dead_time_v", "dead_time_w",  "phase_high_u",
                             "bootstrap_u", "phase_low_v", "bootstrap_w", "samples",     "path_mean",   "path_longest", "failed"}));
  EXPECT_EQ(b.value("failed"), 20);
  EXPECT_EQ(b.vendor_status(), 20);
  EXPECT_FALSE(b.bus.board.led());
  EXPECT_NEAR(b.value("dead_time_v"), 1600, 50);
}

TEST(SelfTest, GatesThatDoNotReachTheirPinsAreNamedOneByOneAndWhatHangsOnThem) {
  FirstPower b;
  b.run_past("can_acknowledged");
  for (const std::uint32_t afr : {0x48000024u, 0x48000424u, 0x48000824u}) b.poke(afr, 0xFFFF0FFF, 0);  // but PA11, the bus
  b.poke(0x48000424, 0, 9u << 4);                                                                      // PB9, the bus
  b.run();
  Names expected = kOfGates;
  for (const char* phase : {"u", "v", "w"}) {
    for (const char* check : {"phase_high_", "phase_low_", "bootstrap_", "dead_time_"}) expected.insert(std::string(check) + phase);
  }
  expected.insert("failed");
  EXPECT_EQ(b.failed, expected);
  EXPECT_EQ(b.value("gate_low_w"), 0);
}

TEST(SelfTest, SwappedGatesAndAGateThatIsNeverOffAreSeenAtThePins) {
  FirstPower b;
  b.run_past("zero_w");
  b.poke(kGpioA + 0x14, 0, 1u << 9);          // PA9: high …
  b.poke(kGpioA + 0x00, 3u << 18, 1u << 18);  // … as an output of the port
  b.run();
  EXPECT_EQ(b.value("gates_off"), 2);
  EXPECT_TRUE(b.failed.contains("gates_off"));
  EXPECT_EQ(b.value("gate_low_u"), 8 + 2);
  EXPECT_EQ(b.value("dead_time_v"), 0) << "both gates of the leg at once";
}

TEST(SelfTest, BitsOfTwiceTheLengthAreCountedIn340Cycles) {
  FirstPower b;
  b.run_to("selftest::loop_back(");
  b.configure_can();
  b.poke(kFdcan + 0x1C, 0x01FF << 16, 19u << 16);  // NBTP: divided by 20 instead of 10
  b.bus.run_to(b.bus.now_ns() + 5'000'000);        // the other node says nothing before the loop back is over
  b.run();
  EXPECT_EQ(b.failed, (Names{"can_bit", "failed"}));
  EXPECT_EQ(b.value("can_bit"), 340);
}

TEST(SelfTest, FramesThatDoNotComeBackAndABusWithoutAnotherNodeAreNamedAndTheSerialLineSaysAll) {
  FirstPower b({{.kind = sim::BusFaultKind::unplugged, .port = 1}});
  b.run_to("selftest::loop_back(");
  b.configure_can();
  b.poke(kFdcan + 0x80, 0x3C, 0x28);  // RXGFC: what no filter names is rejected
  b.run();
  EXPECT_EQ(b.failed, (Names{"can_loop", "can_bit", "can_acknowledged", "failed"}));
  EXPECT_TRUE(b.heard.empty());
}

TEST(SelfTest, AFlashWithoutCacheAt15WaitStatesIsSeenInTheLongestPathOfTheInterrupt) {
  FirstPower b;
  b.run_past("bootstrap_w");
  b.poke(kFlashAcr, 0x70F, 15);  // 15 wait states, neither cache nor prefetch
  b.run();
  EXPECT_EQ(b.failed, (Names{"path_longest", "failed"}));
}

TEST(SelfTest, ConvertersThatDoNotStartAreSaidByTheirCode) {
  FirstPower b;
  b.run_to("g431::start_adc(");
  for (int i = 0; i < 200 && (b.peek(kAhb2Enable) & 1u << 13) == 0; ++i) b.bus.run_to_cycle(b.bus.chip.cycle() + 1);
  b.poke(kAhb2Enable, 1u << 13, 0);
  b.run();
  EXPECT_EQ(b.value("converters"), 1);
  EXPECT_TRUE(b.failed.contains("samples"));
}

TEST(SelfTest, WithoutACrystalTheSerialLineSaysSo) {
  FirstPower b;
  Clocks none = b.bus.chip.clocks();
  none.hse_Hz = 0;
  b.bus.chip.change_clocks(none);
  b.run();
  EXPECT_EQ(b.value("clocks"), 1);
  EXPECT_TRUE(b.failed.contains("can_bit"));
  EXPECT_TRUE(b.heard.empty());
}

}  // namespace
}  // namespace rotorloop::selftest

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  if (argc != 2) {
    std::fprintf(stderr, "usage: selftest_test ELF\n");
    return 2;
  }
  rotorloop::selftest::program() = argv[1];
  if (!std::filesystem::is_regular_file(argv[1])) {
    std::printf("skipped: 10 tests; the program was not built\n");
    return 77;
  }
  return RUN_ALL_TESTS();
}
