// OpenSSL as the other side of a signature: keys from 32 bytes, signatures of messages and of images.
#pragma once
#include <openssl/evp.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "firmware/update/signature.hpp"
#include "firmware/update/update_key.hpp"

namespace rotorloop::firmware {

class Signer {
 public:
  explicit Signer(std::span<const std::uint8_t> seed)
      : key_(EVP_PKEY_new_raw_private_key(EVP_PKEY_ED25519, nullptr, seed.data(), seed.size()), &EVP_PKEY_free) {}
  static Signer test_key() {
    constexpr std::string_view kSeed = "rotorloop test key, not a secret";
    return Signer({reinterpret_cast<const std::uint8_t*>(kSeed.data()), kSeed.size()});
  }
  PublicKey public_key() const {
    PublicKey out{};
    std::size_t n = out.size();
    EVP_PKEY_get_raw_public_key(key_.get(), out.data(), &n);
    return out;
  }
  std::vector<std::uint8_t> sign(std::span<const std::uint8_t> message) const {
    const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
    EVP_DigestSignInit(context.get(), nullptr, nullptr, nullptr, key_.get());
    std::vector<std::uint8_t> out(kSignatureBytes);
    std::size_t n = out.size();
    EVP_DigestSign(context.get(), out.data(), &n, message.data(), message.size());
    return out;
  }
  std::vector<std::uint8_t> signed_image(std::vector<std::uint8_t> image) const {
    EVP_Digest(&image[kImageHeaderBytes], image.size() - kImageHeaderBytes, &image[kDigestAt], nullptr, EVP_sha512(), nullptr);
    const auto signature = sign(signed_bytes(image));
    std::copy(signature.begin(), signature.end(), image.begin() + kSignatureAt);
    return image;
  }

 private:
  std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key_;
};

}  // namespace rotorloop::firmware
