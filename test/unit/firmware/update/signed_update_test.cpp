// Updates of a program with a key: what is refused, what is said, and that there is no way back below the installed security version.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/update/release_key.hpp"
#include "firmware/update/updater.hpp"
#include "test/unit/firmware/update/signer.hpp"
#include "test/unit/firmware/update/update_rig.hpp"

namespace rotorloop::firmware {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes test_signed(const ImageOptions& o) { return Signer::test_key().signed_image(make_image(o)); }
Bytes installed_before() { return test_signed({.size = 4000, .security_version = 3, .seed = 200}); }
Signer other_signer() { return Signer(Bytes(32, 0x17)); }

// An ESC with the test key and a signed image; `file` is offered to it.
void offer(UpdateRig& rig, const Bytes& file, double most_s = 60.0) {
  rig.config.key = kTestKey;
  rig.install(installed_before());
  rig.server.file = file;
  rig.hand_over();
  rig.reset();
  rig.run(most_s);
}
bool said(const UpdateRig& rig, std::string_view part) {
  const auto logs = rig.logs();
  return std::any_of(logs.begin(), logs.end(), [&](const std::string& line) { return line.find(part) != std::string::npos; });
}
// Bytes 40 and 48: CRC of the payload, CRC of the fields.
void forge_crcs(Bytes& image) {
  protocols::Crc64 payload, fields;
  payload.add(std::span<const std::uint8_t>(image).subspan(kImageHeaderBytes));
  put_little_endian(image, 40, payload.value(), 8);
  fields.add(std::span<const std::uint8_t>(image).first(48));
  put_little_endian(image, 48, fields.value(), 8);
}
void flip(Bytes& image, std::size_t bit) { image[bit / 8] = static_cast<std::uint8_t>(image[bit / 8] ^ 1u << bit % 8); }

TEST(SignedUpdate, ImageSignedWithTheTestKeyIsInstalledAndTheNodeCallsTheKeyATestKey) {
  UpdateRig rig;
  const Bytes image = test_signed({.size = 9000, .security_version = 3});
  offer(rig, image);
  EXPECT_EQ(rig.updater->end(), UpdateEnd::installed);
  EXPECT_EQ(rig.area_bytes(image.size()), image);
  EXPECT_TRUE(rig.installed());
  EXPECT_TRUE(said(rig, "test key: anybody can sign for this program"));
}

TEST(SignedUpdate, ProgramWithoutAKeySaysOnEveryUpdateThatUnsignedIsAcceptedAndOneWithAReleaseKeySaysNothing) {
  UpdateRig rig;
  rig.install(make_image({.size = 4000, .seed = 200}));
  rig.server.file = make_image({.size = 3000});
  rig.hand_over();
  rig.reset();
  rig.run(10.0);
  EXPECT_TRUE(said(rig, "unsigned accepted"));
  UpdateRig release;
  release.config.key = {KeyKind::release, other_signer().public_key()};
  release.server.file = other_signer().signed_image(make_image({.size = 3000}));
  release.hand_over();
  release.reset();
  release.run(10.0);
  EXPECT_TRUE(release.installed());
  EXPECT_EQ(release.logs(), std::vector<std::string>{"image installed"});
}

TEST(SignedUpdate, NameInGetNodeInfoEndsWithWhatTheKeyIs) {
  EXPECT_STREQ(key_name_suffix(KeyKind::none), ".unsigned_accepted");
  EXPECT_STREQ(key_name_suffix(KeyKind::test), ".test_key");
  EXPECT_STREQ(key_name_suffix(KeyKind::release), "");
}

TEST(SignedUpdate, TestKeyIsThatOfItsPublishedSeedAndThereIsNoReleaseKeyYet) {
  EXPECT_EQ(Signer::test_key().public_key(), kTestKey.key);
  EXPECT_FALSE(kHasReleaseKey) << "when there is one: it must not be the test key";
}

TEST(SignedUpdate, RefusedImagesLeaveTheInstalledOneAsItIsAndSayWhy) {
  const std::uint32_t most_B = UpdateLayout{}.pages * EmulatedFlash::kFlashPageBytes - kImageHeaderBytes;
  Bytes cut = test_signed({.size = 9000, .security_version = 3}), damaged = cut, layout = cut, field = cut;
  cut.pop_back();
  damaged[30] ^= 1;
  layout[4] = 2;
  field[30] ^= 1;  // security version, signed as another
  forge_crcs(field);
  struct Row {
    Bytes file;
    const char* says;
  };
  const Row rows[] = {
      {damaged, "image header is damaged"},
      {cut, "image is cut short: the file has fewer bytes than its header says"},
      {test_signed({.size = most_B + 1, .security_version = 3}), "image is too large for this board"},
      {test_signed({.size = 9000, .board = "b_other", .security_version = 3}), "image is for another board"},
      {layout, "image header of an unknown version"},
      {make_image({.size = 9000, .security_version = 3}), "image is not signed, and this node wants a signature"},
      {other_signer().signed_image(make_image({.size = 9000, .security_version = 3})),
       "image is signed with another key, or changed since"},
      {field, "image is signed with another key, or changed since"},
      {test_signed({.size = 9000, .security_version = 2}), "image has security version 2, this node wants 3 or more"},
      {Bytes(300, 0x55), "no rotorloop image: its header is missing"},
  };
  for (const Row& row : rows) {
    UpdateRig rig;
    offer(rig, row.file);
    EXPECT_EQ(rig.updater->end(), UpdateEnd::refused) << row.says;
    EXPECT_EQ(rig.area_bytes(installed_before().size()), installed_before()) << "untouched: " << row.says;
    EXPECT_TRUE(said(rig, row.says)) << row.says;
    EXPECT_TRUE(rig.updater->finished(rig.now_us + 600'000)) << "the installed image runs on";
  }
  UpdateRig rig;
  offer(rig, test_signed({.size = most_B, .security_version = 3}));
  EXPECT_EQ(rig.updater->end(), UpdateEnd::installed) << "the largest image fits";
}

// One area: this is found when the old image is gone. The tool looks at a file before it serves it.
TEST(SignedUpdate, PayloadThatDoesNotFitItsGenuineHeaderIsReadTwiceThenRefusedAndTheNodeWaits) {
  UpdateRig rig;
  Bytes file = test_signed({.size = 9000, .security_version = 3});
  file[5000] ^= 1;
  offer(rig, file);
  EXPECT_FALSE(rig.updater->has_job());
  EXPECT_FALSE(rig.installed());
  EXPECT_TRUE(said(rig, "image is damaged: its CRC does not fit"));
  EXPECT_FALSE(rig.updater->finished(rig.now_us + 600'000)) << "there is nothing to start";
  rig.hand_over();
  rig.server.file = test_signed({.size = 9000, .security_version = 3});
  rig.reset();
  rig.run(30.0);
  EXPECT_TRUE(rig.installed()) << "a good image installs";
}

TEST(SignedUpdate, ImageWithABitFlippedAtAnyOf5000PlacesDoesNotStart) {
  UpdateRig rig;
  rig.config.key = kTestKey;
  const Bytes image = test_signed({.size = 3000});
  int places = 0;
  const auto starts = [&](std::size_t bit, bool forged) {
    Bytes other = image;
    flip(other, bit);
    if (forged) forge_crcs(other);
    rig.install(other);
    ++places;
    return rig.installed().has_value();
  };
  for (std::size_t bit = 0; bit < 8 * kImageHeaderBytes; ++bit) ASSERT_FALSE(starts(bit, false)) << "bit " << bit << " of the header";
  const RandomStream random(3, 0xF11B);
  for (std::uint64_t k = 0; k < 900; ++k) {
    const std::size_t bit = 8 * kImageHeaderBytes + random.bits(k) % (8 * 3000);
    ASSERT_FALSE(starts(bit, k % 2 == 0)) << "bit " << bit << (k % 2 == 0 ? ", CRCs made to fit" : "");
  }
  EXPECT_GE(places, 4996);
  rig.install(image);
  EXPECT_TRUE(rig.installed());
}

TEST(SecurityVersion, OfTheLastInstalledImageHoldsWhenThatImageIsDamaged) {
  UpdateRig rig;
  offer(rig, test_signed({.size = 9000, .security_version = 5}));
  ASSERT_EQ(rig.updater->end(), UpdateEnd::installed);
  for (std::uint32_t page = 0; page < 5; ++page) {
    rig.flash.flash_erase(rig.config.layout.first_page + page);
    rig.sent.clear();
    rig.server.file = test_signed({.size = 2000, .security_version = 4});
    rig.reset();
    rig.ask_to_begin();
    rig.run(30.0);
    EXPECT_FALSE(rig.installed());
    EXPECT_TRUE(said(rig, "image has security version 4, this node wants 5 or more")) << "page " << page << " damaged";
  }
  rig.server.file = test_signed({.size = 2000, .security_version = 5});
  rig.ask_to_begin();
  rig.run(30.0);
  EXPECT_TRUE(rig.installed());
}

// After a cut at any operation, during an update from 3 to 5: 2 never comes in.
void cut_then_offer_older(std::uint64_t operation, Torn torn, bool old_is_damaged) {
  UpdateRig rig;
  rig.install(make_image({.size = 2500, .security_version = 3, .seed = 200}));
  rig.server.file = make_image({.size = 2500, .security_version = 3, .seed = 201});
  rig.hand_over();
  rig.reset();
  rig.run(30.0);
  ASSERT_EQ(rig.updater->end(), UpdateEnd::installed);
  if (old_is_damaged) rig.flash.flash_erase(rig.config.layout.first_page + 1);
  rig.server.file = make_image({.size = 2500, .security_version = 5, .seed = 9});
  if (!old_is_damaged) rig.hand_over();
  rig.reset();
  rig.flash.cut_at(rig.flash.operations() + operation, torn);
  if (old_is_damaged) rig.ask_to_begin();
  rig.run(30.0);
  rig.flash.power_on();
  rig.server.file = make_image({.size = 2000, .security_version = 2, .seed = 10});
  for (int attempt = 0; attempt < 2; ++attempt) {
    rig.reset();
    if (!rig.updater->has_job()) {
      if (rig.installed()) {
        rig.hand_over();
        rig.reset();
      } else {
        rig.ask_to_begin();
      }
    }
    rig.run(40.0);
    const auto now = rig.installed();
    ASSERT_TRUE(!now || now->security_version >= 3) << "operation " << operation << ", torn " << static_cast<int>(torn);
  }
}

TEST(SecurityVersion, HoldsAfterAPowerCutAtAnyFlashOperationWithTheOldImageWholeOrDamaged) {
  for (const bool damaged : {false, true}) {
    for (std::uint64_t k = 0; k < 480; k += k < 40 ? 1 : 29) {
      for (const Torn torn : {Torn::untouched, Torn::half, Torn::unreadable, Torn::done}) {
        cut_then_offer_older(k, torn, damaged);
        if (HasFatalFailure()) return;
      }
    }
  }
}

}  // namespace
}  // namespace rotorloop::firmware
