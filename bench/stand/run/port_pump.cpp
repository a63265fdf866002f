#include "bench/stand/run/port_pump.hpp"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <thread>

#include "bench/stand/instruments/poll_plan.hpp"
#include "bench/stand/instruments/port_clock.hpp"

namespace rotorloop::stand_run {

std::vector<modbus::PolledDevice> polled_devices(const modbus::StandBus& bus) {
  std::vector<modbus::PolledDevice> out;
  for (const modbus::StandDevice& d : bus.devices)
    out.push_back({d.name, d.profile, static_cast<std::uint8_t>(d.slave), d.channels,
                   bus.port.tcp ? modbus::tcp_timing(d.profile) : modbus::rtu_timing(d.profile, bus.format),
                   static_cast<std::int64_t>(1e6 * d.stale_ms), static_cast<std::int64_t>(1e6 * d.slow_stale_ms)});
  return out;
}

std::optional<StandReading> reading_of(const modbus::StandSetup& setup, std::size_t bus, const modbus::Sample& s) {
  if (s.value.quality != modbus::Quality::good) return std::nullopt;
  const auto& channels = setup.buses[bus].devices[s.device].profile.channels;
  // By name: the models of a family have channels of one name, and only the one that is there is read.
  for (const modbus::BoundChannel& a : setup.axes)
    if (a.bus == bus && a.device == s.device && channels[a.channel].name == channels[s.channel].name)
      return StandReading{a.axis, a.to_si * s.value.value, s.sampled_ns, s.uncertainty_ns};
  return std::nullopt;
}

std::string channel_name(const modbus::StandSetup& setup, std::size_t bus, std::size_t device, std::size_t channel) {
  const modbus::StandDevice& d = setup.buses[bus].devices[device];
  return d.name + "." + d.profile.channels[channel].name;
}

// What bus threads hand over: swapped out under the lock, so that nobody waits longer than a copy of pointers.
struct PortPump::Shared {
  struct Stale {
    std::string channel;
    double age_ms;
  };
  const modbus::StandSetup& setup;
  std::vector<std::unique_ptr<modbus::PortLink>> links;
  std::vector<std::thread> threads;
  std::atomic<bool> stop{false};
  std::mutex mutex;
  std::vector<StandReading> readings;
  std::vector<Stale> stale;

  explicit Shared(const modbus::StandSetup& s) : setup(s) {}
  void poll(std::size_t b) {
    modbus::Exchanger exchanger(*links[b], setup.buses[b].port.tcp ? modbus::Exchanger::Framing::tcp : modbus::Exchanger::Framing::rtu);
    modbus::Poller poller(exchanger, polled_devices(setup.buses[b]), {.slow_divider = setup.buses[b].slow_divider});
    poller.on_sample = [&](const modbus::Sample& s) {
      const auto r = reading_of(setup, b, s);
      const std::lock_guard lock(mutex);
      if (r) readings.push_back(*r);
    };
    poller.on_stale = [&](const modbus::Stale& s) {
      const std::lock_guard lock(mutex);
      stale.push_back({channel_name(setup, b, s.device, s.channel), 1e-6 * static_cast<double>(s.age_ns)});
    };
    while (!stop) poller.step();
  }
};

PortPump::PortPump(const modbus::StandSetup& setup) : shared_(std::make_unique<Shared>(setup)) {
  for (const modbus::StandBus& b : setup.buses) shared_->links.push_back(std::make_unique<modbus::PortLink>(b.port, b.format));
}

PortPump::~PortPump() {
  shared_->stop = true;
  for (std::thread& t : shared_->threads) t.join();
}

void PortPump::run(Session& session, TimedBus& bus, const std::function<void()>& every) {
  constexpr std::int64_t kTurn_ns = 2'000'000, kEvery_ns = 20'000'000;
  Shared& s = *shared_;
  for (std::size_t b = 0; b < s.links.size(); ++b) s.threads.emplace_back([&s, b] { s.poll(b); });
  const std::int64_t offset_ns = bus.now_ns() - modbus::port_clock_ns();  // the bus counts from 1970, ports from the machine's start
  std::int64_t next_ns = 0;
  std::vector<StandReading> readings;
  std::vector<Shared::Stale> stale;
  while (!session.done()) {
    {
      const std::lock_guard lock(s.mutex);
      readings.swap(s.readings);
      stale.swap(s.stale);
    }
    for (StandReading& r : readings) {
      r.sampled_ns += offset_ns;
      session.take(r);
    }
    for (const Shared::Stale& x : stale) session.note_stale(x.channel, x.age_ms);
    readings.clear();
    stale.clear();
    session.step();
    if (bus.now_ns() >= next_ns) {
      next_ns = bus.now_ns() + kEvery_ns;
      every();
    }
    bus.wait_until(bus.now_ns() + kTurn_ns);
  }
}

}  // namespace rotorloop::stand_run
