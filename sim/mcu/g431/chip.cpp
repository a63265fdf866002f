// The loop that gives core and blocks their time, and the wires between them.
#include "sim/mcu/g431/chip.hpp"

#include <algorithm>
#include <cstring>

#include "sim/mcu/g431/blocks.hpp"

namespace rotorloop::mcu::g431 {
namespace {

constexpr uint32_t kPages = 0x300 + 0x20 + 0x20 + 4;

// 256 bytes each: APB and AHB1 from 0x40000000, GPIO from 0x48000000, ADC and DAC from 0x50000000, DBGMCU.
int page_of(uint32_t address) {
  if (address - 0x40000000u < 0x30000u) return static_cast<int>((address - 0x40000000u) >> 8);
  if (address - 0x48000000u < 0x2000u) return static_cast<int>(0x300 + ((address - 0x48000000u) >> 8));
  if (address - 0x50000000u < 0x2000u) return static_cast<int>(0x320 + ((address - 0x50000000u) >> 8));
  if (address - 0xE0042000u < 0x400u) return static_cast<int>(0x340 + ((address - 0xE0042000u) >> 8));
  return -1;
}

}  // namespace

Chip::Chip(uint64_t unique_id, const Clocks& crystals)
    : flash_(kFlashBytes, 0xFF), ram_(0x8000), information_(kInformationBytes, 0xFF), core_(map(), *this, 131072) {
  time_.clocks = crystals;
  blocks_ = std::make_unique<Blocks>(*this);
  pages_.resize(kPages);
  listeners_.resize(static_cast<size_t>(Signal::count));
  blocks_->visit([&](Block& block) {
    block.order = static_cast<uint32_t>(all_.size());
    all_.push_back(&block);
    for (uint32_t a = block.base; a < block.base + block.size_bytes; a += 256) {
      Block*& first = pages_[static_cast<size_t>(page_of(a))];
      if (first == nullptr) first = &block;
    }
    for (uint32_t n = 0; n < listeners_.size(); ++n)
      if (n != 0 && block.listens(static_cast<Signal>(n))) listeners_[n].push_back(&block);
  });
  fill_information(unique_id);
  power_up();
}

Chip::~Chip() = default;

MemoryMap& Chip::map() {
  memories_.add({flash_.data(), 0, kFlashBytes, false, true, false});  // the boot alias
  memories_.add({flash_.data(), kFlashBase, kFlashBytes, false, true, false});
  memories_.add({information_.data(), kInformationBase, kInformationBytes, false, true, false});
  memories_.add({ram_.data() + kSramBytes, kCcmBase, kCcmBytes, true, false, false});
  memories_.add({ram_.data(), kSramBase, kSramBytes + kCcmBytes, true, false, false});  // CCM again behind SRAM2
  return memories_;
}

// Identity and calibration words (RM0440, 47; DS12589, 3.18): of a typical part, 30 degC and 110 degC at 3.0 V.
void Chip::fill_information(uint64_t unique_id) {
  const auto put = [&](uint32_t address, uint64_t value, size_t bytes) {
    std::memcpy(&information_[address - kInformationBase], &value, bytes);
  };
  put(0x1FFF7590, unique_id, 8);
  put(0x1FFF7598, 0x20313436, 4);
  put(0x1FFF75E0, kFlashBytes / 1024, 2);
  put(0x1FFF7500, 0x1, 2);                  // UFQFPN48
  put(0x1FFF75A8, 1037, 2);                 // TS_CAL1
  put(0x1FFF75CA, 1378, 2);                 // TS_CAL2
  put(0x1FFF75AA, 1655, 2);                 // VREFINT
  put(0x1FFF7800, 0x00100755FFEFF8AAu, 8);  // option bytes as delivered, with their complements
}

uint8_t* Chip::memory(uint32_t address, uint32_t bytes) {
  MemoryRegion& r = memories_.at(address);
  const uint32_t offset = address - r.base;
  return address >= r.base && offset < r.size_bytes && bytes <= r.size_bytes - offset ? r.bytes + offset : nullptr;
}

void Chip::flash_changed(uint32_t address, uint32_t bytes) {
  core_.code_changed(address, bytes);
  core_.code_changed(address - kFlashBase, bytes);
}

void Chip::power_up(uint8_t ram) {
  std::fill(ram_.begin(), ram_.end(), ram);
  reset(kPinReset | kBrownOutReset, true);
}

void Chip::reset(uint32_t rcc_csr_flags, bool power_up) {
  reset_flags_ = 0;
  now_ = core_.cycle();
  for (Block* block : all_) block->clocks_change();
  for (auto& held : lines_.held) held = 0;
  for (uint32_t n = 0; n < kInterrupts; ++n) core_.set_interrupt_line(n, false);
  Clocks at_reset;
  at_reset.hse_Hz = time_.clocks.hse_Hz;
  at_reset.lse_Hz = time_.clocks.lse_Hz;
  time_ = {at_reset, now_, time_s_at(now_)};
  core_.set_clocking(Clocking::flash, 0);
  for (Block* block : all_) block->reset(power_up);
  ask_all();
  next_due_ = due_.first();
  blocks_->rcc.add_reset_cause(rcc_csr_flags | kPinReset);  // every internal cause pulls the pin too (RM0440, 7.1.2)
  core_.state.nvic.line = {};
  core_.reset(0);
  if (!power_up) ++counts_.resets;
}

double Chip::time_s_at(uint64_t cycle) const { return time_.from_s + static_cast<double>(cycle - time_.from_cycle) / time_.clocks.hclk_Hz; }

uint64_t Chip::cycle_at(double time_s) const {
  return time_.from_cycle + static_cast<uint64_t>(std::max(0.0, time_s - time_.from_s) * time_.clocks.hclk_Hz);
}

void Chip::change_clocks(const Clocks& clocks) {
  for (Block* block : all_) block->clocks_change();
  time_ = {clocks, now_, time_s_at(now_)};
  for (Block* block : all_) block->clocks_changed();
  ask_all();
  next_due_ = std::max(now_, due_.first());
  core_.stop_at(next_due_);
}

void Chip::reset_behind(uint8_t gate_offset, uint32_t bits) {
  for (Block* block : all_) {
    if (block->gate.offset != gate_offset || (bits >> block->gate.bit & 1) == 0) continue;
    for (uint32_t line = 0; line < kInterrupts; ++line) set_interrupt(*block, line, false);
    block->reset(false);
    reschedule(*block);
  }
}

void Chip::ask_all() {
  for (uint32_t n = 0; n < all_.size(); ++n) due_.set(n, all_[n]->next_event());
}

End Chip::run_until(uint64_t cycle) {
  while (core_.cycle() < cycle || ended_ || stop_asked_) {
    if (ended_) {
      ended_ = false;
      return End::refused;
    }
    if (stop_asked_) {
      stop_asked_ = false;
      return End::stopped;
    }
    const Stopped stopped = core_.run_until(std::min(cycle, next_due_));
    settle(core_.cycle());
    if (stopped == Stopped::reset_request) reset_flags_ |= kSoftwareReset;
    if (reset_flags_ != 0) {
      reset(reset_flags_, false);
      continue;
    }
    if (stopped == Stopped::locked_up && !ignore_lock_up) return End::locked_up;
    if (stopped == Stopped::breakpoint) return End::breakpoint;
  }
  return End::at_cycle;
}

void Chip::settle(uint64_t cycle) {
  while (next_due_ <= cycle) {
    const uint64_t first = due_.first();
    if (first > cycle) {
      next_due_ = first;
      break;
    }
    now_ = std::max(now_, first);
    const uint32_t n = due_.whose();
    all_[n]->advance(now_);
    due_.set(n, all_[n]->next_event());
    next_due_ = 0;
  }
  now_ = std::max(now_, cycle);
}

void Chip::reschedule(const Block& block) {
  const uint64_t due = block.next_event();
  due_.set(block.order, due);
  next_due_ = std::min(next_due_, due);
  if (due != kNever) core_.stop_at(due);
}

void Chip::set_interrupt(const Block& from, uint32_t line, bool high) {
  uint64_t& held = lines_.held[line];
  const uint64_t bit = uint64_t{1} << from.order;
  if (((held & bit) != 0) == high) return;
  const bool was = held != 0;
  held ^= bit;
  if ((held != 0) != was) core_.set_interrupt_line(line, held != 0);
}

void Chip::set_signal(Signal signal, bool high) {
  if (levels_[index(signal)] == high) return;
  levels_[index(signal)] = high;
  for (Block* block : listeners_[index(signal)]) {
    block->on_signal(signal, high);
    reschedule(*block);
  }
  if (pins != nullptr && pins->heard(signal)) pins->on_signal(signal, high);
}

void Chip::set_pin(uint32_t pin, Level level) { blocks_->port_of(pin).set_external(pin % 16, level); }

void Chip::set_dma_request(uint32_t request, bool high) {
  blocks_->dmamux.on_dma_request(request, high);
  if (!high) return;
  blocks_->dma1.on_dma_request(request, false);
  blocks_->dma2.on_dma_request(request, false);
}

void Chip::pulse_dma_request(uint32_t request) {
  blocks_->dma1.on_dma_request(request, true);
  blocks_->dma2.on_dma_request(request, true);
}

Block* Chip::at(uint32_t address) const {
  const int page = page_of(address);
  if (page < 0) return nullptr;
  Block* block = pages_[static_cast<size_t>(page)];
  for (size_t n = block != nullptr ? block->order : all_.size(); n < all_.size(); ++n)
    if (address - all_[n]->base < all_[n]->size_bytes) return all_[n];
  return nullptr;
}

bool Chip::refuse_access(const char* block, const char* name, const char* why) {
  doing_.block = block;
  doing_.reg = name;
  refuse(why);
  return true;
}

void Chip::refuse(const char* why) {
  doing_.why = why;
  access_refused_ = true;
  ++counts_.refused;
  if (lenient) {
    if (counts_.refused == 1) refused_ = doing_;
    return;
  }
  refused_ = doing_;
  ended_ = true;
  core_.stop_at(0);
}

bool Chip::access(uint32_t address, uint32_t bytes, uint32_t& value, bool write, bool by_core) {
  if (by_core) settle(core_.cycle());
  doing_ = {"", "", "", address, bytes, value, core_.state.r[kPc], write, now_};
  if (write && (address < kFlashBytes || address - kFlashBase < kFlashBytes || address - kInformationBase < kInformationBytes)) {
    doing_.block = blocks_->flash.name;
    blocks_->flash.store(address, bytes, value);
    reschedule(blocks_->flash);
    return true;
  }
  Block* block = at(address);
  if (block == nullptr) {
    for (const NotBuilt& n : not_built()) {
      if (address - n.base >= n.size_bytes) continue;
      if (!write) value = 0;
      return refuse_access(n.name, "", "this block is not built");
    }
    // Trace and breakpoint units of the core: they read 0 and do nothing, as without a debugger's set-up.
    if (address >> 20 == 0xE00) {
      if (!write) value = 0;
      return true;
    }
    return false;  // nothing answers there: a bus fault, as on the chip
  }
  doing_.block = block->name;
  if (!blocks_->rcc.clocked(block->gate)) {
    ++counts_.unclocked;
    if (!write) value = 0;
    return true;
  }
  const uint32_t offset = (address - block->base) & ~3u;
  const Register* found = block->find(offset);
  if (!write) value = 0;
  if (found == nullptr) return refuse_access(block->name, "", "there is no such register");
  doing_.reg = found->name;
  if ((block->widths() & bytes) == 0) return refuse_access(block->name, found->name, "accesses of this width are not allowed");
  const uint32_t shift = 8 * (address & 3), mask = (bytes == 4 ? ~0u : (1u << 8 * bytes) - 1) << shift;
  if (write)
    block->write(offset, (value << shift) & mask, mask);
  else
    value = (block->read(offset) & mask) >> shift;
  reschedule(*block);
  return true;
}

bool Chip::read(uint32_t address, uint32_t bytes, uint32_t& value) { return access(address, bytes, value, false, true); }
bool Chip::write(uint32_t address, uint32_t bytes, uint32_t value) { return access(address, bytes, value, true, true); }

bool Chip::bus_read(uint32_t address, uint32_t bytes, uint32_t& value) {
  const uint8_t* here = memory(address, bytes);
  if (here == nullptr) return access(address, bytes, value, false, false);
  value = 0;
  std::memcpy(&value, here, bytes);
  return true;
}

bool Chip::bus_write(uint32_t address, uint32_t bytes, uint32_t value) {
  uint8_t* here = memory(address, bytes);
  if (here == nullptr || !memories_.at(address).writable) return access(address, bytes, value, true, false);
  std::memcpy(here, &value, bytes);
  if (memories_.at(address).holds_code(address)) core_.code_changed(address, bytes);
  return true;
}

void Chip::on_access(uint32_t address, uint32_t, Access kind) {
  if (kind == Access::write) return;
  settle(core_.cycle());
  blocks_->flash.loaded(address);
  reschedule(blocks_->flash);
}

template <class Visit>
void Chip::visit_state(Visit&& visit) const {
  auto* self = const_cast<Chip*>(this);
  const auto plain = [&](auto& value) { visit(std::as_writable_bytes(std::span(&value, 1))); };
  visit(std::as_writable_bytes(std::span(self->flash_)));
  visit(std::as_writable_bytes(std::span(self->ram_)));
  visit(std::as_writable_bytes(std::span(self->information_)));
  plain(self->core_.state);
  plain(self->levels_);
  plain(self->lines_);
  plain(self->time_);
  plain(self->counts_);
  plain(self->now_);
  for (Block* block : all_) visit(block->state());
}

std::vector<std::byte> Chip::snapshot() const {
  std::vector<std::byte> out;
  visit_state([&](std::span<std::byte> s) { out.insert(out.end(), s.begin(), s.end()); });
  return out;
}

void Chip::restore(std::span<const std::byte> snapshot) {
  visit_state([&](std::span<std::byte> s) {
    std::memcpy(s.data(), snapshot.data(), s.size());
    snapshot = snapshot.subspan(s.size());
  });
  core_.restored();
  watch_flash_loads(blocks_->flash.watches_loads());
  ask_all();
  next_due_ = 0;
}

}  // namespace rotorloop::mcu::g431
