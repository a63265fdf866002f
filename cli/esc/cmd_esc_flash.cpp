// `rotorloop esc flash`: new firmware for one or several nodes at once.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "cli/esc/esc_commands.hpp"
#include "cli/esc/esc_session.hpp"
#include "cli/esc/flash_image.hpp"
#include "cli/esc/flash_text.hpp"
#include "cli/image/image_file.hpp"
#include "host/base/error.hpp"
#include "host/tools/esc_table.hpp"
#include "host/tools/update_plan.hpp"

namespace rotorloop::cli {
namespace {

struct FlashArguments {
  EscOptions esc;
  std::vector<int> nodes;
  std::filesystem::path image;
  std::string board;
  bool all = false, recover = false, verify_only = false, while_others_fly = false;
};

struct FlashImage {
  std::vector<std::uint8_t> bytes;
  tools::ImageFacts facts;
};

FlashImage loaded(const std::filesystem::path& path) {
  FlashImage image{.bytes = read_image_bytes(path), .facts = {}};
  if (is_elf(image.bytes)) image.bytes = image_of_elf(path);
  image.facts = image_facts(image.bytes, path.generic_string());
  return image;
}

void check_choice(const FlashArguments& o) {
  if (o.all && o.board.empty())
    throw Error({"--all", "the board is not given", "", "for example: --all --board b_g431b_esc1; names are in: rotorloop esc list"});
  if (o.nodes.empty() && !o.all && !o.recover)
    throw Error({"--node", "which nodes are to be updated was not given", "",
                 "give --node 21,22, or --all --board NAME, or --recover for nodes that wait in their bootloader"});
}

// Those named, or all of a board, or all that wait in their bootloader. Throws Error when there is none, or one that does not fit.
std::vector<std::uint8_t> chosen_nodes(EscSession& session, const FlashArguments& o) {
  const auto& seen = session.tool().nodes();
  std::vector<std::uint8_t> nodes;
  if (!o.nodes.empty()) {
    nodes = session.nodes(o.nodes);
  } else {
    session.discover();
    for (const auto& [id, node] : seen)
      if ((o.board.empty() || tools::is_board(node, o.board)) && (o.all || tools::waits_in_bootloader(node))) nodes.push_back(id);
  }
  if (nodes.empty() && !session.stop().asked())
    throw Error({o.esc.bus, o.recover ? "no node waits in its bootloader" : fmt::format("no node of this bus calls itself {}", o.board),
                 "it has no power, another bit rate, or no node id yet",
                 "see who is there with: rotorloop esc list; give an id with: rotorloop esc serve"},
                ExitCode::device);
  for (const std::uint8_t id : nodes) {
    if (!o.board.empty() && !tools::is_board(seen.at(id), o.board))
      throw Error({"--board", fmt::format("node {} calls itself {}, not {}", id, tools::node_name(seen.at(id)), o.board), "",
                   "see who is there with: rotorloop esc list"});
    if (o.recover && !tools::waits_in_bootloader(seen.at(id)))
      throw Error({"--recover", fmt::format("node {} does not wait in its bootloader: {}", id, tools::running_text(seen.at(id))), "",
                   "leave --recover out"},
                  ExitCode::device);
  }
  return nodes;
}

// Nobody updates what turns or is armed, nor beside somebody who commands unless that is said.
void refuse_in_use(const tools::CommandWatch& watch, const std::vector<std::uint8_t>& nodes, bool while_others_fly) {
  for (const std::uint8_t id : nodes) {
    if (const std::string use = watch.in_use(id); !use.empty())
      throw Error({"esc flash", fmt::format("nothing was begun: node {} {}", id, use), "",
                   "stop and disarm it; beside a flight of others only a node that waits in its bootloader can be updated"},
                  ExitCode::safety);
  }
  const auto commanders = watch.commanders();
  if (!commanders.empty() && !while_others_fly)
    throw Error({"esc flash", fmt::format("nothing was begun: node {} commands on this bus", fmt::join(commanders, ", ")),
                 "an autopilot, a controller or another tool runs", "end it; where other ESCs are to fly on, give --while-others-fly"},
                ExitCode::safety);
}

// What runs against the file; nothing is asked to update.
int verify(EscSession& session, const FlashArguments& o, const std::vector<std::uint8_t>& nodes, const tools::ImageFacts& facts) {
  nlohmann::ordered_json document = nlohmann::ordered_json::array();
  bool differs = false, unknown = false;
  for (const std::uint8_t id : nodes) {
    const tools::SeenNode& node = session.tool().nodes().at(id);
    const bool waits = tools::waits_in_bootloader(node);
    const bool reports = !waits && node.info && (node.info->software_flags & protocols::GetNodeInfoResponse::kHasImageCrc) != 0;
    const bool same = reports && node.info->image_crc == *facts.crc;
    differs = differs || waits || (reports && !same);
    unknown = unknown || !(waits || reports);
    const char* verdict = same ? "same" : waits || reports ? "differs" : "not known";
    document.push_back({{"node", id}, {"verdict", verdict}, {"now", tools::node_json(node, session.tool().now_ns())}});
    if (!o.esc.live.json) fmt::print("node {}: {}: {}; the file has {:016x}\n", id, verdict, tools::running_text(node), *facts.crc);
  }
  if (o.esc.live.json) fmt::print("{}\n", document.dump(2));
  session.finish();
  if (session.stop().asked()) return session.stop().exit_code();
  return to_int(differs ? ExitCode::differs : unknown ? ExitCode::incomplete : ExitCode::ok);
}

// Until every node has ended; false after a signal.
bool follow(tools::ToolNode& tool, tools::FirmwareUpdates& updates, bool redraw) {
  std::map<std::uint8_t, int> told;  // tenths of each node, on a stream that is no terminal
  const bool ended = tool.run_until(INT64_MAX, [&] {
    updates.step();
    if (redraw) {
      fmt::print(stderr, "\r\033[K{}", progress_text(updates, tool.now_ns()));
      return updates.over();
    }
    for (const auto& [node, s] : updates.nodes()) {
      const bool reading = s.phase == tools::UpdatePhase::reading;
      const int step = reading ? static_cast<int>(10 * s.read_B / updates.size_B()) : 100 + static_cast<int>(s.phase);
      if (std::exchange(told[node], step) != step) fmt::print(stderr, "{}\n", node_progress_text(node, s, updates.size_B(), tool.now_ns()));
    }
    return updates.over();
  });
  if (redraw) fmt::print(stderr, "\n");
  tool.run_until(tool.now_ns() + 3'000'000'000, [&] { return tool.requests_open() == 0; });
  return ended;
}

int flash(const FlashArguments& o) {
  check_choice(o);
  FlashImage image = loaded(o.image);
  if (o.verify_only && !image.facts.crc)
    throw Error({o.image.generic_string(), "the image does not name its CRC: there is nothing to compare", "", "compare the versions"});
  EscSession session(o.esc);
  tools::ToolNode& tool = session.tool();
  const tools::CommandWatch watch(tool);
  const auto nodes = chosen_nodes(session, o);
  if (session.stop().asked()) return session.stop().exit_code();
  if (o.verify_only) return verify(session, o, nodes, image.facts);
  refuse_in_use(watch, nodes, o.while_others_fly);
  fmt::print(stderr, "{}", plan_text(tool, nodes, image.facts, image.bytes.size()));
  tools::FirmwareUpdates updates(tool, std::move(image.bytes), image.facts.crc);
  for (const std::uint8_t node : nodes) updates.start(node);
  const bool ended = follow(tool, updates, !o.esc.live.json && ::isatty(STDERR_FILENO) == 1);
  nlohmann::ordered_json document = nlohmann::ordered_json::array();
  bool failed = false;
  for (const auto& [node, s] : updates.nodes()) {
    failed = failed || s.phase != tools::UpdatePhase::done;
    document.push_back(end_json(node, s, tool));
    if (!o.esc.live.json) fmt::print("node {}: {}\n", node, end_text(s, image.facts.crc.has_value(), updates.size_B()));
  }
  if (o.esc.live.json) fmt::print("{}\n", document.dump(2));
  session.finish();
  if (!ended) return session.stop().exit_code();
  return failed ? to_int(ExitCode::device) : 0;
}

}  // namespace

void add_esc_flash(CLI::App& group, int& exit_code) {
  auto o = std::make_shared<FlashArguments>();
  CLI::App* c = group.add_subcommand("flash", "update the firmware of one or several nodes");
  add_esc_options(*c, o->esc);
  c->add_option("image", o->image, "firmware image, .rlf, an image for nodes of other makes, or the ELF of scripts/firmware")->required();
  auto* node = c->add_option("--node", o->nodes, "node ids, such as 21 or 21,22")->delimiter(',')->allow_extra_args(false);
  c->add_flag("--all", o->all, "every node of --board")->excludes(node);
  c->add_option("--board", o->board, "only nodes whose name says this board, such as b_g431b_esc1");
  c->add_flag("--recover", o->recover, "nodes that wait in their bootloader; without --node all of them");
  c->add_flag("--verify-only", o->verify_only, "update nothing; compare the CRC that each node reports with the image");
  c->add_flag("--while-others-fly", o->while_others_fly, "also while somebody commands other ESCs on this bus");
  c->footer(
      "First the plan is shown, then each node reads the image and restarts. Nothing begins while one of the nodes is armed or turns, or\n"
      "while somebody commands on the bus. After an interrupted update a node runs the old firmware or waits for a new update: run the\n"
      "command again. At the end the command compares the CRC of the running image.\n"
      "Examples:\n  rotorloop esc flash esc.rlf --node 21,22,23,24\n  rotorloop esc flash esc.rlf --all --board b_g431b_esc1\n"
      "Exit code 3: a node did not accept the image; the message gives the reason and what to do. 4: nothing was begun, as a node is in\n"
      "use or somebody commands. With --verify-only 8: a node runs something else; 7: a node does not report its CRC.");
  c->callback([o, &exit_code] { exit_code = flash(*o); });
}

}  // namespace rotorloop::cli
