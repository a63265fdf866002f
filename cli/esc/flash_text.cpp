#include "cli/esc/flash_text.hpp"

#include <fmt/format.h>

#include <cmath>

#include "host/tools/esc_table.hpp"

namespace rotorloop::cli {
namespace {

using tools::UpdatePhase;

constexpr const char* kInterrupted = "interrupted; run the command again and it goes on";

std::string share_text(const tools::UpdateState& s, std::uint64_t size_B, std::int64_t now_ns) {
  std::string text = fmt::format("{:.0f} %", 100.0 * static_cast<double>(s.read_B) / static_cast<double>(size_B));
  if (const auto left_s = tools::remaining_s(s, size_B, now_ns)) text += fmt::format(", {:.0f} s left", std::ceil(*left_s));
  return text;
}

std::string image_text(const tools::ImageFacts& f) {
  std::string text;
  if (!f.board.empty()) text += fmt::format(" for {}, version {}", f.board, f.version);
  if (f.security_version) text += fmt::format(", security version {}", *f.security_version);
  return text + (f.crc ? fmt::format(", CRC {:016x}", *f.crc) : ", does not name its CRC");
}

}  // namespace

std::string plan_text(const tools::ToolNode& tool, const std::vector<std::uint8_t>& nodes, const tools::ImageFacts& facts,
                      std::uint64_t size_B) {
  std::string text = fmt::format("plan: {} bytes{}; {} {}, about {:.0f} s on an idle bus\n", size_B, image_text(facts), nodes.size(),
                                 nodes.size() == 1 ? "node" : "nodes", std::ceil(tools::expected_update_s(size_B, nodes.size())));
  for (const std::uint8_t id : nodes) {
    const tools::SeenNode& node = tool.nodes().at(id);
    const bool same = facts.crc && node.info && (node.info->software_flags & protocols::GetNodeInfoResponse::kHasImageCrc) != 0 &&
                      node.info->image_crc == *facts.crc;
    text += fmt::format("  node {:>3}  {}: {}{}\n", id, tools::node_name(node).empty() ? "name not known" : tools::node_name(node),
                        tools::running_text(node),
                        same                    ? ", this image already"
                        : facts.version.empty() ? ""
                                                : " -> " + facts.version);
  }
  if (facts.security_version) text += "  no node says its security version beforehand: it refuses an older one, with both numbers\n";
  return text;
}

std::string progress_text(const tools::FirmwareUpdates& updates, std::int64_t now_ns) {
  std::string text;
  for (const auto& [node, s] : updates.nodes())
    text += fmt::format("{}node {}: {}{}", text.empty() ? "" : "   ", node, tools::phase_name(s.phase),
                        s.phase == UpdatePhase::reading ? " " + share_text(s, updates.size_B(), now_ns) : "");
  return text;
}

std::string node_progress_text(std::uint8_t node, const tools::UpdateState& s, std::uint64_t size_B, std::int64_t now_ns) {
  const auto left_s = tools::remaining_s(s, size_B, now_ns);
  return fmt::format("node {}: {} {} of {} bytes{}", node, tools::phase_name(s.phase), s.read_B, size_B,
                     left_s ? fmt::format(", {:.0f} s left", std::ceil(*left_s)) : "");
}

std::string end_text(const tools::UpdateState& s, bool has_crc, std::uint64_t size_B) {
  if (s.phase != UpdatePhase::done) {
    if (s.failure == tools::UpdateFailure::none) return fmt::format("{}: {}", tools::phase_name(s.phase), kInterrupted);
    return fmt::format("{}: {}\n  do:     {}", tools::phase_name(s.phase), s.reason, tools::remedy_of(s.failure));
  }
  std::string text = s.verified && s.read_B < size_B ? "done, had this image already" : "done";
  if (s.info) text += fmt::format(", runs {}.{}", s.info->software_major, s.info->software_minor);
  return text + (s.verified ? fmt::format(", image CRC {:016x} as in the file", s.info->image_crc)
                 : has_crc  ? ", not verified: the node does not report the CRC of its image"
                            : ", not verified: the image does not name its CRC");
}

nlohmann::ordered_json end_json(std::uint8_t node, const tools::UpdateState& s, const tools::ToolNode& tool) {
  nlohmann::ordered_json j{{"node", node},           {"end", tools::phase_name(s.phase)},
                           {"read_B", s.read_B},     {"blocks", s.blocks},
                           {"verified", s.verified}, {"reason", s.reason}};
  if (s.phase != UpdatePhase::done) j["do"] = s.failure == tools::UpdateFailure::none ? kInterrupted : tools::remedy_of(s.failure);
  if (s.before) j["before"] = fmt::format("{}.{}", s.before->software_major, s.before->software_minor);
  const auto seen = tool.nodes().find(node);
  if (seen != tool.nodes().end()) j["now"] = tools::node_json(seen->second, tool.now_ns());
  return j;
}

}  // namespace rotorloop::cli
