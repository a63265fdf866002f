#include "bench/hil/closed_loop/stage.hpp"

#include <fmt/format.h>

#include "host/base/error.hpp"
#include "host/base/sha256.hpp"
#include "host/base/text_file.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::closed_loop {
namespace fs = std::filesystem;
namespace {

std::string key_of(const StageInputs& inputs) {
  std::string text;
  for (const auto& [name, value] : inputs) text += name + "\n" + value + "\n\n";
  return sha256_text(text);
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c == '\n' ? ' ' : c;
  }
  return out + "\"";
}

}  // namespace

bool Stage::done() const {
  if (!fs::is_regular_file(done_file())) return false;
  const auto file = TomlFile::read(done_file());
  return file.root().text("key") == key_of(inputs_);
}

std::string Stage::made_by() const {
  return fs::is_regular_file(done_file()) ? TomlFile::read(done_file()).root().text("made_by") : std::string();
}

void Stage::begin() const {
  std::error_code ec;
  fs::remove_all(folder_, ec);
  fs::create_directories(folder_, ec);
  if (ec)
    throw Error({folder_.generic_string(), "cannot be made: " + ec.message(), "", "free space, or choose another folder with --out"},
                ExitCode::device);
}

void Stage::finish(const std::string& made_by) const {
  std::string text = "# This stage is complete; it is made again when one of its inputs changes.\nformat = 1\n";
  text += fmt::format("key = \"{}\"\nmade_by = {}\n\n[inputs]\n", key_of(inputs_), quoted(made_by));
  for (const auto& [name, value] : inputs_) text += fmt::format("{} = {}\n", quoted(name), quoted(value));
  write_text_file(done_file(), text);
}

}  // namespace rotorloop::closed_loop
