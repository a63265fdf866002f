// FDCAN1 on its bus: which buffer takes part in an arbitration, what becomes of frames, error confinement of ISO 11898-1 (12.1.4).
#include <algorithm>
#include <cmath>

#include "host/bus/frame_bits.hpp"
#include "sim/mcu/g431/fdcan/fdcan.hpp"
#include "sim/mcu/g431/fdcan/fdcan_bits.hpp"
#include "sim/world/virtual_bus_port.hpp"
#include "sim/world/virtual_time.hpp"

namespace rotorloop::mcu::g431 {

using namespace fdcan;

bool Fdcan::in_time(int64_t wire_bit_ns) const {
  return std::abs(bit_ns() - static_cast<double>(wire_bit_ns)) <= 0.01 * static_cast<double>(wire_bit_ns);  // 1.58 % at best (ISO 11898-1)
}

bool Fdcan::acknowledges(int64_t) const { return started() && ((reg(CCCR) & MON) == 0); }

// Since when the buffer that comes first may take part in an arbitration.
int64_t Fdcan::first_request_ns() const {
  const FdcanMore& m = s.more;
  if (!started() || !sends_frames() || m.pending == 0) return sim::kNever_ns;
  int64_t first_ns = sim::kNever_ns;
  for (uint32_t b = 0; b < 3; ++b)
    if ((m.pending >> b & 1) != 0 && (queue_mode() || b == m.tx_get)) first_ns = std::min(first_ns, m.asked_ns[b]);
  return std::max({first_ns, m.recessive_from_ns, m.suspended_until_ns});
}

int64_t Fdcan::ready_ns() const { return loops_back() && (reg(CCCR) & MON) != 0 ? sim::kNever_ns : first_request_ns(); }

// FIFO: in the order of requests. Queue: the lowest identifier, of equal ones the lowest buffer (44.3.6).
int Fdcan::best_buffer(int64_t time_ns) const {
  const FdcanMore& m = s.more;
  if (!queue_mode()) return (m.pending >> m.tx_get & 1) != 0 && m.asked_ns[m.tx_get] <= time_ns ? m.tx_get : -1;
  int best = -1;
  uint32_t best_key = 0;
  for (uint32_t b = 0; b < 3; ++b) {
    if ((m.pending >> b & 1) == 0 || m.asked_ns[b] > time_ns) continue;
    const uint32_t key = arbitration_key(frame_of(b));
    if (best < 0 || key < best_key) {
      best = static_cast<int>(b);
      best_key = key;
    }
  }
  return best;
}

CanFrame Fdcan::frame_of(uint32_t buffer) const {
  const uint32_t at = kTxBuffers + buffer * kElementBytes, first = ram_.word(at), second = ram_.word(at + 4);
  CanFrame frame;
  frame.extended = (first & kExtended) != 0;
  frame.id = frame.extended ? first & 0x1FFFFFFF : first >> 18 & 0x7FF;
  frame.length = static_cast<uint8_t>(std::min(second >> 16 & 15, 8u));
  for (uint32_t i = 0; i < frame.length; ++i) frame.data[i] = static_cast<uint8_t>(ram_.word(at + 8 + i / 4 * 4) >> 8 * (i % 4));
  return frame;
}

const CanFrame* Fdcan::offer(int64_t time_ns) { return ready_ns() <= time_ns ? offer_at(time_ns) : nullptr; }

const CanFrame* Fdcan::offer_at(int64_t time_ns) {
  s.more.offered = best_buffer(time_ns);
  if (s.more.offered < 0) return nullptr;
  s.more.frame = frame_of(static_cast<uint32_t>(s.more.offered));
  return &s.more.frame;
}

void Fdcan::on_start(int64_t time_ns, bool own) {
  hear_recessive(time_ns);
  s.more.sending = own;
  s.more.hearing = !own;
}

void Fdcan::on_end(const sim::FrameEnd& end) {
  FdcanMore& m = s.more;
  const bool lost = m.offered >= 0 && !end.own;
  const bool took_part = started();
  m.hearing = false;
  m.sending = end.own && !end.error;  // until what follows is done
  m.recessive_from_ns = end.end_ns + bits_ns(kIntermissionBits);
  if (!took_part) {  // delimiter, end of frame and intermission are 11 recessive bits
    if (m.recovery_left > 0 && (reg(CCCR) & INIT) == 0) --m.recovery_left;
    hear_recessive(end.end_ns);
    m.sending = false;
    m.offered = -1;
    return;
  }
  if (end.own && !end.error && m.offered >= 0)
    sent(end);
  else if (end.own)
    count_error(true, end.acknowledge_missing, end.acknowledge_missing ? kAckError : kBit1Error);
  else if (end.error)
    count_error(false, false, kStuffError);
  else
    take_in(*end.frame, end.start_ns);
  m.sending = false;
  if (m.offered >= 0 && (lost || end.error)) {  // tried and not sent: again, unless told otherwise
    const uint32_t bit = 1u << m.offered;
    if ((m.cancelling & bit) != 0 || (reg(CCCR) & DAR) != 0) not_sent(static_cast<uint32_t>(m.offered));
  }
  if (end.own && passive()) m.suspended_until_ns = end.end_ns + bits_ns(kIntermissionBits + sim::kSuspendBits);
  m.offered = -1;
}

void Fdcan::sent(const sim::FrameEnd& end) {
  FdcanMore& m = s.more;
  const auto buffer = static_cast<uint32_t>(m.offered);
  const int32_t before = m.transmit_errors;
  m.transmit_errors = std::max(0, before - 1);
  m.last_error = kNoError;
  follow_errors(before, m.receive_errors);
  record_event(buffer, end.start_ns);
  const bool in_spite = (m.cancelling >> buffer & 1) != 0;
  finish_request(buffer, true);
  if (in_spite) m.cancelled |= 1u << buffer;
  if (loops_back()) take_in(m.frame, end.start_ns);
}

// One element for each buffer that asks for it; 3 fit (44.3.6).
void Fdcan::record_event(uint32_t buffer, int64_t start_ns) {
  FdcanMore& m = s.more;
  const uint32_t from = kTxBuffers + buffer * kElementBytes, second = ram_.word(from + 4);
  if ((second & kEventWanted) == 0) return;
  if (m.events.fill == 3) return flag(TEFL);
  const bool in_spite = (m.cancelling >> buffer & 1) != 0 || (reg(CCCR) & DAR) != 0;
  const uint32_t to = kTxEvents + m.events.put() * kEventBytes;
  ram_.word(to) = ram_.word(from);
  ram_.word(to + 4) = (second & 0xFF3F0000) | (in_spite ? 2u : 1u) << 22 | time_stamp(start_ns);
  ++m.events.fill;
  flag(m.events.fill == 3 ? TEFN | TEFF : TEFN);
}

void Fdcan::count_error(bool transmitting, bool acknowledge_missing, uint8_t code) {
  FdcanMore& m = s.more;
  const int32_t transmit_before = m.transmit_errors, receive_before = m.receive_errors;
  // A passive node that only misses the acknowledge may be alone: it must not go bus-off for that. Restricted operation counts nothing.
  const bool frozen = (reg(CCCR) & ASM) != 0;
  if (transmitting && !frozen && !(acknowledge_missing && passive())) m.transmit_errors += sim::kTransmitErrorStep;
  if (!transmitting && !frozen) m.receive_errors = std::min(m.receive_errors + 1, 255);
  m.last_error = code;
  flag(PEA);
  if (m.transmit_errors != transmit_before || m.receive_errors != receive_before) {
    if (m.logged_errors == 255) flag(ELO);
    m.logged_errors = static_cast<uint8_t>(std::min(m.logged_errors + 1, 255));
  }
  follow_errors(transmit_before, receive_before);
}

// Flags of the states that changed: warning at 96, passive at 128, bus-off at 256, which sets INIT.
void Fdcan::follow_errors(int32_t transmit_before, int32_t receive_before) {
  FdcanMore& m = s.more;
  const auto above = [](int32_t transmit, int32_t receive, int32_t limit) { return transmit > limit || receive > limit; };
  if (above(transmit_before, receive_before, 95) != above(m.transmit_errors, m.receive_errors, 95)) flag(EW);
  if (above(transmit_before, receive_before, 127) != above(m.transmit_errors, m.receive_errors, 127)) flag(EP);
  if (m.transmit_errors <= sim::kBusOffAbove || m.bus_off) return;
  m.bus_off = true;
  reg(CCCR) |= INIT;
  flag(BO);
  stop();
}

// Recessive bits since the bus fell silent, while it waits for them.
void Fdcan::hear_recessive(int64_t until_ns) {
  FdcanMore& m = s.more;
  if (m.recovery_left == 0 || (reg(CCCR) & INIT) != 0 || m.hearing || bit_ns() <= 0) return;
  while (m.recovery_left > 0 && m.recessive_from_ns + bits_ns(kRecessiveBits) <= until_ns) {
    m.recessive_from_ns += bits_ns(kRecessiveBits);
    --m.recovery_left;
    if (m.bus_off) m.last_error = kBit0Error;  // shows that the bus is not stuck (44.4.13)
  }
  if (m.recovery_left > 0) return;
  if (m.bus_off) {
    m.bus_off = false;
    m.transmit_errors = m.receive_errors = 0;
    flag(BO);
  }
  if (medium_ != nullptr && ready_ns() != sim::kNever_ns) medium_->has_frame(ready_ns());
}

// TEST.LBCK with CCCR.MON: frames go from transmit buffers to receive FIFOs in their bus time and never reach the pin (44.3.3).
void Fdcan::run_internal_loop(int64_t until_ns) {
  FdcanMore& m = s.more;
  if (!loops_back() || (reg(CCCR) & MON) == 0 || !started()) return;
  for (;;) {
    if (m.loop_end_ns == 0) {
      const int64_t start_ns = first_request_ns();
      if (start_ns > until_ns || offer_at(start_ns) == nullptr) return;
      m.recessive_from_ns = start_ns;
      m.loop_end_ns = start_ns + bits_ns(frame_bits(m.frame));
      m.sending = true;
    }
    if (m.loop_end_ns > until_ns) return;
    const sim::FrameEnd end{&m.frame, m.recessive_from_ns, m.loop_end_ns, true, false, false};
    m.loop_end_ns = 0;
    on_end(end);
  }
}

}  // namespace rotorloop::mcu::g431
