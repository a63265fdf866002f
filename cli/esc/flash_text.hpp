// What `rotorloop esc flash` tells: the plan, how far each node is, how it ended.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/tools/update_plan.hpp"

namespace rotorloop::cli {

// Before anything is asked of a node: image, time, and a line for each node.
std::string plan_text(const tools::ToolNode& tool, const std::vector<std::uint8_t>& nodes, const tools::ImageFacts& facts,
                      std::uint64_t size_B);
std::string progress_text(const tools::FirmwareUpdates& updates, std::int64_t now_ns);  // all nodes in one line
std::string node_progress_text(std::uint8_t node, const tools::UpdateState& state, std::uint64_t size_B, std::int64_t now_ns);

// With what to do in a second line where it failed.
std::string end_text(const tools::UpdateState& state, bool has_crc, std::uint64_t size_B);
nlohmann::ordered_json end_json(std::uint8_t node, const tools::UpdateState& state, const tools::ToolNode& tool);

}  // namespace rotorloop::cli
