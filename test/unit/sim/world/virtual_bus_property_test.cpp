// What holds for any traffic: nothing is lost uncounted, frames never overlap, the best of those that waited goes first, and a
// repeated run is the same run.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "host/bus/frame_bits.hpp"
#include "test/unit/sim/world/bus_fixture.hpp"

namespace rotorloop::sim {
namespace {

using test::Bus;
using test::kBit_ns;

constexpr std::size_t kPorts = 6;

struct Sending {
  std::int64_t time_ns = 0;
  std::size_t port = 0;
  CanFrame frame;
  bool queued = false;
  std::int64_t start_ns = kNever_ns;
};

struct Outcome {
  std::vector<Sending> sendings;
  std::vector<BusEvent> trace;
  std::vector<PortCounters> counters;
  BusStatistics statistics;
  std::uint64_t read = 0;
};

// 0.3 s of random traffic around full load; ports poll at random; every frame carries its number.
Outcome run(std::uint64_t seed, std::vector<BusFault> faults) {
  Bus b({.seed = seed, .faults = std::move(faults)}, kPorts);
  const RandomStream random(seed, 99);
  std::uint64_t draw = 0;
  const auto below = [&](std::uint64_t n) { return random.bits(draw++) % n; };
  Outcome out;
  std::int64_t now_ns = 0;
  while (now_ns < 300 * kNs_per_ms) {
    now_ns += static_cast<std::int64_t>(below(250)) * kBit_ns;
    b.bus.advance_to(now_ns);
    for (std::uint64_t burst = below(4); burst > 0; --burst) {
      Sending s{.time_ns = now_ns, .port = below(kPorts), .frame = {}};
      s.frame.extended = below(2) == 0;
      // Identifiers of a port are its own, as on a real bus.
      s.frame.id = static_cast<std::uint32_t>(below(8) * 8 + s.port) << (s.frame.extended ? 16 : 3);
      s.frame.length = static_cast<std::uint8_t>(4 + below(5));
      const std::size_t number = out.sendings.size();
      for (std::size_t i = 0; i < 4; ++i) s.frame.data[i] = static_cast<std::uint8_t>(number >> (8 * i));
      s.queued = b.port[s.port]->send(s.frame) == SendStatus::queued;
      out.sendings.push_back(s);
    }
    if (below(3) == 0) out.read += b.received(below(kPorts)).size();
  }
  b.bus.advance_to(now_ns + 100 * kNs_per_ms);
  for (std::size_t i = 0; i < kPorts; ++i) out.counters.push_back(b.port[i]->counters());
  out.trace = b.trace;
  out.statistics = b.bus.statistics();
  return out;
}

std::size_t number_of(const CanFrame& f) {
  return f.data[0] | static_cast<std::size_t>(f.data[1]) << 8 | static_cast<std::size_t>(f.data[2]) << 16;
}

TEST(VirtualBusProperty, EveryFrameIsSentOrCountedAndEveryReceptionIsDeliveredOrCounted) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Outcome o = run(seed, {{.kind = BusFaultKind::lose_received, .probability = 0.02},
                                 {.kind = BusFaultKind::corrupt, .probability = 0.02},
                                 {.kind = BusFaultKind::corrupt, .port = 2, .at_ns = 50 * kNs_per_ms, .duration_ns = 100 * kNs_per_ms}});
    std::uint64_t sent = 0, dropped_tx = 0, received = 0, dropped_rx = 0;
    for (const PortCounters& c : o.counters) {
      sent += c.sent;
      dropped_tx += c.dropped_tx;
      received += c.received;
      dropped_rx += c.dropped_rx;
    }
    EXPECT_EQ(o.sendings.size(), sent + dropped_tx);
    EXPECT_EQ(sent * (kPorts - 1), received + dropped_rx + o.statistics.lost_by_fault + o.statistics.missed_while_off);
    EXPECT_GT(o.statistics.missed_while_off, 0u) << "port 2 has to go bus-off";
    EXPECT_EQ(sent, o.statistics.frames);
    EXPECT_GT(dropped_rx, 0u) << "the traffic has to strain the queues for this test to mean something";
    EXPECT_GT(o.statistics.error_frames, 0u);
    std::uint64_t by_id = 0;
    for (const IdStatistics& row : o.statistics.ids) by_id += row.frames;
    EXPECT_EQ(by_id + o.statistics.ids_not_counted, sent);
  }
}

TEST(VirtualBusProperty, FramesNeverOverlapAndThreeBitsOfIntermissionSeparateThem) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Outcome o = run(seed, {{.kind = BusFaultKind::corrupt, .probability = 0.05}});
    std::int64_t busy_ns = 0;
    for (std::size_t i = 0; i < o.trace.size(); ++i) {
      if (i > 0) {
        ASSERT_GE(o.trace[i].start_ns, o.trace[i - 1].end_ns + 3 * kBit_ns) << "frame " << i;
      }
      if (!o.trace[i].error) {
        ASSERT_EQ(o.trace[i].end_ns - o.trace[i].start_ns, frame_bits(o.trace[i].frame) * kBit_ns);
      }
      busy_ns += o.trace[i].end_ns - o.trace[i].start_ns + 3 * kBit_ns;
    }
    EXPECT_EQ(o.statistics.busy_ns, busy_ns);
    EXPECT_GT(o.statistics.max_load_percent, 90.0);
    EXPECT_LE(o.statistics.max_load_percent, 100.0);
  }
}

TEST(VirtualBusProperty, NoFrameStartsWhileABetterOneThatWaitedIsPassedOver) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Outcome o = run(seed, {});
    for (const BusEvent& e : o.trace) o.sendings[number_of(e.frame)].start_ns = e.start_ns;
    std::size_t compared = 0;
    for (const BusEvent& e : o.trace) {
      const Sending& winner = o.sendings[number_of(e.frame)];
      for (const Sending& other : o.sendings) {
        if (!other.queued || other.time_ns > e.start_ns || other.start_ns <= e.start_ns) continue;
        ASSERT_GE(arbitration_key(other.frame), arbitration_key(e.frame)) << "at " << e.start_ns << " ns";
        if (arbitration_key(other.frame) == arbitration_key(e.frame)) {
          ASSERT_GE(other.time_ns, winner.time_ns);
        }
        ++compared;
      }
    }
    EXPECT_GT(compared, 10'000u);
  }
}

TEST(VirtualBusProperty, SameInputsGiveTheIdenticalTrace) {
  const std::vector<BusFault> faults = {
      {.kind = BusFaultKind::corrupt, .probability = 0.05},
      {.kind = BusFaultKind::extra_traffic, .frame = test::standard(0x7F0, {0, 0, 0, 0}), .period_ns = 700'000}};
  const Outcome a = run(11, faults), b = run(11, faults), c = run(12, faults);
  const auto same = [](const Outcome& x, const Outcome& y) {
    return std::ranges::equal(x.trace, y.trace, [](const BusEvent& p, const BusEvent& q) {
      return p.start_ns == q.start_ns && p.end_ns == q.end_ns && p.frame == q.frame && p.port == q.port && p.error == q.error;
    });
  };
  EXPECT_TRUE(same(a, b));
  EXPECT_FALSE(same(a, c));
}

}  // namespace
}  // namespace rotorloop::sim
