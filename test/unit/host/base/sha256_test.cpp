#include "host/base/sha256.hpp"

#include <gtest/gtest.h>

namespace rotorloop {
// FIPS 180-4 examples (NIST "SHA-256" example document).
TEST(Sha256, GivesThePublishedDigests) {
  EXPECT_EQ(sha256_text(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256_text("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256_text("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
}
TEST(Sha256, DoesNotDependOnHowTheTextIsCutIntoPieces) {
  const std::string text(1000, 'a');
  for (std::size_t cut = 1; cut < 200; cut += 7) {
    Sha256 s;
    for (std::size_t i = 0; i < text.size(); i += cut) s.add(std::string_view(text).substr(i, cut));
    EXPECT_EQ(s.hex(), sha256_text(text));
  }
}
// The published million of 'a', and every length about the ends of the blocks of 64 bytes by a digest over their digests, which Python's
// hashlib gave.
TEST(Sha256, GivesThePublishedDigestOfAMillionLettersAndThoseOfTextsOf0To199Bytes) {
  EXPECT_EQ(sha256_text(std::string(1'000'000, 'a')), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
  std::string digests;
  for (std::size_t length = 0; length < 200; ++length) digests += sha256_text(std::string(length, 'b'));
  EXPECT_EQ(sha256_text(digests), "3499a2bda59b4604715ff4051e64aeaea8d4340ffe03e108e53e656e87136d73");
}
}  // namespace rotorloop
