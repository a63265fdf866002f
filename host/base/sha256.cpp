#include "host/base/sha256.hpp"

#include <openssl/evp.h>

#include <array>
#include <fstream>
#include <vector>

#include "host/base/error.hpp"

namespace rotorloop {
namespace {

// Only a libcrypto without SHA-256 or a machine without memory gets here.
void require(int done) {
  if (done != 1)
    throw Error({"SHA-256", "libcrypto refused", "the installed OpenSSL is damaged", "install libssl3 again"}, ExitCode::device);
}

}  // namespace

void Sha256::Free::operator()(evp_md_ctx_st* context) const { EVP_MD_CTX_free(context); }

Sha256::Sha256() : context_(EVP_MD_CTX_new()) { require(context_ ? EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) : 0); }

void Sha256::add(std::string_view bytes) { require(EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size())); }

std::string Sha256::hex() {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  require(EVP_DigestFinal_ex(context_.get(), digest.data(), &size));
  std::string out;
  for (unsigned i = 0; i < size; ++i) {
    out.push_back("0123456789abcdef"[digest[i] >> 4]);
    out.push_back("0123456789abcdef"[digest[i] & 15]);
  }
  return out;
}

std::string sha256_text(std::string_view text) {
  Sha256 s;
  s.add(text);
  return s.hex();
}

std::string sha256_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw Error({path.generic_string(), "cannot be read", "", "check that it exists and its permissions"});
  Sha256 s;
  std::vector<char> buffer(1 << 16);
  while (in.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) || in.gcount() > 0)
    s.add({buffer.data(), static_cast<std::size_t>(in.gcount())});
  return s.hex();
}

}  // namespace rotorloop
