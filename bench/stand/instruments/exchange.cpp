#include "bench/stand/instruments/exchange.hpp"

#include <algorithm>

namespace rotorloop::modbus {
namespace {

constexpr std::size_t kShortestRtuAnswer = 5;  // slave, function, code, CRC: an exception

}  // namespace

std::int64_t frame_gap_ns(int baud, std::int64_t character_ns) { return baud > 19200 ? 1'750'000 : (7 * character_ns + 1) / 2; }

void Exchanger::watch(std::int64_t first_ns, std::function<std::int64_t(std::int64_t)> watcher) {
  watch_at_ns_ = first_ns;
  watcher_ = std::move(watcher);
}

int Exchanger::receive(std::span<std::uint8_t> into, std::int64_t deadline_ns) {
  for (;;) {
    const int n = link_.receive(into, watcher_ ? std::min(deadline_ns, watch_at_ns_) : deadline_ns);
    const std::int64_t now = link_.now_ns();
    if (n > 0) last_byte_ns_ = now;
    if (watcher_ && now >= watch_at_ns_) watch_at_ns_ = watcher_(now);
    if (n != 0 || now >= deadline_ns) return n;
  }
}

void Exchanger::wait_until(std::int64_t time_ns) {
  std::array<std::uint8_t, 256> junk{};
  while (link_.now_ns() < time_ns) {
    const int n = receive(junk, time_ns);
    if (n < 0) break;
    stray_bytes_ += static_cast<std::uint64_t>(n);
  }
}

// The line must have been quiet for the gap; bytes that nobody asked for begin it anew, for at most ten frames.
void Exchanger::wait_for_gap(std::int64_t gap_ns) {
  std::array<std::uint8_t, 256> junk{};
  for (std::size_t heard = 0; heard < 10 * kMaxRtuFrame;) {
    const int n = receive(junk, last_byte_ns_ + gap_ns);
    if (n <= 0) return;
    stray_bytes_ += static_cast<std::uint64_t>(n);
    heard += static_cast<std::size_t>(n);
  }
}

Failure Exchanger::collect(std::size_t wanted, const ExchangeTiming& timing, std::int64_t first_deadline_ns) {
  while (got_ < wanted) {
    const std::int64_t deadline = got_ == 0 ? first_deadline_ns : last_byte_ns_ + timing.byte_timeout_ns;
    const int n = receive(std::span(buffer_).subspan(got_, wanted - got_), deadline);
    if (n < 0) return Failure::disconnected;
    if (n == 0) return got_ == 0 ? Failure::timeout : Failure::incomplete;
    got_ += static_cast<std::size_t>(n);
  }
  return Failure::none;
}

void Exchanger::drop(std::size_t bytes) {
  std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(bytes), buffer_.begin() + static_cast<std::ptrdiff_t>(got_), buffer_.begin());
  got_ -= bytes;
}

// Drivers of a two-wire line make a byte of zeros or ones when they take it or leave it; neither is the address of a device.
Failure Exchanger::pass_over_line_bytes(const ExchangeTiming& timing, std::int64_t deadline_ns) {
  constexpr int kMostBytes = 4;
  for (int i = 0; i < kMostBytes; ++i) {
    if (const Failure f = collect(1, timing, deadline_ns); f != Failure::none) return f;
    if (buffer_[0] != 0x00 && buffer_[0] != 0xFF) break;
    drop(1);
    ++stray_bytes_;
  }
  return Failure::none;
}

Failure Exchanger::pass_over(const Request& request, std::span<const std::uint8_t> sent, const ExchangeTiming& timing,
                             std::int64_t deadline_ns) {
  if (const Failure f = pass_over_line_bytes(timing, deadline_ns); f != Failure::none) return f;
  // An answer may begin as its request does (that to function 6 is the same): it is the echo where no answer of its length has a right CRC,
  // or where this line is known to echo.
  const std::size_t answer = request.reply_pdu_bytes() + 3, shorter = std::min({answer, sent.size(), kShortestRtuAnswer});
  if (const Failure f = collect(shorter, timing, deadline_ns); f != Failure::none) return f;
  if (!std::equal(sent.begin(), sent.begin() + static_cast<std::ptrdiff_t>(shorter), buffer_.begin())) return Failure::none;
  if (answer <= sent.size()) {
    if (const Failure f = collect(answer, timing, deadline_ns); f != Failure::none) return f;
    if (!hears_itself_ && rtu_pdu(std::span(buffer_).first(answer), request.slave)) return Failure::none;
  }
  if (const Failure f = collect(sent.size(), timing, deadline_ns); f != Failure::none) return f;
  if (!std::equal(sent.begin(), sent.end(), buffer_.begin())) return Failure::none;
  hears_itself_ = true;
  drop(sent.size());
  return pass_over_line_bytes(timing, deadline_ns);
}

Reply Exchanger::receive_rtu(const Request& request, std::span<const std::uint8_t> sent, const ExchangeTiming& timing,
                             std::int64_t request_end_ns) {
  const std::int64_t deadline = request_end_ns + timing.timeout_ns + timing.character_ns;  // its first byte takes a character to come in
  if (const Failure f = pass_over(request, sent, timing, deadline); f != Failure::none) return {f, 0, {}};
  if (const Failure f = collect(kShortestRtuAnswer, timing, deadline); f != Failure::none) return {f, 0, {}};
  const bool exception = buffer_[1] == (static_cast<std::uint8_t>(request.fc) | 0x80u);
  const std::size_t length = exception ? kShortestRtuAnswer : request.reply_pdu_bytes() + 3;
  if (buffer_[0] != request.slave) return {Failure::malformed, 0, {}};
  if (const Failure f = collect(length, timing, deadline); f != Failure::none) return {f, 0, {}};
  const auto pdu = rtu_pdu(std::span(buffer_).first(length), request.slave);
  return pdu ? read_reply(request, *pdu) : Reply{Failure::crc, 0, {}};
}

Reply Exchanger::receive_tcp(const Request& request, const ExchangeTiming& timing, std::int64_t request_end_ns) {
  for (;;) {  // answers with another number are late ones: passed over
    got_ = 0;
    if (const Failure f = collect(kMbapBytes, timing, request_end_ns + timing.timeout_ns); f != Failure::none) return {f, 0, {}};
    const unsigned number = (unsigned{buffer_[0]} << 8) | buffer_[1], protocol = (unsigned{buffer_[2]} << 8) | buffer_[3];
    const std::size_t length = (std::size_t{buffer_[4]} << 8) | buffer_[5];
    if (protocol != 0 || length < 2 || length > kMaxTcpFrame - 6) return {Failure::malformed, 0, {}};
    if (const Failure f = collect(kMbapBytes - 1 + length, timing, request_end_ns + timing.timeout_ns); f != Failure::none)
      return {f, 0, {}};
    if (number != transaction_) {
      stray_bytes_ += got_;
      continue;
    }
    if (buffer_[6] != request.slave) return {Failure::malformed, 0, {}};
    return read_reply(request, std::span(buffer_).subspan(kMbapBytes, length - 1));
  }
}

// After a failure: silent until an answer that began as late as it may has passed too, and whatever came is forgotten.
void Exchanger::settle(const ExchangeTiming& timing, std::int64_t request_end_ns) {
  if (framing_ == Framing::rtu) {
    wait_until(request_end_ns + timing.late_max_ns + timing.gap_ns);
    wait_for_gap(timing.gap_ns);
  } else {
    std::array<std::uint8_t, 256> junk{};
    for (int i = 0; i < 64; ++i) {
      const int n = receive(junk, 0);
      if (n <= 0) break;
      stray_bytes_ += static_cast<std::uint64_t>(n);
    }
  }
}

Exchanged Exchanger::exchange(const Request& request, const ExchangeTiming& timing) {
  Exchanged x;
  if (framing_ == Framing::rtu) wait_for_gap(timing.gap_ns);
  const auto pdu = request_pdu(request);
  const auto frame = framing_ == Framing::rtu ? rtu_frame(request.slave, pdu) : tcp_frame(++transaction_, request.slave, pdu);
  got_ = 0;
  x.begin_ns = link_.now_ns();
  const bool sent = link_.send(frame);
  const std::int64_t request_end_ns = link_.now_ns() + static_cast<std::int64_t>(frame.size()) * timing.character_ns;
  if (!sent) {
    x.reply.failure = Failure::disconnected;
    wait_until(request_end_ns + timing.timeout_ns);  // as long as an answer would have been awaited: no busy loop
  } else {
    x.reply = framing_ == Framing::rtu ? receive_rtu(request, frame, timing, request_end_ns) : receive_tcp(request, timing, request_end_ns);
  }
  x.end_ns = link_.now_ns();
  if (x.reply.failure != Failure::none && sent) settle(timing, request_end_ns);
  return x;
}

}  // namespace rotorloop::modbus
