#include "host/tools/transfer_listener.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/tools/type_json.hpp"
#include "protocols/fast_channel.hpp"
#include "protocols/types/registry.hpp"

namespace rotorloop::tools {

std::string detail::bytes_text(const std::uint8_t* bytes, std::size_t count) {
  const bool text = std::all_of(bytes, bytes + count, [](std::uint8_t b) { return b >= 0x20 && b < 0x7F; });
  if (text) return {bytes, bytes + count};
  std::string hex = "0x";
  for (std::size_t i = 0; i < count; ++i) hex += fmt::format("{:02x}", bytes[i]);
  return hex;
}

namespace {

using Json = nlohmann::ordered_json;
using protocols::TransferKind;

struct KnownType {
  std::uint16_t crc_seed = 0;
  Json (*fields)(std::span<const std::uint8_t>, protocols::Framing) = nullptr;
};

template <class T>
Json fields_of(std::span<const std::uint8_t> payload, protocols::Framing framing) {
  T value;
  return decode(payload, value, framing) ? to_json(value) : Json();
}

const std::map<std::pair<TransferKind, std::uint16_t>, KnownType>& known_types() {
  static const auto types = [] {
    std::map<std::pair<TransferKind, std::uint16_t>, KnownType> known;
    protocols::for_each_message([&]<class T>() { known[{TransferKind::message, T::kType.id}] = {T::kType.crc_seed(), fields_of<T>}; });
    protocols::for_each_service([&]<class Request, class Response>() {
      known[{TransferKind::request, Request::kType.id}] = {Request::kType.crc_seed(), fields_of<Request>};
      known[{TransferKind::response, Request::kType.id}] = {Request::kType.crc_seed(), fields_of<Response>};
    });
    return known;
  }();
  return types;
}

void flatten(const Json& j, const std::string& name, std::string& text) {
  if (j.is_object()) {
    for (const auto& [key, value] : j.items()) flatten(value, name.empty() ? key : name + "." + key, text);
    return;
  }
  if (!text.empty()) text += ' ';
  text += name + "=" + (j.is_number_float() ? fmt::format("{:.6g}", j.get<double>()) : j.dump());
}

}  // namespace

std::optional<HeardTransfer> TransferListener::accept(const StampedBusFrame& f) {
  if (!f.frame.extended || f.frame.length == 0) return std::nullopt;
  constexpr std::uint32_t kWithoutPriority = 0x00FFFFFF;
  const protocols::Tail tail = protocols::decode_tail(f.frame.data[f.frame.length - 1u]);
  Session& s = sessions_[{f.frame.id & kWithoutPriority, f.frame.fd}];
  if (tail.start) {
    s = {.payload = {}, .transfer_id = tail.transfer_id, .toggle = false, .open = true};
  } else if (!s.open || tail.transfer_id != s.transfer_id || tail.toggle != s.toggle) {
    ++broken_;
    s.open = false;
    return std::nullopt;
  }
  s.toggle = !s.toggle;
  s.payload.insert(s.payload.end(), f.frame.data.begin(), f.frame.data.begin() + f.frame.length - 1);
  constexpr std::size_t kLongestPayload = 1024;  // of any type, with its CRC
  if (s.payload.size() > kLongestPayload) s.open = false;
  if (!tail.end || !s.open) return std::nullopt;
  s.open = false;

  HeardTransfer t;
  t.time_ns = f.time_ns;
  t.id = protocols::decode_id(f.frame.id);
  t.transfer_id = tail.transfer_id;
  t.fd = f.frame.fd;
  t.payload = s.payload;
  const auto known = known_types().find({t.id.kind, t.id.data_type_id});
  if (!tail.start) {
    const std::uint16_t sent = static_cast<std::uint16_t>(t.payload[0] | t.payload[1] << 8);
    t.payload.erase(t.payload.begin(), t.payload.begin() + 2);
    if (known != known_types().end()) t.wrong_crc = protocols::crc16(known->second.crc_seed, t.payload) != sent;
  }
  if (known != known_types().end() && !t.wrong_crc)
    t.fields = known->second.fields(t.payload, f.frame.fd ? protocols::Framing::fd : protocols::Framing::classic);
  return t;
}

Json decode_fast(const BusFrame& frame) {
  namespace fast = protocols::fast;
  const auto classic = frame.classic();
  if (!classic || classic->extended) return {};
  if (const auto s = fast::is_setpoint_id(*classic) ? fast::decode_setpoint(*classic) : std::nullopt) {
    constexpr const char* kModes[] = {"speed_rad_s", "duty", "current_A"};
    Json values = Json::array();
    for (int i = 0; i < fast::kEscsPerGroup; ++i) {
      if (s->raw[static_cast<std::size_t>(i)] == fast::kNoOrder) {
        values.push_back(nullptr);
      } else {
        values.push_back(s->get(i));
      }
    }
    return {{kModes[static_cast<std::size_t>(s->mode) % 3], values}, {"sequence", s->sequence}};
  }
  if (const auto b = fast::is_feedback_id(*classic) ? fast::decode_feedback(*classic) : std::nullopt) {
    Json j{{"esc_index", b->esc_index}};
    j["speed_rad_s"] = b->speed_valid() ? Json(b->speed_rad_s()) : Json(nullptr);
    j["current_A"] = b->current_A();
    j["sequence"] = b->sequence;
    return j;
  }
  return {};
}

std::string fields_text(const Json& fields) {
  std::string text;
  flatten(fields, "", text);
  return text;
}

}  // namespace rotorloop::tools
