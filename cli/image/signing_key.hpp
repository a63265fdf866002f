// Ed25519 keys in PEM files, as `openssl genpkey -algorithm ed25519` writes them. All throw Error (usage) that names the file.
#pragma once
#include <openssl/evp.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

namespace rotorloop::cli {

class SigningKey {
 public:
  // The private half of firmware::kTestKey, which is published: it protects nothing.
  static SigningKey test_key();
  // Refused: a file that others than its owner can read or write, a key of another kind, one with a pass phrase.
  static SigningKey read(const std::filesystem::path& pem);
  // A new key into a new file of mode 0600; a file that is there is never replaced.
  static SigningKey make(const std::filesystem::path& pem);

  std::array<std::uint8_t, 32> public_key() const;  // RFC 8032, 5.1.5
  void write_public(const std::filesystem::path& pem) const;
  std::vector<std::uint8_t> sign(std::span<const std::uint8_t> message) const;  // 64 bytes

 private:
  using Key = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;
  explicit SigningKey(Key key) : key_(std::move(key)) {}
  Key key_;
};

// The public half, from a PEM file of either half: verifying needs no secret.
std::array<std::uint8_t, 32> read_public_key(const std::filesystem::path& pem);

}  // namespace rotorloop::cli
