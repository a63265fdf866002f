#include "firmware/update/signature.hpp"

#include <algorithm>

#include "third_party/ed25519/ge25519.h"

namespace rotorloop::firmware {
namespace {

using Scalar = std::array<std::uint8_t, 32>;  // little-endian
// Of the group: 2^252 + 27742317777372353535851937790883648493.
constexpr Scalar kOrder{0xED, 0xD3, 0xF5, 0x5C, 0x1A, 0x63, 0x12, 0x58, 0xD6, 0x9C, 0xF7, 0xA2, 0xDE, 0xF9, 0xDE, 0x14,
                        0,    0,    0,    0,    0,    0,    0,    0,    0,    0,    0,    0,    0,    0,    0,    0x10};

// Takes the order off, unless the scalar is below it: false.
bool take_order_off(Scalar& s) {
  Scalar less{};
  int t = 0;
  for (std::size_t i = 0; i < s.size(); ++i) {
    t += s[i] - kOrder[i];
    less[i] = static_cast<std::uint8_t>(t);
    t >>= 8;
  }
  if (t == 0) s = less;
  return t == 0;
}

// What is left of it below the order. Bit by bit, which takes 2 ms on the target and little code.
Scalar reduced(const std::array<std::uint8_t, SHA512_DIGEST_LENGTH>& h) {
  Scalar s{};
  for (std::size_t bit = 8 * h.size(); bit-- > 0;) {
    unsigned t = static_cast<unsigned>(h[bit / 8]) >> bit % 8 & 1u;
    for (std::uint8_t& byte : s) {
      t |= static_cast<unsigned>(byte) << 1u;
      byte = static_cast<std::uint8_t>(t);
      t >>= 8u;
    }
    take_order_off(s);
  }
  return s;
}

}  // namespace

SignatureCheck::SignatureCheck(std::span<const std::uint8_t, kSignatureBytes> signature, const PublicKey& key) : key_(key) {
  std::copy(signature.begin(), signature.end(), signature_.begin());
  SHA512Init(&hash_);
  SHA512Update(&hash_, signature_.data(), 32);  // R
  SHA512Update(&hash_, key_.data(), key_.size());
}

void SignatureCheck::add(std::span<const std::uint8_t> message) { SHA512Update(&hash_, message.data(), message.size()); }

bool SignatureCheck::good() {
  std::array<std::uint8_t, SHA512_DIGEST_LENGTH> digest{};
  SHA512Final(digest.data(), &hash_);
  Scalar s{};
  std::copy_n(signature_.begin() + 32, s.size(), s.begin());
  if (take_order_off(s)) return false;
  ge25519 negative_key, r;
  if (ge25519_unpackneg_vartime(&negative_key, key_.data()) != 0) return false;
  ge25519_double_scalarmult_vartime(&r, &negative_key, reduced(digest).data(), &ge25519_base, s.data());
  std::array<std::uint8_t, 32> bytes{};
  ge25519_pack(bytes.data(), &r);
  return std::equal(bytes.begin(), bytes.end(), signature_.begin());
}

PayloadDigest::PayloadDigest() { SHA512Init(&hash_); }
void PayloadDigest::add(std::span<const std::uint8_t> payload) { SHA512Update(&hash_, payload.data(), payload.size()); }
std::array<std::uint8_t, kDigestBytes> PayloadDigest::value() {
  std::array<std::uint8_t, kDigestBytes> out{};
  SHA512Final(out.data(), &hash_);
  return out;
}

std::array<std::uint8_t, 48 + kDigestBytes> signed_bytes(std::span<const std::uint8_t> head) {
  std::array<std::uint8_t, 48 + kDigestBytes> out{};
  std::copy_n(head.begin(), 48, out.begin());
  std::copy_n(head.begin() + kDigestAt, kDigestBytes, out.begin() + 48);
  return out;
}

bool signature_good(std::span<const std::uint8_t> head, const PublicKey& key) {
  SignatureCheck check(head.subspan<kSignatureAt, kSignatureBytes>(), key);
  check.add(signed_bytes(head));
  return check.good();
}

}  // namespace rotorloop::firmware
