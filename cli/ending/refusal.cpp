#include "cli/ending/refusal.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>

#include "host/base/nearest.hpp"

namespace rotorloop::cli {
namespace {

const CLI::App* subcommand(const CLI::App& app, const std::string& name) {
  const auto found = app.get_subcommands([&](const CLI::App* s) { return s->get_name() == name; });
  return found.empty() ? nullptr : found.front();
}

// Names of the commands or options that are shown to users.
std::vector<std::string> commands_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App* s) { return !s->get_group().empty(); }))
    names.push_back(sub->get_name());
  return names;
}
std::vector<std::string> options_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty()) continue;
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

bool is_option(const CLI::App& app, const std::string& word) {
  const auto options = app.get_options();
  return std::any_of(options.begin(), options.end(), [&](const CLI::Option* o) { return o->check_name(word); });
}

// Has arguments of its own beside options: then a word need not be a command.
bool takes_words(const CLI::App& app) {
  const auto options = app.get_options();
  return std::any_of(options.begin(), options.end(), [](const CLI::Option* o) { return o->get_positional(); });
}

std::string lower_first(std::string text) {
  if (text.size() > 1 && text[0] >= 'A' && text[0] <= 'Z' && text[1] >= 'a' && text[1] <= 'z')
    text[0] = static_cast<char>(text[0] - 'A' + 'a');
  return text;
}

// "300.000000" as a person writes it.
std::string plain_number(std::string text) {
  if (text.find('.') == std::string::npos || text.find_first_not_of("-0123456789.") != std::string::npos) return text;
  text.erase(text.find_last_not_of('0') + 1);
  if (text.ends_with('.')) text.pop_back();
  return text;
}

bool is_number(const std::string& text) {
  std::size_t used = 0;
  try {
    (void)std::stod(text, &used);
  } catch (const std::exception&) {
    return false;
  }
  return used == text.size();
}

ErrorText not_a_number(const std::string& where, std::string value, const std::string& see) {
  const std::string what = fmt::format("\"{}\" is not a number", value);
  if (std::count(value.begin(), value.end(), ',') != 1) return {where, what, "", see};
  value[value.find(',')] = '.';
  return {where, what, "a comma in place of the decimal point", fmt::format("write {}", value)};
}

// What is wrong with the value of one option or argument; `what` is the parser's sentence without the name. The remedy is the option's own
// description, which has the unit.
ErrorText refused_value(const TypedCommand& command, const std::string& option, const std::string& what) {
  const CLI::Option* known = command.app->get_option_no_throw(option);
  const std::string see =
      (known && !known->get_description().empty() ? known->get_description() + "; " : "") + "see " + command.name + " --help";
  const std::string where = command.name + " " + option;
  static constexpr std::string_view kValue = "Value ", kRange = " not in range ", kTo = " to ", kNoFile = "File does not exist: ";
  const auto range = what.find(kRange), to = what.find(kTo, range);
  if (what.starts_with(kValue) && to != std::string::npos) {
    const std::string value = what.substr(kValue.size(), range - kValue.size());
    if (!is_number(value)) return not_a_number(where, value, see);
    const std::size_t low = range + kRange.size();
    return {where,
            fmt::format("{} is out of range: {} to {}", value, plain_number(what.substr(low, to - low)),
                        plain_number(what.substr(to + kTo.size()))),
            "", see};
  }
  if (what.starts_with(kNoFile))
    return {where, fmt::format("\"{}\": no such file", what.substr(kNoFile.size())), "",
            "check the path; it is relative to the folder where the command runs"};
  return {where, lower_first(what), "", see};
}

// "Could not convert: --mass-kg = 0,75"
std::optional<ErrorText> refused_number(const TypedCommand& command, const std::string& what) {
  static constexpr std::string_view kStart = "Could not convert: ", kIs = " = ";
  const auto is = what.find(kIs);
  if (!what.starts_with(kStart) || is == std::string::npos) return std::nullopt;
  const ErrorText text = refused_value(command, what.substr(kStart.size(), is - kStart.size()), "");
  return not_a_number(text.where, what.substr(is + kIs.size()), text.remedy);
}

}  // namespace

TypedCommand typed_command(const CLI::App& app, int argc, const char* const* argv) {
  TypedCommand out{app.get_name().empty() ? "rotorloop" : app.get_name(), &app};
  for (int i = 1; i < argc; ++i) {
    const CLI::App* sub = subcommand(*out.app, argv[i]);
    if (!sub) break;
    out.name += " " + sub->get_name();
    out.app = sub;
  }
  return out;
}

std::string use_one_of(const std::string& word, const std::vector<std::string>& allowed) {
  return did_you_mean(word, allowed) + fmt::format("use one of: {}", fmt::join(allowed, ", "));
}

std::optional<ErrorText> unknown_word(const CLI::App& app, int argc, const char* const* argv) {
  TypedCommand at{app.get_name().empty() ? "rotorloop" : app.get_name(), &app};
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--") break;
    if (const CLI::App* sub = subcommand(*at.app, word)) {
      at = {at.name + " " + sub->get_name(), sub};
      continue;
    }
    if (!word.starts_with('-')) {
      const auto commands = commands_of(*at.app);
      if (!commands.empty() && !takes_words(*at.app))
        return ErrorText{at.name, fmt::format("\"{}\" is not a command", word), "",
                         use_one_of(word, commands) + "; see " + at.name + " --help"};
      continue;
    }
    const std::string option = word.substr(0, word.find('='));
    if (!option.starts_with("--") || is_option(*at.app, option)) continue;
    const std::string near = did_you_mean(option, options_of(*at.app));
    return ErrorText{at.name + " " + option, "is not an option of this command", "", near + "see " + at.name + " --help"};
  }
  return std::nullopt;
}

ErrorText refusal_of(const CLI::ParseError& error, const TypedCommand& command) {
  const std::string see = "see " + command.name + " --help";
  std::string what = error.what();
  if (const auto number = refused_number(command, what)) return *number;
  // "--noise: emm not in {em,fixed}": the option belongs to where, and its list gives the nearest word. Arguments have no dashes.
  const auto colon = what.find(": ");
  if (colon != std::string::npos && what.find(' ') > colon) {
    const std::string option = what.substr(0, colon);
    what = what.substr(colon + 2);
    const auto in = what.find(" not in {");
    if (in != std::string::npos && what.ends_with('}')) {
      const std::string word = what.substr(0, in);
      std::vector<std::string> allowed;
      std::string list = what.substr(in + 9, what.size() - in - 10);
      for (std::size_t from = 0; from <= list.size();) {
        const auto comma = std::min(list.find(',', from), list.size());
        allowed.push_back(list.substr(from, comma - from));
        from = comma + 1;
      }
      return {command.name + " " + option, fmt::format("\"{}\" is not known", word), "", use_one_of(word, allowed)};
    }
    if (what.starts_with("At Most 1 required")) return {command.name + " " + option, "is given more than once", "", "give it once"};
    return refused_value(command, option, what);
  }
  return {command.name, lower_first(what), "", see};
}

std::string refusal_text(const ErrorText& text, const std::string& command) {
  ErrorText out = text;
  if (out.where.empty())
    out.where = command;
  else if (out.where.starts_with('-'))
    out.where = command + " " + out.where;
  return Error(out).what();
}

}  // namespace rotorloop::cli
