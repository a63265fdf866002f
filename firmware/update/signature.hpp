// The signature in the header of an image (image.hpp): Ed25519 by RFC 8032, without a context and without a hash in front, over bytes 0..47
// of the header and the SHA-512 of the payload, which the header has too. So a header says whether it is genuine before anything of the
// payload is there, and before anything is erased for it (decision 0192); the payload is then held against its SHA-512. Only the check is
// here: no secret ever enters a target, so it may take different times. No heap; about 1 KB of stack in good().
// Arithmetic: third_party/ed25519.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware/update/image.hpp"
#include "third_party/ed25519/sha512.h"

namespace rotorloop::firmware {

using PublicKey = std::array<std::uint8_t, 32>;

inline constexpr std::size_t kSignatureAt = 56, kSignatureBytes = 64, kDigestAt = 120, kDigestBytes = SHA512_DIGEST_LENGTH;
inline constexpr std::size_t kImageHeadBytes = kDigestAt + kDigestBytes;  // of an image: all that has a meaning in its header

// Feeds on the message piece by piece, as it is read.
class SignatureCheck {
 public:
  SignatureCheck(std::span<const std::uint8_t, kSignatureBytes> signature, const PublicKey& key);
  void add(std::span<const std::uint8_t> message);
  // Once, after the last piece. False for a wrong signature, for one whose S is not below the order of the group (RFC 8032, 5.1.7), and for
  // a key that is no point of the curve.
  bool good();

 private:
  std::array<std::uint8_t, kSignatureBytes> signature_;
  PublicKey key_;
  SHA512_CTX hash_;
};

// SHA-512 of a payload that comes in pieces.
class PayloadDigest {
 public:
  PayloadDigest();
  void add(std::span<const std::uint8_t> payload);
  std::array<std::uint8_t, kDigestBytes> value();  // once

 private:
  SHA512_CTX hash_;
};

// `head`: the first kImageHeadBytes of an image, its first word included. What has to be signed is signed_bytes(head).
bool signature_good(std::span<const std::uint8_t> head, const PublicKey& key);
std::array<std::uint8_t, 48 + kDigestBytes> signed_bytes(std::span<const std::uint8_t> head);

// Not signed: the place of the signature is as an erased flash has it.
constexpr bool has_signature(std::span<const std::uint8_t> head) {
  for (std::size_t i = 0; i < kSignatureBytes; ++i)
    if (head[kSignatureAt + i] != 0xFF) return true;
  return false;
}

}  // namespace rotorloop::firmware
