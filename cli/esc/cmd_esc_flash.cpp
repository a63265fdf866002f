// `rotorloop esc flash`: new firmware for one or several nodes at once.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cli/esc/esc_commands.hpp"
#include "cli/esc/esc_session.hpp"
#include "firmware/update/image.hpp"
#include "host/base/error.hpp"
#include "host/tools/esc_table.hpp"
#include "host/tools/firmware_update.hpp"

namespace rotorloop::cli {
namespace {

constexpr std::uintmax_t kLargestImage_B = 16u << 20;  // far beyond any ESC: a disk image given by mistake

struct FlashArguments {
  EscOptions esc;
  std::vector<int> nodes;
  std::filesystem::path image;
};

std::vector<std::uint8_t> read_image(const std::filesystem::path& path) {
  std::error_code none;
  const auto size = std::filesystem::file_size(path, none);
  std::ifstream file(path, std::ios::binary);
  if (none || !file) throw Error({path.generic_string(), "cannot read the image", "", "check the path"});
  if (size == 0 || size > kLargestImage_B)
    throw Error({path.generic_string(), fmt::format("{} bytes are no image: 1 to {} are possible", size, kLargestImage_B), "",
                 "give the file that the build made for the node"});
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// What a node that runs this image reports as its CRC: by the header of rotorloop's images, or the descriptor "APDesc00" that PX4 and sapog
// put into theirs (CRC-64 behind it). None for an image that says neither. Throws Error for an image of ours that is damaged.
std::optional<std::uint64_t> image_crc(std::span<const std::uint8_t> image, const std::string& name) {
  firmware::ImageHeader h;
  const firmware::ImageFault fault = firmware::parse_image(image, h);
  if (fault == firmware::ImageFault::none) {
    protocols::Crc64 crc;
    const auto payload = image.subspan(std::min<std::size_t>(firmware::kImageHeaderBytes, image.size()));
    crc.add(payload.first(std::min<std::size_t>(h.size, payload.size())));
    if (payload.size() < h.size)
      throw Error({name, fmt::format("the image ends after {} of {} bytes", payload.size(), h.size), "the file was cut",
                   "make or download it again"});
    if (crc.value() != h.crc)
      throw Error({name, firmware::image_fault_text(firmware::ImageFault::damaged), "", "make or download it again"});
    return h.crc;
  }
  if (fault != firmware::ImageFault::not_an_image) throw Error({name, firmware::image_fault_text(fault), "", "make or download it again"});
  constexpr std::string_view kDescriptor = "APDesc00";
  const auto at = std::search(image.begin(), image.end(), kDescriptor.begin(), kDescriptor.end());
  if (image.end() - at < 16) return std::nullopt;
  std::uint64_t crc = 0;
  for (int i = 0; i < 8; ++i) crc |= static_cast<std::uint64_t>(at[8 + i]) << (8 * i);
  return crc;
}

std::string end_text(const tools::UpdateState& s, bool has_crc, std::uint64_t size_B) {
  if (s.phase != tools::UpdatePhase::done)
    return std::string(tools::phase_name(s.phase)) + ": " +
           (s.reason.empty() ? "interrupted; run the command again and it goes on" : s.reason);
  std::string text = s.verified && s.read_B < size_B ? "done, had this image already" : "done";
  if (s.info) text += fmt::format(", runs {}.{}", s.info->software_major, s.info->software_minor);
  return text + (s.verified ? fmt::format(", image CRC {:016x} as in the file", s.info->image_crc)
                 : has_crc  ? ", not verified: the node does not report the CRC of its image"
                            : ", not verified: the image does not name its CRC");
}

std::string progress_text(const tools::FirmwareUpdates& updates) {
  std::string text;
  for (const auto& [node, s] : updates.nodes())
    text += fmt::format("{}node {}: {}{}", text.empty() ? "" : "   ", node, tools::phase_name(s.phase),
                        s.phase == tools::UpdatePhase::reading
                            ? fmt::format(" {:.0f} %", 100.0 * static_cast<double>(s.read_B) / static_cast<double>(updates.size_B()))
                            : "");
  return text;
}

int flash(const FlashArguments& o) {
  auto image = read_image(o.image);
  const auto crc = image_crc(image, o.image.generic_string());
  EscSession session(o.esc);
  tools::ToolNode& tool = session.tool();
  const auto nodes = session.nodes(o.nodes);
  tools::FirmwareUpdates updates(tool, std::move(image), crc);
  for (const std::uint8_t node : nodes) updates.start(node);
  const bool redraw = !o.esc.live.json && ::isatty(STDERR_FILENO) == 1;
  std::map<std::uint8_t, int> told;  // tenths of each node, on a stream that is no terminal
  const bool ended = tool.run_until(INT64_MAX, [&] {
    updates.step();
    if (redraw) {
      fmt::print(stderr, "\r\033[K{}", progress_text(updates));
    } else {
      for (const auto& [node, s] : updates.nodes()) {
        const int step =
            s.phase == tools::UpdatePhase::reading ? static_cast<int>(10 * s.read_B / updates.size_B()) : 100 + static_cast<int>(s.phase);
        if (std::exchange(told[node], step) != step)
          fmt::print(stderr, "node {}: {} {} of {} bytes\n", node, tools::phase_name(s.phase), s.read_B, updates.size_B());
      }
    }
    return updates.over();
  });
  if (redraw) fmt::print(stderr, "\n");
  tool.run_until(tool.now_ns() + 3'000'000'000, [&] { return tool.requests_open() == 0; });
  nlohmann::ordered_json document = nlohmann::ordered_json::array();
  bool failed = false;
  for (const auto& [node, s] : updates.nodes()) {
    failed = failed || s.phase != tools::UpdatePhase::done;
    nlohmann::ordered_json j{{"node", node},           {"end", tools::phase_name(s.phase)},
                             {"read_B", s.read_B},     {"blocks", s.blocks},
                             {"verified", s.verified}, {"reason", s.reason}};
    const auto seen = tool.nodes().find(node);
    if (seen != tool.nodes().end()) j["now"] = tools::node_json(seen->second, tool.now_ns());
    document.push_back(j);
    if (!o.esc.live.json) fmt::print("node {}: {}\n", node, end_text(s, crc.has_value(), updates.size_B()));
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
  c->add_option("image", o->image, "firmware image file")->required();
  c->add_option("--node", o->nodes, "node ids, such as 21 or 21,22")->delimiter(',')->allow_extra_args(false)->required();
  c->footer(
      "Each node reads the image and restarts. A node refuses while its motor runs. After an interrupted update the node runs the old\n"
      "firmware or waits for a new update: run the command again. At the end the command compares the CRC of the running image.\n"
      "Example:\n  rotorloop esc flash esc.bin --node 21,22,23,24\n"
      "Exit code 3: a node did not accept the image; the message gives the reason.");
  c->callback([o, &exit_code] { exit_code = flash(*o); });
}

}  // namespace rotorloop::cli
