// Asks an allocator for a node id (DroneCAN, "Dynamic node ID allocation"): anonymous requests with 6, 6 and 4 bytes of the unique id,
// each repeated by the allocator with all that it knows. Done when all 16 bytes come back with an id. Random pauses keep the
// clients of a bus from asking at the same time: 600 to 1000 ms before a first part, up to 400 ms before the parts that follow.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "protocols/transfer.hpp"
#include "protocols/types/param.hpp"

namespace rotorloop::firmware {

class AllocationClient {
 public:
  AllocationClient(const std::array<std::uint8_t, 16>& unique_id, std::uint8_t preferred_id)
      : unique_id_(unique_id),
        random_(protocols::crc16(protocols::kCrc16Start, unique_id) * 2654435761u + 1u),
        preferred_id_(preferred_id) {}

  // The request that is due, at most one.
  std::optional<CanFrame> poll(std::uint64_t now_us) {
    using protocols::Allocation;
    if (!started_) {
      started_ = true;
      wait_first_part(now_us);
    }
    if (now_us < next_us_) return std::nullopt;
    Allocation request{.node_id = preferred_id_, .first_part = known_ == 0, .unique_id = {}};
    for (std::size_t i = known_; i < std::min(known_ + Allocation::kMaxIdBytesInRequest, unique_id_.size()); ++i) {
      request.unique_id.push_back(unique_id_[i]);
    }
    // No answer to a following part: begin anew.
    wait_first_part(now_us);
    std::array<std::uint8_t, 7> payload{};
    const std::size_t size = encode(request, payload);
    CanFrame frame;
    // The discriminator differs from try to try, so that two nodes that collided once do not collide for ever.
    protocols::encode_transfer({.kind = protocols::TransferKind::message,
                                .priority = kPriority,
                                .data_type_id = Allocation::kType.id,
                                .source = protocols::kNoNode,
                                .discriminator = static_cast<std::uint16_t>(next_random() & 0x3FFFu)},
                               Allocation::kType.crc_seed(), transfer_id_.next(), {payload.data(), size}, [&](const CanFrame& f) {
                                 frame = f;
                                 return true;
                               });
    return frame;
  }

  // An allocator's message. The id when it is ours.
  std::optional<std::uint8_t> on_message(const protocols::Allocation& a, std::uint64_t now_us) {
    const auto theirs = a.unique_id.view();
    if (theirs.empty() || !std::equal(theirs.begin(), theirs.end(), unique_id_.begin())) {
      wait_first_part(now_us);  // it is serving someone else
      return std::nullopt;
    }
    if (theirs.size() == unique_id_.size()) {
      if (a.node_id != 0) return a.node_id;
      wait_first_part(now_us);
      return std::nullopt;
    }
    known_ = theirs.size();
    next_us_ = now_us + next_random() % std::uint32_t{protocols::Allocation::kFollowUpMax_us};
    return std::nullopt;
  }

 private:
  static constexpr std::uint8_t kPriority = 30;

  void wait_first_part(std::uint64_t now_us) {
    using protocols::Allocation;
    known_ = 0;
    next_us_ = now_us + Allocation::kRequestPeriodMin_us +
               next_random() % std::uint32_t{Allocation::kRequestPeriodMax_us - Allocation::kRequestPeriodMin_us};
  }
  // Of the upper half: the lower bits of such a generator repeat soon.
  std::uint32_t next_random() {
    random_ = random_ * 6364136223846793005u + 1442695040888963407u;
    return static_cast<std::uint32_t>(random_ >> 33);
  }

  std::array<std::uint8_t, 16> unique_id_;
  std::uint64_t next_us_ = 0;
  std::uint64_t random_;
  std::size_t known_ = 0;  // bytes of our id that the allocator has repeated
  protocols::TransferIdCounter transfer_id_;
  std::uint8_t preferred_id_;
  bool started_ = false;
};

}  // namespace rotorloop::firmware
