// Parameters over power cuts: at every operation of the flash, in every way in which it can be torn.
#include "firmware/core/node/parameter_store.hpp"

#include <gtest/gtest.h>

#include "firmware/board/fake/emulated_flash.hpp"
#include "test/unit/firmware/node/esc_rig.hpp"

namespace rotorloop::firmware {
namespace {

Parameters tuned(float max_speed_rad_s) {
  Parameters p = valid_parameters();
  p.max_speed_rad_s = max_speed_rad_s;
  p.raw_mode = RawMode::thrust;
  p.dir_reversed = true;
  p.esc_index = kNoEscIndex;
  return p;
}

bool same(const Parameters& a, const Parameters& b) {
  for (const ParameterRange& r : kParameterRanges) {
    if (r.get(a) != r.get(b)) return false;
  }
  return true;
}

TEST(ParameterStore, NewBoardIsEmptyAndGivesDefaults) {
  EmulatedFlash flash(2);
  const StoredParameters s = ParameterStore(flash).load();
  EXPECT_EQ(s.state, StoreState::empty);
  EXPECT_TRUE(same(s.parameters, Parameters{}));
}

TEST(ParameterStore, EveryParameterComesBackAfterEachOfManySaves) {
  EmulatedFlash flash(2);
  ParameterStore store(flash);
  for (int n = 0; n < 7; ++n) {
    const Parameters p = tuned(1000.0f + static_cast<float>(n));
    ASSERT_TRUE(store.save(p));
    const StoredParameters s = ParameterStore(flash).load();
    EXPECT_EQ(s.state, StoreState::loaded);
    EXPECT_TRUE(same(s.parameters, p)) << n;
    EXPECT_EQ(s.clamped + s.unknown, 0);
  }
}

TEST(ParameterStore, CutAtEveryOperationOfASaveLeavesTheOldValuesOrTheNewOnes) {
  const Parameters before = tuned(1000.0f), after = tuned(1500.0f);
  std::uint64_t operations = 0;
  {
    EmulatedFlash flash(2);
    ParameterStore store(flash);
    ASSERT_TRUE(store.save(before));
    const std::uint64_t first = flash.operations();
    ASSERT_TRUE(store.save(after));
    operations = flash.operations() - first;
  }
  ASSERT_EQ(operations, kParameterRanges.size() + 3);  // erase, head, values, CRC
  int old_values = 0, new_values = 0;
  for (std::uint64_t k = 0; k < operations; ++k) {
    for (const Torn torn : {Torn::untouched, Torn::half, Torn::unreadable, Torn::done}) {
      EmulatedFlash flash(2);
      ParameterStore store(flash);
      store.save(tuned(900.0f));
      store.save(before);
      flash.cut_at(flash.operations() + k, torn);
      EXPECT_FALSE(store.save(after));
      flash.power_on();
      const StoredParameters s = ParameterStore(flash).load();
      ASSERT_EQ(s.state, StoreState::loaded) << "operation " << k;
      const bool is_old = same(s.parameters, before), is_new = same(s.parameters, after);
      ASSERT_TRUE(is_old || is_new) << "operation " << k;
      ++(is_old ? old_values : new_values);
      // And the next save works.
      ASSERT_TRUE(ParameterStore(flash).save(after)) << "operation " << k;
      EXPECT_TRUE(same(ParameterStore(flash).load().parameters, after));
    }
  }
  EXPECT_EQ(new_values, 1) << "only when the last word was written whole";
  EXPECT_EQ(old_values, static_cast<int>(4 * operations) - 1);
}

TEST(ParameterStore, CutAtEveryOperationOfTheFirstSaveLeavesDefaultsThatSaySo) {
  for (std::uint64_t k = 0; k + 1 < kParameterRanges.size() + 3; ++k) {
    EmulatedFlash flash(2);
    flash.cut_at(k, Torn::half);
    ParameterStore(flash).save(tuned(1500.0f));
    flash.power_on();
    const StoredParameters s = ParameterStore(flash).load();
    EXPECT_NE(s.state, StoreState::loaded) << k;
    EXPECT_TRUE(same(s.parameters, Parameters{})) << k;
  }
}

TEST(ParameterStore, ValuesOutsideTheirRangeAreClampedAtLoadAndCounted) {
  EmulatedFlash flash(2);
  Parameters p = tuned(1000.0f);
  p.status_Hz = 60000;
  p.resistance_ohm = std::nanf("");
  ParameterStore(flash).save(p);
  const StoredParameters s = ParameterStore(flash).load();
  EXPECT_EQ(s.clamped, 2);
  EXPECT_EQ(s.parameters.status_Hz, 200);
  EXPECT_EQ(s.parameters.resistance_ohm, Parameters{}.resistance_ohm);
  EXPECT_FALSE(check(s.parameters));
}

TEST(ParameterStore, FlippedBitAnywhereInTheNewerPageGivesTheOlderValues) {
  EmulatedFlash flash(2);
  ParameterStore store(flash);
  store.save(tuned(1000.0f));
  store.save(tuned(1500.0f));
  std::array<std::uint8_t, EmulatedFlash::kFlashPageBytes> page{};
  ASSERT_TRUE(flash.flash_read(1, 0, page));
  for (std::size_t bit = 0; bit < 8 * 8 * (kParameterRanges.size() + 2); ++bit) {
    EmulatedFlash damaged = flash;
    damaged.flash_erase(1);
    auto bytes = page;
    bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ 1u << bit % 8);
    for (std::uint32_t at = 0; at < 8 * (kParameterRanges.size() + 2); at += 8) {
      std::uint64_t word = 0;
      for (unsigned n = 0; n < 8; ++n) word |= static_cast<std::uint64_t>(bytes[at + n]) << (8 * n);
      damaged.flash_program(1, at, word);
    }
    ASSERT_EQ(ParameterStore(damaged).load().parameters.max_speed_rad_s, 1000.0f) << bit;
  }
}

}  // namespace
}  // namespace rotorloop::firmware
