// What every ESC on a bus last said of itself: the rows of `rotorloop esc monitor`.
#pragma once
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "host/tools/tool_node.hpp"

namespace rotorloop::tools {

struct EscRow {
  std::uint8_t node = 0;
  protocols::EscStatus status;
  std::int64_t heard_ns = 0;
  std::uint64_t reports = 0;
  bool shares_index = false;  // another node reports the same esc_index
};

class EscTable {
 public:
  // Listens through the tool from now on; it must outlive the table's use.
  explicit EscTable(ToolNode& tool);
  // By (esc_index, node).
  const std::map<std::pair<int, int>, EscRow>& rows() const { return rows_; }
  const EscRow* of_index(int esc_index) const;  // the first one; null when none reports it

 private:
  std::map<std::pair<int, int>, EscRow> rows_;
};

// "operational", "initialization", …; "ok", "warning", "error", "critical".
std::string mode_name(protocols::NodeMode mode);
std::string health_name(protocols::Health health);
// What an ESC of rotorloop says in its vendor status (docs/wire.md): "overcurrent", "limited by bus_current"; empty when all is well.
std::string trouble_of(const protocols::NodeStatus& status);
// "org.rotorloop.esc"; empty before the node has said it.
std::string node_name(const SeenNode& node);
std::string unique_id_text(const SeenNode& node);

nlohmann::ordered_json esc_row_json(const EscRow& row, const ToolNode& tool);
nlohmann::ordered_json node_json(const SeenNode& node, std::int64_t now_ns);

}  // namespace rotorloop::tools
