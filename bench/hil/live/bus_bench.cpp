// Live: frames carry their number, so that each is accounted for: received, dropped by the sender, counted as dropped by the receiver's
// system, or unexplained. After the last burst the sender sends on until the receiver's count of drops has come along with a frame.
#include "bench/hil/live/bus_bench.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "host/base/random.hpp"
#include "host/bus/frame_bits.hpp"
#include "host/bus/live/live_clock.hpp"
#include "sim/world/virtual_bus.hpp"

namespace rotorloop::live {
namespace {

constexpr std::uint64_t kBenchStream = 0x42454E4348000001ull;
constexpr std::uint32_t kBenchId = 0x7E0, kBenchAnswerId = 0x7E1;  // 11 bits: tools for DroneCAN pass over them silently
constexpr std::int64_t kLongestSilence_ns = 500'000'000;           // after that a frame on this machine is lost

CanFrame random_frame(std::uint32_t id, std::uint64_t bits) {
  CanFrame f{.id = id, .extended = true, .length = 8, .data = {}};
  for (std::size_t i = 0; i < 8; ++i) f.data[i] = static_cast<std::uint8_t>(bits >> (8 * i) & 0xFFu);
  return f;
}

BusFrame numbered(std::uint32_t id, std::uint64_t number) {
  BusFrame f;
  f.id = id;
  f.length = 8;
  for (std::size_t i = 0; i < 8; ++i) f.data[i] = static_cast<std::uint8_t>(number >> (8 * i) & 0xFFu);
  return f;
}

std::uint64_t number_of(const BusFrame& f) {
  std::uint64_t number = 0;
  for (std::size_t i = 8; i > 0; --i) number = number << 8 | f.data[i - 1];
  return number;
}

double quantile_us(std::vector<double>& sorted_us, double share) {
  if (sorted_us.empty()) return std::nan("");
  return sorted_us[std::min(sorted_us.size() - 1, static_cast<std::size_t>(share * static_cast<double>(sorted_us.size())))];
}

// Receives numbered frames and keeps account of them.
class Account {
 public:
  Account(TimedBus& bus, BusBenchResult& result) : bus_(bus), result_(result) {}
  // Until `expected` frames were received, or silence says that no more come.
  void read(std::uint64_t expected) {
    while (result_.received < expected) {
      const auto f = bus_.receive_until(bus_.now_ns() + kLongestSilence_ns);
      if (!f) return;
      take(*f);
    }
  }
  void read_waiting() {
    while (const auto f = bus_.receive_any()) take(*f);
  }
  std::int64_t last_ns() const { return last_ns_; }  // when the last frame was taken

 private:
  void take(const StampedBusFrame& f) {
    if (f.frame.id != kBenchId || f.frame.extended) return;
    if (f.frame.length != 8) {
      ++result_.damaged;
      return;
    }
    const std::uint64_t number = number_of(f.frame);
    last_ns_ = bus_.now_ns();
    ++result_.received;
    if (number < next_) ++result_.out_of_order;
    next_ = std::max(next_, number + 1);
  }
  TimedBus& bus_;
  BusBenchResult& result_;
  std::uint64_t next_ = 0;
  std::int64_t last_ns_ = 0;
};

// A multicast bus hears itself: what is not read fills the buffer.
void drain(TimedBus& bus) {
  while (bus.receive_any()) {
  }
}

// Until the system took or refused what was queued.
void let_leave(TimedBus& sender) {
  while (sender.output_waits() || sender.next_flush_ns() != INT64_MAX) {
    sender.wait_until(sender.now_ns() + kLongestSilence_ns);
    drain(sender);
  }
}

void measure_round_trips(TimedBus& a, TimedBus& b, std::uint64_t count, BusBenchResult& r) {
  std::vector<double> times_us;
  const auto wait_for = [](TimedBus& bus, std::uint32_t id, std::uint64_t number) {
    const std::int64_t deadline_ns = bus.now_ns() + kLongestSilence_ns;
    while (const auto f = bus.receive_until(deadline_ns)) {
      if (f->frame.id == id && !f->frame.extended && number_of(f->frame) == number) return true;
    }
    return false;
  };
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::int64_t begun_ns = a.now_ns();
    a.send_any(numbered(kBenchId, i));
    if (!wait_for(b, kBenchId, i) || (b.send_any(numbered(kBenchAnswerId, i)), !wait_for(a, kBenchAnswerId, i))) {
      ++r.round_trips_lost;
      continue;
    }
    times_us.push_back(static_cast<double>(a.now_ns() - begun_ns) * 1e-3);
  }
  std::sort(times_us.begin(), times_us.end());
  r.round_trips = times_us.size();
  r.round_trip_median_us = quantile_us(times_us, 0.5);
  r.round_trip_p99_us = quantile_us(times_us, 0.99);
  r.round_trip_worst_us = times_us.empty() ? std::nan("") : times_us.back();
}

}  // namespace

BusBenchResult bench_virtual_bus(const BusBenchOptions& options) {
  sim::VirtualBus bus({});
  CanBus& a = bus.attach({.name = "a"});
  CanBus& b = bus.attach({.name = "b"});
  constexpr std::uint32_t kFromA = 0x1401550A, kFromB = 0x1401550B;
  const CanFilter to_a{.id = kFromB, .mask = 0x1FFFFFFF}, to_b{.id = kFromA, .mask = 0x1FFFFFFF};
  a.set_filters({&to_a, 1});
  b.set_filters({&to_b, 1});
  const RandomStream random(1, kBenchStream);
  BusBenchResult r;
  std::int64_t now_ns = 0, trips_ns = 0, trip_begun_ns = 0;
  std::uint64_t bits = 0;
  const std::int64_t begun_ns = live_now_ns();
  for (std::uint64_t i = 0; i < options.frames; ++i) {
    const bool answer = i % 2 == 1;
    const CanFrame frame = random_frame(answer ? kFromB : kFromA, random.bits(i));
    if (!answer) trip_begun_ns = now_ns;
    (answer ? b : a).send(frame);
    ++r.sent;
    CanBus& listener = answer ? a : b;
    auto heard = listener.receive();
    while (!heard && bus.next_event_ns() != sim::kNever_ns) {
      now_ns = bus.next_event_ns();
      bus.advance_to(now_ns);
      heard = listener.receive();
    }
    if (heard) {
      ++r.received;
      if (!(heard->frame == frame)) ++r.damaged;
    }
    bits += static_cast<std::uint64_t>(frame_bits(frame) + kIntermissionBits);
    if (answer) {
      trips_ns += now_ns - trip_begun_ns;
      ++r.round_trips;
    }
  }
  const double elapsed_s = static_cast<double>(live_now_ns() - begun_ns) * 1e-9;
  r.frames_per_s = static_cast<double>(r.received) / elapsed_s;
  r.bits_per_frame = static_cast<double>(bits) / static_cast<double>(std::max<std::uint64_t>(options.frames, 1));
  r.unexplained = r.sent - r.received;
  if (r.round_trips > 0) {
    r.virtual_round_trip_us = static_cast<double>(trips_ns) * 1e-3 / static_cast<double>(r.round_trips);
    r.round_trip_median_us = 1e6 * elapsed_s / static_cast<double>(r.round_trips);
  }
  return r;
}

BusBenchResult bench_live_bus(TimedBus& sender, TimedBus& receiver, const BusBenchOptions& options) {
  BusBenchResult r;
  r.receive_buffer_B = receiver.link_counters().receive_buffer_B;
  const std::uint64_t dropped_before = receiver.counters().dropped_rx, dropped_tx_before = sender.counters().dropped_tx;
  Account account(receiver, r);
  account.read_waiting();
  r.received = 0;
  const std::int64_t begun_ns = sender.now_ns();
  std::uint64_t number = 0;
  const auto lost = [&] { return receiver.counters().dropped_rx - dropped_before; };
  // Frames that were queued and then dropped (waited too long) were not sent after all.
  const auto on_the_bus = [&] { return r.sent + r.dropped_by_sender - (sender.counters().dropped_tx - dropped_tx_before); };
  while (number < options.frames) {
    for (std::uint64_t i = 0; i < options.burst && number < options.frames; ++i, ++number) {
      ++(sender.send_any(numbered(kBenchId, number)) == SendStatus::queued ? r.sent : r.dropped_by_sender);
    }
    sender.flush();
    if (number >= options.frames) let_leave(sender);
    // What the system dropped is known only with the next frame that it keeps: the burst is over when nothing more waits.
    account.read_waiting();
    drain(sender);
    if (r.received + lost() < on_the_bus() && number >= options.frames) account.read(on_the_bus() - lost());
  }
  r.frames_per_s = static_cast<double>(r.received) * 1e9 / static_cast<double>(std::max<std::int64_t>(account.last_ns() - begun_ns, 1));
  for (int i = 0; i < 3 && r.received + lost() < on_the_bus(); ++i) {
    ++(sender.send_any(numbered(kBenchId, number++)) == SendStatus::queued ? r.sent : r.dropped_by_sender);
    let_leave(sender);
    account.read(on_the_bus() - lost());
  }
  r.sent = on_the_bus();
  r.dropped_by_sender = sender.counters().dropped_tx - dropped_tx_before;
  r.dropped_by_receiver = lost();
  r.unexplained = r.sent > r.received + lost() ? r.sent - r.received - lost() : 0;
  drain(sender);
  measure_round_trips(sender, receiver, options.round_trips, r);
  return r;
}

}  // namespace rotorloop::live
