// What registers mean, found from raw words without load and with 500 g: the reading that was meant comes first.
#include "bench/stand/instruments/probe.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "bench/stand/instruments/profile.hpp"
#include "bench/stand/instruments/signals.hpp"
#include "host/base/error.hpp"
#include "host/base/random.hpp"

namespace rotorloop::modbus {
namespace {

// Six words: a status flag, a counter that runs, the value, and something constant; ten reads each, with noise of `noise` in the value.
ProbeReadings readings(WordType type, WordOrder order, double zero, double loaded, double noise) {
  ProbeReadings r;
  r.address = 100;
  const RandomStream random(3, 9);
  std::uint64_t n = 0;
  for (auto* rows : {&r.zero, &r.loaded})
    for (int i = 0; i < 10; ++i) {
      std::vector<std::uint16_t> words{
          static_cast<std::uint16_t>(rows == &r.loaded), static_cast<std::uint16_t>(1000 + 7 * n), 0, 0, 0, 0, 4711};
      const double value = (rows == &r.zero ? zero : loaded) + noise * random.gaussian(n);
      std::vector<std::uint16_t> value_words(register_count(type));
      spread(to_bits(value, type).value(), order, value_words);
      std::copy(value_words.begin(), value_words.end(), words.begin() + 2);
      rows->push_back(words);
      ++n;
    }
  return r;
}

struct ProbeCase {
  WordType type;
  WordOrder order;
  double zero, loaded, noise, scale;
};

TEST(Probe, TheReadingThatWasMeantComesFirstWithItsRoundScale) {
  for (const ProbeCase& c :
       {ProbeCase{WordType::f32, WordOrder::ABCD, 0.2, 500.2, 0.05, 1.0}, ProbeCase{WordType::f32, WordOrder::CDAB, -0.4, 499.5, 0.05, 1.0},
        ProbeCase{WordType::f32, WordOrder::DCBA, 0.0003, 0.5003, 1e-5, 1000.0},
        ProbeCase{WordType::s32, WordOrder::ABCD, -120, 49900, 3, 0.01},
        ProbeCase{WordType::s32, WordOrder::CDAB, 200, 5000200, 30, 0.0001},
        ProbeCase{WordType::s32, WordOrder::BADC, -300, 249700, 20, 0.002}}) {
    SCOPED_TRACE(std::string(name(c.type)) + " " + std::string(name(c.order)));
    const auto all = rank_candidates(readings(c.type, c.order, c.zero, c.loaded, c.noise), 500.0);
    ASSERT_FALSE(all.empty());
    EXPECT_EQ(all[0].address, 102);
    EXPECT_EQ(name(all[0].type), name(c.type));
    EXPECT_EQ(name(all[0].order), name(c.order));
    EXPECT_DOUBLE_EQ(all[0].round_scale, c.scale);
  }
}

TEST(Probe, A16BitValueIsFoundAndTheFlagBesideItIsNotTaken) {
  const auto all = rank_candidates(readings(WordType::s16, WordOrder::ABCD, -12, 4988, 2), 500.0);
  ASSERT_FALSE(all.empty());
  EXPECT_EQ(all[0].address, 102);
  EXPECT_EQ(name(all[0].type), "s16");
  EXPECT_DOUBLE_EQ(all[0].round_scale, 0.1);
}

TEST(Probe, RegistersThatDoNotChangeWithTheLoadGiveNoCandidate) {
  ProbeReadings r;
  r.zero = r.loaded = {{1, 2, 3}, {1, 2, 3}};
  EXPECT_TRUE(rank_candidates(r, 500.0).empty());
}

TEST(Probe, TheTextOfTheChoiceIsAChannelThatAProfileAccepts) {
  const auto all = rank_candidates(readings(WordType::f32, WordOrder::CDAB, 0.2, 500.2, 0.05), 500.0);
  const std::string text =
      "format = 1\n[device]\nvendor = \"x\"\nmodel = \"y\"\nsource = \"probed\"\nevidence = \"hardware\"\n[bus]\nbaud = [9600]\nformat = "
      "\"8N1\"\ntimeout_ms = 100\nsource = \"probed\"\n" +
      channel_text(all.at(0), "net", "force", "g", 3, "probed with 500 g");
  const Profile p = parse_profile(text, "probed.toml");
  EXPECT_EQ(p.channels.at(0).address, 102);
  EXPECT_EQ(name(p.channels.at(0).order), "CDAB");
}

TEST(Signals, SinesConstantsAndTablesSayWhatWasAskedFor) {
  EXPECT_DOUBLE_EQ(constant_signal("net=2.5", "--set").at(7.0), 2.5);
  const Signal s = sine_signal("thrust.net=10,2,4", "--sine");
  EXPECT_EQ(s.device, "thrust");
  EXPECT_NEAR(s.at(1.0), 12.0, 1e-9);
  EXPECT_NEAR(s.at(3.0), 8.0, 1e-9);
  for (const char* bad : {"net", "=1", "net=", "net=a", "net=1,2"}) EXPECT_THROW((void)constant_signal(bad, "--set"), Error) << bad;
  EXPECT_THROW((void)sine_signal("net=1,2,0", "--sine"), Error);
}

}  // namespace
}  // namespace rotorloop::modbus
