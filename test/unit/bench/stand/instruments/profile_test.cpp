// Profiles: every quirk decodes to the value that the device means, and every mistake is named with line and column.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "bench/stand/instruments/channel_value.hpp"
#include "bench/stand/instruments/poll_plan.hpp"
#include "bench/stand/instruments/slave_device.hpp"
#include "host/base/error.hpp"

namespace rotorloop::modbus {
namespace {

using testing::AllOf;
using testing::HasSubstr;

Profile shipped(const std::string& name) {
  return read_profile(std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "devices" / (name + ".toml"));
}

// Registers as a device sends them, through plan and codec: what each channel of a read says.
double read_of(const Profile& p, const std::map<std::uint16_t, std::uint16_t>& registers, std::string_view channel, int want_nth = 0,
               Quality quality = Quality::good) {
  const RawLookup others = [&](std::size_t i) -> std::optional<std::uint64_t> {
    std::vector<std::uint16_t> words;
    for (std::size_t k = 0; k < p.channels[i].registers(); ++k) {
      const auto found = registers.find(static_cast<std::uint16_t>(p.channels[i].address + k));
      if (found == registers.end()) return std::nullopt;
      words.push_back(found->second);
    }
    return assemble(words, p.channels[i].order);
  };
  for (std::size_t i = 0; i < p.channels.size(); ++i)
    if (p.channels[i].name == channel && want_nth-- == 0) {
      const ChannelValue v = decode(p.channels[i], others(i).value(), others);
      EXPECT_EQ(name(v.quality), name(quality)) << channel;
      return v.value;
    }
  ADD_FAILURE() << "no channel " << channel;
  return std::nan("");
}

TEST(DeviceProfile, SenecaNetWeightIsAFloatWithItsHighWordFirst) {
  EXPECT_DOUBLE_EQ(read_of(shipped("seneca_zsg3"), {{63, 0x40A0}, {64, 0x0000}}, "net"), 5.0);
}

TEST(DeviceProfile, LaumasWeightTakesItsDecimalPointFrom40014AndItsSignFromTheStatus) {
  const Profile p = shipped("laumas_tlb");
  // 1234 in the register, division 0.05 kg (code 10): 12.34 kg; bit 7 of the status turns the gross weight
  EXPECT_DOUBLE_EQ(read_of(p, {{6, 0}, {7, 0}, {8, 1234}, {13, 10}}, "gross"), 12.34);
  EXPECT_DOUBLE_EQ(read_of(p, {{6, 1u << 7}, {7, 0}, {8, 1234}, {13, 10}}, "gross"), -12.34);
  EXPECT_DOUBLE_EQ(read_of(p, {{6, 0}, {7, 1}, {8, 0}, {13, 0x0107}}, "gross"), 6553.6)
      << "the unit in the high byte does not change the scale";
  EXPECT_DOUBLE_EQ(read_of(p, {{6, 0}, {7, 0}, {8, 1}, {13, 77}}, "gross", 0, Quality::unknown_scale), 0.0);
}

TEST(DeviceProfile, DiniArgeoSignBitsOfGrossAndNetDiffer) {
  const Profile p = shipped("dini_argeo_dgt4x");
  EXPECT_DOUBLE_EQ(read_of(p, {{201, 0b000001}, {202, 0}, {203, 250}, {213, 0}, {214, 250}}, "gross"), -250.0);
  EXPECT_DOUBLE_EQ(read_of(p, {{201, 0b000001}, {202, 0}, {203, 250}, {213, 0}, {214, 250}}, "net"), 250.0);
  EXPECT_DOUBLE_EQ(read_of(p, {{201, 0b100000}, {202, 0}, {203, 250}, {213, 0}, {214, 250}}, "net"), -250.0);
}

TEST(DeviceProfile, EagleChannelsAreTwoRegistersApart) {
  const Profile p = shipped("eagle_ei1000");
  ASSERT_NE(p.find("gross3"), nullptr);
  EXPECT_EQ(p.find("gross3")->address, 0x2004);
  EXPECT_EQ(p.find("net4")->address, 0x200E);
}

TEST(DeviceProfile, Ceybnj0To2000IsMinusToPlusFullScaleAnd2001IsOutOfRange) {
  const Profile p = shipped("ceybnj_torque");
  EXPECT_DOUBLE_EQ(read_of(p, {{0, 0}}, "torque"), -1.0);
  EXPECT_DOUBLE_EQ(read_of(p, {{0, 1500}}, "torque"), 0.5);
  (void)read_of(p, {{0, 2001}}, "torque", 0, Quality::out_of_range);
}

TEST(DeviceProfile, RidenCurrentIsMAOf6006TenthsOfMAOf6006PAndCAOf6018) {
  const Profile p = shipped("riden_rd60xx");
  EXPECT_DOUBLE_EQ(read_of(p, {{0, 60062}, {11, 1500}}, "current", 0), 1.5);
  (void)read_of(p, {{0, 60062}, {11, 1500}}, "current", 1, Quality::absent);
  EXPECT_DOUBLE_EQ(read_of(p, {{0, 60065}, {11, 15000}}, "current", 1), 1.5);
  EXPECT_DOUBLE_EQ(read_of(p, {{0, 60181}, {11, 150}}, "current", 2), 1.5);
  EXPECT_DOUBLE_EQ(read_of(p, {{0, 60181}, {10, 1234}}, "voltage"), 12.34);
  EXPECT_DOUBLE_EQ(read_of(p, {{0, 60065}, {10, 12340}}, "voltage"), 12.34);
}

TEST(DeviceProfile, HanmatekDecimals0x0233MakeVOf1And100AndAAndWOf1And1000) {
  const Profile p = shipped("hanmatek_hm310p");
  const std::map<std::uint16_t, std::uint16_t> registers{{0x05, 0x0233}, {0x10, 1234}, {0x11, 1500}, {0x12, 0x0000}, {0x13, 18510}};
  EXPECT_DOUBLE_EQ(read_of(p, registers, "voltage"), 12.34);
  EXPECT_DOUBLE_EQ(read_of(p, registers, "current"), 1.5);
  EXPECT_DOUBLE_EQ(read_of(p, registers, "power"), 18.51);
}

TEST(DeviceProfile, PzemPowerHasItsLowWordFirst) {
  EXPECT_DOUBLE_EQ(read_of(shipped("pzem_017"), {{2, 0x0001}, {3, 0x0001}}, "power"), 6553.7);
}

TEST(DeviceProfile, Kincony10250IsMinus25degCAndXyMd02p0x7FFFIsNoMeasurement) {
  EXPECT_DOUBLE_EQ(read_of(shipped("kincony_sht30"), {{0, 250}}, "temperature"), 25.0);
  EXPECT_DOUBLE_EQ(read_of(shipped("kincony_sht30"), {{0, 10250}}, "temperature"), -25.0);
  EXPECT_DOUBLE_EQ(read_of(shipped("xy_md02"), {{1, 0xFF9C}}, "temperature"), -10.0);
  (void)read_of(shipped("xy_md02"), {{1, 0x7FFF}}, "temperature", 0, Quality::not_available);
}

TEST(DeviceProfile, EveryShippedProfileLoadsNamesItsSourcesAndItsEmulatedDeviceSaysWhatItWasSetTo) {
  std::size_t count = 0;
  for (const auto& file : std::filesystem::directory_iterator(std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "devices")) {
    if (file.path().extension() != ".toml") continue;
    SCOPED_TRACE(file.path().filename().string());
    ++count;
    const Profile p = read_profile(file.path());
    EXPECT_EQ(p.evidence, "manual") << "nothing here was seen on hardware";
    SlaveDevice device(p);
    const RawLookup others = [&](std::size_t i) { return std::optional(device.raw(i)); };
    for (std::size_t i = 0; i < p.channels.size(); ++i) {
      const Channel& c = p.channels[i];
      EXPECT_GT(c.source.size(), 20u);
      if (c.quantity == "status" || c.quantity == "setting" || decode(c, 0, others).quality == Quality::absent) continue;
      const double wanted = c.range                   ? 0.25
                            : c.type == WordType::f32 ? 1.5
                                                      : 3.0 * std::abs(c.scale_of ? c.scale_map.begin()->second * c.scale : c.scale);
      device.set(c.name, wanted);
      EXPECT_DOUBLE_EQ(decode(c, device.raw(i), others).value, wanted) << c.name;
      if (!c.sign && !c.negative_from && c.type != WordType::f32) continue;
      device.set(c.name, -wanted);
      EXPECT_DOUBLE_EQ(decode(c, device.raw(i), others).value, -wanted) << c.name;
    }
  }
  EXPECT_GE(count, 8u);
}

TEST(DeviceProfile, ReadsJoinWhatIsContiguousAndKeepAValueWithItsSign) {
  const PollPlan laumas = make_plan(shipped("laumas_tlb"));
  ASSERT_EQ(laumas.fast.size(), 1u);  // status, gross and net: 6 to 10
  EXPECT_EQ(laumas.fast[0].address, 6);
  EXPECT_EQ(laumas.fast[0].count, 5);
  EXPECT_EQ(laumas.once.size(), 1u);
  const PollPlan dini = make_plan(shipped("dini_argeo_dgt4x"));
  ASSERT_EQ(dini.fast.size(), 1u);  // 203 … 213 lie between, and net must come with its sign in 201
  EXPECT_EQ(dini.fast[0].address, 201);
  EXPECT_EQ(dini.fast[0].count, 14);
  const PollPlan riden = make_plan(shipped("riden_rd60xx"));
  ASSERT_EQ(riden.fast.size(), 2u);  // 10, 11, (12), 13 and 16 … 18: two registers lie between 13 and 16, one may be read in vain
  EXPECT_EQ(riden.fast[0].count, 4);
  const PollPlan some = make_plan(shipped("laumas_tlb"), {"net"});
  EXPECT_EQ(some.fast[0].channels.size(), 2u);  // with the status that holds its sign
}

TEST(DeviceProfile, AReadIsNeverLongerThanTheDeviceAllows) {
  Profile p = shipped("eagle_ei1000");
  p.max_registers = 6;
  for (const ReadGroup& g : make_plan(p).fast) EXPECT_LE(g.count, 6);
  EXPECT_EQ(make_plan(p).fast.size(), 3u);  // eight floats, three a read
}

// --- mistakes ----------------------------------------------------------------------------------------------------------
constexpr const char* kGood = R"(format = 1
[device]
vendor = "A"
model = "B"
source = "a document, page 3"
evidence = "manual"
[bus]
baud = [9600]
format = "8N1"
timeout_ms = 100
source = "a document, page 2"
[[channel]]
name = "status"
quantity = "status"
addr = 0
type = "u16"
[[channel]]
name = "force"
quantity = "force"
unit = "N"
addr = 1
type = "u32"
)";

std::string refusal(std::string text) {
  try {
    (void)parse_profile(text, "p.toml");
    return "accepted";
  } catch (const Error& e) {
    return e.what();
  }
}
std::string with(std::string_view from, std::string_view to) {
  std::string text = kGood;
  const auto at = text.rfind(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}
std::string added(std::string_view line) { return kGood + std::string(line) + "\n"; }

TEST(DeviceProfile, AProfileWithoutMistakesIsAccepted) { EXPECT_EQ(refusal(kGood), "accepted"); }

TEST(DeviceProfile, EveryMistakeIsNamedWithLineColumnValueAndRemedy) {
  EXPECT_THAT(refusal(with("\"u32\"", "\"u33\"")),
              AllOf(HasSubstr("p.toml:22: error:"), HasSubstr("type = \"u33\" is not known (column 8)"), HasSubstr("u16, s16, u32")));
  EXPECT_THAT(refusal(with("addr = 1", "addr = 70000")),
              AllOf(HasSubstr("p.toml:21"), HasSubstr("70000 is outside 0 to 65535 (column 8)")));
  EXPECT_THAT(refusal(with("addr = 1", "addr = 65535")), HasSubstr("passes register 65535"));
  EXPECT_THAT(refusal(with("unit = \"N\"", "unit = \"Nm\"")),
              AllOf(HasSubstr("p.toml:20"), HasSubstr("no unit of force (column 8)"), HasSubstr("N, kN, kg")));
  EXPECT_THAT(refusal(with("unit = \"N\"\n", "")), HasSubstr("key \"channel[2].unit\" is missing (column"));
  EXPECT_THAT(refusal(with("\"force\"\nq", "\"status\"\nq")),
              AllOf(HasSubstr("channel \"status\" is there twice"), HasSubstr("first at p.toml:12")));
  EXPECT_THAT(refusal(with("\"a document, page 2\"", "\" \"")), AllOf(HasSubstr("p.toml:11"), HasSubstr("source is empty (column 10)")));
  EXPECT_THAT(refusal(with("evidence = \"manual\"", "evidence = \"sure\"")), HasSubstr("manual, emulated, hardware"));
  EXPECT_THAT(refusal(with("[9600]", "[9601]")), HasSubstr("baud has 9601"));
  EXPECT_THAT(refusal(with("timeout_ms = 100", "timeout_ms = 100\nlate_max_ms = 50")),
              HasSubstr("late_max_ms = 50 ms is below timeout_ms = 100 ms"));
  EXPECT_THAT(refusal(with("timeout_ms = 100", "timeout_ms = 100\nturnaround_ms = 150")), HasSubstr("every read would time out"));
  EXPECT_THAT(refusal(with("timeout_ms = 100", "timeout_ms = 100\nmax_regs = 1")),
              HasSubstr("needs 2 registers, one read has max_regs = 1"));
  EXPECT_THAT(refusal("format = = 1\n"), AllOf(HasSubstr("p.toml:1"), HasSubstr("not valid TOML"), HasSubstr("(column ")));
}

TEST(DeviceProfile, MistakesOfQuirksAreNamed) {
  EXPECT_THAT(refusal(added("scale = 0.0")), HasSubstr("scale = 0 leaves nothing (column 9)"));
  EXPECT_THAT(refusal(added("word_order = \"AB\"")), HasSubstr("ABCD, CDAB, BADC, DCBA"));
  EXPECT_THAT(refusal(added("sign = { channel = \"statsu\", bit = 0 }")),
              AllOf(HasSubstr("is no channel of this profile (column 20)"), HasSubstr("did you mean \"status\"")));
  EXPECT_THAT(refusal(added("sign = { channel = \"status\", bit = 16 }")), HasSubstr("16 is outside 0 to 15"));
  EXPECT_THAT(refusal(with("addr = 1", "addr = 500\nsign = { channel = \"status\", bit = 0 }")), HasSubstr("cannot come by one read"));
  EXPECT_THAT(refusal(added("rate = \"slow\"\nsign = { channel = \"status\", bit = 0 }")), HasSubstr("a sign of another moment"));
  EXPECT_THAT(refusal(added("scale_from = { channel = \"status\", map = {} }")), HasSubstr("map is empty"));
  EXPECT_THAT(refusal(added("scale_from = { channel = \"status\", map = { a = 1.0 } }")), HasSubstr("keys are the raw value"));
  EXPECT_THAT(refusal(added("when = { channel = \"status\", in = [1] }")), HasSubstr("channel status is not read once"));
  EXPECT_THAT(refusal(added("range = { raw = [5, 1], value = [0, 1] }")), HasSubstr("does not rise"));
  EXPECT_THAT(refusal(added("range = { raw = [0, 1], value = [0, 1] }\nscale = 2.0")), HasSubstr("range stands beside scale"));
  EXPECT_THAT(refusal(added("na = [0x100000000]")), HasSubstr("outside 0 to 4294967295"));
  EXPECT_THAT(refusal(added("bits = { ready = 32 }")), HasSubstr("32 is outside 0 to 31"));
  EXPECT_THAT(refusal(added("stride = 2")), HasSubstr("stride without count"));
  EXPECT_THAT(refusal(added("count = 64\nstride = 1000\naddr2 = 1")), HasSubstr("unknown key"));
  EXPECT_THAT(refusal(added("[command.tare]\nwear = \"ram\"\nsteps = [{ fc = 5, addr = 1, value = 1 }]")),
              HasSubstr("5 is outside 6 to 16"));
  EXPECT_THAT(refusal(added("[command.tare]\nwear = \"ram\"\nsteps = [{ fc = 6, addr = 1, value = [1, 2] }]")),
              HasSubstr("fc 6 writes one value"));
  EXPECT_THAT(refusal(added("[command.tare]\nwear = \"disk\"\nsteps = []")), HasSubstr("ram, flash, eeprom"));
}

}  // namespace
}  // namespace rotorloop::modbus
