#include "bench/hil/controllers/external.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "bench/hil/controllers/variant.hpp"
#include "host/base/error.hpp"

namespace rotorloop::hil {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kMostControllers = 20;

// "python3 fly/my-controller.py --fast" -> "my-controller": the last word that is a file, without folder and ending.
std::string name_from(const std::string& command) {
  std::string best;
  for (std::size_t at = 0; at < command.size();) {
    const auto end = std::min(command.find(' ', at), command.size());
    const std::string word = command.substr(at, end - at);
    std::error_code ignored;
    if (best.empty() || fs::is_regular_file(word, ignored)) best = fs::path(word).stem().string();
    at = end + 1;
  }
  std::replace_if(
      best.begin(), best.end(), [](char c) { return !is_variant_name(std::string_view(&c, 1)); }, '_');
  return best;
}

}  // namespace

ExternalController parse_controller(std::string_view text) {
  ExternalController c;
  const auto equals = text.find('=');
  std::string rest(text);
  if (equals != std::string_view::npos && is_variant_name(text.substr(0, equals))) {
    c.name = text.substr(0, equals);
    rest = text.substr(equals + 1);
  }
  const std::string given(text);
  if (rest.find_first_not_of(' ') == std::string::npos)
    throw Error({"--controller", fmt::format("\"{}\" names no controller", given), "",
                 "give a shared library (./my.so) or a command line (\"python3 my.py\")"});
  if (fs::path(rest).extension() == ".so") {
    std::error_code ignored;
    if (!fs::is_regular_file(rest, ignored))
      throw Error({"--controller", fmt::format("\"{}\": no such library", rest), "", "build it first, and give its path"});
    c.library = rest;
  } else {
    c.command = rest;
  }
  if (c.name.empty()) c.name = name_from(rest);
  if (!is_variant_name(c.name) || variant_from_name(c.name))
    throw Error({"--controller", fmt::format("\"{}\" cannot be the name of a variant", c.name),
                 variant_from_name(c.name) ? "one of ours is called so" : "it names a folder",
                 "write NAME=CONTROLLER with a name of letters, digits, '_' and '-'"});
  return c;
}

std::vector<ExternalController> read_external_controllers(const TomlTable& root) {
  std::vector<ExternalController> out;
  for (const auto& t : root.tables("external_controller", 0, kMostControllers)) {
    ExternalController c;
    c.name = t.text("name");
    if (!is_variant_name(c.name) || variant_from_name(c.name))
      t.fail("name", fmt::format("external_controller.name = \"{}\" cannot be the name of a variant", c.name), "",
             "use 1 to 64 letters, digits, '_' and '-', and no name of our variants");
    for (const auto& other : out)
      if (other.name == c.name)
        t.fail("name", fmt::format("external_controller.name = \"{}\" is used twice", c.name), "", "give each its own name");
    if (t.has("library") == t.has("command"))
      t.fail("name", fmt::format("external controller \"{}\" needs either library or command", c.name), "", "give one of the two");
    if (t.has("library"))
      c.library = t.file("library");
    else
      c.command = t.text("command");
    c.from_scenario = true;
    c.timeout_s = t.number("timeout_s", {kLeastTimeout_s, kMostTimeout_s, "s"}, c.timeout_s);
    out.push_back(std::move(c));
  }
  return out;
}

std::string shell_quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

const Bridge* bridge_of(const ExternalController& c) {
  for (const Bridge& b : kBridges)
    if (c.library.empty() && c.command == b.name) return &b;
  return nullptr;
}

std::string start_line(const ExternalController& c) {
  const std::string rotorloop = shell_quoted(c.rotorloop.string());
  if (!c.library.empty()) return fmt::format("exec {} controller library {}", rotorloop, shell_quoted(fs::absolute(c.library).string()));
  if (bridge_of(c)) return fmt::format("exec {} controller {}", rotorloop, c.command);
  return c.command;
}

std::string argument_text(const ExternalController& c, const std::string& library) {
  return fmt::format("{}={}", c.name, c.library.empty() ? c.command : library);
}

}  // namespace rotorloop::hil
