#include "host/tools/frame_text.hpp"

#include <fmt/format.h>

#include "host/tools/type_names.hpp"
#include "protocols/fast_channel.hpp"
#include "protocols/transfer.hpp"
#include "protocols/types.hpp"

namespace rotorloop::tools {
namespace {

namespace fast = protocols::fast;

FrameKind standard_kind(const BusFrame& frame) {
  FrameKind kind;
  const CanFrame classic{.id = frame.id, .extended = false, .length = frame.length, .data = {}};
  if (fast::is_setpoint_id(classic)) {
    kind.type = fmt::format("fast set-point, ESCs {} to {}", 4 * (frame.id & 3u), 4 * (frame.id & 3u) + 3);
    kind.moves_motors = true;
  } else if (fast::is_feedback_id(classic)) {
    kind.type = fmt::format("fast feedback, ESC {}", frame.id & 15u);
  } else {
    kind.type = "11-bit frame";
  }
  return kind;
}

bool moves(const protocols::FrameId& id) {
  return id.kind == protocols::TransferKind::message &&
         (id.data_type_id == protocols::RawCommand::kType.id || id.data_type_id == protocols::RpmCommand::kType.id ||
          id.data_type_id == protocols::ArmingStatus::kType.id);
}

}  // namespace

FrameKind frame_kind(const BusFrame& frame) {
  if (!frame.extended) return standard_kind(frame);
  const protocols::FrameId id = protocols::decode_id(frame.id);
  FrameKind kind;
  const bool service = id.kind != protocols::TransferKind::message;
  kind.type = short_type_name(service, id.data_type_id);
  kind.source = id.source;
  if (service) kind.destination = id.destination;
  kind.role = !service ? "message" : id.kind == protocols::TransferKind::request ? "request" : "response";
  kind.moves_motors = moves(id);
  return kind;
}

std::string addresses(const FrameKind& kind) {
  if (kind.source < 0) return {};
  const std::string source = kind.source == 0 ? "anonymous" : std::to_string(kind.source);
  return source + " -> " + (kind.destination < 0 ? "*" : std::to_string(kind.destination));
}

std::string id_text(const BusFrame& frame) { return frame.extended ? fmt::format("{:08X}", frame.id) : fmt::format("{:03X}", frame.id); }

std::string data_text(const BusFrame& frame) {
  std::string text;
  for (std::size_t i = 0; i < frame.length; ++i) text += fmt::format("{:02X}", frame.data[i]);
  return text;
}

}  // namespace rotorloop::tools
