#include "cli/esc/esc_session.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "host/base/error.hpp"

namespace rotorloop::cli {
namespace {

constexpr std::int64_t kOneSecond_ns = 1'000'000'000;

bool speaks_as_an_esc(const tools::SeenNode& node) {
  if (!node.info) return false;
  const std::string name(node.info->name.begin(), node.info->name.begin() + node.info->name_length);
  return name.find("esc") != std::string::npos;
}

std::string no_esc_text(std::size_t other_nodes) {
  if (other_nodes == 0) return "nobody is on this bus";
  return fmt::format("no ESC is on this bus, only {} of {}", other_nodes == 1 ? "one node" : fmt::format("{} nodes", other_nodes),
                     other_nodes == 1 ? "another kind" : "other kinds");
}

}  // namespace

void add_esc_options(CLI::App& c, EscOptions& o, bool with_json) {
  c.add_option("--bus", o.bus, kBusHelp)->capture_default_str();
  c.add_option("--tool-id", o.tool_id, "node id of this program; default: the first free one of 126, 127, 119, 118, 117");
  c.add_option("--listen", o.listen_s, "time to wait for the announcements of nodes, s")->capture_default_str();
  c.add_option("--record", o.live.record, "record all frames to this file: .pcap for Wireshark, otherwise text of candump -L");
  c.add_flag("--force", o.live.force, "replace files that exist");
  if (with_json) c.add_flag("--json", o.live.json, "JSON instead of text");
}

void tell(const EscOptions& options, const nlohmann::ordered_json& object, const std::string& sentence) {
  fmt::print("{}\n", options.live.json ? object.dump() : sentence);
  std::fflush(stdout);
}

void add_nodes_option(CLI::App& c, std::vector<int>& nodes) {
  c.add_option("--node", nodes, "node ids, such as 21 or 21,22; default: all nodes that report as ESC")
      ->delimiter(',')
      ->allow_extra_args(false);
}

EscSession::EscSession(const EscOptions& options) : options_(options) {
  if (options.tool_id < 0 || options.tool_id > 127)
    throw Error({"--tool-id", fmt::format("{} is out of range: 1 to 127", options.tool_id), "", "126 and 127 are kept for tools"});
  if (!(options.listen_s >= 0.1 && options.listen_s <= 60.0))
    throw Error({"--listen", fmt::format("{} s is out of range: 0.1 to 60", options.listen_s), "",
                 "nodes say once a second that they are there: 1.5 is enough"});
  check_live_options(options.live);
  bus_ = open_recorded(options.live, options.bus, "--bus");
  tools::ToolNodeConfig config;
  if (options.tool_id != 0) {
    config.node_id = static_cast<std::uint8_t>(options.tool_id);
  } else {
    config.spare_ids = {127, 119, 118, 117};  // several tools at once: a monitor, an allocator, and what is typed beside them
  }
  config.stop = [this] {
    tell_notices(*bus_);
    return stop_.asked();
  };
  tool_ = std::make_unique<tools::ToolNode>(*bus_, config);
}

void EscSession::discover() {
  tool_->run_for(static_cast<std::int64_t>(options_.listen_s * 1e9));
  tool_->run_until(tool_->now_ns() + 3 * kOneSecond_ns, [this] { return tool_->requests_open() == 0; });
  if (tool_->id_conflict())
    throw Error({"--tool-id", fmt::format("another node on {} has id {}", bus_->name(), tool_->node_id()), "another tool runs",
                 "give --tool-id another number, or end the other tool"},
                ExitCode::device);
}

std::vector<std::uint8_t> EscSession::nodes(const std::vector<int>& given) {
  std::vector<std::uint8_t> chosen;
  for (const int id : given) {
    if (id < 1 || id > 127)
      throw Error({"--node", fmt::format("{} is out of range: 1 to 127", id), "", "see who is there with: rotorloop esc list"});
    chosen.push_back(static_cast<std::uint8_t>(id));
  }
  discover();
  if (chosen.empty()) {
    for (const auto& [id, node] : tool_->nodes()) {
      if (speaks_as_an_esc(node)) chosen.push_back(id);
    }
  }
  if (stop_.asked()) throw Error({"", "interrupted", "", ""}, ExitCode::interrupted);
  if (chosen.empty())
    throw Error({options_.bus, no_esc_text(tool_->nodes().size()), "it has no power, another bit rate, or no node id yet",
                 "see what is on the bus with: rotorloop bus dump " + options_.bus},
                ExitCode::device);
  for (const std::uint8_t id : chosen) {
    if (!tool_->nodes().contains(id))
      throw Error({"--node", fmt::format("node {} is not on {}", id, options_.bus), "",
                   "see who is there with: rotorloop esc list --bus " + options_.bus},
                  ExitCode::device);
  }
  return chosen;
}

void EscSession::finish() {
  finish_recording(*bus_);
  tell_losses(*bus_);
  if (tool_->not_sent() > 0) fmt::print(stderr, "{}: {} frames were not taken by the bus\n", bus_->name(), tool_->not_sent());
}

}  // namespace rotorloop::cli
