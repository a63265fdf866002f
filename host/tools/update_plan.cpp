#include "host/tools/update_plan.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/tools/esc_table.hpp"

namespace rotorloop::tools {
namespace {

using namespace protocols;

constexpr std::uint32_t kArmedFlag = 1u << 16;  // of rotorloop's esc.StatusExtended (docs/wire.md)

}  // namespace

CommandWatch::CommandWatch(ToolNode& tool) : tool_(tool) {
  const auto commands = [this](const auto&, std::uint8_t source) { commanded_ns_[source] = tool_.now_ns(); };
  tool.on<RawCommand>(commands);
  tool.on<RpmCommand>(commands);
  tool.on<ArmingStatus>([this](const ArmingStatus& a, std::uint8_t source) {
    commanded_ns_[source] = tool_.now_ns();
    if (a.status == ArmingStatus::kFullyArmed) fully_armed_ns_ = tool_.now_ns();
  });
  tool.on<EscStatus>([this](const EscStatus& s, std::uint8_t source) { turned_rpm_[source] = {s.rpm, tool_.now_ns()}; });
  tool.on<EscStatusExtended>([this](const EscStatusExtended& s, std::uint8_t source) {
    const auto node = tool_.nodes().find(source);
    if (node == tool_.nodes().end() || !node_name(node->second).starts_with("org.rotorloop.")) return;
    armed_ns_[source] = (s.status_flags & kArmedFlag) != 0 ? tool_.now_ns() : -1;
  });
}

std::vector<std::uint8_t> CommandWatch::commanders() const {
  std::vector<std::uint8_t> recently;
  for (const auto& [node, heard_ns] : commanded_ns_)
    if (recent(heard_ns)) recently.push_back(node);
  return recently;
}

std::string CommandWatch::in_use(std::uint8_t node) const {
  if (const auto t = turned_rpm_.find(node); t != turned_rpm_.end() && t->second.first != 0 && recent(t->second.second))
    return fmt::format("turns with {} rpm", t->second.first);
  if (const auto a = armed_ns_.find(node); a != armed_ns_.end() && recent(a->second)) return "is armed";
  const auto seen = tool_.nodes().find(node);
  const bool runs = seen == tool_.nodes().end() || seen->second.status.mode != NodeMode::software_update;
  return runs && recent(fully_armed_ns_) ? "is armed" : "";
}

bool is_board(const SeenNode& node, const std::string& board) {
  const std::string name = node_name(node);
  if (name == board) return true;
  const auto at = name.find("." + board);
  return at != std::string::npos && (at + 1 + board.size() == name.size() || name[at + 1 + board.size()] == '.');
}

bool waits_in_bootloader(const SeenNode& node) { return node.status.mode == NodeMode::software_update; }

std::string running_text(const SeenNode& node) {
  if (waits_in_bootloader(node)) return "waits in its bootloader";
  if (!node.info) return "not known";
  const std::string version = fmt::format("{}.{}", node.info->software_major, node.info->software_minor);
  const bool reports = (node.info->software_flags & GetNodeInfoResponse::kHasImageCrc) != 0;
  return reports ? fmt::format("{}, CRC {:016x}", version, node.info->image_crc) : version + ", CRC not reported";
}

// A node asks for the next block when it has written the last one, 24 kB/s; the bus carries no more than some 45 kB/s of blocks. The
// restarts before and after, signature included, are a second and a half, and a node says within another that it runs.
double expected_update_s(std::uint64_t size_B, std::size_t nodes) {
  const auto bytes = static_cast<double>(size_B);
  return 2.5 + std::max(bytes / 24e3, static_cast<double>(nodes) * bytes / 45e3);
}

std::optional<double> remaining_s(const UpdateState& s, std::uint64_t size_B, std::int64_t now_ns) {
  if (s.phase != UpdatePhase::reading || s.read_B <= s.first_B || now_ns <= s.first_ns) return std::nullopt;
  const double B_per_s = static_cast<double>(s.read_B - s.first_B) / (static_cast<double>(now_ns - s.first_ns) * 1e-9);
  return static_cast<double>(size_B - s.read_B) / B_per_s;
}

}  // namespace rotorloop::tools
