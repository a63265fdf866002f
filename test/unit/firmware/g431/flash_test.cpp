// The flash driver over plain registers: what it writes to program and erase, what it makes of error flags, and words that cannot be read.
#include "test/unit/firmware/g431/chip_fake.hpp"

namespace rotorloop::g431 {
namespace {

using namespace flash_bits;

class Flash : public ChipFake {
 protected:
  Flash() {
    on_write = [this](Register& r, std::uint32_t value) {
      FlashRegisters& f = flash_registers();
      if (&r == &f.keyr) {
        keys.push_back(value);
        if (keys.size() >= 2 && keys[keys.size() - 2] == kKey1 && value == kKey2) f.cr.hardware(f.cr.peek() & ~kLock);
      }
      if (&r == &f.cr && (value & (kPageErase | kStart)) == (kPageErase | kStart)) {
        if (fails == 0) std::fill_n(flash_memory() + (value >> 3 & 63u) * kPageBytes, kPageBytes, std::uint8_t{0xFF});
        f.sr.hardware(fails);
      }
    };
  }
  std::vector<std::uint32_t> keys;
  std::uint32_t fails = 0;
};

TEST_F(Flash, AWordIsProgrammedInTwoHalvesBetweenUnlockAndLock) {
  ASSERT_TRUE(program_word(62 * kPageBytes + 8, 0x1122334455667788u, nullptr));
  EXPECT_EQ(keys, (std::vector<std::uint32_t>{kKey1, kKey2}));
  EXPECT_EQ(flash_memory()[62 * kPageBytes + 8], 0x88);
  EXPECT_EQ(flash_memory()[62 * kPageBytes + 15], 0x11);
  EXPECT_EQ(flash_registers().cr.peek(), kLock);
  EXPECT_LT(first_with(flash_registers().cr, kProgram), writes.size());
}

TEST_F(Flash, APageIsErasedByItsNumberAndNoOther) {
  std::fill_n(flash_memory(), kFlashBytes, std::uint8_t{0});
  ASSERT_TRUE(erase_page(61, nullptr));
  EXPECT_EQ(flash_memory()[61 * kPageBytes], 0xFF);
  EXPECT_EQ(flash_memory()[61 * kPageBytes - 1], 0);
  EXPECT_EQ(flash_memory()[62 * kPageBytes], 0);
  EXPECT_FALSE(erase_page(64, nullptr));
}

TEST_F(Flash, AnErrorOfTheHardwareIsAFailureAndTheFlashIsLockedAgain) {
  for (const std::uint32_t flag : {bit(1), bit(3), bit(4), bit(5), bit(6), bit(7)}) {
    fails = flag;
    EXPECT_FALSE(erase_page(62, nullptr)) << flag;
    EXPECT_EQ(flash_registers().cr.peek(), kLock);
  }
}

TEST_F(Flash, UnevenOrOutsideIsRefusedBeforeAnythingIsUnlocked) {
  EXPECT_FALSE(program_word(4, 1, nullptr));
  EXPECT_FALSE(program_word(kFlashBytes, 1, nullptr));
  EXPECT_TRUE(keys.empty());
  std::array<std::uint8_t, 8> out{};
  EXPECT_FALSE(read_flash(kFlashBytes - 4, out));
}

TEST_F(Flash, ADoubleErrorOutsideOfACarefulReadIsNotExpected) {
  flash_registers().eccr.hardware(kDoubleError);
  EXPECT_FALSE(expected_ecc_error());
  std::array<std::uint8_t, 8> out{};
  EXPECT_TRUE(read_flash(0, out));
}

TEST(ResetCause, TheWatchdogsComeBeforeThePinThatEveryResetPullsLow) {
  using firmware::ResetCause;
  EXPECT_EQ(reset_cause_of(kIwdgFlag | kPinFlag), ResetCause::watchdog);
  EXPECT_EQ(reset_cause_of(kWwdgFlag | kPinFlag), ResetCause::watchdog);
  EXPECT_EQ(reset_cause_of(kSoftwareFlag | kPinFlag), ResetCause::software);
  EXPECT_EQ(reset_cause_of(kBrownOutFlag | kPinFlag), ResetCause::power_on);
  EXPECT_EQ(reset_cause_of(kPinFlag), ResetCause::pin);
  EXPECT_EQ(reset_cause_of(0), ResetCause::unknown);
}

TEST(OptionBytes, WantABrownOutResetAt2V8NoBootPinAndTheBootloaderProtected) {
  const OptionBytes factory{.optr = 0xFFEFF8AA, .wrp1ar = 0xFF};
  const OptionBytes wanted = wanted_options(factory, 12);
  EXPECT_EQ(wanted.optr & kBorMask, kBor2V8);
  EXPECT_EQ(wanted.optr & kBootByPin, 0u);
  EXPECT_NE(wanted.optr & kBootFlash, 0u);
  EXPECT_EQ(wanted.optr & 0xFFu, 0xAAu) << "never a read-out protection";
  EXPECT_EQ(wanted.wrp1ar, 11u << 16) << "pages 0 to 11";
}

}  // namespace
}  // namespace rotorloop::g431
