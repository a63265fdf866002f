// `rotorloop image create`, `sign` and `keygen`: what writes files.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "cli/image/image_commands.hpp"
#include "cli/image/image_file.hpp"
#include "host/base/error.hpp"

namespace rotorloop::cli {
namespace {

struct KeyChoice {
  std::filesystem::path pem;
  bool test = false;
};

struct CreateArguments {
  std::filesystem::path payload, out;
  std::string board = "b_g431b_esc1", version, commit = "0";
  std::uint32_t security_version = 0;
  KeyChoice key;
};

struct SignArguments {
  std::filesystem::path image, out;
  KeyChoice key;
};

struct KeygenArguments {
  std::filesystem::path pem, public_pem;
};

// `digits`: all of `text`, or the part of it that is this number.
template <class T>
T number(std::string_view digits, int base, const char* option, std::string_view text, const char* expected) {
  T value{};
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value, base);
  if (error != std::errc{} || end != digits.data() + digits.size())
    throw Error({fmt::format("rotorloop image create {}", option), fmt::format("\"{}\" is not {}", text, expected), "",
                 "see rotorloop image create --help"});
  return value;
}

firmware::ImageHeader header_of(const CreateArguments& o) {
  constexpr const char* kVersion = "MAJOR.MINOR, each 0 to 255";
  const std::string_view version = o.version;
  const auto dot = std::min(version.find('.'), version.size());
  firmware::ImageHeader h;
  h.major = number<std::uint8_t>(version.substr(0, dot), 10, "--version", version, kVersion);
  h.minor = number<std::uint8_t>(version.substr(std::min(dot + 1, version.size())), 10, "--version", version, kVersion);
  h.vcs_commit = number<std::uint32_t>(o.commit, 16, "--commit", o.commit, "a commit of 1 to 8 hexadecimal digits");
  h.security_version = o.security_version;
  if (o.board.empty() || o.board.size() > h.board.size())
    throw Error({"rotorloop image create --board",
                 fmt::format("\"{}\" has {} characters: 1 to {} are possible", o.board, o.board.size(), h.board.size()), "",
                 "give the name that the bootloader of the board has"});
  h.board = firmware::board_name(o.board.c_str());
  return h;
}

std::optional<SigningKey> key_of(const KeyChoice& k) {
  if (k.test) return SigningKey::test_key();
  if (k.pem.empty()) return std::nullopt;
  return SigningKey::read(k.pem);
}

std::string signature_text(const KeyChoice& k) {
  if (k.test) return "signed with the test key, which everybody has: it protects nothing";
  return k.pem.empty() ? "not signed: a bootloader with a key refuses it" : fmt::format("signed with {}", k.pem.generic_string());
}

int create(const CreateArguments& o) {
  const auto key = key_of(o.key);
  const firmware::ImageHeader header = header_of(o);
  const auto payload = read_image_bytes(o.payload);
  firmware::ImageHeader already;
  if (firmware::parse_image(payload, already) == firmware::ImageFault::none)
    throw Error({o.payload.generic_string(), "is an image already", "", "sign it with `rotorloop image sign`, or give the payload alone"});
  if (payload.size() > 3 && payload[0] == 0x7F && payload[1] == 'E' && payload[2] == 'L' && payload[3] == 'F')
    throw Error({o.payload.generic_string(), "is an ELF, and an image holds what lies in flash behind its header", "",
                 "arm-none-eabi-objcopy -O binary, from the vector table on"});
  auto image = made_image(header, payload);
  if (key) sign_image(image, *key);
  write_image_bytes(o.out, image);
  fmt::print("{}: {} {}.{}, {} bytes of payload, {}\n", o.out.generic_string(), o.board, header.major, header.minor, payload.size(),
             signature_text(o.key));
  return 0;
}

int sign(const SignArguments& o) {
  const auto key = key_of(o.key);
  auto image = read_image_bytes(o.image);
  const ExaminedImage e = examined(image);
  must_be_whole(o.image, e);
  image.resize(firmware::kImageHeaderBytes + e.header.size);
  sign_image(image, *key);
  write_image_bytes(o.out, image);
  fmt::print("{}: {} {}.{}, {}\n", o.out.generic_string(), e.board(), e.header.major, e.header.minor, signature_text(o.key));
  return 0;
}

int keygen(const KeygenArguments& o) {
  const SigningKey key = SigningKey::make(o.pem);
  if (!o.public_pem.empty()) key.write_public(o.public_pem);
  fmt::print("{}: private key, mode 0600; keep it off the machine that is on the bus, and a copy of it offline\n", o.pem.generic_string());
  fmt::print("public half:\n");
  const auto half = key.public_key();
  for (std::size_t i = 0; i < half.size(); ++i) fmt::print("0x{:02x},{}", half[i], i % 16 == 15 ? "\n" : " ");
  return 0;
}

void add_key_options(CLI::App& c, KeyChoice& key) {
  auto* pem = c.add_option("--key", key.pem, "PEM file of an Ed25519 private key; refused when others than its owner can read it");
  c.add_flag("--test-key", key.test, "sign with the test key, whose private half is published: it protects nothing")->excludes(pem);
}

}  // namespace

void add_image_create(CLI::App& image_group, int& exit_code) {
  auto o = std::make_shared<CreateArguments>();
  CLI::App* c = image_group.add_subcommand("create", "an image of a payload: what lies in flash from the vector table on");
  c->add_option("payload", o->payload, "the bytes, as `objcopy -O binary` makes them")->required();
  c->add_option("-o,--out", o->out, "image to write, .rlf")->required();
  c->add_option("--version", o->version, "MAJOR.MINOR of the software")->required();
  c->add_option("--board", o->board, "name of the board; its bootloader refuses any other")->capture_default_str();
  c->add_option("--security", o->security_version, "security version; a bootloader with a key takes none below the installed one")
      ->capture_default_str();
  c->add_option("--commit", o->commit, "commit of the source, hexadecimal")->capture_default_str();
  add_key_options(*c, o->key);
  c->footer(
      "`scripts/firmware` makes the image of this repository's own program; this command is for programs of your own.\n"
      "Example:\n  rotorloop image create esc.bin -o esc.rlf --version 1.2 --key release.pem");
  c->callback([o, &exit_code] { exit_code = create(*o); });
}

void add_image_sign(CLI::App& image_group, int& exit_code) {
  auto o = std::make_shared<SignArguments>();
  CLI::App* c = image_group.add_subcommand("sign", "an image with a key; a signature that it has is replaced");
  c->add_option("image", o->image, "firmware image, .rlf")->required();
  c->add_option("-o,--out", o->out, "signed image to write")->required();
  add_key_options(*c, o->key);
  c->footer(
      "The key goes to the OpenSSL library as a file and is in no argument and no message.\n"
      "Example:\n  rotorloop image sign esc.rlf --key release.pem -o esc_signed.rlf");
  c->callback([o, &exit_code] {
    if (o->key.pem.empty() && !o->key.test)
      throw Error({"rotorloop image sign", "no key is given", "", "give --key KEY.pem, made by `rotorloop image keygen`"});
    exit_code = sign(*o);
  });
}

void add_image_keygen(CLI::App& image_group, int& exit_code) {
  auto o = std::make_shared<KeygenArguments>();
  CLI::App* c = image_group.add_subcommand("keygen", "a new Ed25519 key in a file that only you can read");
  c->add_option("key", o->pem, "file to write, PEM; one that is there is not replaced")->required();
  c->add_option("--public", o->public_pem, "also write the public half there, PEM, for `rotorloop image verify`");
  c->footer(
      "A bootloader takes images of one key, which is compiled into it (docs/security.md).\n"
      "Example:\n  rotorloop image keygen release.pem --public release_public.pem");
  c->callback([o, &exit_code] { exit_code = keygen(*o); });
}

}  // namespace rotorloop::cli
