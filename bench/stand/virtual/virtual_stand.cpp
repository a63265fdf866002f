#include "bench/stand/virtual/virtual_stand.hpp"

#include <algorithm>
#include <cmath>

#include "bench/stand/instruments/poll_plan.hpp"
#include "bench/stand/run/port_pump.hpp"

namespace rotorloop::virtual_stand {
namespace {

using modbus::StandAxis;

constexpr std::int64_t kChain_ns = 500'000;      // the mount is stepped at 2 kHz, as the rotor's loads come
constexpr std::int64_t kSession_ns = 1'000'000;  // the host looks at its buses every millisecond
constexpr std::int64_t kEvery_ns = 20'000'000, kKept_ns = 1'000'000'000;

// Pressure at which moist air of this temperature and humidity has the density (the reverse of what an estimate does).
double pressure_Pa(double density_kg_m3, double degC, double humidity_percent) {
  const double vapour_Pa = 0.01 * humidity_percent * 611.2 * std::exp(17.62 * degC / (243.12 + degC));
  return density_kg_m3 * 287.05 * (degC + 273.15) + 0.378 * vapour_Pa;
}

// Registers that say how others are to be read: the finest scale, and the model that has the channel.
void set_settings(modbus::SlaveDevice& slave, const modbus::Channel& c) {
  const auto put = [&](const modbus::OtherChannel& other, std::uint64_t part) {
    const std::uint64_t old = slave.raw(other.channel);
    slave.set_raw(other.channel, (old & ~other.mask) | ((part << other.shift) & other.mask));
  };
  if (c.scale_of && !c.scale_map.empty()) {
    const auto finest = std::min_element(c.scale_map.begin(), c.scale_map.end(),
                                         [](const auto& a, const auto& b) { return std::abs(a.second) < std::abs(b.second); });
    put(*c.scale_of, finest->first);
  }
  if (c.when && !c.when_in.empty() && c.when->part(slave.raw(c.when->channel)) == 0) put(*c.when, c.when_in.front());
}

}  // namespace

struct VirtualStand::Bus {
  modbus::SerialHub hub;
  modbus::Exchanger exchanger;
  std::unique_ptr<modbus::Poller> poller;
  Bus(const modbus::SerialFormat& format, const modbus::LineFaults& faults)
      : hub(format, faults), exchanger(hub, modbus::Exchanger::Framing::rtu) {}
};

VirtualStand::VirtualStand(const modbus::StandSetup& setup, const VirtualStandConfig& config)
    : setup_(setup),
      config_(config),
      can_(sim::BusConfig{}),
      esc_port_(&can_.attach({.name = "esc"})),
      port_(&can_.attach({.name = "stand"})),
      chain_(config.errors, config.properties, config.seed, 1e-9 * static_cast<double>(kChain_ns)) {
  config_.rotor.speed_error = config.errors.speed;
  rotor_ = std::make_unique<StandRotor>(config_.rotor, *esc_port_);
  tool_port_ = std::make_unique<sim::LockstepBus>(can_, *port_, StandRotor::kPollNs, [this](std::int64_t now_ns) { follow(now_ns); });
  states_.push_back({0, {}, 0.0, rotor_->supply_V(), 0.0});
}

VirtualStand::~VirtualStand() = default;

void VirtualStand::follow(std::int64_t now_ns) {
  while (followed_ns_ + StandRotor::kPollNs <= now_ns) {
    rotor_->advance();
    followed_ns_ += StandRotor::kPollNs;
    if (followed_ns_ % kChain_ns != 0) continue;
    chain_.step(rotor_->thrust_N(), rotor_->reaction_N_m(), rotor_->omega_rad_s());
    states_.push_back({followed_ns_, chain_.reading(), rotor_->omega_rad_s(), rotor_->supply_V(), rotor_->supply_A()});
    while (states_.front().t_ns < followed_ns_ - kKept_ns) states_.pop_front();
  }
}

void VirtualStand::advance_to(std::int64_t time_ns) {
  while (can_.now_ns() + StandRotor::kPollNs <= time_ns) {
    can_.advance_to(can_.now_ns() + StandRotor::kPollNs);
    follow(can_.now_ns());
    if (session_ == nullptr || can_.now_ns() < next_session_ns_) continue;
    next_session_ns_ = can_.now_ns() + kSession_ns;
    session_->step();
    if (every_ && can_.now_ns() >= next_every_ns_) {
      next_every_ns_ = can_.now_ns() + kEvery_ns;
      every_();
    }
  }
}

const VirtualStand::State& VirtualStand::at(std::int64_t time_ns) const {
  const auto after = std::upper_bound(states_.begin(), states_.end(), time_ns, [](std::int64_t t, const State& s) { return t < s.t_ns; });
  return after == states_.begin() ? states_.front() : *(after - 1);
}

double VirtualStand::shown(StandAxis axis, const State& s) const {
  const ChainErrors& e = chain_.errors();
  switch (axis) {
    case StandAxis::thrust:
      return chain_.rounded(0, s.reading[0]);
    case StandAxis::torque:
      return chain_.rounded(1, s.reading[1]);
    case StandAxis::voltage:
      return s.supply_V * (1.0 + e.voltage);
    case StandAxis::current:
      return std::max(0.0, s.supply_A) * (1.0 + e.current);
    case StandAxis::power:
      return s.supply_V * std::max(0.0, s.supply_A) * (1.0 + e.voltage) * (1.0 + e.current);
    case StandAxis::rotor_speed:
      return std::abs(s.omega_rad_s) * config_.optical_marks;
    case StandAxis::vibration: {
      const bool chipped = config_.chipped_at_s > 0.0 && 1e-9 * static_cast<double>(s.t_ns) >= config_.chipped_at_s;
      return config_.shake_s2_m * (chipped ? config_.chipped_shake : 1.0) * s.omega_rad_s * s.omega_rad_s;
    }
    case StandAxis::air_temperature:
      return config_.air_temperature_degC;
    case StandAxis::air_humidity:
      return config_.air_humidity_percent;
    case StandAxis::air_pressure:
      return pressure_Pa(rotor_->density_kg_m3(), config_.air_temperature_degC, config_.air_humidity_percent) * (1.0 + e.pressure);
    case StandAxis::motor_temperature:
    case StandAxis::esc_temperature:
      break;
  }
  return 35.0;
}

void VirtualStand::show(std::size_t bus, std::size_t device, modbus::SlaveDevice& slave, std::int64_t now_ns) {
  advance_to(now_ns);
  const State& state = at(now_ns);
  for (const modbus::BoundChannel& a : setup_.axes) {
    if (a.bus != bus || a.device != device) continue;
    const modbus::Channel& c = slave.profile().channels[a.channel];
    try {
      const auto right = [&](StandAxis axis) { return shown(axis, state); };
      slave.set(c.name, (config_.shows ? config_.shows(a.axis, right) : right(a.axis)) / a.to_si);
    } catch (const std::exception&) {
      // Beyond what the register holds: the device goes on showing what it last could.
    }
  }
}

void VirtualStand::make_bus(std::size_t index) {
  const modbus::StandBus& b = setup_.buses[index];
  modbus::LineFaults line = config_.line;
  line.seed = config_.seed * 16 + index;
  auto bus = std::make_unique<Bus>(b.format, line);
  for (std::size_t d = 0; d < b.devices.size(); ++d) {
    const modbus::StandDevice& device = b.devices[d];
    auto slave = std::make_shared<modbus::SlaveDevice>(device.profile);
    for (const modbus::Channel& c : device.profile.channels) set_settings(*slave, c);
    slave->on_sample = [this, index, d](modbus::SlaveDevice& s, std::int64_t now_ns) { show(index, d, s, now_ns); };
    modbus::HubSlave on_bus{static_cast<std::uint8_t>(device.slave), slave, static_cast<std::int64_t>(1e6 * device.profile.turnaround_ms),
                            config_.turnaround_jitter_ns};
    if (device.name == config_.dies) on_bus.dies_at_ns = static_cast<std::int64_t>(1e9 * config_.dies_at_s);
    bus->hub.add(std::move(on_bus));
  }
  bus->exchanger.wait_until(can_.now_ns());
  bus->poller = std::make_unique<modbus::Poller>(bus->exchanger, stand_run::polled_devices(b),
                                                 modbus::PollerSettings{.slow_divider = b.slow_divider});
  modbus::SerialHub& hub = bus->hub;
  bus->poller->on_sample = [this, index, &hub](const modbus::Sample& s) {
    advance_to(hub.now_ns());
    if (const auto r = stand_run::reading_of(setup_, index, s); r && session_ != nullptr) session_->take(*r);
  };
  bus->poller->on_stale = [this, index, &hub](const modbus::Stale& s) {
    advance_to(hub.now_ns());
    if (session_ != nullptr)
      session_->note_stale(stand_run::channel_name(setup_, index, s.device, s.channel), 1e-6 * static_cast<double>(s.age_ns));
  };
  buses_.push_back(std::move(bus));
}

void VirtualStand::run(stand_run::Session& session, double most_s, const std::function<void()>& every) {
  session_ = &session;
  every_ = every;
  const auto end_ns = can_.now_ns() + static_cast<std::int64_t>(1e9 * most_s);
  if (buses_.empty())
    for (std::size_t b = 0; b < setup_.buses.size(); ++b) make_bus(b);
  while (!session.done() && can_.now_ns() < end_ns) {
    const auto furthest_behind = [this] {
      return std::min_element(buses_.begin(), buses_.end(), [](const auto& a, const auto& b) { return a->hub.now_ns() < b->hub.now_ns(); })
          ->get();
    };
    furthest_behind()->poller->step();
    advance_to(furthest_behind()->hub.now_ns());  // a silent bus moves the world on too
  }
  session_ = nullptr;
  every_ = {};
}

modbus::SerialHub::Counts VirtualStand::line_counts() const {
  modbus::SerialHub::Counts all;
  for (const auto& b : buses_) {
    const auto& c = b->hub.counts();
    all.frames += c.frames;
    all.flipped += c.flipped;
    all.bytes_lost += c.bytes_lost;
    all.late += c.late;
    all.collisions += c.collisions;
  }
  return all;
}

}  // namespace rotorloop::virtual_stand
