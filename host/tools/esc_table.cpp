#include "host/tools/esc_table.hpp"

#include <fmt/format.h>

#include <array>

namespace rotorloop::tools {
namespace {

// In the order of their codes in the vendor status.
constexpr std::array<const char*, 9> kFaultNames{"",       "overcurrent",     "undervoltage", "overvoltage", "stall", "start failed",
                                                 "sensor", "overtemperature", "self-test"};
constexpr std::array<const char*, 11> kLimiterNames{"",          "phase_current", "bus_current", "regen_current", "voltage", "speed_slew",
                                                    "max_speed", "min_speed",     "temperature", "undervoltage",  "observer"};

nlohmann::ordered_json number_or_null(float v) {
  if (v != v) return nullptr;
  return v;
}

}  // namespace

EscTable::EscTable(ToolNode& tool) {
  tool.on<protocols::EscStatus>([this, &tool](const protocols::EscStatus& s, std::uint8_t source) {
    EscRow& row = rows_[{s.esc_index, source}];
    row.node = source;
    row.status = s;
    row.heard_ns = tool.now_ns();
    ++row.reports;
    row.shares_index = false;
    for (auto& [key, other] : rows_) {
      if (key.first == s.esc_index && other.node != source && tool.now_ns() - other.heard_ns < kToolOffline_ns)
        other.shares_index = row.shares_index = true;
    }
  });
}

const EscRow* EscTable::of_index(int esc_index) const {
  const auto first = rows_.lower_bound({esc_index, 0});
  return first != rows_.end() && first->first.first == esc_index ? &first->second : nullptr;
}

std::string mode_name(protocols::NodeMode mode) {
  switch (mode) {
    case protocols::NodeMode::operational:
      return "operational";
    case protocols::NodeMode::initialization:
      return "initialization";
    case protocols::NodeMode::maintenance:
      return "maintenance";
    case protocols::NodeMode::software_update:
      return "software update";
    case protocols::NodeMode::offline:
      return "offline";
  }
  return fmt::format("mode {}", static_cast<int>(mode));
}

std::string health_name(protocols::Health health) {
  constexpr std::array<const char*, 4> kNames{"ok", "warning", "error", "critical"};
  return kNames[static_cast<std::size_t>(health) & 3u];
}

std::string trouble_of(const protocols::NodeStatus& s) {
  const unsigned fault = s.vendor_status & 0xFFu, limiter = s.vendor_status >> 8;
  std::string text;
  if (fault > 0) text = fault < kFaultNames.size() ? kFaultNames[fault] : fmt::format("fault {}", fault);
  if (limiter > 0) {
    if (!text.empty()) text += ", ";
    text += "limited by " + (limiter < kLimiterNames.size() ? std::string(kLimiterNames[limiter]) : std::to_string(limiter));
  }
  if (fault == 0 && s.health >= protocols::Health::error)
    text += std::string(text.empty() ? "" : ", ") + "no fault named: no or bad parameters stored, or a second node with its id or index";
  return text;
}

std::string node_name(const SeenNode& node) {
  return node.info ? std::string(node.info->name.begin(), node.info->name.begin() + node.info->name_length) : "";
}

std::string unique_id_text(const SeenNode& node) { return node.info ? fmt::format("{:02x}", fmt::join(node.info->unique_id, "")) : ""; }

nlohmann::ordered_json esc_row_json(const EscRow& row, const ToolNode& tool) {
  nlohmann::ordered_json j{{"esc_index", row.status.esc_index}, {"node", row.node}, {"rpm", row.status.rpm}};
  j["bus_V"] = number_or_null(row.status.voltage_V);
  j["bus_A"] = number_or_null(row.status.current_A);
  j["temperature_C"] = number_or_null(row.status.temperature_K - 273.15f);
  j["power_percent"] = row.status.power_rating_pct;
  j["errors"] = row.status.error_count;
  j["age_ms"] = (tool.now_ns() - row.heard_ns) / 1'000'000;
  j["shares_index"] = row.shares_index;
  if (const auto node = tool.nodes().find(row.node); node != tool.nodes().end()) {
    j["mode"] = mode_name(node->second.status.mode);
    j["health"] = health_name(node->second.status.health);
    j["trouble"] = trouble_of(node->second.status);
  }
  return j;
}

nlohmann::ordered_json node_json(const SeenNode& n, std::int64_t now_ns) {
  nlohmann::ordered_json j{{"node", n.id},
                           {"mode", mode_name(n.status.mode)},
                           {"health", health_name(n.status.health)},
                           {"uptime_s", n.status.uptime_s},
                           {"vendor_status", n.status.vendor_status},
                           {"age_ms", (now_ns - n.heard_ns) / 1'000'000},
                           {"restarts", n.restarts}};
  if (const std::string trouble = trouble_of(n.status); !trouble.empty()) j["trouble"] = trouble;
  if (!n.info) return j;
  j["name"] = node_name(n);
  j["unique_id"] = unique_id_text(n);
  j["software"] = fmt::format("{}.{}", n.info->software_major, n.info->software_minor);
  j["hardware"] = fmt::format("{}.{}", n.info->hardware_major, n.info->hardware_minor);
  if ((n.info->software_flags & 1u) != 0) j["vcs_commit"] = fmt::format("{:08x}", n.info->vcs_commit);
  if ((n.info->software_flags & 2u) != 0) j["image_crc"] = fmt::format("{:016x}", n.info->image_crc);
  return j;
}

}  // namespace rotorloop::tools
