// What FDCAN1 does with a frame that it heard: filters in their order, then the receive FIFOs (RM0440, 44.3.4 and 44.3.5).
#include <algorithm>

#include "sim/mcu/g431/fdcan/fdcan.hpp"
#include "sim/mcu/g431/fdcan/fdcan_bits.hpp"

namespace rotorloop::mcu::g431 {

using namespace fdcan;

namespace {

constexpr uint8_t kDisabled = 0, kToFifo0 = 1, kToFifo1 = 2, kReject = 3, kPriority = 4;
enum FilterType : uint32_t { kRange = 0, kDual = 1, kMask = 2 };

bool fits(uint32_t type, uint32_t first, uint32_t second, uint32_t id) {
  if (type == kRange) return id >= first && id <= second;
  return type == kDual ? id == first || id == second : ((id ^ first) & second) == 0;
}

}  // namespace

Fdcan::Match Fdcan::match_standard(uint32_t id) {
  const uint32_t count = std::min(field(RXGFC, 16, 5), 28u);
  for (uint32_t n = 0; n < count; ++n) {
    const uint32_t element = ram_.word(kStandardFilters + 4 * n), type = element >> 30;
    const auto action = static_cast<uint8_t>(element >> 27 & 7);
    if (type != 3 && action != kDisabled && fits(type, element >> 16 & 0x7FF, element & 0x7FF, id))
      return {action, static_cast<uint8_t>(n), false};
  }
  return {static_cast<uint8_t>(std::min(field(RXGFC, 4, 2) + 1, 3u)), 0, true};
}

// The mask XIDAM lies over the identifier first, but not for type 3, a range without it.
Fdcan::Match Fdcan::match_extended(uint32_t id) {
  const uint32_t count = std::min(field(RXGFC, 24, 4), 8u);
  for (uint32_t n = 0; n < count; ++n) {
    const uint32_t first = ram_.word(kExtendedFilters + 8 * n), second = ram_.word(kExtendedFilters + 8 * n + 4), type = second >> 30;
    const auto action = static_cast<uint8_t>(first >> 29);
    const uint32_t compared = type == 3 ? id : id & reg(XIDAM);
    if (action != kDisabled && fits(type == 3 ? kRange : type, first & 0x1FFFFFFF, second & 0x1FFFFFFF, compared))
      return {action, static_cast<uint8_t>(n), false};
  }
  return {static_cast<uint8_t>(std::min(field(RXGFC, 2, 2) + 1, 3u)), 0, true};
}

Fdcan::Match Fdcan::match(const CanFrame& frame) { return frame.extended ? match_extended(frame.id) : match_standard(frame.id); }

void Fdcan::take_in(const CanFrame& frame, int64_t start_ns) {
  FdcanMore& m = s.more;
  if (!m.sending) {
    const int32_t before = m.receive_errors;
    if (before > 0) m.receive_errors = before > 127 ? 119 : before - 1;
    m.last_error = kNoError;
    follow_errors(m.transmit_errors, before);
  }
  const Match found = match(frame);
  if (found.action == kReject || found.action > 6) return;
  const bool priority = found.action >= kPriority;
  const uint32_t target = priority ? found.action - kPriority : found.action;  // 1: FIFO 0, 2: FIFO 1, 0: none
  uint32_t stored = 0;                                                         // MSI: none, lost, in FIFO 0, in FIFO 1
  const uint8_t index = target != 0 ? m.rx[target - 1].put() : 0;
  if (target == kToFifo0) stored = store(0, frame, found, start_ns) ? 2 : 1;
  if (target == kToFifo1) stored = store(1, frame, found, start_ns) ? 3 : 1;
  if (!priority) return;
  reg(HPMS) = uint32_t{frame.extended} << 15 | uint32_t{found.filter} << 8 | stored << 6 | index;
  flag(HPM);
}

// A full FIFO keeps what it has and loses the frame (blocking), or gives up its oldest element (overwrite).
bool Fdcan::store(uint32_t which, const CanFrame& frame, const Match& found, int64_t start_ns) {
  FdcanMore::Fifo& fifo = s.more.rx[which];
  const bool overwrite = bit(RXGFC, which == 0 ? 9 : 8);
  const uint32_t shift = 3 * which;
  if (fifo.fill == 3 && !overwrite) {
    flag(RF0L << shift);
    return false;
  }
  const uint32_t at = (which == 0 ? kRxFifo0 : kRxFifo1) + fifo.put() * kElementBytes;
  ram_.word(at) = frame.extended ? kExtended | frame.id : frame.id << 18;
  ram_.word(at + 4) = uint32_t{found.none} << 31 | uint32_t{found.filter} << 24 | uint32_t{frame.length} << 16 | time_stamp(start_ns);
  for (uint32_t i = 0; i < frame.length; i += 4)
    ram_.word(at + 8 + i) =
        frame.data[i] | uint32_t{frame.data[i + 1]} << 8 | uint32_t{frame.data[i + 2]} << 16 | uint32_t{frame.data[i + 3]} << 24;
  if (fifo.fill == 3)
    fifo.get = static_cast<uint8_t>((fifo.get + 1) % 3);
  else
    ++fifo.fill;
  flag((RF0N << shift) | (fifo.fill == 3 ? RF0F << shift : 0));
  return true;
}

}  // namespace rotorloop::mcu::g431
