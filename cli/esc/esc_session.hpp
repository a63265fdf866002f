// What every `rotorloop esc` command shares: the bus, the tool as a node on it, and the end by Ctrl-C.
#pragma once
#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "cli/bus/live_options.hpp"
#include "cli/ending/stop_signals.hpp"
#include "host/bus/timed_bus.hpp"
#include "host/tools/tool_node.hpp"

namespace rotorloop::cli {

struct EscOptions {
  std::string bus = "mcast:0";
  int tool_id = 0;        // 0: 126, or a free one when another tool has it
  double listen_s = 1.5;  // how long to wait for nodes to say that they are there: each does once a second
  LiveOptions live;
};
void add_esc_options(CLI::App& command, EscOptions& options, bool with_json = true);

// --node 21,22; without it every node that calls itself an ESC.
void add_nodes_option(CLI::App& command, std::vector<int>& nodes);

// What has happened: a sentence for a person, with --json the same as one object a line.
void tell(const EscOptions& options, const nlohmann::ordered_json& object, const std::string& sentence);

class EscSession {
 public:
  // Opens the bus; throws Error for options out of range and for a bus that cannot be opened.
  explicit EscSession(const EscOptions& options);
  tools::ToolNode& tool() { return *tool_; }
  const StopSignals& stop() const { return stop_; }

  // Listens until every node had time to say that it is there and what it is. Throws Error when another node has the tool's id.
  void discover();
  // The nodes given, or when none are: all that report as ESCs. Throws Error (exit 3) when there is none.
  std::vector<std::uint8_t> nodes(const std::vector<int>& given);
  // The recording is whole; tells losses; throws Error (interrupted) after a signal.
  void finish();

 private:
  EscOptions options_;
  StopSignals stop_;
  std::unique_ptr<TimedBus> bus_;
  std::unique_ptr<tools::ToolNode> tool_;
};

}  // namespace rotorloop::cli
