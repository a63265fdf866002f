// SHA-256 of files and texts: run folders name their inputs and logs by it. The work is libcrypto's, which uses what the CPU has for it.
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

struct evp_md_ctx_st;  // libcrypto's; its headers stay out of this one

namespace rotorloop {

class Sha256 {
 public:
  Sha256();
  void add(std::string_view bytes);
  std::string hex();  // ends the hash; the object is used up

 private:
  struct Free {
    void operator()(evp_md_ctx_st* context) const;
  };
  std::unique_ptr<evp_md_ctx_st, Free> context_;
};

std::string sha256_text(std::string_view text);
std::string sha256_file(const std::filesystem::path& path);  // throws Error when it cannot be read

}  // namespace rotorloop
