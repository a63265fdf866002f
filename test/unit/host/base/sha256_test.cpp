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
TEST(Sha256, IsTheSameInPlainCodeAndWithTheInstructionsOfTheCpu) {
  if (detail::sha256_blocks_of_cpu() == nullptr) GTEST_SKIP() << "this CPU has no SHA instructions";
  std::string text;
  std::uint32_t word = 1;
  for (std::size_t length = 0; length < 400; ++length) {
    Sha256 plain(true), fast;
    plain.add(text), fast.add(text);
    ASSERT_EQ(fast.hex(), plain.hex()) << length << " bytes";
    word = word * 1664525u + 1013904223u;
    text.push_back(static_cast<char>(word >> 24));
  }
}
TEST(Sha256, InPlainCodeGivesThePublishedDigest) {
  Sha256 s(true);
  s.add("abc");
  EXPECT_EQ(s.hex(), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}
}  // namespace rotorloop
