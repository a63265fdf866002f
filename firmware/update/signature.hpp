// The Ed25519 signature in the header of an image (image.hpp, bytes 56..119): over bytes 0..47 of the header and the payload, by RFC 8032,
// without a context and without a hash in front. Only the check is here: no secret ever enters a target, so it may take different times.
// No heap; about 3 KB of stack in good(), 2 KB of it a table of 16 points. Arithmetic: third_party/ed25519.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware/update/image.hpp"
#include "third_party/ed25519/sha512.h"

namespace rotorloop::firmware {

using PublicKey = std::array<std::uint8_t, 32>;

inline constexpr std::size_t kSignatureAt = 56, kSignatureBytes = 64;
inline constexpr std::size_t kImageHeadBytes = kSignatureAt + kSignatureBytes;  // of an image: all that has a meaning in its header

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

// For an image: what is left is to add its payload.  `head`: the first kImageHeadBytes of it, its first word included.
//   auto check = image_signature(head, key); while (more) check.add(piece); if (check.good()) ...
SignatureCheck image_signature(std::span<const std::uint8_t> head, const PublicKey& key);

// A whole image that lies in memory: header, payload. False also when it is shorter than its header says.
bool signature_good(std::span<const std::uint8_t> image, const PublicKey& key);

// Not signed: the place of the signature is as an erased flash has it.
constexpr bool has_signature(std::span<const std::uint8_t> head) {
  for (std::size_t i = 0; i < kSignatureBytes; ++i)
    if (head[kSignatureAt + i] != 0xFF) return true;
  return false;
}

}  // namespace rotorloop::firmware
