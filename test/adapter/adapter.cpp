#include "test/adapter/adapter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <utility>
#include <vector>

#include "protocols/receiver.hpp"
#include "protocols/transfer.hpp"
#include "protocols/types/registry.hpp"
#include "test/adapter/json_fields.hpp"

namespace rotorloop {
namespace {

using protocols::FrameId;
using protocols::Framing;
using protocols::Subscription;
using protocols::Transfer;
using protocols::TransferKind;

// What the adapter has to know of a type, in a table by which it is found.
struct AdapterType {
  const char* name;
  TransferKind kind;
  protocols::DataType type;
  std::vector<std::uint8_t> (*to_payload)(const Json& fields, Framing);
  bool (*to_fields)(std::span<const std::uint8_t>, Framing, Json&);
};

template <class T>
AdapterType row(TransferKind kind) {
  return {T::kName, kind, T::kType,
          [](const Json& fields, Framing framing) {
            T value{};
            JsonToFields reader(fields, "fields");
            T::describe(reader, value);
            reader.finish();
            std::vector<std::uint8_t> payload(protocols::max_bytes<T>());
            payload.resize(encode(value, payload, framing));
            return payload;
          },
          [](std::span<const std::uint8_t> payload, Framing framing, Json& fields) {
            T value{};
            if (!decode(payload, value, framing)) return false;
            FieldsToJson writer(fields);
            T::describe(writer, std::as_const(value));
            return true;
          }};
}

const std::vector<AdapterType>& types() {
  static const std::vector<AdapterType> table = [] {
    std::vector<AdapterType> all;
    protocols::for_each_message([&]<class T>() { all.push_back(row<T>(TransferKind::message)); });
    protocols::for_each_service([&]<class Request, class Response>() {
      all.push_back(row<Request>(TransferKind::request));
      all.push_back(row<Response>(TransferKind::response));
    });
    return all;
  }();
  return table;
}

// A number of the request, or `fallback` where it is absent or null.
std::int64_t number(const Json& in, const char* key, std::int64_t fallback, std::int64_t min, std::int64_t max,
                    const std::string& at = "") {
  const auto it = in.find(key);
  if (it == in.end() || it->is_null()) return fallback;
  const bool fits = it->is_number_integer() && (!it->is_number_unsigned() || it->get<std::uint64_t>() <= static_cast<std::uint64_t>(max));
  if (!fits || it->get<std::int64_t>() < min || it->get<std::int64_t>() > max) {
    throw BadRequest(at + key + " is " + it->dump().substr(0, 40) + ": an integer from " + std::to_string(min) + " to " +
                     std::to_string(max) + " is expected");
  }
  return it->get<std::int64_t>();
}

bool flag(const Json& in, const char* key, bool fallback, const std::string& at = "") {
  const auto it = in.find(key);
  if (it == in.end() || it->is_null()) return fallback;
  if (!it->is_boolean()) throw BadRequest(at + key + ": true or false is expected");
  return it->get<bool>();
}

std::string text(const Json& in, const char* key, const std::string& at = "") {
  const auto it = in.find(key);
  if (it == in.end() || !it->is_string()) throw BadRequest(at + key + ": a text is expected");
  return it->get<std::string>();
}

Json encode_request(const Json& in) {
  const std::string kind_name = text(in, "kind"), type_name = text(in, "type");
  const bool anonymous = kind_name == "anonymous", service = kind_name == "request" || kind_name == "response";
  if (!service && !anonymous && kind_name != "message")
    throw BadRequest("kind is \"" + kind_name + "\": message, anonymous, request or response is expected");
  const TransferKind kind = kind_name == "request"    ? TransferKind::request
                            : kind_name == "response" ? TransferKind::response
                                                      : TransferKind::message;
  const auto type =
      std::find_if(types().begin(), types().end(), [&](const AdapterType& t) { return type_name == t.name && t.kind == kind; });
  if (type == types().end()) {
    const bool other = std::any_of(types().begin(), types().end(), [&](const AdapterType& t) { return type_name == t.name; });
    if (other) throw BadRequest(type_name + " is no " + (service ? "service" : "message"));
    return Json{{"skip", "the data type " + type_name + " is not known here"}};
  }
  FrameId id{.kind = kind};
  id.priority = static_cast<std::uint8_t>(number(in, "priority", 16, 0, 31));
  id.data_type_id = static_cast<std::uint16_t>(number(in, "dtid", type->type.id, 0, service ? 255 : anonymous ? 3 : 65535));
  if (anonymous && id.data_type_id > 3) throw BadRequest(type_name + ": only types 0 to 3 can be sent anonymously");
  id.source = static_cast<std::uint8_t>(number(in, "source", 0, anonymous ? 0 : 1, anonymous ? 0 : 127));
  if (!anonymous && id.source == 0) throw BadRequest("source: a node id from 1 to 127 is expected");
  id.destination = static_cast<std::uint8_t>(number(in, "dest", 0, service ? 1 : 0, service ? 127 : 0));
  if (service && id.destination == 0) throw BadRequest("dest: a service goes to a node from 1 to 127");
  const auto transfer_id = static_cast<std::uint8_t>(number(in, "transfer_id", 0, 0, 31));
  const Framing framing = flag(in, "canfd", false) ? Framing::fd : Framing::classic;
  static const Json kEmpty = Json::object();
  const std::vector<std::uint8_t> payload = type->to_payload(in.contains("fields") ? in["fields"] : kEmpty, framing);
  const std::uint16_t seed = type->type.crc_seed();
  if (anonymous && payload.size() > (framing == Framing::fd ? 63u : 7u))
    throw BadRequest("an anonymous transfer is one frame; this payload has " + std::to_string(payload.size()) + " bytes");
  id.discriminator = static_cast<std::uint16_t>(number(in, "discriminator", protocols::crc16(seed, payload) & 0x3FFF, 0, 0x3FFF));
  Json frames = Json::array();
  const auto sink = [&](const auto& f) {
    std::array<char, 9> digits{};
    std::snprintf(digits.data(), digits.size(), "%08x", f.id);
    frames.push_back(Json{{"id", digits.data()}, {"data", to_hex(std::span<const std::uint8_t>(f.data.data(), f.length))}});
    return true;
  };
  if (framing == Framing::fd) {
    encode_transfer_fd(id, seed, transfer_id, payload, sink);
  } else {
    encode_transfer(id, seed, transfer_id, payload, sink);
  }
  return Json{{"frames", frames}};
}

std::uint32_t frame_id(const Json& event, bool extended, const std::string& at) {
  const std::uint32_t most = extended ? 0x1FFFFFFFu : 0x7FFu;
  const auto it = event.find("id");
  if (it != event.end() && it->is_number()) return static_cast<std::uint32_t>(number(event, "id", 0, 0, most, at));
  const std::string digits = text(event, "id", at);
  if (digits.empty() || digits.size() > 8 || digits.find_first_not_of("0123456789abcdefABCDEF") != std::string::npos) {
    throw BadRequest(at + "id is \"" + digits.substr(0, 40) + "\": up to 8 hexadecimal digits are expected");
  }
  const unsigned long id = std::stoul(digits, nullptr, 16);
  if (id > most) throw BadRequest(at + "id " + digits + " has more than " + (extended ? "29" : "11") + " bits");
  return static_cast<std::uint32_t>(id);
}

std::uint64_t event_time_us(const Json& event, const std::string& at) {
  const auto it = event.find("t");
  if (it == event.end()) return 0;
  if (!it->is_number()) throw BadRequest(at + "t: a time in seconds is expected");
  const double t = it->get<double>();
  if (!(t >= 0.0 && t <= 1e9)) throw BadRequest(at + "t is " + it->dump() + " s: 0 to 1e9 is expected");
  return static_cast<std::uint64_t>(std::llround(t * 1e6));
}

// Many more senders at once than a vector has: no session is ever given up for another.
using AdapterReceiver = protocols::Receiver<2048, 512>;

class Decoding {
 public:
  explicit Decoding(std::uint8_t local_node) : receiver_(std::make_unique<AdapterReceiver>(local_node, subscriptions())) {}

  void event(const Json& e, const std::string& at) {
    if (!e.is_object()) throw BadRequest(at + "an object is expected");
    const bool extended = flag(e, "extended", true, at), fd = flag(e, "canfd", false, at);
    const std::uint32_t id = frame_id(e, extended, at);
    const std::vector<std::uint8_t> data = from_hex(text(e, "data", at), at + "data");
    const std::size_t most = fd ? 64 : 8;
    if (data.size() > most || (fd && fd_length(static_cast<std::uint32_t>(data.size())) != data.size())) {
      throw BadRequest(at + "data: no " + (fd ? "CAN FD" : "classic CAN") + " frame has " + std::to_string(data.size()) + " bytes");
    }
    const std::uint64_t now_us = event_time_us(e, at);
    fd ? accept<CanFdFrame>(id, extended, data, now_us) : accept<CanFrame>(id, extended, data, now_us);
  }

  Json answer() {
    Json out{{"transfers", transfers_}};
    if (!rejected_.empty()) out["rejected"] = rejected_;
    return out;
  }

 private:
  static const std::vector<Subscription>& subscriptions() {
    static const std::vector<Subscription> all = [] {
      std::vector<Subscription> s;
      for (const AdapterType& t : types()) {
        s.push_back(!t.type.service && t.type.id <= 3 ? protocols::subscribe_anonymous(t.type) : protocols::subscribe(t.kind, t.type));
      }
      return s;
    }();
    return all;
  }

  template <class Frame>
  void accept(std::uint32_t id, bool extended, std::span<const std::uint8_t> data, std::uint64_t now_us) {
    Frame f;
    f.id = id;
    f.extended = extended;
    f.length = static_cast<std::uint8_t>(data.size());
    std::copy(data.begin(), data.end(), f.data.begin());
    if (const auto t = receiver_->accept(f, now_us)) deliver(*t);
  }

  void deliver(const Transfer& t) {
    const auto type = std::find_if(types().begin(), types().end(),
                                   [&](const AdapterType& row) { return row.kind == t.id.kind && row.type.id == t.id.data_type_id; });
    const char* kind = t.id.kind == TransferKind::request    ? "request"
                       : t.id.kind == TransferKind::response ? "response"
                       : t.id.source == protocols::kNoNode   ? "anonymous"
                                                             : "message";
    Json out{{"type", type->name}, {"kind", kind}, {"source", t.id.source}, {"transfer_id", t.transfer_id}, {"payload", to_hex(t.payload)}};
    Json fields;
    if (type->to_fields(t.payload, t.framing, fields)) {
      out["fields"] = std::move(fields);
      transfers_.push_back(std::move(out));
    } else {
      out["reason"] = "the payload is too short for the fields of this type, or an array longer than it can be";
      rejected_.push_back(std::move(out));
    }
  }

  std::unique_ptr<AdapterReceiver> receiver_;
  Json transfers_ = Json::array(), rejected_ = Json::array();
};

Json decode_request(const Json& in) {
  Decoding decoding(static_cast<std::uint8_t>(number(in, "local_node", 0, 0, 127)));
  const auto events = in.find("events");
  if (events == in.end() || !events->is_array()) throw BadRequest("events: an array is expected");
  for (std::size_t k = 0; k < events->size(); ++k) decoding.event((*events)[k], "events[" + std::to_string(k) + "].");
  return decoding.answer();
}

Json answer(const std::string& line) {
  const Json in = Json::parse(line);
  if (!in.is_object()) throw BadRequest("a JSON object is expected");
  const std::string op = text(in, "op");
  if (op == "encode") return encode_request(in);
  if (op == "decode") return decode_request(in);
  throw BadRequest("op is \"" + op + "\": encode or decode is expected");
}

}  // namespace

std::string adapter_answer(const std::string& line) noexcept {
  // What a hostile line has in it may be no UTF-8; the answer is.
  const auto dump = [](const Json& j) { return j.dump(-1, ' ', false, Json::error_handler_t::replace); };
  try {
    return dump(answer(line));
  } catch (const std::exception& e) {
    try {
      return dump(Json{{"error", e.what()}});
    } catch (...) {
      return R"({"error":"out of memory"})";
    }
  }
}

}  // namespace rotorloop
