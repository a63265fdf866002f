#include "bench/stand/instruments/poller.hpp"

#include <algorithm>
#include <numeric>

namespace rotorloop::modbus {

double ChannelStatistics::rate_Hz() const {
  return good > 1 && last_ns > first_ns ? static_cast<double>(good - 1) * 1e9 / static_cast<double>(last_ns - first_ns) : 0.0;
}
std::uint64_t DeviceStatistics::failed() const { return std::accumulate(failures.begin(), failures.end(), std::uint64_t{0}); }

Poller::Poller(Exchanger& bus, std::vector<PolledDevice> devices, PollerSettings settings)
    : bus_(bus), devices_(std::move(devices)), settings_(settings) {
  const std::int64_t now = bus_.now_ns();
  for (const PolledDevice& d : devices_) {
    State s;
    s.plan = make_plan(d.profile, d.channels);
    s.tracks.resize(d.profile.channels.size());
    s.statistics.channels.resize(d.profile.channels.size());
    for (const auto* groups : {&s.plan.fast, &s.plan.slow})
      for (const ReadGroup& g : *groups)
        for (const std::size_t c : g.channels) {
          s.tracks[c].polled = true;
          s.tracks[c].limit_ns = d.profile.channels[c].rate == PollRate::fast ? d.stale_ns : d.slow_stale_ns;
          s.tracks[c].good_since_ns = now;  // the clock runs from the start: a device that never answers is named too
        }
    states_.push_back(std::move(s));
  }
  bus_.watch(now, [this](std::int64_t time) { return look_for_stale(time); });
}

std::int64_t Poller::look_for_stale(std::int64_t now_ns) {
  std::int64_t next = std::int64_t{1} << 62;
  for (std::size_t d = 0; d < states_.size(); ++d)
    for (std::size_t c = 0; c < states_[d].tracks.size(); ++c) {
      Track& t = states_[d].tracks[c];
      if (!t.polled || t.stale) continue;
      const std::int64_t due = t.good_since_ns + t.limit_ns;
      if (now_ns < due) {
        next = std::min(next, due);
        continue;
      }
      t.stale = true;
      ++states_[d].statistics.channels[c].stale;
      if (on_stale) on_stale({d, c, now_ns, now_ns - t.good_since_ns});
    }
  return next;
}

void Poller::take(std::size_t device, const ReadGroup& group, const Exchanged& x) {
  State& s = states_[device];
  const Profile& profile = devices_[device].profile;
  const auto registers_of = [&](std::size_t c) {
    const Channel& channel = profile.channels[c];
    return std::span(x.reply.registers).subspan(static_cast<std::size_t>(channel.address - group.address), channel.registers());
  };
  for (const std::size_t c : group.channels) s.tracks[c].raw = assemble(registers_of(c), profile.channels[c].order);
  const RawLookup others = [&s](std::size_t c) { return s.tracks[c].raw; };
  for (const std::size_t c : group.channels) {
    Track& t = s.tracks[c];
    ChannelStatistics& count = s.statistics.channels[c];
    const Sample sample{device, c, decode(profile.channels[c], *t.raw, others), x.sampled_ns(), x.uncertainty_ns()};
    if (sample.value.quality == Quality::absent) {
      t.polled = false;  // another model of the family
      continue;
    }
    if (sample.value.quality == Quality::good) {
      if (count.good++ == 0)
        count.first_ns = sample.sampled_ns;
      else
        count.greatest_interval_ns = std::max(count.greatest_interval_ns, sample.sampled_ns - count.last_ns);
      count.last_ns = sample.sampled_ns;
      t.good_since_ns = x.begin_ns;
      if (t.stale) {
        t.stale = false;
        bus_.watch_again(x.end_ns);  // looks at all limits anew
      }
    } else {
      ++count.bad;
    }
    if (on_sample) on_sample(sample);
  }
}

void Poller::note_failure(std::size_t device, const Exchanged& x) {
  State& s = states_[device];
  ++s.statistics.failures[static_cast<std::size_t>(x.reply.failure)];
  if (x.reply.failure == Failure::exception) s.statistics.last_exception = x.reply.exception;
  if (++s.failures < settings_.failures_until_lost) return;
  s.phase = Phase::lost;
  s.retry_at_ns = x.end_ns + settings_.retry_ns;
}

bool Poller::read(std::size_t device, const ReadGroup& group) {
  const PolledDevice& d = devices_[device];
  State& s = states_[device];
  const Exchanged x = bus_.exchange({d.slave, group.fc, group.address, group.count, {}}, d.timing);
  ++s.statistics.exchanges;
  if (x.reply.failure != Failure::none) {
    note_failure(device, x);
    return false;
  }
  s.failures = 0;
  s.statistics.round_trip_sum_ns += x.end_ns - x.begin_ns;
  s.statistics.round_trip_max_ns = std::max(s.statistics.round_trip_max_ns, x.end_ns - x.begin_ns);
  take(device, group, x);
  return true;
}

void Poller::begin_cycle() {
  turns_.clear();
  next_turn_ = 0;
  const auto divider = static_cast<std::uint64_t>(std::max(1, settings_.slow_divider));
  std::uint64_t slow_index = 0;
  for (std::size_t d = 0; d < states_.size(); ++d) {
    for (std::size_t g = 0; g < states_[d].plan.fast.size(); ++g) turns_.push_back({d, g, false});
    for (std::size_t g = 0; g < states_[d].plan.slow.size(); ++g)
      if (slow_index++ % divider == cycle_ % divider) turns_.push_back({d, g, true});  // spread, so that cycles stay alike
  }
  ++cycle_;
}

void Poller::step() {
  const std::uint64_t cycle = cycle_;
  for (;;) {
    if (next_turn_ >= turns_.size()) {
      const bool nothing_to_do = cycle_ > cycle + static_cast<std::uint64_t>(std::max(1, settings_.slow_divider));
      if (nothing_to_do) {  // every device is lost: there is no neighbour that would wait for another try
        bus_.wait_until(bus_.now_ns() + settings_.retry_alone_ns);
        for (State& s : states_)
          if (s.phase == Phase::lost) s.retry_at_ns = std::min(s.retry_at_ns, bus_.now_ns());
        return;
      }
      begin_cycle();
      continue;
    }
    const Turn turn = turns_[next_turn_++];
    State& s = states_[turn.device];
    if (s.phase == Phase::lost) {
      if (bus_.now_ns() < s.retry_at_ns) continue;
      s.phase = Phase::new_found;
      s.failures = settings_.failures_until_lost - 1;  // one try
      s.once_done = 0;
    }
    if (s.phase == Phase::new_found && s.once_done < s.plan.once.size()) {
      if (read(turn.device, s.plan.once[s.once_done])) {
        ++s.once_done;
        --next_turn_;  // its turn is still to come; a device that does not answer has had it
      }
      return;
    }
    s.phase = Phase::running;
    (void)read(turn.device, turn.slow ? s.plan.slow[turn.group] : s.plan.fast[turn.group]);
    return;
  }
}

void Poller::run_until(std::int64_t time_ns) {
  while (bus_.now_ns() < time_ns) step();
}

std::int64_t Poller::cycle_ns() const {
  std::int64_t total = 0;
  for (std::size_t d = 0; d < states_.size(); ++d)
    for (const ReadGroup& g : states_[d].plan.fast)
      total += exchange_ns(g, devices_[d].timing, static_cast<std::int64_t>(devices_[d].profile.turnaround_ms * 1e6));
  return total;
}

}  // namespace rotorloop::modbus
