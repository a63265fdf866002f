// `rotorloop image`: firmware images for updates over the bus. Here the group, and what looks at an image.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "cli/commands.hpp"
#include "cli/image/image_commands.hpp"
#include "cli/image/image_file.hpp"
#include "firmware/update/update_key.hpp"
#include "host/base/error.hpp"

namespace rotorloop::cli {
namespace {

struct InfoArguments {
  std::filesystem::path image;
  bool json = false;
};

struct VerifyArguments {
  std::filesystem::path image, key;
};

// The test key is the one that everybody has, so an image can say by itself whether it is signed with that.
bool has_test_signature(const std::vector<std::uint8_t>& image) { return firmware::signature_good(image, firmware::kTestKey.key); }

int info(const InfoArguments& o) {
  const auto image = read_image_bytes(o.image);
  const ExaminedImage e = examined(image);
  must_be_whole(o.image, e);
  const auto& h = e.header;
  const bool test = e.is_signed && has_test_signature(image);
  if (o.json) {
    const nlohmann::ordered_json j{{"board", e.board()},
                                   {"software_major", h.major},
                                   {"software_minor", h.minor},
                                   {"vcs_commit", fmt::format("{:08x}", h.vcs_commit)},
                                   {"security_version", h.security_version},
                                   {"payload_bytes", h.size},
                                   {"image_crc", fmt::format("{:016x}", h.crc)},
                                   {"signature", !e.is_signed ? "none"
                                                 : test       ? "test key"
                                                              : "other key"}};
    fmt::print("{}\n", j.dump(2));
    return 0;
  }
  fmt::print("{}: whole\n", o.image.generic_string());
  fmt::print("  {:<18} {}\n", "board", e.board());
  fmt::print("  {:<18} {}.{}, commit {:08x}\n", "version", h.major, h.minor, h.vcs_commit);
  fmt::print("  {:<18} {}\n", "security version", h.security_version);
  fmt::print("  {:<18} {} bytes, CRC {:016x}\n", "payload", h.size, h.crc);
  fmt::print("  {:<18} {}\n", "signature",
             !e.is_signed ? "none: a bootloader with a key refuses it"
             : test       ? "by the test key, which everybody has: it protects nothing"
                          : "by a key that is not the test key; `rotorloop image verify --key` says whether it is yours");
  return 0;
}

int verify(const VerifyArguments& o) {
  const firmware::PublicKey key = read_public_key(o.key);
  const auto image = read_image_bytes(o.image);
  const ExaminedImage e = examined(image);
  must_be_whole(o.image, e);
  const std::string where = o.image.generic_string();
  if (!e.is_signed)
    throw Error({where, "the image is not signed", "", "sign it: rotorloop image sign IMAGE --key KEY.pem -o SIGNED"}, ExitCode::verdict);
  if (!firmware::signature_good(image, key))
    throw Error({where, fmt::format("the image is not signed by the key of {}", o.key.generic_string()),
                 has_test_signature(image) ? "it is signed by the test key" : "another key, or a header that was changed afterwards",
                 "get the image from who has the key, or give the key that signed it"},
                ExitCode::verdict);
  fmt::print("{}: signed by the key of {}, and whole\n", where, o.key.generic_string());
  return 0;
}

}  // namespace

void add_image_info(CLI::App& image_group, int& exit_code) {
  auto o = std::make_shared<InfoArguments>();
  CLI::App* c = image_group.add_subcommand("info", "what an image is: board, versions, size, CRC, whose signature");
  c->add_option("image", o->image, "firmware image, .rlf")->required();
  c->add_flag("--json", o->json, "the same for programs");
  c->footer("A damaged or cut image is refused with exit code 5.\nExample:\n  rotorloop image info build/firmware/bin/b_g431b_esc1.rlf");
  c->callback([o, &exit_code] { exit_code = info(*o); });
}

void add_image_verify(CLI::App& image_group, int& exit_code) {
  auto o = std::make_shared<VerifyArguments>();
  CLI::App* c = image_group.add_subcommand("verify", "whether an image is whole and signed by a key");
  c->add_option("image", o->image, "firmware image, .rlf")->required();
  c->add_option("--key", o->key, "PEM file with the public key (the private one does, too)")->required();
  c->footer(
      "Exit code 0: signed by this key and whole; 6: not signed, or by another key; 5: damaged.\n"
      "Example:\n  rotorloop image verify esc.rlf --key release_public.pem");
  c->callback([o, &exit_code] { exit_code = verify(*o); });
}

void add_image(CLI::App& app, int& exit_code) {
  CLI::App* group = app.add_subcommand("image", "firmware images for updates over the bus: made, signed, verified; keys");
  group->require_subcommand(1);
  add_image_info(*group, exit_code);
  add_image_verify(*group, exit_code);
  add_image_create(*group, exit_code);
  add_image_sign(*group, exit_code);
  add_image_keygen(*group, exit_code);
}

}  // namespace rotorloop::cli
