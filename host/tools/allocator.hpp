// Gives node ids to nodes that ask for one (DroneCAN dynamic node id allocation, the side of the allocator), and remembers which unique id
// has which: the same ESC gets the same id for ever, as long as its table is kept and no other node holds that id. The bus is looked at
// before the table: nothing is given before it was listened to for a while, and a stored id that a live node of another unique id holds is
// replaced, for two nodes of one id would both fall silent.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/tools/tool_node.hpp"

namespace rotorloop::tools {

using UniqueId = std::array<std::uint8_t, 16>;

// Text of a table: a line "UNIQUE_ID = NODE_ID" for each. Throws Error (exit 2) with the line.
std::map<UniqueId, std::uint8_t> parse_allocation_table(const std::string& text, const std::string& name);
std::string allocation_table_text(const std::map<UniqueId, std::uint8_t>& table);
std::string unique_id_text(const UniqueId& id);

struct Allocated {
  UniqueId unique_id{};
  std::uint8_t node_id = 0;
  bool is_new = false;  // the table has changed
  // Its id of the table, where another node holds that; and the unique id of that node, all zero where it does not answer.
  std::optional<std::uint8_t> stored_id = {};
  UniqueId held_by{};
};

class Allocator {
 public:
  // `told`: called for every id given. Listens through the tool; it must outlive the allocator's use.
  Allocator(ToolNode& tool, std::map<UniqueId, std::uint8_t> table, std::function<void(const Allocated&)> told);
  const std::map<UniqueId, std::uint8_t>& table() const { return table_; }
  std::uint64_t refused() const { return refused_; }  // requests while no id was free

 private:
  void on_request(const protocols::Allocation& request);
  // Whether the id of a stored node is free for it, as far as the bus shows by now.
  enum class Holder { nobody, itself, another, not_known_yet };
  Holder holder_of(std::uint8_t node, const UniqueId& id);
  void give(const UniqueId& id, std::uint8_t preferred);
  std::uint8_t free_id(std::uint8_t preferred) const;  // 0: none is free

  ToolNode& tool_;
  std::map<UniqueId, std::uint8_t> table_;
  std::function<void(const Allocated&)> report_;
  std::vector<std::uint8_t> heard_;  // unique id of the node being served, as far as it is known
  std::int64_t heard_ns_ = 0;
  std::int64_t begun_ns_;
  std::map<UniqueId, std::int64_t> waiting_since_ns_;  // nodes that were not answered, as the holder of their id is not known yet
  std::uint64_t refused_ = 0;
};

// Tells all nodes the time of this bus, once a second; silent while a node with a lower id does.
class TimeMaster {
 public:
  explicit TimeMaster(ToolNode& tool);
  void step();
  bool leads() const;

 private:
  ToolNode& tool_;
  std::int64_t next_ns_ = 0, sent_ns_ = 0, other_ns_;
};

}  // namespace rotorloop::tools
