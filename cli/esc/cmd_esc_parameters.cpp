// `rotorloop esc get, set, save, reset`: parameters of ESCs by name, with limits said before a node refuses in silence.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "cli/esc/esc_commands.hpp"
#include "cli/esc/esc_session.hpp"
#include "cli/shipped_files.hpp"
#include "host/base/error.hpp"
#include "host/tools/esc_table.hpp"
#include "host/tools/parameters.hpp"
#include "sim/plant/motor_file.hpp"

namespace rotorloop::cli {
namespace {

using Json = nlohmann::ordered_json;

struct ParameterArguments {
  EscOptions esc;
  std::vector<int> nodes;
  std::vector<std::string> words;  // names, or NAME=VALUE
  std::filesystem::path from;
  bool save = false;
};

Json parameter_json(const tools::NodeParameter& p) {
  return {{"name", p.name},
          {"value", tools::value_json(p.value)},
          {"default", tools::value_json(p.default_value)},
          {"min", tools::limit_text(p.min)},
          {"max", tools::limit_text(p.max)}};
}

int get(const ParameterArguments& o) {
  EscSession session(o.esc);
  Json document = Json::array();
  for (const std::uint8_t node : session.nodes(o.nodes)) {
    std::vector<tools::NodeParameter> parameters;
    if (o.words.empty()) {
      parameters = tools::read_parameters(session.tool(), node);
    } else {
      for (const std::string& name : o.words) parameters.push_back(tools::read_parameter(session.tool(), node, name));
    }
    Json row{{"node", node}, {"parameters", Json::array()}};
    for (const auto& p : parameters) row["parameters"].push_back(parameter_json(p));
    document.push_back(row);
    if (o.esc.live.json) continue;
    fmt::print("node {}: {} parameters\n  {:<24} {:>14} {:>14} {:>12} {:>12}\n", node, parameters.size(), "name", "value", "default", "min",
               "max");
    for (const auto& p : parameters)
      fmt::print("{} {:<24} {:>14} {:>14} {:>12} {:>12}\n",
                 p.default_value.kind != protocols::ParamValue::Kind::empty && !tools::same_value(p.value, p.default_value) ? '*' : ' ',
                 p.name, tools::value_text(p.value), tools::value_text(p.default_value), tools::limit_text(p.min),
                 tools::limit_text(p.max));
  }
  if (o.esc.live.json) fmt::print("{}\n", document.dump(2));
  session.finish();
  return 0;
}

// What a motor file says, by the names that an ESC of rotorloop has for it.
std::vector<std::pair<std::string, std::string>> of_motor(const std::filesystem::path& path) {
  const sim::MotorFile motor = sim::read_motor(path);
  return {{"pole_pairs", std::to_string(motor.pole_pairs)},
          {"resistance", fmt::format("{}", static_cast<float>(motor.resistance_ohm))},
          {"inductance", fmt::format("{}", static_cast<float>(0.5 * (motor.inductance_d_H + motor.inductance_q_H)))},
          {"flux_linkage", fmt::format("{}", static_cast<float>(motor.flux_linkage_Wb))}};
}

std::vector<std::pair<std::string, std::string>> assignments(const ParameterArguments& o) {
  std::vector<std::pair<std::string, std::string>> wanted;
  if (!o.from.empty()) wanted = of_motor(shipped_or_given(o.from));
  for (const std::string& word : o.words) {
    const std::size_t equals = word.find('=');
    if (equals == 0 || equals == std::string::npos)
      throw Error({"parameter", "\"" + word + "\" is not NAME=VALUE", "", "for example: rotorloop esc set --node 21 esc_index=0"});
    wanted.emplace_back(word.substr(0, equals), word.substr(equals + 1));
  }
  if (wanted.empty()) throw Error({"parameter", "nothing to set", "", "give NAME=VALUE, or --from MOTOR.toml"});
  return wanted;
}

int set(const ParameterArguments& o) {
  const auto wanted = assignments(o);
  EscSession session(o.esc);
  const auto nodes = session.nodes(o.nodes);
  if (o.nodes.empty() && nodes.size() > 1)
    throw Error({"--node", fmt::format("{} ESCs are on the bus, and none was named", nodes.size()), "",
                 "say which: --node 21, or --node 21,22 for several"});
  Json document = Json::array();
  for (const std::uint8_t node : nodes) {
    // All are checked before the first is set: half of a set is worse than none.
    std::vector<std::pair<tools::NodeParameter, protocols::ParamValue>> checked;
    for (const auto& [name, text] : wanted) {
      const tools::NodeParameter p = tools::read_parameter(session.tool(), node, name);
      checked.emplace_back(p, tools::parse_value(p, text, name));
    }
    for (const auto& [p, value] : checked) {
      const auto now = tools::set_parameter(session.tool(), node, p, value);
      document.push_back(
          {{"node", node}, {"name", p.name}, {"before", tools::value_json(p.value)}, {"value", tools::value_json(now.value)}});
      if (!o.esc.live.json)
        fmt::print("node {}: {} = {} (was {})\n", node, p.name, tools::value_text(now.value), tools::value_text(p.value));
    }
    if (o.save) tools::execute(session.tool(), node, tools::ParameterOrder::save);
  }
  if (o.esc.live.json) {
    fmt::print("{}\n", document.dump(2));
  } else {
    fmt::print("{}\n", o.save ? "saved" : "not saved: lost at the next restart; rotorloop esc save keeps it");
  }
  for (const std::uint8_t node : nodes) {
    if (const std::string names = tools::waits_for_restart(session.tool(), node); !names.empty())
      fmt::print(stderr, "node {}: in force only after {}restart: {}; rotorloop esc restart --node {}\n", node,
                 o.save ? "a " : "saving and a ", names, node);
  }
  session.finish();
  return 0;
}

int order(const ParameterArguments& o, tools::ParameterOrder what) {
  EscSession session(o.esc);
  for (const std::uint8_t node : session.nodes(o.nodes)) {
    tools::execute(session.tool(), node, what);
    const char* const done = what == tools::ParameterOrder::save ? "saved" : "parameters are the defaults again";
    tell(o.esc, {{"node", node}, {"what", done}}, fmt::format("node {}: {}", node, done));
  }
  session.finish();
  return 0;
}

CLI::App* add(CLI::App& group, ParameterArguments& o, const char* name, const char* what) {
  CLI::App* c = group.add_subcommand(name, what);
  add_esc_options(*c, o.esc);
  add_nodes_option(*c, o.nodes);
  return c;
}

}  // namespace

void add_esc_parameters(CLI::App& group, int& exit_code) {
  auto g = std::make_shared<ParameterArguments>();
  CLI::App* c = add(group, *g, "get", "print parameters with defaults and limits");
  c->add_option("names", g->words, "names of parameters; default: all");
  c->footer(
      "A * marks a value that differs from the default.\nExamples:\n  rotorloop esc get --node 21\n  rotorloop esc get esc_index          "
      "# of every "
      "ESC");
  c->callback([g, &exit_code] { exit_code = get(*g); });

  auto s = std::make_shared<ParameterArguments>();
  c = add(group, *s, "set", "set parameters");
  c->add_option("parameters", s->words, "NAME=VALUE, one or several");
  c->add_option("--from", s->from, "motor file that gives pole pairs, resistance, inductance and flux linkage");
  c->add_flag("--save", s->save, "store the parameters, so that they survive a restart");
  c->footer(
      "All values are checked against the limits of the node before the first one is set, and read back afterwards. Motor constants and "
      "node\n"
      "id take effect after a restart.\n"
      "Examples:\n  rotorloop esc set --node 21 esc_index=0 --save\n  rotorloop esc set --node 21,22 --from "
      "vehicles/motors/2306_2300kv.toml");
  c->callback([s, &exit_code] { exit_code = set(*s); });

  auto v = std::make_shared<ParameterArguments>();
  c = add(group, *v, "save", "store the parameters in the node, so that they survive a restart");
  c->footer("Example:\n  rotorloop esc save --node 21");
  c->callback([v, &exit_code] { exit_code = order(*v, tools::ParameterOrder::save); });

  auto r = std::make_shared<ParameterArguments>();
  c = add(group, *r, "reset", "set all parameters to their defaults, also in the flash of the node");
  c->get_option("--node")->required();
  c->footer(
      "This includes node id and esc_index: after its next restart the ESC asks an allocator for a node id, and ignores commands until it\n"
      "has an index.\n"
      "Example:\n  rotorloop esc reset --node 21");
  c->callback([r, &exit_code] { exit_code = order(*r, tools::ParameterOrder::erase); });
}

}  // namespace rotorloop::cli
