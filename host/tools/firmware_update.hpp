// Firmware updates of several nodes at once: asks each to begin, serves it the image block by block as it reads, follows it through its
// restart. The node leads: it asks for blocks, so a slow or deaf node holds up nobody else, and one that was cut off goes on where it
// was when it is asked again.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/tools/tool_node.hpp"

namespace rotorloop::tools {

enum class UpdatePhase : std::uint8_t {
  asking,   // BeginFirmwareUpdate is not answered yet
  waiting,  // answered; no block read yet
  reading,
  restarting,  // has read to the end
  verifying,   // operational again; asked which image it runs
  done,
  failed,
};

enum class UpdateFailure : std::uint8_t {
  none,
  no_answer,     // to BeginFirmwareUpdate
  refused,       // BeginFirmwareUpdate, with the node's reason
  elsewhere,     // it fetches an image from another program
  no_blocks,     // it stopped asking for them
  kept_old,      // it runs what it ran before
  runs_another,  // an image that is neither
  not_back,      // it has read everything and does not run it
};
// What a person does about it.
std::string remedy_of(UpdateFailure failure);

struct UpdateState {
  UpdatePhase phase = UpdatePhase::asking;
  UpdateFailure failure = UpdateFailure::none;
  std::uint64_t read_B = 0;     // up to here
  std::uint64_t blocks = 0;     // served, repeated ones counted again
  std::int64_t changed_ns = 0;  // of the last progress
  std::uint64_t first_B = 0;    // up to here by the first block that it read now, at first_ns; an update that goes on begins in the middle
  std::int64_t first_ns = 0;
  std::int64_t asked_ns = 0;
  int asked = 0;
  bool elsewhere = false;                                      // it said that an update is in progress, and has read no block here
  bool was_updating = false;                                   // has reported mode "software update"
  bool verified = false;                                       // runs the image that was sent, by the CRC that it reports
  std::optional<protocols::GetNodeInfoResponse> before, info;  // as it was asked to update, after its restart
  std::string said;                                            // its last log message of level warning or error
  std::string reason;                                          // of a failure, in words
};

class FirmwareUpdates {
 public:
  static constexpr std::int64_t kSilence_ns = 30'000'000'000;  // without a block read: failed; the old image runs on
  static constexpr std::int64_t kRestart_ns = 20'000'000'000;  // to report as operational after the last block
  static constexpr int kMostAsked = 4;                         // every 2 s, as the DroneCAN GUI tool does

  // Serves the image under a path of two characters: a request for a block is one frame then. `image_crc`: what a node that runs the image
  // reports in GetNodeInfo; a node that reports another one has failed, none given or reported: not verified.
  FirmwareUpdates(ToolNode& tool, std::vector<std::uint8_t> image, std::optional<std::uint64_t> image_crc = std::nullopt);
  void start(std::uint8_t node);
  void step();
  bool over() const;  // every node is done or has failed
  const std::map<std::uint8_t, UpdateState>& nodes() const { return nodes_; }
  std::uint64_t size_B() const { return image_.size(); }

 private:
  void ask(std::uint8_t node);
  void follow(std::uint8_t node, UpdateState& s);
  void verify(std::uint8_t node, UpdateState& s);
  void judge(UpdateState& s, const std::optional<protocols::GetNodeInfoResponse>& info);
  void fail(UpdateState& s, UpdateFailure failure, std::string reason);

  ToolNode& tool_;
  std::vector<std::uint8_t> image_;
  std::optional<std::uint64_t> image_crc_;
  std::map<std::uint8_t, UpdateState> nodes_;
};

std::string phase_name(UpdatePhase phase);

}  // namespace rotorloop::tools
