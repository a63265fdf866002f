#include "firmware/board/g431/fdcan.hpp"

#include "firmware/board/g431/cortex.hpp"

namespace rotorloop::g431 {
namespace {

using namespace fdcan_bits;

constexpr std::uint32_t kTries = 100'000;

CanFrame frame_of(const FdcanElement& e) {
  const std::uint32_t head = e.word[0].read(), control = e.word[1].read();
  CanFrame f;
  f.extended = (head & kExtended) != 0;
  f.id = f.extended ? head & 0x1FFFFFFFu : head >> 18u & 0x7FFu;
  const std::uint32_t length = control >> 16u & 15u;
  f.length = static_cast<std::uint8_t>(length < 8 ? length : 8);
  const std::uint32_t words[2]{e.word[2].read(), e.word[3].read()};
  for (std::size_t i = 0; i < f.length; ++i) f.data[i] = static_cast<std::uint8_t>(words[i / 4] >> (8u * (i % 4)));
  return f;
}

void write_element(FdcanElement& e, const CanFrame& f) {
  std::uint32_t words[2]{};
  for (std::size_t i = 0; i < f.length; ++i) words[i / 4] |= static_cast<std::uint32_t>(f.data[i]) << (8u * (i % 4));
  e.word[0].write(f.extended ? kExtended | f.id : f.id << 18u);
  e.word[1].write(field(f.length, 16));
  e.word[2].write(words[0]);
  e.word[3].write(words[1]);
}

void clear_memory() {
  FdcanMemory& m = fdcan_memory();
  for (Register& r : m.standard_filter) r.write(0);
  for (auto& f : m.extended_filter) {
    f[0].write(0);
    f[1].write(0);
  }
  for (FdcanElement* list : {m.fifo0, m.fifo1, m.transmit}) {
    for (std::size_t i = 0; i < 3; ++i) {
      for (Register& r : list[i].word) r.write(0);
    }
  }
  for (auto& e : m.events) {
    e[0].write(0);
    e[1].write(0);
  }
}

}  // namespace

bool Fdcan::enter_configuration() {
  FdcanRegisters& f = fdcan();
  f.cccr.set(kInit);
  if (!wait_for([&] { return f.cccr.has(kInit); }, kTries)) return false;
  f.cccr.set(kConfigure);
  return true;
}

bool Fdcan::start(std::uint32_t bit_rate) {
  const auto timing = can_bit_timing(kCore_Hz, bit_rate);
  if (!timing) return false;
  rcc().ccipr.change(rcc_bits::kFdcanMask, rcc_bits::kFdcanFromPclk1);
  rcc().apb1enr1.set(rcc_bits::kFdcan);
  if (!enter_configuration()) return false;
  FdcanRegisters& f = fdcan();
  clear_memory();
  f.ckdiv.write(0);
  f.nbtp.write(timing->nbtp());
  f.rxgfc.write(kAcceptOthers | kRejectRemote);
  f.txbc.write(kQueueMode);
  f.ir.write(0xFFFFFFFF);
  f.ie.write(kNewInFifo0 | kLostInFifo0);
  f.ils.write(0);
  f.ile.write(1);
  f.cccr.clear(kConfigure | kInit);
  return true;
}

void Fdcan::on_interrupt(std::uint64_t now_us) {
  FdcanRegisters& f = fdcan();
  const std::uint32_t flags = f.ir.read();
  f.ir.write(flags & (kNewInFifo0 | kLostInFifo0));  // before the FIFO is emptied: a frame that comes meanwhile calls again
  if ((flags & kLostInFifo0) != 0) ++lost_;
  for (std::uint32_t most = 8; most != 0; --most) {
    const std::uint32_t status = f.rxf0s.read();
    if ((status & 0xFu) == 0) return;
    const std::uint32_t index = status >> 8u & 3u;
    const FdcanElement& e = fdcan_memory().fifo0[index < 3 ? index : 0];
    if (((e.word[0].read() & kRemote) | (e.word[1].read() & kFd)) == 0) ring_.push({frame_of(e), now_us});
    f.rxf0a.write(index);
  }
}

bool Fdcan::ready() const {
  const FdcanRegisters& f = fdcan();
  if (f.psr.has(kBusOff) || f.cccr.has(kInit)) return false;
  const std::uint32_t waiting = f.txbrp.read() & 7u;
  return waiting == 0 || waiting == 1 || waiting == 3;  // the lowest free buffer, which is the next, is above all that wait
}

bool Fdcan::send(const CanFrame& frame) {
  if (!ready() || frame.length > 8) return false;
  FdcanRegisters& f = fdcan();
  const std::uint32_t waiting = f.txbrp.read() & 7u;
  const std::uint32_t index = waiting == 0 ? 0 : waiting == 1 ? 1 : 2;
  write_element(fdcan_memory().transmit[index], frame);
  f.txbar.write(bit(index));
  return true;
}

bool Fdcan::set_filters(std::span<const CanFilter> filters) {
  std::size_t standard = 0, extended = 0;
  for (const CanFilter& filter : filters) ++(filter.extended ? extended : standard);
  if (standard > kStandardFilters || extended > kExtendedFilters || !enter_configuration()) return false;
  FdcanMemory& m = fdcan_memory();
  standard = extended = 0;
  for (const CanFilter& filter : filters) {
    if (filter.extended) {
      m.extended_filter[extended][0].write(field(1, 29) | (filter.id & 0x1FFFFFFFu));
      m.extended_filter[extended++][1].write(field(2, 30) | (filter.mask & 0x1FFFFFFFu));
    } else {
      m.standard_filter[standard++].write(field(2, 30) | field(1, 27) | field(filter.id & 0x7FFu, 16) | (filter.mask & 0x7FFu));
    }
  }
  const std::uint32_t others = filters.empty() ? kAcceptOthers : kRejectOthers;
  fdcan().rxgfc.write(others | kRejectRemote | field(static_cast<std::uint32_t>(standard), 16) |
                      field(static_cast<std::uint32_t>(extended), 24));
  fdcan().cccr.clear(kConfigure | kInit);
  return true;
}

BusState Fdcan::state() const {
  const std::uint32_t status = fdcan().psr.read();
  if ((status & kBusOff) != 0) return BusState::bus_off;
  return (status & kPassive) != 0 ? BusState::error_passive : BusState::error_active;
}

void Fdcan::recover() {
  FdcanRegisters& f = fdcan();
  if (!f.psr.has(kBusOff)) return;
  f.txbcr.write(7);  // what waited is old news
  f.cccr.clear(kInit);
}

}  // namespace rotorloop::g431
