// Ed25519 as a target checks it: vectors of RFC 8032, and OpenSSL as the other side, which makes keys, signatures and big numbers.
#include "firmware/update/signature.hpp"

#include <gtest/gtest.h>
#include <openssl/bn.h>

#include <algorithm>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "host/base/random.hpp"
#include "test/unit/firmware/update/signer.hpp"
#include "test/unit/firmware/update/update_rig.hpp"
#include "third_party/ed25519/fe25519.h"

namespace rotorloop::firmware {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes from_hex(std::string_view text) {
  Bytes out;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2)
    out.push_back(static_cast<std::uint8_t>(std::stoi(std::string(text.substr(i, 2)), nullptr, 16)));
  return out;
}
PublicKey key_of(const Bytes& b) {
  PublicKey key{};
  std::copy(b.begin(), b.end(), key.begin());
  return key;
}
bool good(const PublicKey& key, std::span<const std::uint8_t> message, const Bytes& signature, std::size_t piece = 1000) {
  SignatureCheck check(std::span<const std::uint8_t, kSignatureBytes>(signature.data(), kSignatureBytes), key);
  for (std::size_t at = 0; at < message.size(); at += piece) check.add(message.subspan(at, std::min(piece, message.size() - at)));
  return check.good();
}
Bytes noise(std::uint64_t seed, std::size_t n) {
  const RandomStream random(seed, 0x5167);
  Bytes out(n);
  for (std::size_t i = 0; i < n; ++i) out[i] = static_cast<std::uint8_t>(random.bits(i) >> 56);
  return out;
}

struct Vector {
  const char *key, *message, *signature;
};
// RFC 8032, 7.1: tests 1, 2, 3 and SHA(abc).
constexpr Vector kRfc8032[] = {
    {"d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a", "",
     "e5564300c360ac729086e2cc806e828a84877f1eb8e5d974d873e065224901555fb8821590a33bacc61e39701cf9b46bd25bf5f0595bbe24655141438e7a100b"},
    {"3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c", "72",
     "92a009a9f0d4cab8720e820b5f642540a2b27b5416503f8fb3762223ebdb69da085ac1e43e15996e458f3613d0f11d8c387b2eaeb4302aeeb00d291612bb0c00"},
    {"fc51cd8e6218a1a38da47ed00230f0580816ed13ba3303ac5deb911548908025", "af82",
     "6291d657deec24024827e69c3abe01a30ce548a284743a445e3680d7db5ac3ac18ff9b538d16f290ae67f760984dc6594a7c15e9716ed28dc027beceea1ec40a"},
    {"ec172b93ad5e563bf4932c70e1245034c35467ef2efd4d64ebf819683467e2bf",
     "ddaf35a193617abacc417349ae20413112e6fa4e89a97ea20a9eeee64b55d39a2192992a274fc1a836ba3c23a3feebbd454d4423643ce80e2a9ac94fa54ca49f",
     "dc2a4459e7369633a52b1bf277839a00201009a3efbf3ecb69bea2186c26b58909351fc9ac90b3ecfdfbc7c66431e0303dca179c138ac17ad9bef1177331a704"},
};

TEST(Signature, VectorsOfRfc8032AreGoodAndEachFlippedBitOfThemIsNot) {
  for (const Vector& v : kRfc8032) {
    const PublicKey key = key_of(from_hex(v.key));
    const Bytes message = from_hex(v.message), signature = from_hex(v.signature);
    EXPECT_TRUE(good(key, message, signature)) << v.key;
    for (std::size_t bit = 0; bit < 8 * kSignatureBytes; bit += 3) {
      Bytes wrong = signature;
      wrong[bit / 8] = static_cast<std::uint8_t>(wrong[bit / 8] ^ (1u << (bit % 8)));
      EXPECT_FALSE(good(key, message, wrong)) << "bit " << bit << " of the signature";
    }
    for (std::size_t bit = 0; bit < 8 * message.size(); ++bit) {
      Bytes wrong = message;
      wrong[bit / 8] = static_cast<std::uint8_t>(wrong[bit / 8] ^ (1u << (bit % 8)));
      EXPECT_FALSE(good(key, wrong, signature)) << "bit " << bit << " of the message";
    }
  }
}

TEST(Signature, MadeByOpenSslForRandomKeysAndLengthsIsGoodInPiecesOfAnySize) {
  const RandomStream random(7, 0x5168);
  for (std::uint64_t k = 0; k < 200; ++k) {
    const Signer signer(noise(1000 + k, 32));
    const Bytes message = noise(k, random.bits(k) % 700);
    const Bytes signature = signer.sign(message);
    EXPECT_TRUE(good(signer.public_key(), message, signature, 1 + k)) << "key " << k << ", " << message.size() << " bytes";
    Bytes other = message;
    other.push_back(0);
    EXPECT_FALSE(good(signer.public_key(), other, signature)) << "a byte more";
    EXPECT_FALSE(good(Signer(noise(5000 + k, 32)).public_key(), message, signature)) << "another key";
  }
}

// RFC 8032, 5.1.7: otherwise anybody makes a second signature of a signed image.
TEST(Signature, WithTheOrderOfTheGroupAddedToSIsRefused) {
  constexpr std::array<std::uint8_t, 32> kOrder{0xED, 0xD3, 0xF5, 0x5C, 0x1A, 0x63, 0x12, 0x58, 0xD6, 0x9C, 0xF7,
                                                0xA2, 0xDE, 0xF9, 0xDE, 0x14, 0,    0,    0,    0,    0,    0,
                                                0,    0,    0,    0,    0,    0,    0,    0,    0,    0x10};
  const Signer signer(noise(1, 32));
  const Bytes message = noise(2, 100);
  Bytes signature = signer.sign(message);
  ASSERT_TRUE(good(signer.public_key(), message, signature));
  unsigned carry = 0;
  for (std::size_t i = 0; i < 32; ++i) {
    carry += signature[32 + i] + unsigned{kOrder[i]};
    signature[32 + i] = static_cast<std::uint8_t>(carry);
    carry >>= 8;
  }
  EXPECT_FALSE(good(signer.public_key(), message, signature));
  std::copy(kOrder.begin(), kOrder.end(), signature.begin() + 32);
  EXPECT_FALSE(good(signer.public_key(), message, signature)) << "S is the order itself";
}

TEST(Signature, KeyThatIsNoPointOfTheCurveIsRefused) {
  PublicKey none{};
  none[0] = 2;  // y = 2 has no x
  EXPECT_FALSE(good(none, noise(1, 10), noise(2, 64)));
}

TEST(Signature, OfAnImageIsInItsHeaderAndCoversFieldsAndTheDigestOfThePayload) {
  Bytes image = make_image({.size = 3001});
  const Signer signer(noise(3, 32));
  EXPECT_FALSE(has_signature(image));
  image = signer.signed_image(image);
  PayloadDigest digest;
  for (std::size_t at = kImageHeaderBytes; at < image.size(); at += 100)
    digest.add(std::span(image).subspan(at, std::min<std::size_t>(100, image.size() - at)));
  const auto ours = digest.value();
  EXPECT_TRUE(std::equal(ours.begin(), ours.end(), image.begin() + kDigestAt)) << "SHA-512 as OpenSSL has it";
  EXPECT_TRUE(has_signature(image));
  EXPECT_TRUE(signature_good(image, signer.public_key()));
  for (const std::size_t byte : {8u, 30u, 40u, 47u, 120u, 183u}) {
    Bytes other = image;
    other[byte] ^= 1;
    EXPECT_FALSE(signature_good(other, signer.public_key())) << "byte " << byte;
  }
}

// The field is the part of third_party/ed25519 that is not as its authors wrote it: values at its edges and random ones, modulo 2^255 - 19.
class Field : public ::testing::Test {
 protected:
  using Number = std::unique_ptr<BIGNUM, decltype(&BN_free)>;
  static Number number(const Bytes& little_endian) { return {BN_lebin2bn(little_endian.data(), 32, nullptr), &BN_free}; }
  static fe25519 element(const Bytes& b) {
    fe25519 f;
    for (std::size_t i = 0; i < 8; ++i)
      f.v[i] = b[4 * i] | unsigned{b[4 * i + 1]} << 8 | unsigned{b[4 * i + 2]} << 16 | unsigned{b[4 * i + 3]} << 24;
    return f;
  }
  static Bytes packed(const fe25519& f) {
    Bytes out(32);
    fe25519_pack(out.data(), &f);
    return out;
  }
  static Bytes bytes(const BIGNUM* n) {
    Bytes out(32);
    BN_bn2lebinpad(n, out.data(), 32);
    return out;
  }
  static std::vector<Bytes> values() {
    std::vector<Bytes> all;
    for (const int low : {0, 1, 2, 0xEC, 0xED, 0xEE, 0xDA, 0xD9, 0xDB, 0xFF}) {
      for (const int fill : {0x00, 0xFF}) {
        for (const int top : {0x00, 0x7F, 0x80, 0xFF}) {
          Bytes b(32, static_cast<std::uint8_t>(fill));
          b[0] = static_cast<std::uint8_t>(low);
          b[31] = static_cast<std::uint8_t>(top);
          all.push_back(b);
        }
      }
    }
    for (std::uint64_t k = 0; k < 40; ++k) all.push_back(noise(900 + k, 32));
    return all;
  }
  std::unique_ptr<BN_CTX, decltype(&BN_CTX_free)> context{BN_CTX_new(), &BN_CTX_free};
  Number p = number(from_hex("edffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff7f"));
  Number result{BN_new(), &BN_free};
};

TEST_F(Field, SumsDifferencesAndProductsAreThoseOfOpenSslsBigNumbers) {
  const auto all = values();
  for (const Bytes& a : all) {
    for (const Bytes& b : all) {
      const fe25519 x = element(a), y = element(b);
      fe25519 r;
      fe25519_add(&r, &x, &y);
      BN_mod_add(result.get(), number(a).get(), number(b).get(), p.get(), context.get());
      ASSERT_EQ(packed(r), bytes(result.get())) << "sum";
      fe25519_sub(&r, &x, &y);
      BN_mod_sub(result.get(), number(a).get(), number(b).get(), p.get(), context.get());
      ASSERT_EQ(packed(r), bytes(result.get())) << "difference";
      fe25519_mul(&r, &x, &y);
      BN_mod_mul(result.get(), number(a).get(), number(b).get(), p.get(), context.get());
      ASSERT_EQ(packed(r), bytes(result.get())) << "product";
      ASSERT_EQ(fe25519_iseq_vartime(&x, &y) != 0, packed(x) == packed(y));
    }
  }
}

TEST_F(Field, InverseTimesItsElementIsOne) {
  Bytes one(32);
  one[0] = 1;
  for (const Bytes& a : values()) {
    fe25519 x = element(a), inverse, r;
    if (packed(x) == Bytes(32)) continue;  // nought has none
    fe25519_invert(&inverse, &x);
    fe25519_mul(&r, &inverse, &x);
    EXPECT_EQ(packed(r), one);
  }
}

}  // namespace
}  // namespace rotorloop::firmware
