#include "bench/stand/instruments/serial_hub.hpp"

#include <algorithm>

#include "bench/stand/instruments/exchange.hpp"

namespace rotorloop::modbus {
namespace {
constexpr std::uint64_t kHubModule = 4851;  // of the random stream
}

SerialHub::SerialHub(SerialFormat format, LineFaults faults)
    : format_(format),
      faults_(faults),
      character_ns_(format.character_ns()),
      silence_ns_(frame_gap_ns(format.baud, character_ns_)),
      random_(faults.seed, kHubModule) {}

void SerialHub::add(HubSlave slave) { stations_.push_back({std::move(slave), {}, {}, {}, 0, 0}); }

void SerialHub::push(std::int64_t time_ns, Event::Kind kind, int source, std::uint8_t value, std::uint64_t ticket) {
  events_queue_.push({time_ns, events_++, kind, source, value, ticket});
}

// Damage happens on the line: everyone who listens hears the same.
void SerialHub::put_on_line(std::span<const std::uint8_t> bytes, int source) {
  std::vector<std::uint8_t> damaged(bytes.begin(), bytes.end());
  ++counts_.frames;
  if (faults_.frame_flipped > 0.0 && uniform() < faults_.frame_flipped) {
    ++counts_.flipped;
    const auto flips = 1 + below(static_cast<std::uint64_t>(faults_.flips_max));
    for (std::uint64_t i = 0; i < flips; ++i) {
      const std::uint64_t bit = below(8 * damaged.size());
      damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1u << (bit % 8)));
    }
  }
  const std::int64_t end = now_ns_ + static_cast<std::int64_t>(bytes.size()) * character_ns_;
  on_line_.push_back({source, now_ns_, end});
  for (std::size_t i = 0; i < damaged.size(); ++i) {
    if (faults_.byte_lost > 0.0 && uniform() < faults_.byte_lost) {
      ++counts_.bytes_lost;
      continue;
    }
    push(now_ns_ + static_cast<std::int64_t>(i + 1) * character_ns_, Event::Kind::byte, source, damaged[i]);
  }
}

bool SerialHub::send(std::span<const std::uint8_t> bytes) {
  put_on_line(bytes, kMaster);
  return true;
}

int SerialHub::receive(std::span<std::uint8_t> into, std::int64_t deadline_ns) {
  while (inbox_.empty()) {
    if (events_queue_.empty() || events_queue_.top().time_ns > deadline_ns) {
      now_ns_ = std::max(now_ns_, deadline_ns);
      return 0;
    }
    const Event event = events_queue_.top();
    events_queue_.pop();
    now_ns_ = std::max(now_ns_, event.time_ns);
    handle(event);
  }
  std::size_t n = 0;
  for (; n < into.size() && !inbox_.empty(); ++n) {
    into[n] = inbox_.front();
    inbox_.pop_front();
  }
  return static_cast<int>(n);
}

void SerialHub::handle(const Event& event) {
  if (event.kind == Event::Kind::byte) return hear(event);
  const auto index = static_cast<std::size_t>(event.source);
  Station& s = stations_[index];
  if (event.kind == Event::Kind::silence) return end_of_frame(index, event);
  if (now_ns_ >= s.setup.dies_at_ns) return;
  if (event.kind == Event::Kind::sample) {
    const auto pdu = s.setup.slave->answer(s.request, now_ns_);
    s.reply = pdu.empty() ? std::vector<std::uint8_t>{} : rtu_frame(s.setup.id, pdu);
  } else if (!s.reply.empty()) {
    put_on_line(s.reply, event.source);
  }
}

void SerialHub::hear(const Event& event) {
  std::uint8_t value = event.value;
  while (!on_line_.empty() && on_line_.front().end_ns <= now_ns_ - character_ns_) on_line_.pop_front();
  for (const Transmission& t : on_line_)
    if (t.source != event.source && t.begin_ns < now_ns_ && t.end_ns > now_ns_ - character_ns_) {  // two drivers fight
      value = static_cast<std::uint8_t>(random_.bits(draws_++));
      ++counts_.collisions;
      break;
    }
  if (event.source != kMaster) inbox_.push_back(value);
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    if (static_cast<int>(i) == event.source) continue;
    Station& s = stations_[i];
    s.heard.push_back(value);
    s.last_ns = now_ns_;
    push(now_ns_ + silence_ns_, Event::Kind::silence, static_cast<int>(i), 0, ++s.bytes);
  }
}

// 3.5 characters of silence end a frame. What is no request to this slave is forgotten.
void SerialHub::end_of_frame(std::size_t index, const Event& event) {
  Station& s = stations_[index];
  if (event.ticket != s.bytes) return;  // more came
  const std::vector<std::uint8_t> frame = std::move(s.heard);
  s.heard.clear();
  if (now_ns_ >= s.setup.dies_at_ns || rtu_request_bytes(frame) != frame.size()) return;
  const auto pdu = rtu_pdu(frame, s.setup.id);
  if (!pdu) return;
  s.request.assign(pdu->begin(), pdu->end());
  std::int64_t after = std::max(s.setup.turnaround_ns, silence_ns_);
  if (s.setup.jitter_ns > 0) after += static_cast<std::int64_t>(uniform() * static_cast<double>(s.setup.jitter_ns));
  if (faults_.reply_late > 0.0 && uniform() < faults_.reply_late) {
    ++counts_.late;
    after = std::max(after, static_cast<std::int64_t>(uniform() * static_cast<double>(faults_.late_max_ns)));
  }
  const std::int64_t reply_at = s.last_ns + after;
  const auto sample_at =
      now_ns_ + static_cast<std::int64_t>(uniform() * static_cast<double>(reply_at - now_ns_));  // whenever it pleases the device
  push(sample_at, Event::Kind::sample, event.source);
  push(reply_at, Event::Kind::reply, event.source);
}

}  // namespace rotorloop::modbus
