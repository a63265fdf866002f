// The flash interface, sentence by sentence of RM0440, section 3; and words torn by a power cut.
#include "test/unit/sim/mcu/g431/bench.hpp"

namespace rotorloop::mcu::g431::testing {
namespace {

constexpr uint32_t kFlash = 0x40022000, ACR = kFlash, KEYR = kFlash + 0x08, OPTKEYR = kFlash + 0x0C, SR = kFlash + 0x10, CR = kFlash + 0x14,
                   ECCR = kFlash + 0x18, OPTR = kFlash + 0x20, WRP1AR = kFlash + 0x2C;
constexpr uint32_t PROGERR = 8, WRPERR = 16, PGAERR = 32, SIZERR = 64, PGSERR = 128, BSY = 1u << 16;
constexpr uint32_t PER = 2, STRT = 1u << 16, EOPIE = 1u << 24, ECCC = 1u << 30, ECCD = 1u << 31;
constexpr uint32_t kPlace = 0x08010000, kPage = 32, kInRam = 0x20000100;

class FlashBench : public Bench {
 public:
  FlashBench() {
    run_at_170_MHz();
    unlock();
  }
  void unlock() {
    write(KEYR, 0x45670123);
    write(KEYR, 0xCDEF89AB);
  }
  void program(uint32_t address, uint32_t low, uint32_t high) {
    set(CR, 1);
    write(address, low);
    write(address + 4, high);
  }
  void erase(uint32_t page) { write(CR, PER | page << 3 | STRT); }
  uint32_t word(uint32_t address) {
    uint32_t value = 0;
    std::memcpy(&value, chip.memory(address, 4), 4);
    return value;
  }
  using Bench::word;
  // Runs halfwords from SRAM with r1 = address, until they branch to themselves.
  void run_in_ram(std::initializer_list<uint16_t> code, uint32_t r1) {
    uint32_t at = kInRam;
    for (const uint16_t h : code) {
      std::memcpy(chip.memory(at, 2), &h, 2);
      at += 2;
    }
    chip.core().restored();
    chip.core().state.sleeping = false;
    chip.core().state.r[1] = r1;
    chip.core().set_pc(kInRam);
    run_cycles(60);
  }
  double stalled_us(uint64_t before) { return static_cast<double>(chip.cycle() - before) / 170.0; }
};
constexpr std::initializer_list<uint16_t> kLoad = {0x6808, 0xE7FE};  // LDR r0, [r1]; B .

TEST(McuFlash, Section3_3_5_TwoKeysInOrderUnlockAndAWrongOneLocksUntilReset) {
  Bench b;
  b.run_at_170_MHz();
  b.write(CR, 1);
  EXPECT_EQ(b.read(CR), 0xC0000000u) << "locked after reset";
  b.write(KEYR, 0x45670123);
  b.write(KEYR, 0xCDEF89AB);
  EXPECT_EQ(b.read(CR), 0x40000000u);
  b.write(CR, 1u << 31);
  EXPECT_EQ(b.read(CR) >> 31, 1u) << "and it can be locked again";
  b.write(KEYR, 0x45670123);
  b.write(KEYR, 0x11111111);
  b.write(KEYR, 0x45670123);
  b.write(KEYR, 0xCDEF89AB);
  EXPECT_EQ(b.read(CR) >> 31, 1u);
  b.chip.power_up();
  b.clock_everything();
  b.write(KEYR, 0x45670123);
  b.write(KEYR, 0xCDEF89AB);
  EXPECT_EQ(b.read(CR) >> 31, 0u);
}

TEST(McuFlash, Section3_3_6_APageOf2KBIsErasedAndTheSingleBankStallsFor22ms) {
  FlashBench b;
  b.chip.flash()[0x10000] = 0;
  b.chip.flash()[0x107FF] = 0;
  b.chip.flash()[0x10800] = 0;
  const uint64_t before = b.chip.cycle();
  b.erase(kPage);
  EXPECT_NEAR(b.stalled_us(before), 22020, 5) << "the program is in flash";
  EXPECT_EQ(b.word(kPlace), ~0u);
  EXPECT_EQ(b.word(0x080107FC), ~0u);
  EXPECT_EQ(b.word(0x08010800), 0xFFFFFF00u);
  EXPECT_EQ(b.read(SR), 0u);
}

TEST(McuFlash, Section3_3_7_BothHalvesOfADoubleWordAreWrittenThenItIsProgrammedIn85us) {
  FlashBench b;
  b.set(CR, 1);
  b.write(kPlace, 0x11223344);
  EXPECT_EQ(b.word(kPlace), ~0u) << "the first half waits for the second";
  const uint64_t before = b.chip.cycle();
  b.write(kPlace + 4, 0x55667788);
  EXPECT_NEAR(b.stalled_us(before), 85, 1);
  EXPECT_EQ(b.word(kPlace), 0x11223344u);
  EXPECT_EQ(b.word(kPlace + 4), 0x55667788u);
  EXPECT_EQ(b.word(kPlace - 0x08000000), 0x11223344u) << "at the boot alias too";
}

TEST(McuFlash, Section3_3_7_AWordThatIsNotErasedGivesProgerrButMayBecomeZero) {
  FlashBench b;
  b.program(kPlace, 1, 2);
  b.program(kPlace, 3, 4);
  EXPECT_EQ(b.read(SR), PROGERR);
  EXPECT_EQ(b.word(kPlace), 1u);
  b.write(SR, PROGERR);
  b.program(kPlace, 0, 0);
  EXPECT_EQ(b.read(SR), 0u);
  EXPECT_EQ(b.word(kPlace), 0u);
}

TEST(McuFlash, Section3_3_7_HalvesOfAnotherWordOrInTheWrongOrderGivePgaerr) {
  FlashBench b;
  b.set(CR, 1);
  b.write(kPlace + 4, 0);
  EXPECT_EQ(b.read(SR), PGAERR);
  b.write(SR, PGAERR);
  b.write(kPlace, 0);
  b.write(kPlace + 12, 0);
  EXPECT_EQ(b.read(SR), PGAERR);
}

TEST(McuFlash, Section3_3_7_BytesAndHalfwordsGiveSizerrAndWithoutPgPgserr) {
  FlashBench b;
  b.write(kPlace, 0);
  EXPECT_EQ(b.read(SR), PGSERR);
  b.write(SR, PGSERR);
  b.set(CR, 1);
  b.write(kPlace, 0, 2);
  EXPECT_EQ(b.read(SR), SIZERR);
}

TEST(McuFlash, Section3_3_7_AfterAnErrorNothingIsDoneUntilItIsCleared) {
  FlashBench b;
  b.write(kPlace, 0);
  b.program(kPlace, 1, 2);
  EXPECT_EQ(b.word(kPlace), ~0u);
  const uint64_t before = b.chip.cycle();
  b.erase(kPage);
  EXPECT_LT(b.stalled_us(before), 1);
  EXPECT_EQ(b.read(SR), PGSERR);
}

TEST(McuFlash, Section3_7_5_EopComesWithItsInterruptEnabledOnly) {
  FlashBench b;
  b.program(kPlace, 1, 2);
  b.run_us(100);
  EXPECT_EQ(b.read(SR) & 1, 0u);
  b.set(CR, EOPIE);
  b.program(kPlace + 8, 1, 2);
  b.run_us(1);
  EXPECT_EQ(b.read(SR) & 1, 1u);
  EXPECT_TRUE(b.line(4));
  b.write(SR, 1);
  EXPECT_FALSE(b.line(4));
}

TEST(McuFlash, Section3_3_1_CodeInRamGoesOnWhileTheBankIsBusyUntilItLoadsFromFlash) {
  FlashBench b;
  b.write(CR, PER | kPage << 3);
  const uint32_t start = PER | kPage << 3 | STRT;
  std::memcpy(b.chip.memory(kInRam + 0x40, 4), &start, 4);
  // LDR r0, [pc, #60]; STR r0, [r1]; LDR r2, [r1, #-4 as SR: r3]; B .
  b.chip.core().state.r[3] = SR;
  const uint64_t before = b.chip.cycle();
  b.run_in_ram({0x480F, 0x6008, 0x681A, 0xE7FE}, CR);
  EXPECT_LT(b.stalled_us(before), 5);
  EXPECT_EQ(b.chip.core().state.r[2] & BSY, BSY);
  b.run_in_ram(kLoad, kPlace + 0x1000);
  EXPECT_NEAR(b.stalled_us(before), 22020, 10);
  EXPECT_EQ(b.read(SR) & BSY, 0u);
}

TEST(McuFlash, Section3_5_3_AProtectedPageIsNeitherErasedNorProgrammed) {
  FlashBench b;
  b.write(OPTKEYR, 0x08192A3B);
  b.write(OPTKEYR, 0x4C5D6E7F);
  b.write(WRP1AR, kPage | (kPage + 1) << 16);
  b.program(kPlace, 1, 2);
  EXPECT_EQ(b.read(SR), WRPERR);
  b.write(SR, WRPERR);
  b.erase(kPage + 1);
  EXPECT_EQ(b.read(SR), WRPERR);
}

TEST(McuFlash, Section3_4_2_OptionsNeedTheirOwnKeysAndTakeEffectByLaunchWhichResets) {
  FlashBench b;
  b.write(OPTR, 0xFFEFF8AA & ~(1u << 16));
  EXPECT_EQ(b.read(OPTR), 0xFFEFF8AAu) << "locked";
  b.write(OPTKEYR, 0x08192A3B);
  b.write(OPTKEYR, 0x4C5D6E7F);
  EXPECT_EQ(b.read(CR) >> 30, 0u);
  b.write(OPTR, 0xFFEFF8AA & ~(1u << 16));
  b.set(CR, 1u << 17);
  b.set(CR, 1u << 27);
  b.run_us(1);
  EXPECT_EQ(b.chip.resets(), 1u);
  EXPECT_EQ(b.read(kRcc + 0x94) >> 25 & 1, 1u) << "OBLRSTF";
  EXPECT_EQ(b.read(OPTR), 0xFFEFF8AAu & ~(1u << 16));
}

TEST(McuFlash, Section3_4_2_AnOptionWhoseComplementDoesNotFitSetsOptverr) {
  FlashBench b;
  b.chip.information()[0x1FFF7804 - kInformationBase] ^= 1;
  b.chip.power_up();
  EXPECT_EQ(b.read(SR) >> 15 & 1, 1u);
}

TEST(McuFlash, Section3_3_4_ASingleErrorIsCorrectedAndReportedWithItsAddress) {
  FlashBench b;
  b.program(kPlace + 8, 0xCAFE, 0xF00D);
  b.chip.blocks().flash.damage(kPlace + 8, TornWord::single_error);
  b.write(ECCR, 1u << 24);
  b.run_in_ram(kLoad, kPlace + 8);
  EXPECT_EQ(b.chip.core().state.r[0], 0xCAFEu);
  EXPECT_EQ(b.read(ECCR), ECCC | 1u << 24 | 0x10008u);
  EXPECT_TRUE(b.line(4)) << "ECCIE";
  b.write(ECCR, ECCC | 1u << 24);
  EXPECT_EQ(b.read(ECCR), 1u << 24);
  EXPECT_FALSE(b.line(4));
}

TEST(McuFlash, Section3_3_4_ADoubleErrorRaisesNmiOnceAndTheReaderGoesOnWithWhatItGot) {
  FlashBench b;
  b.program(kPlace, 0xCAFE, 0xF00D);
  b.chip.blocks().flash.damage(kPlace, TornWord::double_error);
  uint64_t nmis = 0;
  b.word(8, 0x08000301);  // NMI: r4 += 1, BX LR
  b.word(0x300, 0x47703401);
  b.chip.core().state.r[4] = 0;
  b.run_in_ram({0x6808, 0x6848, 0xE7FE}, kPlace);
  nmis = b.chip.core().state.r[4];
  EXPECT_EQ(nmis, 1u) << "two loads, one NMI while ECCD is set";
  EXPECT_NE(b.chip.core().state.r[0], 0xF00Du);
  EXPECT_EQ(b.read(ECCR), ECCD | 0x10000u);
  b.write(ECCR, ECCD);
  b.run_in_ram(kLoad, kPlace);
  EXPECT_EQ(b.chip.core().state.r[4], 2u);
}

TEST(McuFlash, AWordThatReadsAsErasedAfterACutCannotBeProgrammedBeforeItsPageIsErased) {
  FlashBench b;
  b.chip.blocks().flash.cut_power_at(1, TornWord::all_ones);
  b.program(kPlace, 1, 2);
  EXPECT_EQ(b.run_us(1), End::stopped);
  b.chip.power_up();
  b.clock_everything();
  b.unlock();
  EXPECT_EQ(b.word(kPlace), ~0u);
  b.program(kPlace, 1, 2);
  EXPECT_EQ(b.read(SR), PROGERR);
  b.write(SR, PROGERR);
  b.erase(kPage);
  b.program(kPlace, 1, 2);
  EXPECT_EQ(b.read(SR), 0u);
  EXPECT_EQ(b.word(kPlace), 1u);
}

TEST(McuFlash, EachKindOfTornWordAtTheSecondOfThreeOperations) {
  for (const TornWord kind : {TornWord::untouched, TornWord::all_ones, TornWord::single_error, TornWord::double_error}) {
    FlashBench b;
    b.chip.blocks().flash.cut_power_at(2, kind);
    b.program(kPlace, 0x10, 0x11);
    EXPECT_EQ(b.run_us(1), End::at_cycle);
    b.program(kPlace + 8, 0x20, 0x21);
    EXPECT_EQ(b.run_us(1), End::stopped);
    b.chip.power_up();
    b.clock_everything();
    EXPECT_EQ(b.word(kPlace), 0x10u);
    b.chip.core().state.r[4] = 0;
    b.run_in_ram(kLoad, kPlace + 8);
    const uint32_t read = b.chip.core().state.r[0], flags = b.read(ECCR) & (ECCC | ECCD);
    const bool erased = kind == TornWord::untouched || kind == TornWord::all_ones;
    EXPECT_EQ(read == ~0u, erased) << static_cast<int>(kind);
    EXPECT_EQ(read == 0x20u, kind == TornWord::single_error) << static_cast<int>(kind);
    EXPECT_EQ(flags, kind == TornWord::single_error ? ECCC : kind == TornWord::double_error ? ECCD : 0u) << static_cast<int>(kind);
  }
}

TEST(McuFlash, ACutErasureLeavesItsPageTornAndOthersWhole) {
  FlashBench b;
  b.program(kPlace, 1, 2);
  b.program(kPlace + 0x800, 3, 4);
  b.chip.blocks().flash.cut_power_at(1, TornWord::double_error);
  b.erase(kPage);
  EXPECT_EQ(b.run_us(1), End::stopped);
  b.chip.power_up();
  b.run_in_ram(kLoad, kPlace + 0x800);
  EXPECT_EQ(b.chip.core().state.r[0], 3u);
  EXPECT_EQ(b.read(ECCR), 0u);
  b.run_in_ram(kLoad, kPlace);
  EXPECT_EQ(b.read(ECCR) & ECCD, ECCD);
}

TEST(McuFlash, LatencyAndCacheBitsAreTakenAndReservedBitsReadAsZero) {
  FlashBench b;
  b.write(ACR, 0xFFFFF704);
  EXPECT_EQ(b.read(ACR), 0x00045704u);
  b.chip.lenient = true;
  b.set(CR, 1u << 18);
  EXPECT_STREQ(b.chip.refused().why, "fast programming is not built");
}

TEST(McuFlash, DamagedWordsAreInASnapshot) {
  FlashBench b;
  b.program(kPlace, 1, 2);
  b.chip.blocks().flash.damage(kPlace, TornWord::double_error);
  const auto torn = b.chip.snapshot();
  b.erase(kPage);
  b.chip.restore(torn);
  b.run_in_ram(kLoad, kPlace);
  EXPECT_EQ(b.read(ECCR) & ECCD, ECCD);
}

}  // namespace
}  // namespace rotorloop::mcu::g431::testing
