// Tools against nodes on a simulated 1 Mbit/s bus, in virtual time: discovery, parameters, node ids, updates, turning a motor, the time.
// The node at the other end is made of the same transport but has no code of the tools under test.
#include "host/tools/tool_node.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "host/base/error.hpp"
#include "host/tools/allocator.hpp"
#include "host/tools/esc_table.hpp"
#include "host/tools/firmware_update.hpp"
#include "host/tools/parameters.hpp"
#include "host/tools/spin.hpp"
#include "test/unit/host/tools/tool_pair.hpp"

namespace rotorloop::tools {
namespace {

using namespace protocols;
using ::testing::HasSubstr;

ParamGetSetResponse parameter(const std::string& name, float value, float min, float max) {
  ParamGetSetResponse r;
  r.name = Text<kMaxParameterName>(name.c_str());
  r.value = r.default_value = ParamValue::of(value);
  r.min_value = NumericValue::of(min);
  r.max_value = NumericValue::of(max);
  return r;
}

// Serves parameters as a node does: by index, by name, silently keeping what it refuses.
struct ParameterNode {
  std::vector<ParamGetSetResponse> all;
  bool refuses = false;
  int sets = 0;
  explicit ParameterNode(ToolNode& node) {
    node.serve<ParamGetSet, ParamGetSetResponse>([this](const ParamGetSet& q, std::uint8_t) {
      for (std::size_t i = 0; i < all.size(); ++i) {
        if (q.name.count > 0 ? !(q.name == all[i].name) : q.index != i) continue;
        if (q.value.kind != ParamValue::Kind::empty) {
          ++sets;
          if (!refuses) all[i].value = q.value;
        }
        return std::optional(all[i]);
      }
      return std::optional(ParamGetSetResponse{});
    });
  }
};

TEST(ToolNode, FindsANodeAndReadsWhoItIsWithinTwoSeconds) {
  Pair p;
  ASSERT_TRUE(p.tool.run_until(2 * kSecond_ns, [&] { return p.tool.nodes().contains(21) && p.tool.nodes().at(21).info.has_value(); }));
  EXPECT_EQ(node_name(p.tool.nodes().at(21)), "org.example.esc");
  EXPECT_EQ(unique_id_text(p.tool.nodes().at(21)), "01020300000000000000000000000000");
}

// The pair's node talks as 21: a second tool that begins as 21 has to find another id, and is answered on it.
TEST(ToolNode, TheToolThatCameLaterTakesASpareIdAndIsAnsweredThere) {
  Pair p;
  p.node.serve<RestartNode, RestartNodeResponse>(
      [](const RestartNode&, std::uint8_t) { return std::optional(RestartNodeResponse{.ok = true}); });
  p.tool.run_for(100 * kMs_ns);
  ToolNode later(p.tool.bus(), {.node_id = 21, .spare_ids = {127, 119}});
  later.run_for(1500 * kMs_ns);
  EXPECT_EQ(later.node_id(), 127);
  EXPECT_FALSE(later.id_conflict());
  EXPECT_TRUE(later.ask<RestartNodeResponse>(21, RestartNode{}));
  ToolNode stubborn(p.tool.bus(), {.node_id = 21});
  stubborn.run_for(1500 * kMs_ns);
  EXPECT_EQ(stubborn.node_id(), 21);
  EXPECT_TRUE(stubborn.id_conflict());
}

TEST(ToolNode, AQuestionThatNobodyAnswersEndsAfterItsAttempts) {
  Pair p;
  const std::int64_t begun_ns = p.tool.now_ns();
  EXPECT_FALSE(p.tool.ask<RestartNodeResponse>(99, RestartNode{}, {.attempts = 3, .timeout_ns = 200 * kMs_ns}));
  EXPECT_GE(p.tool.now_ns() - begun_ns, 600 * kMs_ns);
  EXPECT_LE(p.tool.now_ns() - begun_ns, 800 * kMs_ns);
}

TEST(Parameters, FortyAreReadWithinTwoSecondsWithNamesAndTextsOfFullLength) {
  Pair p;
  ParameterNode node(p.node);
  for (int i = 0; i < 40; ++i)
    node.all.push_back(
        parameter(std::string(i < 35 ? 16u : kMaxParameterName, static_cast<char>('a' + i % 26)), static_cast<float>(i), 0, 100));
  node.all[39].value = {};
  node.all[39].value.kind = ParamValue::Kind::string;
  node.all[39].value.string = Text<128>(std::string(128, 'x').c_str());
  const std::int64_t begun_ns = p.tool.now_ns();
  const auto read = read_parameters(p.tool, 21);
  EXPECT_LE(p.tool.now_ns() - begun_ns, 2 * kSecond_ns);
  ASSERT_EQ(read.size(), 40u);
  EXPECT_EQ(read[36].name.size(), kMaxParameterName);
  EXPECT_EQ(value_text(read[39].value).size(), 130u);
  EXPECT_EQ(read[7].value.real, 7.0f);
}

TEST(Parameters, AValueBeyondItsLimitsIsNamedWithThemAndNothingIsSent) {
  Pair p;
  ParameterNode node(p.node);
  node.all.push_back(parameter("phase_limit", 40, 0.5f, 45));
  const NodeParameter read = read_parameter(p.tool, 21, "phase_limit");
  for (const char* text : {"46", "0.4", "much", "", "nan"}) {
    try {
      parse_value(read, text, "phase_limit");
      ADD_FAILURE() << text;
    } catch (const Error& e) {
      EXPECT_EQ(e.exit_code(), ExitCode::usage);
      EXPECT_THAT(e.text().what, HasSubstr("phase_limit"));
    }
  }
  EXPECT_EQ(node.sets, 0);
  EXPECT_EQ(set_parameter(p.tool, 21, read, parse_value(read, "12.5", "")).value.real, 12.5f);
}

TEST(Parameters, AMisspeltNameIsAnsweredWithTheNearestAndARefusedSetWithTheValueThatStays) {
  Pair p;
  ParameterNode node(p.node);
  node.all.push_back(parameter("phase_limit", 40, 0.5f, 45));
  try {
    read_parameter(p.tool, 21, "phase_limti");
    ADD_FAILURE();
  } catch (const Error& e) {
    EXPECT_THAT(e.text().remedy, HasSubstr("phase_limit"));
  }
  node.refuses = true;
  const NodeParameter read = read_parameter(p.tool, 21, "phase_limit");
  try {
    set_parameter(p.tool, 21, read, ParamValue::of(20.0f));
    ADD_FAILURE();
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::device);
    EXPECT_THAT(e.text().what, HasSubstr("it stays 40"));
  }
}

TEST(ParameterFile, HoldsEveryDigitOfAFloat) {
  SeenNode seen;
  seen.id = 21;
  std::vector<NodeParameter> parameters(1);
  parameters[0].name = "resistance";
  parameters[0].value = ParamValue::of(0.0612345678f);
  const std::string text = parameter_file(seen, parameters);
  const std::string written = text.substr(text.rfind("= ") + 2);
  EXPECT_EQ(std::stof(written), 0.0612345678f);
}

// The requesting side of an allocation, as docs/wire.md has it: three parts of the unique id, each after the answer to the one before.
std::uint8_t allocate(Pair& p, ToolNode& anonymous_listener, const UniqueId& id, std::uint8_t preferred, CanBus& port) {
  std::size_t known = 0;
  std::uint8_t given = 0;
  anonymous_listener.on<Allocation>([&](const Allocation& a, std::uint8_t) {
    if (!std::equal(a.unique_id.view().begin(), a.unique_id.view().end(), id.begin())) return;
    known = a.unique_id.count;
    if (known == 16) given = a.node_id;
  });
  for (int part = 0; part < 3; ++part) {
    const std::size_t at = known, size = std::min<std::size_t>(6, 16 - at);
    Allocation request;
    request.node_id = preferred;
    request.first_part = at == 0;
    request.unique_id.assign({id.data() + at, size});
    std::array<std::uint8_t, 8> payload{};
    CanFrame f{.id = 30u << 24 | (0x155u + static_cast<std::uint32_t>(part)) << 10 | 1u << 8, .extended = true, .length = 0, .data = {}};
    const std::size_t bytes = encode(request, payload);
    std::copy_n(payload.begin(), bytes, f.data.begin());
    f.data[bytes] = 0xC0;
    f.length = static_cast<std::uint8_t>(bytes + 1);
    port.send(f);
    p.tool.run_for(100 * kMs_ns);
  }
  return given;
}

TEST(Allocator, GivesTheSameIdToTheSameUniqueIdAndNeverOneThatIsTaken) {
  Pair p;  // node 21 is on the bus already
  std::vector<Allocated> told;
  Allocator allocator(p.tool, {}, [&](const Allocated& a) { told.push_back(a); });
  p.tool.run_for(2 * kSecond_ns);
  const UniqueId first{9, 8, 7, 6, 5, 4, 3, 2, 1, 0, 1, 2, 3, 4, 5, 6}, second{1};
  EXPECT_EQ(allocate(p, p.node, first, 0, p.node.bus()), 125) << "counted down from 125";
  EXPECT_EQ(allocate(p, p.node, second, 21, p.node.bus()), 22) << "21 is wished and taken: the next above";
  EXPECT_EQ(allocate(p, p.node, first, 0, p.node.bus()), 125);
  ASSERT_EQ(told.size(), 3u);
  EXPECT_TRUE(told[1].is_new);
  EXPECT_FALSE(told[2].is_new);
  const auto table = parse_allocation_table(allocation_table_text(allocator.table()), "t");
  EXPECT_EQ(table, allocator.table());
}

TEST(Allocator, AStoredIdThatALiveNodeOfAnotherUniqueIdHoldsIsReplacedAndTheHolderNamed) {
  Pair p;                                           // node 21 is on the bus
  const UniqueId stored{9, 8, 7}, holder{1, 2, 3};  // as Pair has it
  std::vector<Allocated> told;
  Allocator allocator(p.tool, {{stored, 21}}, [&](const Allocated& a) { told.push_back(a); });
  p.tool.run_for(2 * kSecond_ns);
  EXPECT_EQ(allocate(p, p.node, stored, 0, p.node.bus()), 125);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].stored_id, 21);
  EXPECT_EQ(told[0].held_by, holder);
  EXPECT_TRUE(told[0].is_new) << "the table has to be kept";
  EXPECT_EQ(allocator.table().at(stored), 125);
}

TEST(Allocator, GivesNothingBeforeItHasListenedForMoreThanAPeriodOfNodeStatus) {
  Pair p;
  Allocator allocator(p.tool, {{UniqueId{9, 8, 7}, 21}}, [](const Allocated&) { ADD_FAILURE(); });
  EXPECT_EQ(allocate(p, p.node, UniqueId{9, 8, 7}, 0, p.node.bus()), 0);
}

TEST(Allocator, TheNodeThatHeldItsIdBeforeItStartedAnewGetsItAgainAtOnce) {
  Pair p;
  std::vector<Allocated> told;
  const UniqueId own{1, 2, 3};  // as Pair has it
  Allocator allocator(p.tool, {{own, 21}}, [&](const Allocated& a) { told.push_back(a); });
  p.tool.run_for(2 * kSecond_ns);
  EXPECT_EQ(allocate(p, p.node, own, 0, p.node.bus()), 21);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_FALSE(told[0].stored_id);
}

TEST(Allocator, ATableWithAMistakeIsRefusedWithItsLine) {
  const std::string id(32, 'a');
  for (const std::string& text : {std::string("hello"), id + " = 0", id + " = 126", id + " = x", id + " = 5\n" + id + " = 6",
                                  id + " = 5\n" + std::string(32, 'b') + " = 5"}) {
    try {
      parse_allocation_table(text, "ids.txt");
      ADD_FAILURE() << text;
    } catch (const Error& e) {
      EXPECT_THAT(e.text().where, HasSubstr("ids.txt:"));
    }
  }
}

// Reads an image block by block, as a node does, until the short one; may fall silent on the way.
struct UpdatingNode {
  ToolNode& node;
  std::vector<std::uint8_t> image;
  std::uint64_t silent_from_B = UINT64_MAX;
  bool asked = false;
  explicit UpdatingNode(ToolNode& n) : node(n) {
    node.serve<BeginFirmwareUpdate, BeginFirmwareUpdateResponse>([this](const BeginFirmwareUpdate& q, std::uint8_t client) {
      asked = true;
      next(client, q.path);
      return std::optional(BeginFirmwareUpdateResponse{});
    });
  }
  void next(std::uint8_t server, const FilePath& path) {
    if (image.size() >= silent_from_B) return;
    FileRead q;
    q.offset = image.size();
    q.path = path;
    node.request<FileRead, FileReadResponse>(server, q, [this, server, path](const std::optional<FileReadResponse>& r) {
      if (!r || r->error.value != FileError::kOk) return;
      image.insert(image.end(), r->data.items.begin(), r->data.items.begin() + r->data.count);
      if (r->data.count == FileRead::kBlock) next(server, path);
    });
  }
};

std::vector<std::uint8_t> some_image(std::size_t size) {
  std::vector<std::uint8_t> image(size);
  for (std::size_t i = 0; i < size; ++i) image[i] = static_cast<std::uint8_t>(i * 31 + i / 256);
  return image;
}

TEST(FirmwareUpdates, SixtyFourKilobytesArriveBitExactWithinFiveSecondsOfAnIdleBus) {
  for (const std::size_t size : {std::size_t{65'536}, std::size_t{65'500}, std::size_t{1}}) {
    Pair p;
    UpdatingNode node(p.node);
    p.tool.run_for(2 * kSecond_ns);
    FirmwareUpdates updates(p.tool, some_image(size));
    const std::int64_t begun_ns = p.tool.now_ns();
    updates.start(21);
    ASSERT_TRUE(p.tool.run_until(begun_ns + 20 * kSecond_ns,
                                 [&] { return updates.step(), updates.nodes().at(21).phase == UpdatePhase::restarting; }));
    EXPECT_LE(p.tool.now_ns() - begun_ns, 5 * kSecond_ns);
    EXPECT_TRUE(p.tool.run_until(p.tool.now_ns() + 5 * kSecond_ns, [&] { return updates.step(), updates.over(); }));
    EXPECT_EQ(updates.nodes().at(21).phase, UpdatePhase::done);
    EXPECT_EQ(node.image, some_image(size));
  }
}

TEST(FirmwareUpdates, ANodeThatFallsSilentFailsAfterThirtySecondsWithWhatItHadRead) {
  Pair p;
  UpdatingNode node(p.node);
  node.silent_from_B = 2048;
  p.tool.run_for(2 * kSecond_ns);
  FirmwareUpdates updates(p.tool, some_image(65'536));
  updates.start(21);
  ASSERT_TRUE(p.tool.run_until(p.tool.now_ns() + 40 * kSecond_ns, [&] { return updates.step(), updates.over(); }));
  EXPECT_EQ(updates.nodes().at(21).phase, UpdatePhase::failed);
  EXPECT_THAT(updates.nodes().at(21).reason, HasSubstr("2048 of 65536 bytes"));
}

TEST(FirmwareUpdates, ANodeThatNeverAnswersFailsAfterFourQuestions) {
  Pair p;
  FirmwareUpdates updates(p.tool, some_image(1000));
  updates.start(99);
  ASSERT_TRUE(p.tool.run_until(20 * kSecond_ns, [&] { return updates.step(), updates.over(); }));
  EXPECT_EQ(updates.nodes().at(99).asked, FirmwareUpdates::kMostAsked);
  EXPECT_THAT(updates.nodes().at(99).reason, HasSubstr("does not answer"));
}

// Reports as ESC 0 and keeps what it is told.
struct ReportingEsc {
  ToolNode& node;
  EscStatus status;
  std::vector<std::int32_t> rpm;
  std::vector<std::uint8_t> arming;
  bool speaks = true;
  std::int64_t next_ns = 0;
  explicit ReportingEsc(Pair& p) : node(p.node) {
    node.on<RpmCommand>([this](const RpmCommand& c, std::uint8_t) { rpm.push_back(c.rpm[0]); });
    node.on<ArmingStatus>([this](const ArmingStatus& a, std::uint8_t) { arming.push_back(a.status); });
    p.on_tick = [this] {
      if (!speaks || node.now_ns() < next_ns) return;
      next_ns = node.now_ns() + 20 * kMs_ns;
      status.rpm = rpm.empty() ? 0 : rpm.back();
      node.broadcast(status, 16);
    };
  }
};

SpinEnd spin(Pair& p, ReportingEsc& esc, const SpinOptions& options, const std::function<void()>& meanwhile = {}) {
  EscTable table(p.tool);
  Spin motor(p.tool, table, options);
  p.tool.run_for(2 * kSecond_ns);
  EXPECT_EQ(motor.check_before(), SpinEnd::running);
  EXPECT_TRUE(esc.arming.empty()) << "armed before it was asked to";
  motor.begin();
  EXPECT_TRUE(p.tool.run_until(p.tool.now_ns() + 20 * kSecond_ns, [&] {
    motor.step(true);
    if (meanwhile) meanwhile();
    return motor.done();
  }));
  p.tool.run_for(100 * kMs_ns);
  return motor.end();
}

TEST(Spin, RampsToItsSpeedAndEndsWithZerosAndADisarming) {
  Pair p;
  ReportingEsc esc(p);
  EXPECT_EQ(spin(p, esc, {.value = 3000, .ramp_s = 1.0, .for_s = 2.0}), SpinEnd::done);
  EXPECT_TRUE(std::is_sorted(esc.rpm.begin(), std::max_element(esc.rpm.begin(), esc.rpm.end())));
  EXPECT_EQ(*std::max_element(esc.rpm.begin(), esc.rpm.end()), 3000);
  EXPECT_EQ(esc.rpm.back(), 0);
  EXPECT_EQ(esc.arming.front(), ArmingStatus::kFullyArmed);
  EXPECT_EQ(esc.arming.back(), ArmingStatus::kDisarmed);
}

TEST(Spin, ALimitSilenceAndAnotherCommanderDisarmAtOnce) {
  {
    Pair p;
    ReportingEsc esc(p);
    EXPECT_EQ(spin(p, esc, {.value = 3000, .for_s = 10.0}, [&] { esc.status.current_A = esc.rpm.size() > 50 ? 25.0f : 1.0f; }),
              SpinEnd::current);
    EXPECT_EQ(esc.arming.back(), ArmingStatus::kDisarmed);
  }
  {
    Pair p;
    ReportingEsc esc(p);
    EXPECT_EQ(spin(p, esc, {.value = 3000, .for_s = 10.0}, [&] { esc.speaks = esc.rpm.size() < 50; }), SpinEnd::silent);
    EXPECT_EQ(esc.arming.back(), ArmingStatus::kDisarmed);
  }
  {
    Pair p;
    ReportingEsc esc(p);
    EXPECT_EQ(spin(p, esc, {.value = 3000, .for_s = 10.0},
                   [&] {
                     if (esc.rpm.size() == 50) p.node.broadcast(RpmCommand{}, 7);
                   }),
              SpinEnd::foreign_commander);
    EXPECT_EQ(esc.rpm.back(), 0);
  }
}

TEST(TimeMaster, TellsTheTimeOfTheMessageBeforeAndIsSilentWhileALowerIdDoes) {
  Pair p;
  std::vector<std::pair<std::int64_t, std::uint64_t>> heard;  // (when, what)
  p.node.on<GlobalTimeSync>([&](const GlobalTimeSync& m, std::uint8_t) { heard.emplace_back(p.node.now_ns(), m.previous_us); });
  TimeMaster master(p.tool);
  p.tool.run_until(4500 * kMs_ns, [&] { return master.step(), false; });
  ASSERT_GE(heard.size(), 4u);
  EXPECT_EQ(heard[0].second, 0u);
  for (std::size_t i = 1; i < heard.size(); ++i)
    EXPECT_NEAR(static_cast<double>(heard[i].second), static_cast<double>(heard[i - 1].first) * 1e-3, 1000.0);
  p.node.broadcast(GlobalTimeSync{}, 1);  // node 21
  const std::size_t before = heard.size();
  p.tool.run_until(p.tool.now_ns() + 2000 * kMs_ns, [&] { return master.step(), false; });
  EXPECT_FALSE(master.leads());
  EXPECT_EQ(heard.size(), before);
}

}  // namespace
}  // namespace rotorloop::tools
