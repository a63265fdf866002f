#include "host/tools/replay.hpp"

#include <algorithm>

#include "host/tools/frame_text.hpp"

namespace rotorloop::tools {

std::optional<std::int64_t> Replay::step(TimedBus& bus) {
  for (; next_ < log_.frames.size(); ++next_) {
    const LoggedFrame& f = log_.frames[next_];
    const auto offset_ns = static_cast<std::int64_t>(static_cast<double>(f.time_ns - log_.frames.front().time_ns) / options_.pace);
    const std::int64_t late_ns = bus.now_ns() - (start_ns_ + offset_ns);
    if (late_ns < 0) return start_ns_ + offset_ns;
    if (!options_.with_commands && frame_kind(f.frame).moves_motors) {
      ++counters_.commands_left_out;
      continue;
    }
    counters_.latest_ns = std::max(counters_.latest_ns, late_ns);
    ++(bus.send_any(f.frame) == SendStatus::queued ? counters_.sent : counters_.refused);
  }
  return std::nullopt;
}

}  // namespace rotorloop::tools
