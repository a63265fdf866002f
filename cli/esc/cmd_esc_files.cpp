// `rotorloop esc dump, restore, clone, diff`: parameters of a node in a file, set again, copied to others, compared.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/ending/outputs.hpp"
#include "cli/esc/esc_commands.hpp"
#include "cli/esc/esc_session.hpp"
#include "host/base/error.hpp"
#include "host/base/text_file.hpp"
#include "host/tools/parameters.hpp"

namespace rotorloop::cli {
namespace {

using tools::NodeParameter;

struct FileArguments {
  EscOptions esc;
  int node = 0, from = 0;
  std::vector<int> to;
  std::filesystem::path file;
  std::string other;  // of diff: a file, or a node id
  bool identity = false, save = false;
};

int dump(const FileArguments& o) {
  check_outputs({{"-o", o.file}}, o.esc.live.force);
  EscSession session(o.esc);
  const std::uint8_t node = session.nodes({o.node})[0];
  const std::string text = tools::parameter_file(session.tool().nodes().at(node), tools::read_parameters(session.tool(), node));
  if (o.file.empty()) {
    fmt::print("{}", text);
  } else {
    write_text_file(o.file, text);
    fmt::print(stderr, "{}: the parameters of node {}\n", o.file.generic_string(), node);
  }
  session.finish();
  return 0;
}

const NodeParameter* find(const std::vector<NodeParameter>& all, const std::string& name) {
  const auto p = std::find_if(all.begin(), all.end(), [&](const NodeParameter& x) { return x.name == name; });
  return p == all.end() ? nullptr : &*p;
}

// Sets what differs; all values are checked before the first is set.
void bring_to(EscSession& session, std::uint8_t node, const std::map<std::string, tools::FileValue>& wanted, const FileArguments& o) {
  const auto present = tools::read_parameters(session.tool(), node);
  std::vector<std::pair<const NodeParameter*, protocols::ParamValue>> changes;
  std::size_t left_out = 0;
  for (const auto& [name, value] : wanted) {
    if (tools::only_read(name)) continue;
    if (!o.identity && tools::names_the_node(name)) {
      ++left_out;
      continue;
    }
    const NodeParameter* p = find(present, name);
    if (p == nullptr)
      throw Error({value.where, fmt::format("node {} has no parameter \"{}\"", node, name), "the file is of another firmware",
                   "remove the line, or restore a file of this firmware"});
    const protocols::ParamValue v = tools::parse_value(*p, value.text, value.where);
    if (!tools::same_value(v, p->value)) changes.emplace_back(p, v);
  }
  for (const auto& [p, v] : changes) {
    tools::set_parameter(session.tool(), node, *p, v);
    tell(o.esc, {{"node", node}, {"name", p->name}, {"before", tools::value_json(p->value)}, {"value", tools::value_json(v)}},
         fmt::format("node {}: {} = {} (was {})", node, p->name, tools::value_text(v), tools::value_text(p->value)));
  }
  if (o.save) tools::execute(session.tool(), node, tools::ParameterOrder::save);
  const std::size_t as_before = wanted.size() - changes.size() - left_out;
  tell(o.esc, {{"node", node}, {"changed", changes.size()}, {"as_before", as_before}, {"left_out", left_out}, {"saved", o.save}},
       fmt::format("node {}: {} changed, {} as wanted before{}{}", node, changes.size(), as_before,
                   left_out > 0 ? fmt::format(", {} left that name the node (--identity sets them too)", left_out) : "",
                   o.save ? "; saved" : "; not saved"));
}

int restore(const FileArguments& o) {
  const auto wanted = tools::read_parameter_file(o.file.generic_string());
  EscSession session(o.esc);
  bring_to(session, session.nodes({o.node})[0], wanted, o);
  session.finish();
  return 0;
}

std::string bare(const protocols::ParamValue& v) {
  const std::string text = tools::value_text(v);
  return v.kind == protocols::ParamValue::Kind::string ? text.substr(1, text.size() - 2) : text;
}

std::map<std::string, tools::FileValue> values_of(const std::vector<NodeParameter>& parameters, std::uint8_t node) {
  std::map<std::string, tools::FileValue> values;
  for (const NodeParameter& p : parameters) {
    if (!tools::only_read(p.name)) values[p.name] = {bare(p.value), fmt::format("node {}", node)};
  }
  return values;
}

int clone(const FileArguments& o) {
  if (std::find(o.to.begin(), o.to.end(), o.from) != o.to.end())
    throw Error({"--to", fmt::format("node {} would be copied to itself", o.from), "", "name other nodes"});
  EscSession session(o.esc);
  std::vector<int> all{o.from};
  all.insert(all.end(), o.to.begin(), o.to.end());
  const auto nodes = session.nodes(all);
  const auto wanted = values_of(tools::read_parameters(session.tool(), nodes[0]), nodes[0]);
  for (std::size_t i = 1; i < nodes.size(); ++i) bring_to(session, nodes[i], wanted, o);
  session.finish();
  return 0;
}

int diff(const FileArguments& o) {
  const bool other_is_node =
      !o.other.empty() && std::all_of(o.other.begin(), o.other.end(), [](char c) { return c >= '0' && c <= '9'; }) && o.other.size() <= 3;
  std::map<std::string, tools::FileValue> other;
  if (!other_is_node) other = tools::read_parameter_file(o.other);
  EscSession session(o.esc);
  std::vector<int> ids{o.node};
  if (other_is_node) ids.push_back(std::stoi(o.other));
  const auto nodes = session.nodes(ids);
  const auto mine = tools::read_parameters(session.tool(), nodes[0]);
  if (other_is_node) other = values_of(tools::read_parameters(session.tool(), nodes[1]), nodes[1]);
  nlohmann::ordered_json document = nlohmann::ordered_json::array();
  const auto differs = [&](const std::string& name, const std::string& here, const std::string& there) {
    document.push_back({{"name", name}, {"node", here}, {"other", there}});
    if (!o.esc.live.json) fmt::print("{:<24} {:>16} {:>16}\n", name, here, there);
  };
  if (!o.esc.live.json)
    fmt::print("{:<24} {:>16} {:>16}\n", "parameter", fmt::format("node {}", o.node), other_is_node ? "node " + o.other : "file");
  for (const NodeParameter& p : mine) {
    if (tools::only_read(p.name)) continue;
    const auto there = other.find(p.name);
    if (there == other.end()) {
      differs(p.name, bare(p.value), "-");
    } else if (!tools::same_value(tools::parse_value({.name = p.name, .value = p.value, .default_value = {}, .min = {}, .max = {}},
                                                     there->second.text, there->second.where),
                                  p.value)) {
      differs(p.name, bare(p.value), there->second.text);
    }
  }
  for (const auto& [name, value] : other) {
    if (find(mine, name) == nullptr) differs(name, "-", value.text);
  }
  if (o.esc.live.json) {
    fmt::print("{}\n", document.dump(2));
  } else if (document.empty()) {
    fmt::print("no difference\n");
  }
  session.finish();
  return document.empty() ? 0 : to_int(ExitCode::differs);
}

}  // namespace

void add_esc_files(CLI::App& group, int& exit_code) {
  const auto add = [&](const char* name, const char* what, bool json) {
    auto o = std::make_shared<FileArguments>();
    CLI::App* c = group.add_subcommand(name, what);
    add_esc_options(*c, o->esc, json);
    return std::pair(c, o);
  };
  const auto [d, dump_options] = add("dump", "write the parameters of a node to a file", false);
  d->add_option("--node", dump_options->node, "node id")->required();
  d->add_option("-o,--out", dump_options->file, "file to write; default: standard output");
  d->footer("Example:\n  rotorloop esc dump --node 21 -o front_left.toml");
  d->callback([o = dump_options, &exit_code] { exit_code = dump(*o); });

  const auto [r, restore_options] = add("restore", "set the parameters of a node from a file", true);
  r->add_option("file", restore_options->file, "parameter file, written by `rotorloop esc dump`")->required();
  r->add_option("--node", restore_options->node, "node id")->required();
  r->add_flag("--identity", restore_options->identity, "also set node id and esc_index");
  r->add_flag("--save", restore_options->save, "store the parameters, so that they survive a restart");
  r->footer("All values are checked before the first one is set.\nExample:\n  rotorloop esc restore front_left.toml --node 21 --save");
  r->callback([o = restore_options, &exit_code] { exit_code = restore(*o); });

  const auto [k, clone_options] = add("clone", "copy the parameters of one node to others", true);
  k->add_option("--from", clone_options->from, "node id to copy from")->required();
  k->add_option("--to", clone_options->to, "node ids to copy to, such as 22,23")->delimiter(',')->allow_extra_args(false)->required();
  k->add_flag("--save", clone_options->save, "store the parameters, so that they survive a restart");
  k->footer("Node id and esc_index are not copied.\nExample:\n  rotorloop esc clone --from 21 --to 22,23,24 --save");
  k->callback([o = clone_options, &exit_code] { exit_code = clone(*o); });

  const auto [f, diff_options] = add("diff", "compare the parameters of a node with a file or another node", true);
  f->add_option("other", diff_options->other, "parameter file or node id to compare with")->required();
  f->add_option("--node", diff_options->node, "node id")->required();
  f->footer("Exit code 8: they differ.\nExamples:\n  rotorloop esc diff front_left.toml --node 21\n  rotorloop esc diff 22 --node 21");
  f->callback([o = diff_options, &exit_code] { exit_code = diff(*o); });
}

}  // namespace rotorloop::cli
