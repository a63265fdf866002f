// A tool as a node of a DroneCAN bus: hears who is there, asks and is answered, answers others, broadcasts. On any TimedBus, so that the
// same tool works on hardware, beside a SITL, and against simulated nodes in virtual time. Not for control loops.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host/bus/timed_bus.hpp"
#include "protocols/dsdl.hpp"
#include "protocols/receiver.hpp"
#include "protocols/transfer.hpp"
#include "protocols/types.hpp"

namespace rotorloop::tools {

struct ToolNodeConfig {
  std::uint8_t node_id = 126;  // 126 and 127 are for tools; the GUI tool takes 127
  // What to take instead when another node is heard with that id, in this order. The one that came later gives way; empty: id_conflict().
  std::vector<std::uint8_t> spare_ids = {};
  std::string name = "org.rotorloop.tool";
  std::array<std::uint8_t, 16> unique_id{'r', 'o', 't', 'o', 'r', 'l', 'o', 'o', 'p', ' ', 't', 'o', 'o', 'l', 0, 0};
  std::function<bool()> stop = {};  // asked often; true ends every wait
};

struct SeenNode {
  std::uint8_t id = 0;
  protocols::NodeStatus status;
  std::int64_t heard_ns = 0;
  std::uint32_t restarts = 0;  // its uptime went back while we listened
  std::optional<protocols::GetNodeInfoResponse> info;
};

struct AskOptions {
  int attempts = 3;
  std::int64_t timeout_ns = 1'000'000'000;  // of each attempt: what a DroneCAN client waits
};

inline constexpr std::int64_t kToolOffline_ns = 3'000'000'000;  // DroneCAN: a node that is silent for longer is gone

class ToolNode {
 public:
  ToolNode(TimedBus& bus, ToolNodeConfig config = {});
  ~ToolNode();
  ToolNode(const ToolNode&) = delete;
  ToolNode& operator=(const ToolNode&) = delete;

  TimedBus& bus() { return bus_; }
  std::int64_t now_ns() const { return bus_.now_ns(); }
  bool stopped() const { return config_.stop && config_.stop(); }
  std::uint8_t node_id() const { return config_.node_id; }

  // Takes what arrived, answers, sends what is due (own NodeStatus, repeated requests).
  void poll();
  // Polls and waits until done() or the deadline; false at the deadline and when stopped.
  bool run_until(std::int64_t deadline_ns, const std::function<bool()>& done);
  bool run_for(std::int64_t duration_ns) {
    return run_until(now_ns() + duration_ns, [] { return false; });
  }

  const std::map<std::uint8_t, SeenNode>& nodes() const { return nodes_; }
  bool id_conflict() const { return id_conflict_; }  // another node sends with our id

  // Called for every message of this type, whoever sends it; before the first poll().
  template <class Message>
  void on(std::function<void(const Message&, std::uint8_t source)> handler) {
    subscribe(protocols::TransferKind::message, Message::kType, [handler = std::move(handler)](const protocols::Transfer& t) {
      Message m;
      if (decode(t.payload, m, t.framing)) handler(m, t.id.source);
    });
  }
  // The same for messages of nodes that have no id yet, and of those alone.
  template <class Message>
  void on_anonymous(std::function<void(const Message&)> handler) {
    subscribe(
        protocols::TransferKind::message, Message::kType,
        [handler = std::move(handler)](const protocols::Transfer& t) {
          Message m;
          if (t.id.source == protocols::kNoNode && decode(t.payload, m, t.framing)) handler(m);
        },
        true);
  }
  // Answers requests; none returned: no answer.
  template <class Request, class Response>
  void serve(std::function<std::optional<Response>(const Request&, std::uint8_t client)> handler) {
    subscribe(protocols::TransferKind::request, Request::kType, [this, handler = std::move(handler)](const protocols::Transfer& t) {
      Request request;
      if (!decode(t.payload, request, t.framing)) return;
      if (const auto response = handler(request, t.id.source)) respond(t, *response);
    });
  }
  template <class Message>
  bool broadcast(const Message& message, std::uint8_t priority) {
    std::vector<std::uint8_t> payload(protocols::max_bytes<Message>());
    payload.resize(encode(message, payload));
    return send(
        {.kind = protocols::TransferKind::message, .priority = priority, .data_type_id = Message::kType.id, .source = config_.node_id},
        Message::kType.crc_seed(), message_ids_[Message::kType.id].next(), payload);
  }

  // Sends a request and calls `done` with the response, or with none after the last attempt.
  template <class Request, class Response>
  void request(std::uint8_t node, const Request& request, std::function<void(const std::optional<Response>&)> done,
               AskOptions options = {}) {
    std::vector<std::uint8_t> payload(protocols::max_bytes<Request>());
    payload.resize(encode(request, payload));
    listen_for_responses(Request::kType);
    start_request(node, Request::kType, std::move(payload), options, [done = std::move(done)](const protocols::Transfer* t) {
      Response response;
      if (t != nullptr && decode(t->payload, response, t->framing)) {
        done(response);
      } else {
        done(std::nullopt);
      }
    });
  }
  // The same, waiting for the response.
  template <class Response, class Request>
  std::optional<Response> ask(std::uint8_t node, const Request& request, AskOptions options = {}) {
    auto result = std::make_shared<std::pair<bool, std::optional<Response>>>();
    this->request<Request, Response>(
        node, request,
        [result](const std::optional<Response>& r) {
          *result = {true, r};
        },
        options);
    run_until(now_ns() + options.attempts * options.timeout_ns + options.timeout_ns, [&] { return result->first; });
    return result->second;
  }
  std::size_t requests_open() const { return open_.size(); }

  std::uint64_t not_sent() const { return not_sent_; }  // frames that the bus did not take

 private:
  using Receiver = protocols::Receiver<192, 376>;  // sessions of everything that a busy bus sends; the longest payload, of GetNodeInfo
  using Handler = std::function<void(const protocols::Transfer&)>;
  using Done = std::function<void(const protocols::Transfer*)>;
  struct Open {
    std::uint8_t node;
    protocols::DataType type;
    std::vector<std::uint8_t> payload;
    AskOptions options;
    Done done;
    int attempts = 0;
    std::uint8_t transfer_id = 0;
    std::int64_t due_ns = 0;
  };

  void subscribe(protocols::TransferKind kind, const protocols::DataType& type, Handler handler, bool anonymous = false);
  void listen_for_responses(const protocols::DataType& type);
  void start_request(std::uint8_t node, const protocols::DataType& type, std::vector<std::uint8_t> payload, AskOptions options, Done done);
  void attempt(Open& open);
  void on_response(const protocols::Transfer& t);
  void on_status(const protocols::NodeStatus& status, std::uint8_t source);
  void on_own_id();
  void repeat_requests();
  void send_status();
  bool send(const protocols::FrameId& id, std::uint16_t seed, std::uint8_t transfer_id, std::span<const std::uint8_t> payload);
  template <class Response>
  void respond(const protocols::Transfer& t, const Response& response) {
    std::vector<std::uint8_t> payload(protocols::max_bytes<Response>());
    payload.resize(encode(response, payload));
    send({.kind = protocols::TransferKind::response,
          .priority = t.id.priority,
          .data_type_id = Response::kType.id,
          .source = config_.node_id,
          .destination = t.id.source},
         Response::kType.crc_seed(), t.transfer_id, payload);
  }

  TimedBus& bus_;
  ToolNodeConfig config_;
  std::int64_t begun_ns_, next_status_ns_;
  std::vector<protocols::Subscription> subscriptions_;
  std::unique_ptr<Receiver> receiver_;
  std::map<std::pair<protocols::TransferKind, std::uint16_t>, Handler> handlers_;
  std::map<std::uint16_t, protocols::TransferIdCounter> message_ids_;
  std::map<std::pair<std::uint16_t, std::uint8_t>, protocols::TransferIdCounter> request_ids_;  // (service, node)
  std::vector<Open> open_;
  std::map<std::uint8_t, SeenNode> nodes_;
  std::uint64_t not_sent_ = 0;
  bool id_conflict_ = false;
};

}  // namespace rotorloop::tools
