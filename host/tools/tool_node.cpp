#include "host/tools/tool_node.hpp"

#include <algorithm>

namespace rotorloop::tools {

using protocols::TransferKind;

namespace {

constexpr std::uint8_t kToolStatusPriority = 24, kToolRequestPriority = 24;
constexpr std::int64_t kToolStatusPeriod_ns = 1'000'000'000;
constexpr std::int64_t kLongestNap_ns = 20'000'000;   // between two looks at what is due when no frame comes
constexpr std::int64_t kNewcomer_ns = 3'000'000'000;  // for so long after its start a tool gives way: all others were heard by then
constexpr std::size_t kTogether = 5;                  // requests to one node at a time, as the GUI tool has it

}  // namespace

ToolNode::ToolNode(TimedBus& bus, ToolNodeConfig config)
    : bus_(bus), config_(std::move(config)), begun_ns_(bus.now_ns()), next_status_ns_(begun_ns_) {
  on<protocols::NodeStatus>([this](const protocols::NodeStatus& s, std::uint8_t source) { on_status(s, source); });
  serve<protocols::GetNodeInfo, protocols::GetNodeInfoResponse>([this](const protocols::GetNodeInfo&, std::uint8_t) {
    protocols::GetNodeInfoResponse r;
    r.status.uptime_s = static_cast<std::uint32_t>((now_ns() - begun_ns_) / 1'000'000'000);
    r.software_minor = 1;
    r.unique_id = config_.unique_id;
    r.set_name(config_.name.c_str());
    return std::optional(r);
  });
}

ToolNode::~ToolNode() = default;

void ToolNode::subscribe(TransferKind kind, const protocols::DataType& type, Handler handler, bool anonymous) {
  auto& place = handlers_[{kind, type.id}];
  if (!place) {
    subscriptions_.push_back(anonymous ? protocols::subscribe_anonymous(type) : protocols::subscribe(kind, type));
    receiver_ = std::make_unique<Receiver>(config_.node_id, subscriptions_);
    place = std::move(handler);
    return;
  }
  place = [before = std::move(place), more = std::move(handler)](const protocols::Transfer& t) {
    before(t);
    more(t);
  };
}

void ToolNode::listen_for_responses(const protocols::DataType& type) {
  if (handlers_.contains({TransferKind::response, type.id})) return;
  subscribe(TransferKind::response, type, [this](const protocols::Transfer& t) { on_response(t); });
}

void ToolNode::poll() {
  if (!receiver_) return;
  while (const auto received = bus_.receive_any()) {
    const BusFrame& f = received->frame;
    if (f.extended && (f.id & 127u) == config_.node_id) {
      on_own_id();
      continue;
    }
    const auto time_us = static_cast<std::uint64_t>(received->time_ns / 1000);
    std::optional<protocols::Transfer> t;
    if (const auto classic = f.classic()) {
      t = receiver_->accept(*classic, time_us);
    } else {
      CanFdFrame fd{.id = f.id, .extended = f.extended, .bit_rate_switch = f.bit_rate_switch, .length = f.length, .data = f.data};
      t = receiver_->accept(fd, time_us);
    }
    if (!t) continue;
    // A handler may subscribe, which makes a new receiver: what it was given stays its own.
    const std::vector<std::uint8_t> payload(t->payload.begin(), t->payload.end());
    protocols::Transfer kept = *t;
    kept.payload = payload;
    if (const auto handler = handlers_.find({kept.id.kind, kept.id.data_type_id}); handler != handlers_.end()) {
      const Handler call = handler->second;
      call(kept);
    }
  }
  send_status();
  repeat_requests();
}

bool ToolNode::run_until(std::int64_t deadline_ns, const std::function<bool()>& done) {
  while (true) {
    poll();
    if (done()) return true;
    if (stopped() || now_ns() >= deadline_ns) return false;
    bus_.wait_until(std::min(deadline_ns, now_ns() + kLongestNap_ns));
  }
}

// A bus never gives us our own frames: another node has our id.
void ToolNode::on_own_id() {
  while (now_ns() - begun_ns_ < kNewcomer_ns && !config_.spare_ids.empty()) {
    const std::uint8_t next = config_.spare_ids.front();
    config_.spare_ids.erase(config_.spare_ids.begin());
    if (nodes_.contains(next)) continue;
    config_.node_id = next;
    receiver_ = std::make_unique<Receiver>(config_.node_id, subscriptions_);
    return;
  }
  id_conflict_ = true;
}

void ToolNode::on_status(const protocols::NodeStatus& status, std::uint8_t source) {
  const auto [place, is_new] = nodes_.try_emplace(source);
  SeenNode& n = place->second;
  n.id = source;
  if (!is_new && status.uptime_s < n.status.uptime_s) {
    ++n.restarts;
    n.info.reset();  // perhaps with other software
  }
  n.status = status;
  n.heard_ns = now_ns();
  if (is_new || !n.info) {
    const bool asked = std::any_of(open_.begin(), open_.end(),
                                   [&](const Open& o) { return o.node == source && o.type.id == protocols::GetNodeInfo::kType.id; });
    if (!asked)
      request<protocols::GetNodeInfo, protocols::GetNodeInfoResponse>(source, {}, [this, source](const auto& r) {
        if (r) nodes_[source].info = *r;
      });
  }
}

void ToolNode::start_request(std::uint8_t node, const protocols::DataType& type, std::vector<std::uint8_t> payload, AskOptions options,
                             Done done) {
  open_.push_back({.node = node, .type = type, .payload = std::move(payload), .options = options, .done = std::move(done)});
  repeat_requests();
}

void ToolNode::attempt(Open& o) {
  ++o.attempts;
  o.due_ns = now_ns() + o.options.timeout_ns;
  // There are 32 numbers: one that another request still waits with would give its answer to this one.
  const auto taken = [&](std::uint8_t id) {
    return std::any_of(open_.begin(), open_.end(), [&](const Open& other) {
      return &other != &o && other.attempts > 0 && other.node == o.node && other.type.id == o.type.id && other.transfer_id == id;
    });
  };
  do {
    o.transfer_id = request_ids_[{o.type.id, o.node}].next();
  } while (taken(o.transfer_id));
  send({.kind = TransferKind::request,
        .priority = kToolRequestPriority,
        .data_type_id = o.type.id,
        .source = config_.node_id,
        .destination = o.node},
       o.type.crc_seed(), o.transfer_id, o.payload);
}

void ToolNode::repeat_requests() {
  std::map<std::uint8_t, std::size_t> under_way;
  std::vector<Done> given_up;
  for (auto o = open_.begin(); o != open_.end();) {
    if (o->attempts > 0 && now_ns() >= o->due_ns && o->attempts >= o->options.attempts) {
      given_up.push_back(std::move(o->done));
      o = open_.erase(o);
      continue;
    }
    if (o->attempts > 0 || under_way[o->node] < kTogether) {
      if (o->attempts == 0 || now_ns() >= o->due_ns) attempt(*o);
      ++under_way[o->node];
    }
    ++o;
  }
  for (const Done& done : given_up) done(nullptr);
}

void ToolNode::on_response(const protocols::Transfer& t) {
  const auto o = std::find_if(open_.begin(), open_.end(), [&](const Open& x) {
    return x.attempts > 0 && x.node == t.id.source && x.type.id == t.id.data_type_id && x.transfer_id == t.transfer_id;
  });
  if (o == open_.end()) return;  // late, or of a request that was repeated
  const Done done = std::move(o->done);
  open_.erase(o);
  done(&t);
}

void ToolNode::send_status() {
  if (now_ns() < next_status_ns_) return;
  next_status_ns_ = now_ns() + kToolStatusPeriod_ns;
  protocols::NodeStatus s;
  s.uptime_s = static_cast<std::uint32_t>((now_ns() - begun_ns_) / 1'000'000'000);
  broadcast(s, kToolStatusPriority);
}

bool ToolNode::send(const protocols::FrameId& id, std::uint16_t seed, std::uint8_t transfer_id, std::span<const std::uint8_t> payload) {
  return protocols::encode_transfer(id, seed, transfer_id, payload, [this](const CanFrame& f) {
    if (bus_.send(f) == SendStatus::queued) return true;
    ++not_sent_;
    return false;
  });
}

}  // namespace rotorloop::tools
