// One request and its answer. An answer is accepted only when it is complete, addressed, of the right function and length, and its CRC is
// right (TCP: its transaction number). RTU has no number: an answer that comes after its time-out would pass as the answer to the next
// request of the same shape. Therefore after every failure the line stays silent until no answer can come any more, and what came is
// thrown away.
#pragma once
#include <array>
#include <functional>

#include "bench/stand/instruments/byte_link.hpp"
#include "bench/stand/instruments/frame.hpp"

namespace rotorloop::modbus {

struct ExchangeTiming {
  std::int64_t character_ns = 0;     // serial line: time of one character; 0: TCP
  std::int64_t gap_ns = 0;           // silence before a request
  std::int64_t timeout_ns = 0;       // from the end of the request to the first byte of the answer
  std::int64_t byte_timeout_ns = 0;  // between two bytes of an answer
  std::int64_t late_max_ns = 0;      // no answer begins later than this after the end of its request
};

// The silence that separates two frames: 3.5 characters, fixed at 1.75 ms above 19200 baud (MODBUS over Serial Line V1.02, 2.5.1.1).
std::int64_t frame_gap_ns(int baud, std::int64_t character_ns);

struct Exchanged {
  Reply reply;
  std::int64_t begin_ns = 0, end_ns = 0;  // before the first byte went out, after the last came in: what was read was sampled between them
  std::int64_t sampled_ns() const { return begin_ns + (end_ns - begin_ns) / 2; }
  std::int64_t uncertainty_ns() const { return (end_ns - begin_ns + 1) / 2; }  // half of the round trip: a bound, no standard deviation
};

class Exchanger {
 public:
  enum class Framing : std::uint8_t { rtu, tcp };
  Exchanger(ByteLink& link, Framing framing) : link_(link), framing_(framing) {}

  Exchanged exchange(const Request& request, const ExchangeTiming& timing);

  // Called during every wait when its time has come; returns when it wants to be called next. For what must be noticed while a device
  // lets the bus wait.
  void watch(std::int64_t first_ns, std::function<std::int64_t(std::int64_t now_ns)> watcher);
  void watch_again(std::int64_t at_ns) { watch_at_ns_ = at_ns; }

  std::int64_t now_ns() { return link_.now_ns(); }
  void wait_until(std::int64_t time_ns);                      // what comes meanwhile is counted and thrown away
  std::uint64_t stray_bytes() const { return stray_bytes_; }  // that nobody had asked for, or too late
  bool hears_itself() const { return hears_itself_; }         // an RS-485 adapter whose receiver stays on while it sends

 private:
  int receive(std::span<std::uint8_t> into, std::int64_t deadline_ns);
  void wait_for_gap(std::int64_t gap_ns);
  Reply receive_rtu(const Request& request, std::span<const std::uint8_t> sent, const ExchangeTiming& timing, std::int64_t request_end_ns);
  // Takes from the front what is none of the answer: bytes that are no address, and the request itself.
  Failure pass_over(const Request& request, std::span<const std::uint8_t> sent, const ExchangeTiming& timing, std::int64_t deadline_ns);
  Failure pass_over_line_bytes(const ExchangeTiming& timing, std::int64_t deadline_ns);
  void drop(std::size_t bytes);
  Reply receive_tcp(const Request& request, const ExchangeTiming& timing, std::int64_t request_end_ns);
  // Bytes until `wanted` are there; none: enough. `got` counts those of this answer.
  Failure collect(std::size_t wanted, const ExchangeTiming& timing, std::int64_t first_deadline_ns);
  void settle(const ExchangeTiming& timing, std::int64_t request_end_ns);

  ByteLink& link_;
  Framing framing_;
  std::array<std::uint8_t, 1024> buffer_{};
  std::size_t got_ = 0;
  std::int64_t last_byte_ns_ = -(std::int64_t{1} << 60);  // of anything on the line
  std::int64_t watch_at_ns_ = std::int64_t{1} << 62;
  std::function<std::int64_t(std::int64_t)> watcher_;
  std::uint16_t transaction_ = 0;
  std::uint64_t stray_bytes_ = 0;
  bool hears_itself_ = false;
};

}  // namespace rotorloop::modbus
