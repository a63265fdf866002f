// The receive path of the ESC's node on a Cortex-M4F: makes the frames of each kind of traffic, hands them in and polls, by calls that
// receive_cost_test.py makes and counts. Never linked into an image.
#include "firmware/core/node/esc_node.hpp"
#include "firmware/core/node/esc_node_commission.cpp"
#include "firmware/core/node/esc_node_frames.cpp"
#include "firmware/core/node/esc_node_reports.cpp"

namespace rotorloop::firmware {
namespace {

enum Traffic : std::uint32_t {
  rpm_command,       // of four ESCs, from the commander
  raw_command,       // of four ESCs
  fast_setpoint,     // of our group
  foreign_standard,  // 11-bit identifier that means nothing, no data
  foreign_message,   // of a type that nobody here reads
  foreign_request,   // to another node
  begun_transfer,    // first frame of a transfer that never goes on, each from another node
  esc_status,        // of another ESC: whole, in two frames
  get_by_index,      // GetSet: the answer of a number
  get_by_last_name,  // GetSet by the last name of the table: the longest search
  node_info,
  wrong_restart,  // RestartNode without its magic number
  beep,
  allocation,
  own_id,
};

alignas(EscNode) std::array<std::byte, sizeof(EscNode)> storage;
EscNode* node = nullptr;
std::array<CanFrame, 32> frames;
std::uint32_t frame_count = 0;
std::uint64_t now_us = 1'000'000;
Telemetry telemetry;

bool keep(const CanFrame& f) {
  frames[frame_count++ % frames.size()] = f;
  return true;
}

template <class T>
void make(const T& value, protocols::TransferKind kind, std::uint8_t priority, std::uint8_t source, std::uint8_t number) {
  std::array<std::uint8_t, 200> payload{};
  const std::size_t size = encode(value, payload);
  protocols::encode_transfer({.kind = kind, .priority = priority, .data_type_id = T::kType.id, .source = source, .destination = 42},
                             T::kType.crc_seed(), static_cast<std::uint8_t>(number & 31u), {payload.data(), size}, keep);
}

void make_foreign(std::uint32_t n, bool extended, std::uint32_t id) {
  keep({.id = id,
        .extended = extended,
        .length = static_cast<std::uint8_t>(extended ? 8 : 0),
        .data = {static_cast<std::uint8_t>(n), 1, 2, 3, 4, 5, 6, static_cast<std::uint8_t>(0xC0u | (n & 31u))}});
}

}  // namespace

extern "C" {

void cost_begin() {
  Parameters p;
  p.node_id = 42;
  p.esc_index = 0;
  telemetry.bus_V = 16.0f;
  telemetry.temperature_K = 313.0f;
  node = new (storage.data()) EscNode(p, NodeIdentity{});
  node->poll(now_us, telemetry);
  now_us += 250;
  node->poll(now_us, telemetry);
  while (node->next_frame()) {
  }
}

// The n-th transfer of a kind; returns its frames.
std::uint32_t cost_make(std::uint32_t kind, std::uint32_t n) {
  using protocols::TransferKind;
  frame_count = 0;
  const auto number = static_cast<std::uint8_t>(n), elsewhere = static_cast<std::uint8_t>(50 + n % 60);
  switch (kind) {
    case rpm_command: {
      protocols::RpmCommand c;
      c.count = 4;
      for (std::size_t i = 0; i < 4; ++i) c.rpm[i] = 8000 + static_cast<std::int32_t>(n);
      make(c, TransferKind::message, 7, 10, number);
      break;
    }
    case raw_command: {
      protocols::RawCommand c;
      c.count = 4;
      for (std::size_t i = 0; i < 4; ++i) c.command[i] = 4000;
      make(c, TransferKind::message, 7, 10, number);
      break;
    }
    case fast_setpoint: {
      protocols::fast::Setpoint s{.sequence = static_cast<std::uint8_t>(n & 15u)};
      for (int i = 0; i < 4; ++i) s.set(i, 800.0f);
      keep(encode(s));
      break;
    }
    case foreign_standard:
      make_foreign(n, false, 0x300u + n % 64u);
      break;
    case foreign_message:
      make_foreign(n, true, 16u << 24 | 20000u << 8 | elsewhere);
      break;
    case foreign_request:
      make_foreign(n, true, 16u << 24 | 11u << 16 | 0x8000u | 99u << 8 | 0x80u | elsewhere);
      break;
    case begun_transfer:
      make_foreign(n, true, 16u << 24 | 1034u << 8 | elsewhere);
      frames[0].data[7] = static_cast<std::uint8_t>(0x80u | (n & 31u));
      break;
    case esc_status: {
      protocols::EscStatus s;
      s.esc_index = 3;
      make(s, TransferKind::message, 16, elsewhere, number);
      break;
    }
    case get_by_index:
      make(protocols::ParamGetSet{.index = static_cast<std::uint16_t>(n % 40u), .value = {}, .name = {}}, TransferKind::request, 24,
           elsewhere, number);
      break;
    case get_by_last_name:
      make(protocols::ParamGetSet{.index = 0, .value = {}, .name = "stat_fault_4"}, TransferKind::request, 24, elsewhere, number);
      break;
    case node_info:
      make(protocols::GetNodeInfo{}, TransferKind::request, 24, elsewhere, number);
      break;
    case wrong_restart:
      make(protocols::RestartNode{.magic = 1}, TransferKind::request, 24, elsewhere, number);
      break;
    case beep:
      make(protocols::BeepCommand{.frequency_Hz = 1000.0f, .duration_s = 1.0f}, TransferKind::message, 16, elsewhere, number);
      break;
    case allocation:
      make(protocols::Allocation{}, TransferKind::message, 16, elsewhere, number);
      break;
    default:
      make_foreign(n, true, 16u << 24 | 341u << 8 | 42u);
      break;
  }
  return frame_count;
}

std::uint32_t cost_frame_length(std::uint32_t i) { return frames[i].length | (frames[i].extended ? 0x100u : 0u); }
void cost_on_frame(std::uint32_t i) { node->on_frame(frames[i], now_us); }
void cost_poll() {
  now_us += 250;
  node->poll(now_us, telemetry);
}
// What the bus takes meanwhile; false: nothing waits.
bool cost_send() { return node->next_frame().has_value(); }
void cost_arm() {
  frame_count = 0;
  make(protocols::ArmingStatus{.status = protocols::ArmingStatus::kFullyArmed}, protocols::TransferKind::message, 7, 10, 0);
  node->on_frame(frames[0], now_us);
}

}  // extern "C"

}  // namespace rotorloop::firmware
