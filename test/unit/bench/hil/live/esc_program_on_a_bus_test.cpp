// `esc-sim --elf`: the program that is flashed into the board, on an emulated chip, asked by the tools as any ESC on a bus is.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>

#include "bench/hil/live/emulated_process.hpp"
#include "host/base/error.hpp"
#include "host/tools/esc_table.hpp"
#include "host/tools/parameters.hpp"
#include "host/tools/tool_node.hpp"
#include "sim/world/lockstep_bus.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::live {
namespace {

using namespace protocols;

const std::filesystem::path kElf = ROTORLOOP_FIRMWARE_ELF, kFiles = ROTORLOOP_SOURCE_DIR;
constexpr std::int64_t kMs_ns = 1'000'000, kSecond_ns = 1'000'000'000;
constexpr std::uint8_t kNode = 21;

const sim::EscProgram& program() {
  static const sim::EscProgram p = sim::read_esc_program(kElf, kFiles / "vehicles/boards/b_g431b_esc1.toml");
  return p;
}

EscProcessConfig configuration() {
  EscProcessConfig c;
  c.plant = kFiles / "vehicles/reference_plant.toml";
  c.node_id = kNode;
  return c;
}

// The process and a tool on one virtual bus; waiting of the tool moves the ESC on.
struct Bench {
  Bench() {
    tool.run_until(3 * kSecond_ns, [&] { return operational() && tool.nodes().at(kNode).info; });
  }

  bool operational() const {
    const auto n = tool.nodes().find(kNode);
    return n != tool.nodes().end() && n->second.status.mode == NodeMode::operational;
  }
  double rpm() const { return esc.omega_rad_s() * 30.0 / std::numbers::pi; }
  // As `esc spin` does: arming ten times a second, a command every 10 ms.
  void spin(double seconds, int wanted_rpm) {
    RpmCommand c;
    c.count = 1;
    c.rpm[0] = wanted_rpm;
    for (int n = 0; n < static_cast<int>(seconds * 100.0); ++n) {
      if (n % 10 == 0) tool.broadcast(ArmingStatus{.status = ArmingStatus::kFullyArmed}, 8);
      tool.broadcast(c, 7);
      tool.run_for(10 * kMs_ns);
    }
  }

  sim::VirtualBus bus{{}};
  CanBus& tool_port = bus.attach({.name = "tool", .tx_depth = 4096, .rx_depth = 4096});
  CanBus& esc_port = bus.attach({.name = "esc", .tx_depth = 4096, .rx_depth = 4096});
  sim::LockstepBus esc_end{bus, esc_port, kMs_ns / 4, [](std::int64_t) {}};
  sim::LockstepBus tool_end{bus, tool_port, kMs_ns / 4, [this](std::int64_t) { esc.advance(); }};
  EmulatedEscProcess esc{configuration(), program(), esc_end};
  tools::ToolNode tool{tool_end, tools::ToolNodeConfig{.node_id = 126}};
};

class EscProgramOnABus : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(kElf)) GTEST_SKIP() << "the program was not built (firmware_image builds it)";
  }
};

TEST_F(EscProgramOnABus, IsFoundUnderItsNodeIdWithNameAndCrcOfItsImage) {
  Bench b;
  ASSERT_TRUE(b.operational());
  const tools::SeenNode& n = b.tool.nodes().at(kNode);
  EXPECT_EQ(tools::node_name(n), "org.rotorloop.b_g431b_esc1");
  EXPECT_EQ(n.info->image_crc, program().image.crc);
  EXPECT_EQ(b.esc.node_id(), kNode);
}

TEST_F(EscProgramOnABus, ParametersThatAreSetAndSavedOutliveARestartOfTheChip) {
  Bench b;
  ASSERT_TRUE(b.operational());
  const auto p = tools::read_parameter(b.tool, kNode, "status_Hz");
  tools::set_parameter(b.tool, kNode, p, tools::parse_value(p, "77", "status_Hz"));
  tools::execute(b.tool, kNode, tools::ParameterOrder::save);
  const std::uint64_t resets = b.esc.resets();
  const auto r = b.tool.ask<RestartNodeResponse>(kNode, RestartNode{.magic = RestartNode::kMagic});
  ASSERT_TRUE(r) << "no answer; " << b.esc.resets() << " resets";
  ASSERT_TRUE(r->ok);
  b.tool.run_for(kSecond_ns);
  EXPECT_EQ(b.esc.resets(), resets + 1);
  EXPECT_EQ(tools::value_text(tools::read_parameter(b.tool, kNode, "status_Hz").value), "77");
}

TEST_F(EscProgramOnABus, TurnsAt3000RpmWithin1PercentWhileCommandedAndStopsWithin300MsOfSilence) {
  Bench b;
  ASSERT_TRUE(b.operational());
  b.spin(1.5, 3000);
  EXPECT_NEAR(b.rpm(), 3000.0, 30.0);
  b.tool.run_for(300 * kMs_ns);
  const double rpm_at_stop = b.rpm();
  EXPECT_LT(rpm_at_stop, 3000.0);
  b.tool.run_for(1500 * kMs_ns);
  EXPECT_LT(b.rpm(), 0.5 * rpm_at_stop);
  EXPECT_EQ(b.esc.resets(), 0u);
}

TEST_F(EscProgramOnABus, APlantOfAnotherPowerStageIsRefusedWithBothNames) {
  EscProcessConfig c = configuration();
  c.plant = kFiles / "vehicles/quad_17in/plant.toml";
  sim::VirtualBus bus{{}};
  CanBus& port = bus.attach({.name = "esc"});
  sim::LockstepBus end{bus, port, kMs_ns, [](std::int64_t) {}};
  EXPECT_THAT(rotorloop::test::error_of([&] { EmulatedEscProcess(c, program(), end); }),
              ::testing::AllOf(::testing::HasSubstr("high_voltage_14s_120a"), ::testing::HasSubstr("b_g431b_esc1"),
                               ::testing::HasSubstr("--plant")));
}

}  // namespace
}  // namespace rotorloop::live
