// Before an update of firmware: which nodes of a bus it is for, whether any of them is in use, who else commands, how long it takes.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/tools/firmware_update.hpp"
#include "host/tools/tool_node.hpp"

namespace rotorloop::tools {

// What an image says of itself; none and empty: it does not.
struct ImageFacts {
  std::string board;  // of rotorloop's images, with version and security version
  std::string version;
  std::optional<std::uint32_t> security_version;
  std::optional<std::uint64_t> crc;
};

// Who commands and which ESCs are in use, as heard through the tool; it must outlive the watch's use.
class CommandWatch {
 public:
  static constexpr std::int64_t kRecent_ns = 1'500'000'000;  // ArmingStatus comes twice a second, on a bad bus every other one
  explicit CommandWatch(ToolNode& tool);
  // Nodes that sent a set-point or an arming status of late.
  std::vector<std::uint8_t> commanders() const;
  // "turns with 3000 rpm" or "is armed"; empty: neither. Who is armed says an ESC of rotorloop in esc.StatusExtended; of any other that
  // runs its firmware it is taken to be armed while somebody sends "fully armed".
  std::string in_use(std::uint8_t node) const;

 private:
  bool recent(std::int64_t heard_ns) const { return heard_ns >= 0 && tool_.now_ns() - heard_ns < kRecent_ns; }
  ToolNode& tool_;
  std::map<std::uint8_t, std::int64_t> commanded_ns_, armed_ns_;  // by node: when it commanded; when it said that it is armed
  std::map<std::uint8_t, std::pair<std::int32_t, std::int64_t>> turned_rpm_;
  std::int64_t fully_armed_ns_ = -1;
};

// Does the node's name say this board? "b_g431b_esc1" is said by "org.rotorloop.b_g431b_esc1" and the same with ".test_key" behind it; a
// whole name by itself.
bool is_board(const SeenNode& node, const std::string& board);

bool waits_in_bootloader(const SeenNode& node);

// "0.1, CRC 0011223344556677", "waits in its bootloader", "not known".
std::string running_text(const SeenNode& node);

// On a bus that is idle beside it, from the question to the last node's start: what the emulated B-G431B-ESC1 takes.
double expected_update_s(std::uint64_t size_B, std::size_t nodes);

// By the pace since the first block; none before there is a pace.
std::optional<double> remaining_s(const UpdateState& state, std::uint64_t size_B, std::int64_t now_ns);

}  // namespace rotorloop::tools
