// `rotorloop esc`: ESCs on a DroneCAN bus, of any make. Here the group, list, info, log and restart.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/commands.hpp"
#include "cli/esc/esc_commands.hpp"
#include "cli/esc/esc_session.hpp"
#include "host/base/error.hpp"
#include "host/tools/esc_table.hpp"

namespace rotorloop::cli {
namespace {

using Json = nlohmann::ordered_json;

struct NodesArguments {
  EscOptions esc;
  std::vector<int> nodes;
};

int list(const NodesArguments& o) {
  EscSession session(o.esc);
  tools::EscTable escs(session.tool());
  session.discover();
  const auto& tool = session.tool();
  const auto index_of = [&](std::uint8_t node) {
    std::string text;
    for (const auto& [key, row] : escs.rows()) {
      if (row.node == node) text += (text.empty() ? "" : ",") + std::to_string(key.first) + (row.shares_index ? "!" : "");
    }
    return text;
  };
  if (o.esc.live.json) {
    Json document = Json::array();
    for (const auto& [id, node] : tool.nodes()) {
      Json j = tools::node_json(node, tool.now_ns());
      if (const std::string index = index_of(id); !index.empty()) j["esc_index"] = index;
      document.push_back(j);
    }
    fmt::print("{}\n", document.dump(2));
  } else if (tool.nodes().empty()) {
    fmt::print("no nodes\n");
  } else {
    fmt::print("{:>4} {:>5}  {:<15} {:<8} {:>9}  {:<7} {:<28} {}\n", "node", "index", "mode", "health", "up", "version", "name", "trouble");
    for (const auto& [id, n] : tool.nodes())
      fmt::print("{:>4} {:>5}  {:<15} {:<8} {:>7} s  {:<7} {:<28} {}\n", id, index_of(id), tools::mode_name(n.status.mode),
                 tools::health_name(n.status.health), n.status.uptime_s,
                 n.info ? fmt::format("{}.{}", n.info->software_major, n.info->software_minor) : "?", tools::node_name(n),
                 tools::trouble_of(n.status));
    for (const auto& [key, row] : escs.rows()) {
      if (row.shares_index)
        fmt::print(stderr, "esc_index {} is reported by node {} and others: give each ESC its own\n", key.first, row.node);
    }
  }
  session.finish();
  return session.stop().exit_code();
}

int info(const NodesArguments& o) {
  EscSession session(o.esc);
  const auto nodes = session.nodes(o.nodes);
  Json document = Json::array();
  for (const std::uint8_t id : nodes) document.push_back(tools::node_json(session.tool().nodes().at(id), session.tool().now_ns()));
  if (o.esc.live.json) {
    fmt::print("{}\n", document.dump(2));
  } else {
    for (const Json& node : document) {
      for (const auto& [key, value] : node.items())
        fmt::print("{:<14} {}\n", key, value.is_string() ? value.get<std::string>() : value.dump());
      fmt::print("\n");
    }
  }
  session.finish();
  return 0;
}

int restart(const NodesArguments& o) {
  EscSession session(o.esc);
  const auto nodes = session.nodes(o.nodes);
  int refused = 0;
  for (const std::uint8_t id : nodes) {
    const auto r = session.tool().ask<protocols::RestartNodeResponse>(id, protocols::RestartNode{.magic = protocols::RestartNode::kMagic});
    const bool ok = r && r->ok;
    refused += ok ? 0 : 1;
    const char* const what = ok ? "restarts" : r ? "refuses to restart: does its motor run?" : "no answer";
    tell(o.esc, {{"node", id}, {"ok", ok}, {"what", what}}, fmt::format("node {}: {}", id, what));
  }
  session.finish();
  return refused > 0 ? to_int(ExitCode::device) : 0;
}

int log(const NodesArguments& o) {
  EscSession session(o.esc);
  constexpr const char* kLevels[] = {"debug", "info", "warning", "error"};
  session.tool().on<protocols::LogMessage>([&](const protocols::LogMessage& m, std::uint8_t source) {
    const std::string from(m.source.items.begin(), m.source.items.begin() + m.source.count),
        text(m.text.items.begin(), m.text.items.begin() + m.text.count);
    const char* level = kLevels[static_cast<std::size_t>(m.level) & 3u];
    if (o.esc.live.json) {
      fmt::print("{}\n", Json{{"time_s", static_cast<double>(session.tool().now_ns()) * 1e-9},
                              {"node", source},
                              {"level", level},
                              {"source", from},
                              {"text", text}}
                             .dump());
    } else {
      fmt::print("node {:>3} {:<7} {}: {}\n", source, level, from, text);
    }
    std::fflush(stdout);
  });
  session.tool().run_until(o.esc.live.for_s > 0.0 ? session.tool().now_ns() + static_cast<std::int64_t>(o.esc.live.for_s * 1e9) : INT64_MAX,
                           [] { return false; });
  session.finish();
  return o.esc.live.for_s > 0.0 ? session.stop().exit_code() : 0;
}

void add_nodes_command(CLI::App& group, int& exit_code, const char* name, const char* what, const char* footer,
                       int (*run)(const NodesArguments&), bool json) {
  auto o = std::make_shared<NodesArguments>();
  CLI::App* c = group.add_subcommand(name, what);
  add_esc_options(*c, o->esc, json);
  if (run == log) add_for(*c, o->esc.live, "time to listen, s; default: until Ctrl-C");
  if (run == info || run == restart) add_nodes_option(*c, o->nodes);
  c->footer(footer);
  c->callback([o, run, &exit_code] { exit_code = run(*o); });
}

}  // namespace

void add_esc(CLI::App& app, int& exit_code) {
  CLI::App* group = app.add_subcommand("esc", "ESCs on a DroneCAN bus: find, configure, spin, monitor, update");
  group->require_subcommand(1);
  add_nodes_command(*group, exit_code, "list", "list the nodes on the bus with their health",
                    "A ! after an index: two ESCs have the same index.\nExample:\n  rotorloop esc list --bus slcan:/dev/ttyACM0", list,
                    true);
  add_nodes_command(*group, exit_code, "info", "print versions, unique id and state of nodes", "Example:\n  rotorloop esc info --node 21",
                    info, true);
  add_esc_parameters(*group, exit_code);
  add_esc_files(*group, exit_code);
  add_esc_commission(*group, exit_code);
  add_esc_spin(*group, exit_code);
  add_esc_monitor(*group, exit_code);
  add_esc_serve(*group, exit_code);
  add_esc_flash(*group, exit_code);
  add_nodes_command(*group, exit_code, "log", "print the log messages of nodes", "Example:\n  rotorloop esc log --for 60", log, true);
  add_nodes_command(*group, exit_code, "restart", "restart nodes",
                    "A node refuses while its motor runs.\nExample:\n  rotorloop esc restart --node 21", restart, true);
  group->footer(
      "Examples:\n  rotorloop esc list\n  rotorloop esc monitor --bus slcan:/dev/ttyACM0\nrotorloop --help lists the exit codes.");
}

}  // namespace rotorloop::cli
