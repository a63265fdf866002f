// `rotorloop esc monitor`: what every ESC on the bus reports, as it changes.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "bench/hil/live/live_assets.hpp"
#include "bench/hil/live/live_server.hpp"
#include "cli/esc/esc_commands.hpp"
#include "cli/esc/esc_session.hpp"
#include "host/base/error.hpp"
#include "host/tools/esc_table.hpp"

namespace rotorloop::cli {
namespace {

struct MonitorArguments {
  EscOptions esc;
  double rate_Hz = 2.0;
  bool web = false;
  int port = 0;
};

std::string row_text(const tools::EscRow& row, const tools::ToolNode& tool) {
  const auto node = tool.nodes().find(row.node);
  const double age_s = static_cast<double>(tool.now_ns() - row.heard_ns) * 1e-9;
  std::string state = "?";
  if (node != tool.nodes().end())
    state = tools::mode_name(node->second.status.mode) + " " + tools::health_name(node->second.status.health) + " " +
            tools::trouble_of(node->second.status);
  if (age_s > 3.0) state = fmt::format("silent for {:.0f} s", age_s);
  return fmt::format("{:>5}{} {:>4}  {:>8} {:>7.2f} {:>7.2f} {:>6.1f} {:>5} {:>7}  {}", row.status.esc_index, row.shares_index ? '!' : ' ',
                     row.node, row.status.rpm, row.status.voltage_V, row.status.current_A, row.status.temperature_K - 273.15f,
                     row.status.power_rating_pct, row.status.error_count, state);
}

nlohmann::ordered_json table_json(const tools::EscTable& table, const tools::ToolNode& tool) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const auto& [key, row] : table.rows()) rows.push_back(tools::esc_row_json(row, tool));
  return {{"time_s", static_cast<double>(tool.now_ns()) * 1e-9}, {"escs", rows}};
}

// The page only asks: the command disarms, in its own loop, several times as frames can be lost.
int monitor_page(const MonitorArguments& o) {
  if (o.port < 0 || o.port > 65535)
    throw Error({"--port", fmt::format("{} is out of range: 0 to 65535", o.port), "", "0 takes one that is free"});
  EscSession session(o.esc);
  tools::ToolNode& tool = session.tool();
  tools::EscTable table(tool);
  std::atomic<int> disarm{0};
  live::LiveServer server({.port = o.port, .page = std::string(live::kEscsPage), .script = std::string(live::kEscsScript), .title = "ESCs"},
                          [&](std::string_view what) -> std::string {
                            if (what != "stop") return "unknown order";
                            disarm = 10;
                            return "ArmingStatus 0 is sent to all";
                          });
  fmt::print("{}\n", server.address());
  std::fflush(stdout);
  const std::int64_t end_ns = o.esc.live.for_s > 0.0 ? tool.now_ns() + static_cast<std::int64_t>(o.esc.live.for_s * 1e9) : INT64_MAX;
  while (!session.stop().asked() && tool.now_ns() < end_ns) {
    tool.run_for(50'000'000);
    if (disarm > 0) {
      --disarm;
      tool.broadcast(protocols::ArmingStatus{.status = protocols::ArmingStatus::kDisarmed}, 8);
    }
    server.publish(table_json(table, tool).dump());
  }
  session.finish();
  return o.esc.live.for_s > 0.0 ? session.stop().exit_code() : 0;
}

int monitor(const MonitorArguments& o) {
  if (o.web) return monitor_page(o);
  if (!(o.rate_Hz >= 0.1 && o.rate_Hz <= 20.0))
    throw Error({"--rate", fmt::format("{} Hz is out of range: 0.1 to 20", o.rate_Hz), "", "2 is easy to read"});
  EscSession session(o.esc);
  tools::ToolNode& tool = session.tool();
  tools::EscTable table(tool);
  const bool redraw = !o.esc.live.json && ::isatty(STDOUT_FILENO) == 1;
  const std::int64_t end_ns = o.esc.live.for_s > 0.0 ? tool.now_ns() + static_cast<std::int64_t>(o.esc.live.for_s * 1e9) : INT64_MAX;
  std::size_t drawn = 0;
  while (!session.stop().asked() && tool.now_ns() < end_ns) {
    tool.run_until(std::min(end_ns, tool.now_ns() + static_cast<std::int64_t>(1e9 / o.rate_Hz)), [] { return false; });
    if (o.esc.live.json) {
      fmt::print("{}\n", table_json(table, tool).dump());
    } else {
      if (redraw && drawn > 0) fmt::print("\033[{}A\033[J", drawn);
      if (redraw || drawn == 0)
        fmt::print("{:>5}  {:>4}  {:>8} {:>7} {:>7} {:>6} {:>5} {:>7}  {}\n", "index", "node", "rpm", "V", "A", "°C", "%", "errors",
                   "state");
      for (const auto& [key, row] : table.rows()) fmt::print("{}\n", row_text(row, tool));
      drawn = 1 + table.rows().size();
    }
    std::fflush(stdout);
  }
  session.finish();
  return o.esc.live.for_s > 0.0 ? session.stop().exit_code() : 0;
}

}  // namespace

void add_esc_monitor(CLI::App& group, int& exit_code) {
  auto o = std::make_shared<MonitorArguments>();
  CLI::App* c = group.add_subcommand("monitor", "show the reports of all ESCs live");
  add_esc_options(*c, o->esc);
  add_for(*c, o->esc.live, "time to run, s; default: until Ctrl-C");
  c->add_option("--rate", o->rate_Hz, "update rate of the table, Hz")->capture_default_str();
  c->add_flag("--web", o->web, "serve a page with plots for a browser of this machine; prints its address")->excludes("--json");
  c->add_option("--port", o->port, "TCP port of the page; 0: a free port")->capture_default_str();
  c->footer(
      "A ! after an index: two nodes report the same index. With --json each line is one JSON object.\nThe page is reachable from this "
      "machine only (127.0.0.1). Its address contains the token for its button, which disarms all ESCs.\nExamples:\n  rotorloop esc "
      "monitor\n  rotorloop esc monitor --web");
  c->callback([o, &exit_code] { exit_code = monitor(*o); });
}

}  // namespace rotorloop::cli
