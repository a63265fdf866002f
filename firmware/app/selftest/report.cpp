#include "firmware/app/selftest/report.hpp"

#include <array>

#include "firmware/app/selftest/board.hpp"
#include "firmware/core/node/text_line.hpp"
#include "protocols/types/node.hpp"

namespace rotorloop::selftest {
namespace {

firmware::TextLine line_of(const Finding& f) {
  return firmware::TextLine("{\"check\":\"")
      .add(f.check)
      .add("\",\"ok\":")
      .add(f.ok() ? "true" : "false")
      .add(",\"value\":")
      .add(f.value)
      .add(",\"low\":")
      .add(f.low)
      .add(",\"high\":")
      .add(f.high)
      .add(",\"unit\":\"")
      .add(f.unit)
      .add("\"}");
}

}  // namespace

template <class Message>
void Report::broadcast(const Message& m, std::uint8_t priority, protocols::TransferIdCounter& ids) {
  std::array<std::uint8_t, protocols::max_bytes<Message>()> payload{};
  const std::size_t bytes = encode(m, payload);
  const protocols::FrameId id{
      .kind = protocols::TransferKind::message, .priority = priority, .data_type_id = Message::kType.id, .source = kNodeId};
  const std::uint64_t until = the_board.time_us() + kBus_us;
  encode_transfer(id, Message::kType.crc_seed(), ids.next(), std::span(payload).first(bytes), [&](const CanFrame& frame) {
    while (!the_board.can().ready() && the_board.time_us() < until) {
      g431::feed_iwdg();
      the_board.text().poll();
    }
    return the_board.can().send(frame);
  });
}

void Report::tell(const Finding& f) {
  failed_ += f.ok() ? 0 : 1;
  say(f);
}

void Report::tell_failed() { say({"failed", failed_, 0, 0, "checks"}); }

void Report::say(const Finding& f) {
  const firmware::TextLine line = line_of(f);
  for (const std::uint8_t c : line.text().view()) the_board.text().put(static_cast<char>(c));
  the_board.text().put("\r\n");
  const std::uint64_t until = the_board.time_us() + kLine_us;
  protocols::LogMessage m;
  m.level = f.ok() ? protocols::LogMessage::Level::info : protocols::LogMessage::Level::error;
  for (const char* c = "selftest"; *c != '\0'; ++c) m.source.push_back(static_cast<std::uint8_t>(*c));
  m.text = line.text();
  broadcast(m, 20, log_ids_);
  while (the_board.time_us() < until) {
    g431::feed_iwdg();
    the_board.text().poll();
  }
}

void Report::tell_status() {
  protocols::NodeStatus s;
  s.uptime_s = g431::tim2().cnt.read() / 1'000'000;
  s.health = failed_ == 0 ? protocols::Health::ok : protocols::Health::warning;
  s.mode = protocols::NodeMode::maintenance;
  s.vendor_status = static_cast<std::uint16_t>(failed_);
  broadcast(s, 16, status_ids_);
}

}  // namespace rotorloop::selftest
