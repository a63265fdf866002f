#include "host/tools/parameters.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <fstream>

#include "host/base/error.hpp"
#include "host/base/nearest.hpp"

namespace rotorloop::tools {
namespace {

using protocols::NumericValue;
using protocols::ParamGetSet;
using protocols::ParamGetSetResponse;
using protocols::ParamValue;

constexpr std::size_t kReadAhead = 5;
constexpr std::uint16_t kMostParameters = 8191;  // 13 bits of index

template <class T>
std::string as_text(const T& bytes) {
  return {bytes.items.begin(), bytes.items.begin() + bytes.count};
}

template <class T>
void assign(T& bytes, const std::string& text) {
  bytes.assign({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

NodeParameter parameter_of(const ParamGetSetResponse& r) {
  return {.name = as_text(r.name), .value = r.value, .default_value = r.default_value, .min = r.min_value, .max = r.max_value};
}

[[noreturn]] void no_answer(ToolNode& tool, std::uint8_t node, const std::string& to) {
  if (tool.stopped()) throw Error({"", "interrupted", "", ""}, ExitCode::interrupted);
  const bool there = tool.nodes().contains(node);
  throw Error({.where = fmt::format("node {}", node),
               .what = "does not answer " + to,
               .likely = there ? "the node does not have this service" : "no node with this id is on the bus",
               .remedy = "see who is there with: rotorloop esc list"},
              ExitCode::device);
}

// A GetSet may be asked again without harm. One that is heard on the bus answers in the end: with one frame in twenty lost at each end, an
// answer of 20 frames comes whole one time in three.
AskOptions patience(const ToolNode& tool, std::uint8_t node) {
  const auto seen = tool.nodes().find(node);
  if (seen == tool.nodes().end() || tool.now_ns() - seen->second.heard_ns > kToolOffline_ns) return {};
  return {.attempts = 20, .timeout_ns = 500'000'000};
}

std::optional<double> number(const NumericValue& v) {
  if (v.kind == NumericValue::Kind::integer) return static_cast<double>(v.integer);
  if (v.kind == NumericValue::Kind::real) return static_cast<double>(v.real);
  return std::nullopt;
}

[[noreturn]] void not_a_value(const NodeParameter& p, const std::string& text, const std::string& where, const std::string& wanted) {
  throw Error(
      {where, fmt::format("\"{}\" for {} is no {}", text, p.name, wanted), "", fmt::format("its value now is {}", value_text(p.value))});
}

void check_limits(const NodeParameter& p, double value, const std::string& where) {
  const auto min = number(p.min), max = number(p.max);
  if ((!min || value >= *min) && (!max || value <= *max)) return;
  throw Error({where, fmt::format("{} = {:.7g} is out of range: {} to {}", p.name, value, limit_text(p.min), limit_text(p.max)), "",
               "give a value within the range"});
}

}  // namespace

std::vector<NodeParameter> read_parameters(ToolNode& tool, std::uint8_t node) {
  std::map<std::uint16_t, std::optional<ParamGetSetResponse>> got;
  std::uint16_t next = 0, end = kMostParameters;
  bool failed = false;
  std::size_t open = 0;
  const auto ask_next = [&](const auto& self) -> void {
    while (open < kReadAhead && next < end && !failed) {
      const std::uint16_t index = next++;
      ++open;
      tool.request<ParamGetSet, ParamGetSetResponse>(
          node, {.index = index, .value = {}, .name = {}},
          [&, index](const std::optional<ParamGetSetResponse>& r) {
            --open;
            if (!r) {
              failed = true;
              return;
            }
            if (r->name.count == 0) {
              end = std::min(end, index);
            } else {
              got[index] = r;
            }
            self(self);
          },
          patience(tool, node));
    }
  };
  ask_next(ask_next);
  constexpr std::int64_t kLongest_ns = 300'000'000'000;
  tool.run_until(tool.now_ns() + kLongest_ns, [&] { return open == 0; });
  if (failed || open > 0) no_answer(tool, node, "to a question for its parameters");
  std::vector<NodeParameter> parameters;
  for (const auto& [index, r] : got) {
    if (index < end) parameters.push_back(parameter_of(*r));
  }
  return parameters;
}

std::optional<NodeParameter> find_parameter(ToolNode& tool, std::uint8_t node, const std::string& name) {
  ParamGetSet request;
  assign(request.name, name);
  const auto r = tool.ask<ParamGetSetResponse>(node, request, patience(tool, node));
  if (!r) no_answer(tool, node, "to a question for its parameters");
  return r->name.count > 0 ? std::optional(parameter_of(*r)) : std::nullopt;
}

std::string waits_for_restart(ToolNode& tool, std::uint8_t node) {
  const auto p = find_parameter(tool, node, "stat_restart");
  const std::string names = p && p->value.kind == ParamValue::Kind::string ? as_text(p->value.string) : "";
  return names == "none" ? "" : names;
}

NodeParameter read_parameter(ToolNode& tool, std::uint8_t node, const std::string& name) {
  if (const auto p = find_parameter(tool, node, name)) return *p;
  std::vector<std::string> names;
  for (const NodeParameter& p : read_parameters(tool, node)) names.push_back(p.name);
  throw Error({fmt::format("node {}", node), "has no parameter \"" + name + "\"", "",
               did_you_mean(name, names) + fmt::format("list them: rotorloop esc get --node {}", node)});
}

ParamValue parse_value(const NodeParameter& p, const std::string& text, const std::string& where) {
  const char* const begin = text.data();
  const char* const end = begin + text.size();
  ParamValue v;
  v.kind = p.value.kind;
  switch (p.value.kind) {
    case ParamValue::Kind::integer: {
      const auto [at, error] = std::from_chars(begin, end, v.integer);
      if (text.empty() || error != std::errc{} || at != end) not_a_value(p, text, where, "whole number");
      check_limits(p, static_cast<double>(v.integer), where);
      return v;
    }
    case ParamValue::Kind::real: {
      const auto [at, error] = std::from_chars(begin, end, v.real);
      if (text.empty() || error != std::errc{} || at != end || !std::isfinite(v.real)) not_a_value(p, text, where, "number");
      check_limits(p, static_cast<double>(v.real), where);
      return v;
    }
    case ParamValue::Kind::boolean:
      if (text != "true" && text != "false" && text != "1" && text != "0") not_a_value(p, text, where, "true or false");
      v.boolean = text == "true" || text == "1" ? 1 : 0;
      return v;
    case ParamValue::Kind::string:
      if (text.size() > v.string.items.size())
        not_a_value(p, text, where, fmt::format("text of at most {} characters", v.string.items.size()));
      assign(v.string, text);
      return v;
    case ParamValue::Kind::empty:
      break;
  }
  not_a_value(p, text, where, "value that the node would take");
}

NodeParameter set_parameter(ToolNode& tool, std::uint8_t node, const NodeParameter& parameter, const ParamValue& value) {
  ParamGetSet request;
  request.value = value;
  assign(request.name, parameter.name);
  const auto r = tool.ask<ParamGetSetResponse>(node, request, patience(tool, node));
  if (!r) no_answer(tool, node, "to setting " + parameter.name);
  if (same_value(r->value, value)) return parameter_of(*r);
  throw Error({.where = fmt::format("node {}", node),
               .what = fmt::format("refuses {} = {}; it stays {}", parameter.name, value_text(value), value_text(r->value)),
               .likely = "the motor runs, or the value contradicts another parameter",
               .remedy = "stop the motor; look at the others with: rotorloop esc get"},
              ExitCode::device);
}

void execute(ToolNode& tool, std::uint8_t node, ParameterOrder order) {
  protocols::ParamExecuteOpcode request;
  request.opcode = order == ParameterOrder::save ? protocols::ParamExecuteOpcode::kSave : protocols::ParamExecuteOpcode::kErase;
  const char* const what = order == ParameterOrder::save ? "saving" : "resetting";
  const auto r = tool.ask<protocols::ParamExecuteOpcodeResponse>(node, request);
  if (!r) no_answer(tool, node, std::string("to ") + what + " its parameters");
  if (r->ok) return;
  throw Error({.where = fmt::format("node {}", node),
               .what = std::string("refuses ") + what + " its parameters",
               .likely = "the motor runs, or its memory failed",
               .remedy = "stop the motor and try again"},
              ExitCode::device);
}

std::string value_text(const ParamValue& v) {
  switch (v.kind) {
    case ParamValue::Kind::integer:
      return std::to_string(v.integer);
    case ParamValue::Kind::real:
      return fmt::format("{}", v.real);  // as many digits as bring the same number back
    case ParamValue::Kind::boolean:
      return v.boolean != 0 ? "true" : "false";
    case ParamValue::Kind::string:
      return "\"" + as_text(v.string) + "\"";
    case ParamValue::Kind::empty:
      break;
  }
  return "-";
}

std::string limit_text(const NumericValue& v) {
  const auto n = number(v);
  return n ? fmt::format("{:.7g}", *n) : "-";
}

nlohmann::ordered_json value_json(const ParamValue& v) {
  switch (v.kind) {
    case ParamValue::Kind::integer:
      return v.integer;
    case ParamValue::Kind::real:
      return v.real;
    case ParamValue::Kind::boolean:
      return v.boolean != 0;
    case ParamValue::Kind::string:
      return as_text(v.string);
    case ParamValue::Kind::empty:
      break;
  }
  return nullptr;
}

bool same_value(const ParamValue& a, const ParamValue& b) {
  if (a.kind != b.kind) return false;
  switch (a.kind) {
    case ParamValue::Kind::integer:
      return a.integer == b.integer;
    case ParamValue::Kind::real:
      return a.real == b.real;
    case ParamValue::Kind::boolean:
      return (a.boolean != 0) == (b.boolean != 0);
    case ParamValue::Kind::string:
      return as_text(a.string) == as_text(b.string);
    case ParamValue::Kind::empty:
      break;
  }
  return true;
}

bool names_the_node(const std::string& name) {
  return name == "node_id" || name == "uavcan.node_id" || name == "preferred_id" || name == "esc_index";
}

bool only_read(const std::string& name) { return name.starts_with("stat_") || name.starts_with("commission"); }

std::string parameter_file(const SeenNode& node, const std::vector<NodeParameter>& parameters) {
  std::string text = "# Parameters of one node, as `rotorloop esc dump` read them; `rotorloop esc restore` sets them again.\nformat = 1\n";
  text += fmt::format("node_id = {}\n", node.id);
  if (node.info) {
    text += fmt::format("name = \"{}\"\n", std::string(node.info->name.begin(), node.info->name.begin() + node.info->name_length));
    text += fmt::format("unique_id = \"{:02x}\"\n", fmt::join(node.info->unique_id, ""));
  }
  text += "\n[parameters]\n";
  for (const NodeParameter& p : parameters) {
    if (p.value.kind != ParamValue::Kind::empty && !only_read(p.name)) text += fmt::format("\"{}\" = {}\n", p.name, value_text(p.value));
  }
  return text;
}

// A file of one value a line needs no TOML library, and so keeps what was written, digit by digit.
std::map<std::string, FileValue> read_parameter_file(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw Error({path, "cannot read the parameter file", "", "make one with: rotorloop esc dump --node N -o FILE"});
  std::map<std::string, FileValue> values;
  bool inside = false;
  std::size_t number_of_line = 0;
  for (std::string line; std::getline(file, line);) {
    const std::string where = fmt::format("{}:{}", path, ++number_of_line);
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ' || line.back() == '\t')) line.pop_back();
    if (line.empty() || line[0] == '#') continue;
    if (line[0] == '[') {
      inside = line == "[parameters]";
      continue;
    }
    if (!inside) continue;
    const std::size_t equals = line.find('=');
    const auto trimmed = [](std::string s) {
      const std::size_t first = s.find_first_not_of(" \t"), last = s.find_last_not_of(" \t");
      s = first == std::string::npos ? "" : s.substr(first, last - first + 1);
      return s.size() >= 2 && s.front() == '"' && s.back() == '"' ? s.substr(1, s.size() - 2) : s;
    };
    const std::string name = equals == std::string::npos ? "" : trimmed(line.substr(0, equals));
    if (name.empty()) throw Error({where, "is no line NAME = VALUE", "", "write for example: \"esc_index\" = 2"});
    if (!values.emplace(name, FileValue{trimmed(line.substr(equals + 1)), where}).second)
      throw Error({where, "\"" + name + "\" stands there twice", "", "remove one of the lines"});
  }
  if (values.empty())
    throw Error({path, "has no [parameters]", "this is no parameter file", "make one with: rotorloop esc dump --node N -o FILE"});
  return values;
}

}  // namespace rotorloop::tools
