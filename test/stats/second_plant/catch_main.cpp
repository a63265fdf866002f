// Rotors that already turn, caught by the core on a plant that was written by others: plant2.hpp and motors2.hpp are theirs, and not part
// of this repository (scripts/esc_second_plant). A 1 800 rpm/V motor at 5.9 and 15 uH, four and six cells.
//   usage: catch DRAWS FROM_SEED
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <motors2.hpp>

#include "firmware/core/motor/motor.hpp"

namespace {

using namespace rotorloop::firmware;
using Board = FakeBoard;
constexpr double kPeriod_s = 2.0 / 48000.0, kMost_eRPM = 200e3;

struct Caught {
  double after_ms = 1e9, peak_A = 0.0;  // driven from then on
  unsigned trips = 0;
  bool latched = false;
};

Caught catch_at(double share, double inductance_H, int cells, std::uint64_t seed) {
  const p2::Motor m{"",    "g431", 0.053, 1800, 7, inductance_H, 3.2e-6, 4.6e-6, 2.1e-8, 2.5e-3, 30, cells == 6 ? 24.0 : 15.6,
                    cells, 30,     84,    14};
  p2::Drawn d = p2::draw(m, seed, p2::Ingredients{}, Board::kDeadTime_ns);
  const double rad_s = kMost_eRPM / m.pp * p2::PI / 30.0, top_rad_s = std::min(0.9 * d.t.Voc / (std::sqrt(3.0) * d.t.lambda * m.pp), rad_s);
  d.fw.max_speed_rad_s = static_cast<float>(0.999 * rad_s);
  p2::Plant<Board> plant(d.t, seed * 1000 + 3, 0.3 * static_cast<double>(seed), 0.0);
  const auto motor = std::make_unique<Motor<Board>>(d.fw);
  Setpoint order{};
  const auto sample = [&] {
    motor->set_setpoint(order);
    plant.sample_period([&](Board& b) { motor->on_sample(b); });
  };
  for (double t = 0.0; t < 0.06; t += kPeriod_s) sample();
  plant.w = share * top_rad_s;
  plant.y_in = plant.w * plant.w;
  plant.peak = 0.0;
  order = {Mode::speed, static_cast<float>(0.6 * top_rad_s)};
  const std::uint32_t before = motor->counters().errors();
  Caught c;
  for (double t = 0.0; t < 0.5; t += kPeriod_s) {
    sample();
    const MotorState s = motor->telemetry().state;
    c.after_ms = s == MotorState::running || s == MotorState::handover ? std::min(c.after_ms, 1e3 * t) : 1e9;
  }
  c.trips = motor->counters().errors() - before;
  c.peak_A = plant.peak;
  c.latched = motor->telemetry().latched;
  return c;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return std::fprintf(stderr, "usage: catch DRAWS FROM_SEED\n"), 2;
  const int draws = std::atoi(argv[1]), from = std::atoi(argv[2]);
  std::printf(
      "| inductance | cells | share of the speed | caught in 150 ms | latched | trips | slowest | peak |\n| --- | --- | --- | --- | --- | "
      "--- | --- | --- |\n");
  bool met = true;
  for (const double inductance_H : {5.9e-6, 15e-6})
    for (const int cells : {4, 6})
      for (const double share : {0.2, 0.3, 0.5, 0.7, 0.9}) {
        int caught = 0, latched = 0;
        unsigned trips = 0;
        double slowest_ms = 0.0, peak_A = 0.0;
        for (int seed = from; seed < from + draws; ++seed) {
          const Caught c = catch_at(share, inductance_H, cells, static_cast<std::uint64_t>(seed));
          caught += c.after_ms <= 150.0;
          latched += c.latched;
          trips += c.trips;
          slowest_ms = std::max(slowest_ms, c.after_ms);
          peak_A = std::max(peak_A, c.peak_A);
        }
        met = met && caught >= 0.95 * draws && latched == 0;
        std::printf("| %.1f uH | %d | %.0f %% | %d of %d | %d | %u | %.0f ms | %.0f A |\n", 1e6 * inductance_H, cells, 100.0 * share,
                    caught, draws, latched, trips, slowest_ms, peak_A);
        std::fflush(stdout);
      }
  return met ? 0 : 6;
}
