#include "cli/image/signing_key.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/pem.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>
#include <string_view>

#include "host/base/error.hpp"

namespace rotorloop::cli {
namespace {

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

constexpr std::string_view kTestSeed = "rotorloop test key, not a secret";  // firmware/update/update_key.hpp
constexpr const char* kMakeOne = "make one with `rotorloop image keygen`, or `openssl genpkey -algorithm ed25519`";

[[noreturn]] void refuse(const std::filesystem::path& path, std::string what, std::string remedy) {
  throw Error({path.generic_string(), std::move(what), "", std::move(remedy)});
}

File opened(const std::filesystem::path& path) {
  File file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file) refuse(path, fmt::format("cannot read the key: {}", std::strerror(errno)), "check the path");
  return file;
}

// A pass phrase is never asked for: a command that waits for a keyboard hangs a script.
int no_pass_phrase(char*, int, int, void*) { return -1; }

std::array<std::uint8_t, 32> raw_public(const EVP_PKEY* key) {
  std::array<std::uint8_t, 32> out{};
  std::size_t n = out.size();
  EVP_PKEY_get_raw_public_key(key, out.data(), &n);
  return out;
}

void must_be_ed25519(const std::filesystem::path& path, const EVP_PKEY* key) {
  if (EVP_PKEY_id(key) != EVP_PKEY_ED25519)
    refuse(path, fmt::format("is a key for {}, and images are signed with Ed25519", OBJ_nid2ln(EVP_PKEY_base_id(key))), kMakeOne);
}

}  // namespace

SigningKey SigningKey::test_key() {
  return SigningKey(Key(
      EVP_PKEY_new_raw_private_key(EVP_PKEY_ED25519, nullptr, reinterpret_cast<const std::uint8_t*>(kTestSeed.data()), kTestSeed.size()),
      &EVP_PKEY_free));
}

SigningKey SigningKey::read(const std::filesystem::path& pem) {
  const File file = opened(pem);
  struct stat about {};
  ::fstat(::fileno(file.get()), &about);
  const unsigned mode = about.st_mode & 0777u;
  if ((mode & 077u) != 0)
    refuse(pem, fmt::format("has mode {:04o}: others can read or write this private key, and 0600 is expected", mode),
           "chmod 600, or make a new key if others may have read it");
  Key key(PEM_read_PrivateKey(file.get(), nullptr, no_pass_phrase, nullptr), &EVP_PKEY_free);
  if (!key) refuse(pem, "is no PEM file of a private key, or has a pass phrase", kMakeOne);
  must_be_ed25519(pem, key.get());
  return SigningKey(std::move(key));
}

SigningKey SigningKey::make(const std::filesystem::path& pem) {
  const int descriptor = ::open(pem.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (descriptor < 0)
    refuse(pem,
           errno == EEXIST ? "is there already, and a key is never replaced" : fmt::format("cannot be written: {}", std::strerror(errno)),
           "give a new file, in a folder that exists and may be written");
  const File file(::fdopen(descriptor, "wb"), &std::fclose);
  Key key(EVP_PKEY_Q_keygen(nullptr, nullptr, "ED25519"), &EVP_PKEY_free);
  if (!key || PEM_write_PrivateKey(file.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr) != 1 || std::fflush(file.get()) != 0) {
    ::unlink(pem.c_str());
    throw Error({pem.generic_string(), "the key could not be written whole", "a full disk", "make room and run the command again"},
                ExitCode::device);
  }
  return SigningKey(std::move(key));
}

std::array<std::uint8_t, 32> SigningKey::public_key() const { return raw_public(key_.get()); }

void SigningKey::write_public(const std::filesystem::path& pem) const {
  const File file(std::fopen(pem.c_str(), "wb"), &std::fclose);
  if (!file || PEM_write_PUBKEY(file.get(), key_.get()) != 1 || std::fflush(file.get()) != 0)
    throw Error({pem.generic_string(), fmt::format("the public key cannot be written: {}", std::strerror(errno)), "",
                 "give a folder that exists and may be written"},
                ExitCode::device);
}

std::vector<std::uint8_t> SigningKey::sign(std::span<const std::uint8_t> message) const {
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  std::vector<std::uint8_t> out(64);  // RFC 8032
  std::size_t n = out.size();
  if (EVP_DigestSignInit(context.get(), nullptr, nullptr, nullptr, key_.get()) != 1 ||
      EVP_DigestSign(context.get(), out.data(), &n, message.data(), message.size()) != 1 || n != out.size())
    throw Error({"image", "the signature could not be made", "the OpenSSL library on this machine", "check its installation"},
                ExitCode::defect);
  return out;
}

std::array<std::uint8_t, 32> read_public_key(const std::filesystem::path& pem) {
  const File file = opened(pem);
  std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key(PEM_read_PUBKEY(file.get(), nullptr, no_pass_phrase, nullptr), &EVP_PKEY_free);
  if (!key) {
    std::rewind(file.get());
    key.reset(PEM_read_PrivateKey(file.get(), nullptr, no_pass_phrase, nullptr));
  }
  if (!key) refuse(pem, "is no PEM file of a key", "give the public half, as `rotorloop image keygen --public` writes it");
  must_be_ed25519(pem, key.get());
  return raw_public(key.get());
}

}  // namespace rotorloop::cli
