// `rotorloop esc serve` and `rotorloop esc enumerate`: node ids, the time, and which ESC drives which motor.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cli/esc/esc_commands.hpp"
#include "cli/esc/esc_session.hpp"
#include "host/base/error.hpp"
#include "host/base/text_file.hpp"
#include "host/tools/allocator.hpp"
#include "host/tools/parameters.hpp"

namespace rotorloop::cli {
namespace {

struct ServeArguments {
  EscOptions esc;
  std::filesystem::path table = "node_ids.txt";
  bool time = false;
};

int serve(const ServeArguments& o) {
  std::map<tools::UniqueId, std::uint8_t> table;
  if (std::filesystem::exists(o.table)) {
    std::ifstream file(o.table);
    if (!file) throw Error({o.table.generic_string(), "cannot read the table of node ids", "", "check that it may be read"});
    table =
        tools::parse_allocation_table({std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()}, o.table.generic_string());
  }
  // Now, not when the first node asks: a table that cannot be kept would end the server after an id was given.
  if (const auto folder = o.table.parent_path(); !folder.empty() && !std::filesystem::is_directory(folder))
    throw Error({"--table", fmt::format("{} cannot be kept: there is no folder {}", o.table.generic_string(), folder.generic_string()), "",
                 "make it first: mkdir -p " + folder.generic_string()},
                ExitCode::device);
  write_text_file(o.table, tools::allocation_table_text(table));
  EscSession session(o.esc);
  tools::ToolNode& tool = session.tool();
  std::optional<tools::Allocator> allocator;
  allocator.emplace(tool, table, [&](const tools::Allocated& a) {
    // On disk before the next node is served: an id that was given is never given to another.
    if (a.is_new) write_text_file(o.table, tools::allocation_table_text(allocator->table()));
    nlohmann::ordered_json told = {{"unique_id", tools::unique_id_text(a.unique_id)}, {"node", a.node_id}, {"new", a.is_new}};
    std::string text = fmt::format("{} {}: node {}", a.is_new ? "new" : "known", tools::unique_id_text(a.unique_id), a.node_id);
    if (a.stored_id) {
      const std::string holder = a.held_by == tools::UniqueId{} ? "a node that tells no unique id" : tools::unique_id_text(a.held_by);
      told["stored_node"] = *a.stored_id;
      told["held_by"] = holder;
      text += fmt::format("; its {} of the table is held by {}", *a.stored_id, holder);
    }
    tell(o.esc, told, text);
  });
  std::optional<tools::TimeMaster> time;
  if (o.time) time.emplace(tool);
  fmt::print(stderr, "serving: {} node ids known, table {}{}\n", table.size(), o.table.generic_string(),
             o.time ? ", time once a second" : "");
  const std::int64_t end_ns = o.esc.live.for_s > 0.0 ? tool.now_ns() + static_cast<std::int64_t>(o.esc.live.for_s * 1e9) : INT64_MAX;
  tool.run_until(end_ns, [&] {
    if (time) time->step();
    return false;
  });
  if (allocator->refused() > 0) fmt::print(stderr, "{} requests refused: no node id is free\n", allocator->refused());
  session.finish();
  return o.esc.live.for_s > 0.0 ? session.stop().exit_code() : 0;
}

struct EnumerateArguments {
  EscOptions esc;
  std::vector<int> nodes;
  int first = 0;
  int wait_s = 60;
};

// The user shows one motor after the other, by the button of its ESC or by hand; the ESC says so, and gets the next index.
int enumerate(const EnumerateArguments& o) {
  if (o.first < 0 || o.first > 15)
    throw Error({"--first", fmt::format("{} is out of range: 0 to 15", o.first), "", "the first motor is 0"});
  if (o.wait_s < 1 || o.wait_s > 600)
    throw Error({"--wait", fmt::format("{} s is out of range: 1 to 600", o.wait_s), "", "60 is enough to walk round a frame"});
  EscSession session(o.esc);
  tools::ToolNode& tool = session.tool();
  std::set<std::uint8_t> turned;
  tool.on<protocols::EnumerationIndication>([&](const protocols::EnumerationIndication&, std::uint8_t source) { turned.insert(source); });
  const auto nodes = session.nodes(o.nodes);
  std::set<std::uint8_t> left(nodes.begin(), nodes.end());
  const auto begin = [&](std::uint8_t node, std::uint16_t seconds) {
    protocols::EnumerationBegin request;
    request.timeout_s = seconds;
    request.parameter = protocols::Text<protocols::kMaxParameterName>("esc_index");
    return tool.ask<protocols::EnumerationBeginResponse>(node, request);
  };
  int index = o.first;
  while (!left.empty()) {
    for (const std::uint8_t node : left) {
      const auto r = begin(node, static_cast<std::uint16_t>(o.wait_s + 5));
      if (!r || r->error != protocols::EnumerationBeginResponse::Error::ok)
        throw Error({fmt::format("node {}", node), r ? "refuses enumeration" : "does not answer to enumeration",
                     "it is armed, its motor runs, or it has no enumeration",
                     fmt::format("set its index by: rotorloop esc set --node {} esc_index={} --save", node, index)},
                    ExitCode::device);
    }
    turned.clear();
    tell(o.esc, {{"motor", index}, {"what", "waiting"}, {"left", left.size()}},
         fmt::format("motor {}: press the button of its ESC, or turn the motor by hand, twice round ({} left)", index, left.size()));
    std::optional<std::uint8_t> found;
    const bool heard = tool.run_until(tool.now_ns() + o.wait_s * std::int64_t{1'000'000'000}, [&] {
      for (const std::uint8_t node : turned) {
        if (left.contains(node)) found = node;
      }
      return found.has_value();
    });
    if (!heard) {
      for (const std::uint8_t node : left) begin(node, protocols::EnumerationBegin::kCancel);
      if (session.stop().asked()) return session.stop().exit_code();
      throw Error({"esc enumerate", fmt::format("motor {} was not shown within {} s", index, o.wait_s),
                   "a hand has to turn the motor once round without a stop; some ESCs feel only their button",
                   fmt::format("begin again with --first {}", index)},
                  ExitCode::device);
    }
    begin(*found, protocols::EnumerationBegin::kCancel);
    const auto p = tools::read_parameter(tool, *found, "esc_index");
    tools::set_parameter(tool, *found, p, tools::parse_value(p, std::to_string(index), "esc_index"));
    tools::execute(tool, *found, tools::ParameterOrder::save);
    tell(o.esc, {{"motor", index}, {"what", "saved"}, {"node", *found}}, fmt::format("motor {}: node {}, saved", index, *found));
    left.erase(*found);
    ++index;
  }
  session.finish();
  return 0;
}

}  // namespace

void add_esc_serve(CLI::App& group, int& exit_code) {
  {
    auto o = std::make_shared<ServeArguments>();
    CLI::App* c = group.add_subcommand("serve", "allocate node ids on a bus, and with --time send the time");
    add_esc_options(*c, o->esc);
    c->add_option("--table", o->table, "file that stores the node id of each unique id")->capture_default_str();
    c->add_flag("--time", o->time, "also act as time master of the bus");
    add_for(*c, o->esc.live, "time to run, s; default: until Ctrl-C");
    c->footer(
        "Use it on a bus without an autopilot: an autopilot does the same.\nExample:\n  rotorloop esc serve --table node_ids.txt --time");
    c->callback([o, &exit_code] { exit_code = serve(*o); });
  }
  auto o = std::make_shared<EnumerateArguments>();
  CLI::App* c =
      group.add_subcommand("enumerate", "assign indices to ESCs: press their buttons one after the other, or turn the motors by hand");
  add_esc_options(*c, o->esc);
  add_nodes_option(*c, o->nodes);
  c->add_option("--first", o->first, "index of the first motor")->capture_default_str();
  c->add_option("--wait", o->wait_s, "time to wait for each motor, s")->capture_default_str();
  c->footer("Example:\n  rotorloop esc enumerate");
  c->callback([o, &exit_code] { exit_code = enumerate(*o); });
}

}  // namespace rotorloop::cli
