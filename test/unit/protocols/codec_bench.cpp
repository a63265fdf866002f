// Cost of encoding and decoding one frame; the budget is 100 ns for both together.
#include <benchmark/benchmark.h>

#include "protocols/fast_channel.hpp"
#include "protocols/receiver.hpp"
#include "protocols/state_receiver.hpp"
#include "protocols/types.hpp"

namespace rotorloop::protocols {
namespace {

void fast_setpoint(benchmark::State& bench) {
  fast::Setpoint s;
  for (auto _ : bench) {
    for (int i = 0; i < 4; ++i) s.set(i, 937.0f + static_cast<float>(s.sequence));
    s.sequence = (s.sequence + 1) & 15;
    CanFrame f = encode(s);
    benchmark::DoNotOptimize(f);
    benchmark::DoNotOptimize(fast::decode_setpoint(f));
  }
}
BENCHMARK(fast_setpoint);

void fast_feedback(benchmark::State& bench) {
  fast::Feedback s;
  for (auto _ : bench) {
    s.set_speed_rad_s(900.0f + static_cast<float>(s.sequence));
    s.set_current_A(12.0f);
    s.sequence = (s.sequence + 1) & 15;
    CanFrame f = encode(s);
    benchmark::DoNotOptimize(f);
    benchmark::DoNotOptimize(fast::decode_feedback(f));
  }
}
BENCHMARK(fast_feedback);

// One sample of four frames.
void state_pose(benchmark::State& bench) {
  state::PoseReading s;
  state::StateReceiver r;
  std::uint8_t sequence = 0;
  for (auto _ : bench) {
    s.time_us += 5000;
    s.p_W_m[0] += 1e-3;
    s.q_WS = {0.9, 0.1, 0.2, 0.3};
    benchmark::DoNotOptimize(s);
    for (const CanFrame& f : state::encode(s, sequence)) benchmark::DoNotOptimize(r.on_frame(f, s.time_us));
    sequence = (sequence + 1) & 15;
  }
}
BENCHMARK(state_pose);

// One sample of two frames.
void state_imu(benchmark::State& bench) {
  state::ImuReading s;
  state::StateReceiver r;
  std::uint8_t sequence = 0;
  for (auto _ : bench) {
    s.time_us += 1000;
    s.gyro_B_rad_s[0] = 1e-3 * sequence;
    benchmark::DoNotOptimize(s);
    for (const CanFrame& f : state::encode(s, sequence)) benchmark::DoNotOptimize(r.on_frame(f, s.time_us));
    sequence = (sequence + 1) & 63;
  }
}
BENCHMARK(state_imu);

// One transfer of three frames, encoded, split, reassembled and decoded.
void dronecan_esc_status(benchmark::State& bench) {
  static constexpr std::array<Subscription, 1> kSubscriptions{subscribe(TransferKind::message, EscStatus::kType)};
  static constexpr std::uint16_t kSeed = EscStatus::kType.crc_seed();
  Receiver<12, 45> receiver(1, kSubscriptions);
  TransferIdCounter id;
  EscStatus s{.error_count = 0, .voltage_V = 16.0f, .current_A = 3.0f, .temperature_K = 300.0f, .rpm = 8950};
  std::uint64_t now_us = 0;
  for (auto _ : bench) {
    ++s.error_count;
    now_us += 20000;
    std::array<std::uint8_t, EscStatus::kMaxBytes> payload;
    encode_transfer({.kind = TransferKind::message, .priority = 16, .data_type_id = EscStatus::kType.id, .source = 5}, kSeed, id.next(),
                    {payload.data(), encode(s, payload)}, [&](const CanFrame& f) {
                      if (const auto t = receiver.accept(f, now_us)) {
                        EscStatus back;
                        benchmark::DoNotOptimize(decode(t->payload, back));
                        benchmark::DoNotOptimize(back);
                      }
                      return true;
                    });
  }
}
BENCHMARK(dronecan_esc_status);

}  // namespace
}  // namespace rotorloop::protocols
