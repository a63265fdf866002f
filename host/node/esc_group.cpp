#include "host/node/esc_group.hpp"

#include <algorithm>
#include <limits>

namespace rotorloop::host {

namespace fast = protocols::fast;

std::int64_t EscFeedback::age_us(std::int64_t now_us) const {
  return heard ? now_us - arrival_us : std::numeric_limits<std::int64_t>::max();
}

EscGroup::EscGroup(std::uint8_t group, int feedback_divider)
    : group_(group & 3u), divider_(static_cast<std::uint8_t>(feedback_divider == 2 || feedback_divider == 4 ? feedback_divider : 1)) {}

CanFrame EscGroup::encode(fast::SetpointMode mode, const std::array<float, 4>& values, std::int64_t now_us) {
  sequence_ = static_cast<std::uint8_t>((sequence_ + 1u) % fast::kSequenceModulo);
  fast::Setpoint s{.mode = mode, .group = group_, .sequence = sequence_};
  for (int i = 0; i < fast::kEscsPerGroup; ++i) s.set(i, values[static_cast<std::size_t>(i)]);
  sent_us_[sequence_] = now_us;
  sent_[sequence_] = true;
  return fast::encode(s);
}

bool EscGroup::on_frame(const CanFrame& frame, std::int64_t arrival_us) {
  const auto f = fast::decode_feedback(frame);
  if (!f || f->esc_index / fast::kEscsPerGroup != group_) return false;
  EscFeedback& e = escs_[f->esc_index % fast::kEscsPerGroup];
  const std::int64_t round_trip_us = arrival_us - sent_us_[f->sequence];
  if (sent_[f->sequence] && round_trip_us >= 0 && round_trip_us <= kAnswerWindow_us) {
    e.round_trip_us = round_trip_us;
    e.worst_round_trip_us = std::max(e.worst_round_trip_us, e.round_trip_us);
  } else {
    ++e.unexpected;
  }
  if (e.heard) {
    const unsigned ahead = fast::sequence_ahead(f->sequence, e.last.sequence);
    if (ahead > divider_) e.lost += ahead / divider_ - 1u;
  }
  e.last = *f;
  e.arrival_us = arrival_us;
  e.heard = true;
  ++e.received;
  return true;
}

}  // namespace rotorloop::host
