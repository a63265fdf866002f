// Frames of one channel that the adapter has and did not confirm yet, by their echo ids. As many as Linux has at most, with its numbers 0
// to 9. A number is free again when its USB transfer has ended and its echo has come. Pure.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace rotorloop::gs_usb {

class InFlight {
 public:
  static constexpr unsigned kMost = 10;
  static constexpr std::int64_t kLost_ns = 1'000'000'000;  // a later frame is confirmed: no frame waits that long behind it

  std::optional<std::uint32_t> begin(std::int64_t now_ns) {
    for (std::uint32_t id = 0; id < kMost; ++id) {
      if (entries_[id].on_usb || entries_[id].unconfirmed) continue;
      entries_[id] = {.on_usb = true, .unconfirmed = true, .since_ns = now_ns};
      return id;
    }
    return std::nullopt;
  }
  // The transfer of `id` ended. Returns whether a frame was lost by that: true when it did not reach the adapter.
  bool transferred(std::uint32_t id, bool reached) {
    if (id >= kMost) return false;
    entries_[id].on_usb = false;
    const bool lost = !reached && entries_[id].unconfirmed;
    if (lost) entries_[id].unconfirmed = false;
    return lost;
  }
  // False for an echo of no frame that waits for one.
  bool confirmed(std::uint32_t id) {
    if (id >= kMost || !entries_[id].unconfirmed) return false;
    entries_[id].unconfirmed = false;
    if (entries_[id].since_ns > newest_confirmed_ns_) newest_confirmed_ns_ = entries_[id].since_ns;
    return true;
  }
  // Gives up frames whose echo is lost, so that their numbers are free again; returns how many.
  std::size_t give_up_lost() {
    std::size_t lost = 0;
    for (Entry& e : entries_) {
      if (!e.unconfirmed || newest_confirmed_ns_ - e.since_ns < kLost_ns) continue;
      e.unconfirmed = false;
      ++lost;
    }
    return lost;
  }
  // None of them reaches the bus any more; returns how many. Numbers whose transfer goes on are not free yet.
  std::size_t clear() {
    const std::size_t lost = unconfirmed();
    for (Entry& e : entries_) e.unconfirmed = false;
    return lost;
  }
  std::size_t unconfirmed() const {
    std::size_t count = 0;
    for (const Entry& e : entries_) count += e.unconfirmed ? 1 : 0;
    return count;
  }

 private:
  struct Entry {
    bool on_usb = false, unconfirmed = false;
    std::int64_t since_ns = 0;
  };
  std::array<Entry, kMost> entries_{};
  std::int64_t newest_confirmed_ns_ = INT64_MIN / 2;
};

}  // namespace rotorloop::gs_usb
