#include "host/tools/firmware_update.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

namespace rotorloop::tools {
namespace {

using namespace protocols;

constexpr const char* kImagePath = "fw";
static_assert(std::string_view(kImagePath).size() <= FilePath::kMostBytes, "a longer one would be cut on the way");
constexpr std::int64_t kAskAgain_ns = 2'000'000'000;

}  // namespace

std::string phase_name(UpdatePhase phase) {
  switch (phase) {
    case UpdatePhase::asking:
      return "asking";
    case UpdatePhase::waiting:
      return "waiting";
    case UpdatePhase::reading:
      return "reading";
    case UpdatePhase::restarting:
      return "restarting";
    case UpdatePhase::verifying:
      return "verifying";
    case UpdatePhase::done:
      return "done";
    case UpdatePhase::failed:
      return "failed";
  }
  return "";
}

std::string remedy_of(UpdateFailure failure) {
  switch (failure) {
    case UpdateFailure::none:
      return "";
    case UpdateFailure::no_answer:
      return "see whether it has power and an id: rotorloop esc list; without a bootloader for DroneCAN it needs a debugger";
    case UpdateFailure::refused:
      return "stop and disarm its motor, then run the command again";
    case UpdateFailure::elsewhere:
      return "end the other program that updates it, then run the command again";
    case UpdateFailure::no_blocks:
      return "run the command again: it goes on where it was";
    case UpdateFailure::kept_old:
      return "look at board, signature and security version of the image: rotorloop image info FILE; where they fit, run the command again";
    case UpdateFailure::runs_another:
      return "look for another program that updates it, then run the command again";
    case UpdateFailure::not_back:
      return "see why it waits: rotorloop esc log; then run the command again with --recover";
  }
  return "";
}

FirmwareUpdates::FirmwareUpdates(ToolNode& tool, std::vector<std::uint8_t> image, std::optional<std::uint64_t> image_crc)
    : tool_(tool), image_(std::move(image)), image_crc_(image_crc) {
  tool.on<NodeStatus>([this](const NodeStatus& status, std::uint8_t source) {
    const auto known = nodes_.find(source);
    if (known != nodes_.end() && status.mode == NodeMode::software_update) known->second.was_updating = true;
  });
  tool.on<LogMessage>([this](const LogMessage& m, std::uint8_t source) {
    const auto known = nodes_.find(source);
    if (known != nodes_.end() && m.level >= LogMessage::Level::warning)
      known->second.said.assign(m.text.items.begin(), m.text.items.begin() + m.text.count);
  });
  tool.serve<FileGetInfo, FileGetInfoResponse>([this](const FileGetInfo& request, std::uint8_t) {
    FileGetInfoResponse r;
    if (request.path.path.is(kImagePath)) {
      r.size = image_.size();
      r.entry.flags = EntryType::kFile | EntryType::kReadable;
    } else {
      r.error.value = FileError::kNotFound;
    }
    return std::optional(r);
  });
  tool.serve<FileRead, FileReadResponse>([this](const FileRead& request, std::uint8_t client) {
    FileReadResponse r;
    if (!request.path.path.is(kImagePath)) {
      r.error.value = FileError::kNotFound;
      return std::optional(r);
    }
    const std::uint64_t begin = std::min<std::uint64_t>(request.offset, image_.size());
    const std::uint64_t size = std::min<std::uint64_t>(FileRead::kBlock, image_.size() - begin);
    r.data.assign({image_.data() + begin, static_cast<std::size_t>(size)});
    const auto known = nodes_.find(client);
    if (known != nodes_.end() && known->second.phase != UpdatePhase::done && known->second.phase != UpdatePhase::failed) {
      UpdateState& s = known->second;
      if (s.blocks++ == 0) {
        s.first_B = begin + size;
        s.first_ns = tool_.now_ns();
      }
      s.elsewhere = false;
      s.read_B = std::max(s.read_B, begin + size);
      s.changed_ns = tool_.now_ns();
      // A node that knows the size from the image's header does not ask for the short block that ends a file.
      s.phase = begin + size >= image_.size() ? UpdatePhase::restarting : UpdatePhase::reading;
    }
    return std::optional(r);
  });
}

void FirmwareUpdates::start(std::uint8_t node) {
  nodes_[node] = {};
  nodes_[node].changed_ns = tool_.now_ns();
  if (const auto seen = tool_.nodes().find(node); seen != tool_.nodes().end()) nodes_[node].before = seen->second.info;
  ask(node);
}

void FirmwareUpdates::ask(std::uint8_t node) {
  UpdateState& state = nodes_[node];
  ++state.asked;
  state.asked_ns = tool_.now_ns();
  BeginFirmwareUpdate request;
  request.path = FilePath(kImagePath);
  tool_.request<BeginFirmwareUpdate, BeginFirmwareUpdateResponse>(
      node, request,
      [this, node](const std::optional<BeginFirmwareUpdateResponse>& r) {
        UpdateState& s = nodes_[node];
        if ((s.phase != UpdatePhase::asking && !s.elsewhere) || !r) return;
        using Error = BeginFirmwareUpdateResponse::Error;
        const std::string said(r->message.items.begin(), r->message.items.begin() + r->message.count);
        if (r->error == Error::ok || r->error == Error::in_progress) {
          if (s.phase == UpdatePhase::asking) s.changed_ns = tool_.now_ns();
          s.phase = UpdatePhase::waiting;
          s.elsewhere = r->error == Error::in_progress;
        } else {
          fail(s, UpdateFailure::refused,
               fmt::format("refused: {}", !said.empty()                     ? said
                                          : r->error == Error::invalid_mode ? "not in this mode; does its motor run?"
                                                                            : "no reason given"));
        }
      },
      {.attempts = 1, .timeout_ns = kAskAgain_ns});
}

void FirmwareUpdates::fail(UpdateState& s, UpdateFailure failure, std::string reason) {
  s.phase = UpdatePhase::failed;
  s.failure = failure;
  s.reason = std::move(reason);
}

// Does it run what was sent?
void FirmwareUpdates::verify(std::uint8_t node, UpdateState& s) {
  s.phase = UpdatePhase::verifying;
  tool_.request<GetNodeInfo, GetNodeInfoResponse>(
      node, {}, [this, node](const std::optional<GetNodeInfoResponse>& r) { judge(nodes_[node], r); },
      {.attempts = 20, .timeout_ns = 500'000'000});  // nine frames and more: on a bad bus few come whole
}

void FirmwareUpdates::judge(UpdateState& s, const std::optional<GetNodeInfoResponse>& info) {
  if (s.phase != UpdatePhase::verifying) return;
  s.info = info;
  const bool reports = info && (info->software_flags & GetNodeInfoResponse::kHasImageCrc) != 0;
  s.verified = reports && image_crc_ && info->image_crc == *image_crc_;
  const std::string said = s.said.empty() ? "" : "; it said: " + s.said;
  if (s.read_B < image_.size() && !s.verified) {
    fail(s, UpdateFailure::kept_old, fmt::format("runs its old firmware again after {} of {} bytes{}", s.read_B, image_.size(), said));
  } else if (reports && image_crc_ && !s.verified) {
    fail(s, UpdateFailure::runs_another,
         fmt::format("runs an image with CRC {:016x}; the one sent has {:016x}{}", info->image_crc, *image_crc_, said));
  } else if (reports && !s.verified && !s.said.empty() && s.before && s.before->image_crc == info->image_crc) {
    // The file does not say its CRC, but the node complained and runs what it ran before.
    fail(s, UpdateFailure::kept_old, fmt::format("runs its old firmware again, CRC {:016x}; it said: {}", info->image_crc, s.said));
  } else {
    s.phase = UpdatePhase::done;
  }
}

void FirmwareUpdates::follow(std::uint8_t node, UpdateState& s) {
  const std::int64_t since_ns = tool_.now_ns() - s.changed_ns;
  const auto seen = tool_.nodes().find(node);
  const bool operational =
      seen != tool_.nodes().end() && seen->second.heard_ns > s.changed_ns && seen->second.status.mode == NodeMode::operational;
  const std::string said = s.said.empty() ? "" : "; it said: " + s.said;
  switch (s.phase) {
    case UpdatePhase::asking:
      if (tool_.now_ns() - s.asked_ns <= kAskAgain_ns) break;
      if (s.asked >= kMostAsked) {
        fail(s, UpdateFailure::no_answer, "does not answer BeginFirmwareUpdate");
      } else {
        ask(node);
      }
      break;
    case UpdatePhase::waiting:
    case UpdatePhase::reading:
      if (operational && s.was_updating) {
        verify(node, s);  // it has refused the image, or runs it already
      } else if (since_ns > kSilence_ns && s.elsewhere) {
        fail(s, UpdateFailure::elsewhere,
             fmt::format("is updated by another program; it asked for no block here for {} s{}", kSilence_ns / 1'000'000'000, said));
      } else if (since_ns > kSilence_ns) {
        fail(s, UpdateFailure::no_blocks,
             fmt::format("no block was read for {} s; {} of {} bytes were{}", kSilence_ns / 1'000'000'000, s.read_B, image_.size(), said));
      } else if (s.elsewhere && tool_.now_ns() - s.asked_ns > kAskAgain_ns) {
        ask(node);  // a bootloader whose other server fell silent takes the question after 5 s
      }
      break;
    case UpdatePhase::restarting:
      // Heard after its last block, and not in the updater any more.
      if (operational) {
        verify(node, s);
      } else if (since_ns > kRestart_ns) {
        fail(s, UpdateFailure::not_back, "has read the whole image and does not report as operational" + said);
      }
      break;
    case UpdatePhase::verifying:
    case UpdatePhase::done:
    case UpdatePhase::failed:
      break;
  }
}

void FirmwareUpdates::step() {
  for (auto& [node, s] : nodes_) follow(node, s);
}

bool FirmwareUpdates::over() const {
  return std::all_of(nodes_.begin(), nodes_.end(),
                     [](const auto& n) { return n.second.phase == UpdatePhase::done || n.second.phase == UpdatePhase::failed; });
}

}  // namespace rotorloop::tools
