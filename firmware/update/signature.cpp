#include "firmware/update/signature.hpp"

#include <algorithm>

#include "third_party/ed25519/ge25519.h"
#include "third_party/ed25519/sc25519.h"

namespace rotorloop::firmware {
namespace {

constexpr std::size_t kSignedFieldBytes = 48;

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
  sc25519 h, s;
  sc25519_from64bytes(&h, digest.data());
  const std::uint8_t* const given = signature_.data() + 32;
  sc25519_from32bytes(&s, given);
  std::array<std::uint8_t, 32> bytes{};
  sc25519_to32bytes(bytes.data(), &s);
  if (!std::equal(bytes.begin(), bytes.end(), given)) return false;  // S was reduced: it was not below the order
  ge25519 negative_key, r;
  if (ge25519_unpackneg_vartime(&negative_key, key_.data()) != 0) return false;
  ge25519_double_scalarmult_vartime(&r, &negative_key, &h, &ge25519_base, &s);
  ge25519_pack(bytes.data(), &r);
  return std::equal(bytes.begin(), bytes.end(), signature_.begin());
}

SignatureCheck image_signature(std::span<const std::uint8_t> head, const PublicKey& key) {
  SignatureCheck check(head.subspan<kSignatureAt, kSignatureBytes>(), key);
  check.add(head.first(kSignedFieldBytes));
  return check;
}

bool signature_good(std::span<const std::uint8_t> image, const PublicKey& key) {
  ImageHeader h;
  if (image.size() < kImageHeaderBytes || parse_image(image, h) != ImageFault::none || image.size() - kImageHeaderBytes < h.size)
    return false;
  SignatureCheck check = image_signature(image, key);
  check.add(image.subspan(kImageHeaderBytes, h.size));
  return check.good();
}

}  // namespace rotorloop::firmware
