// Instantiates what the node itself does not use of protocols/, so that the cross build shows that all of it compiles
// freestanding, without exceptions and RTTI. Never linked into an image.
#include "firmware/core/node/esc_node.hpp"
#include "protocols/receiver.hpp"
#include "protocols/state_receiver.hpp"
#include "protocols/types.hpp"

namespace rotorloop::firmware {

// One ESC's node in RAM: the number under bss is its footprint.
alignas(EscNode) std::array<std::byte, sizeof(EscNode)> target_check_storage;
static_assert(sizeof(EscNode) < 6144, "the node has outgrown its share of the ESC's 22 KiB of RAM");

bool target_check_state(protocols::state::StateReceiver& r, const CanFrame& f, std::int64_t now_us) {
  const auto e = r.on_frame(f, now_us);
  return e.imu || e.pose || e.setpoint || e.status;
}

protocols::state::PoseFrames target_check_encode(const protocols::state::PoseReading& s) { return protocols::state::encode(s, 0); }
protocols::state::ImuFrames target_check_encode(const protocols::state::ImuReading& s) { return protocols::state::encode(s, 0); }

std::size_t target_check_types(std::span<std::uint8_t> out) {
  return encode(protocols::RawCommand{}, out) + encode(protocols::RpmCommand{}, out) + encode(protocols::ArmingStatus{}, out);
}

std::optional<protocols::fast::Feedback> target_check_fast(const CanFrame& f) { return protocols::fast::decode_feedback(f); }

}  // namespace rotorloop::firmware
