#include "bench/hil/esc_lab/fault_schedule.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "bench/hil/esc_lab/best_step.hpp"
#include "bench/hil/esc_lab/esc_run.hpp"
#include "host/base/random.hpp"

namespace rotorloop::esc_lab {
namespace {

using firmware::Blocked;

constexpr std::uint64_t kFaultStream = 0x4641554C;
constexpr double kStale_ms = 22.0;       // an order lives for 20 ms, supervision looks every 0.25 ms
constexpr double kAfterStale_ms = 50.0;  // what would drive again after that has done so
constexpr double kAfterLatch_ms = 25.0;
constexpr double kStanding_rad_s = 10.0;

// Most last 100 to 160 ms, one in ten 450: long enough for eight trips and the latch.
double length_of(const RandomStream& random) { return random.uniform(3) < 0.1 ? 450.0 : 100.0 + 60.0 * random.uniform(4); }

// Where schedules begin: a copy costs microseconds, the flight up to here seconds.
template <class Esc>
struct Begun {
  Esc esc;
  double aim_rad_s;
};

// One ESC on its way through a schedule.
template <class Esc>
class FaultFlight {
 public:
  FaultFlight(const Begun<Esc>& begun, std::uint64_t number, EscTrace* trace)
      : esc_(begun.esc), aim_rad_s_(begun.aim_rad_s), trace_(trace) {
    const RandomStream random(number, kFaultStream);
    o_.number = number;
    length_ms_ = length_of(random);
    const double now_s = esc_.drive().time_s();
    const int faults = random.uniform(0) < 0.5 ? 1 : 2;
    for (int k = 0; k < faults; ++k) {
      const std::uint64_t n = 10 + 10 * static_cast<std::uint64_t>(k);
      sim::DriveFault f;
      f.kind = static_cast<sim::DriveFaultKind>(static_cast<int>(random.uniform(n) * static_cast<double>(sim::kDriveFaultNames.size())));
      f.phase = static_cast<std::uint8_t>(3.0 * random.uniform(n + 1));
      f.from_s = now_s + 0.25e-3 * length_ms_ * random.uniform(n + 2);
      f.until_s = random.uniform(n + 3) < 0.5 ? f.from_s + 0.01 + 0.5e-3 * length_ms_ * random.uniform(n + 4)
                                              : std::numeric_limits<double>::infinity();
      f.size = f.kind == sim::DriveFaultKind::weak_magnets ? 0.5 + 0.5 * random.uniform(n + 5) : 0.4 * random.uniform(n + 5);
      esc_.drive().add_fault(f);
      o_.faults += (k > 0 ? " + " : "") + std::string(sim::kDriveFaultNames[static_cast<std::size_t>(f.kind)]);
    }
    if (random.uniform(1) < 0.5) silent_from_ms_ = 0.7 * length_ms_ * random.uniform(2);
  }

  Esc& esc() { return esc_; }
  FaultOutcome& outcome() { return o_; }
  // Before each period. What is no number renews no order.
  void renew() {
    if (!silent_ && ms() >= silent_from_ms_) {
      silent_ = true;
      esc_.set_setpoint({firmware::Mode::speed, std::numeric_limits<float>::quiet_NaN()});
    }
  }
  // After each period; false when nothing more can happen.
  bool watch() {
    ++periods_;
    constexpr double kPeriod_ms = 1.0 / kPeriodsPerMs;
    if (ms() > silent_from_ms_ + kStale_ms && esc_.board().bridge) o_.driven_stale_ms += kPeriod_ms;
    if (trace_ != nullptr && periods_ % kPeriodsPerTracePoint == 0)
      trace_->add(esc_, esc_.board().bridge, 1e-3 * ms(), silent_ ? std::numeric_limits<double>::quiet_NaN() : aim_rad_s_);
    if (periods_ % kPeriodsPerTracePoint == 0) {
      const firmware::Telemetry t = esc_.telemetry();
      const bool blind = t.state == firmware::MotorState::running && std::fabs(esc_.omega_rad_s()) < kStanding_rad_s;
      blind_ms_ = blind ? blind_ms_ + kPeriodsPerTracePoint * kPeriod_ms : 0.0;
      o_.blind_running_ms = std::max(o_.blind_running_ms, blind_ms_);
      latched_ms_ = t.latched ? latched_ms_ + kPeriodsPerTracePoint * kPeriod_ms : 0.0;
    }
    const bool over = ms() >= length_ms_ || latched_ms_ > kAfterLatch_ms || ms() > silent_from_ms_ + kStale_ms + kAfterStale_ms;
    if (over) judge();
    return !over;
  }

 private:
  double ms() const { return periods_ / static_cast<double>(kPeriodsPerMs); }
  void judge() {
    const firmware::Telemetry t = esc_.telemetry();
    const bool reason = t.blocked != Blocked::none && t.blocked != Blocked::no_order && t.blocked != Blocked::stale_order;
    o_.simulated_ms = ms();
    o_.dead_without_reason = !silent_ && !esc_.board().bridge && !reason;
    o_.latched = t.latched;
    o_.latched_without_fault = t.latched && t.fault == firmware::Fault::none;
    o_.tripped = t.trips > 0;
  }

  Esc esc_;
  double aim_rad_s_;
  EscTrace* trace_ = nullptr;
  FaultOutcome o_;
  double length_ms_ = 0.0, silent_from_ms_ = std::numeric_limits<double>::infinity(), blind_ms_ = 0.0, latched_ms_ = 0.0;
  int periods_ = 0;
  bool silent_ = false;
};

template <class Esc>
std::vector<Begun<Esc>> begun(const std::vector<EscDraw>& draws, const FaultSettings& settings) {
  std::vector<Begun<Esc>> escs;
  for (std::size_t k = 0; k < draws.size(); ++k) {
    sim::NativeEscConfig c = native_config(draws[k]);
    c.drive.switched_step_s = settings.switched_step_s;
    const double aim_rad_s = 0.5 * highest_speed_rad_s(draws[k]);
    // aligning, ramping, handing over; at speed
    for (const double after_ms : {20.0 + 60.0 * static_cast<double>(k % 5 + 1), std::max(900.0, 1.5 * draws[k].start_within_ms)}) {
      Esc esc(c);
      if (settings.change) settings.change(esc.motor().config());
      esc.couple_quadratic(draws[k].load_N_m_s2, draws[k].bus_V);
      run_ms(esc, 60.0);
      esc.set_setpoint(speed(aim_rad_s));
      run_ms(esc, after_ms);
      escs.push_back({std::move(esc), aim_rad_s});
    }
  }
  return escs;
}

// Four at a time: their drives step side by side (Drive::step_together).
template <class Esc>
std::vector<FaultOutcome> fly_all(const std::vector<Begun<Esc>>& from, const FaultSettings& s) {
  std::vector<std::unique_ptr<FaultFlight<Esc>>> flights;
  std::vector<FaultOutcome> done;
  std::uint64_t next = s.from;
  const auto more = [&] {
    while (flights.size() < sim::Lanes::kCount && next < s.from + s.count) {
      flights.push_back(std::make_unique<FaultFlight<Esc>>(from[next % from.size()], next, nullptr));
      ++next;
    }
  };
  std::vector<Esc*> escs;
  for (more(); !flights.empty(); more()) {
    escs.clear();
    for (const auto& f : flights) {
      f->renew();
      escs.push_back(&f->esc());
    }
    Esc::step_current_loops(escs);
    std::erase_if(flights, [&](const auto& f) {
      if (f->watch()) return false;
      if (s.each) s.each(f->outcome());
      done.push_back(f->outcome());
      return true;
    });
  }
  return done;
}

}  // namespace

std::string fault_failure(const FaultOutcome& o) {
  if (o.driven_stale_ms > 0.0) return fmt::format("driven for {:.1f} ms without a fresh set-point", o.driven_stale_ms);
  if (o.dead_without_reason) return "the bridge is off and no reason given";
  if (o.latched_without_fault) return "latched without a fault";
  if (o.blind_running_ms >= kBlindRunning_ms) return fmt::format("a rotor at rest reported as running for {:.0f} ms", o.blind_running_ms);
  return {};
}
bool fault_handled(const FaultOutcome& o) { return fault_failure(o).empty(); }

std::vector<FaultOutcome> run_fault_schedules(const std::vector<EscDraw>& draws, const FaultSettings& s) {
  return with_esc_of(draws.at(0).board, [&]<class Esc>() { return fly_all<Esc>(begun<Esc>(draws, s), s); });
}

FaultOutcome trace_fault_schedule(const std::vector<EscDraw>& draws, const FaultSettings& s, std::uint64_t number, EscTrace& trace) {
  return with_esc_of(draws.at(0).board, [&]<class Esc>() {
    const std::vector<Begun<Esc>> escs = begun<Esc>(draws, s);
    FaultFlight<Esc> flight(escs[number % escs.size()], number, &trace);
    do {
      flight.renew();
      flight.esc().step_current_loop();
    } while (flight.watch());
    return flight.outcome();
  });
}

}  // namespace rotorloop::esc_lab
