#include "sim/mcu/g431/flash.hpp"

#include <algorithm>
#include <cstring>

#include "sim/mcu/g431/memory_map.hpp"
#include "sim/mcu/g431/rcc.hpp"

namespace rotorloop::mcu::g431 {
namespace {

constexpr uint32_t ACR = 0x00, PDKEYR = 0x04, KEYR = 0x08, OPTKEYR = 0x0C, SR = 0x10, CR = 0x14, ECCR = 0x18, OPTR = 0x20, PCROP1SR = 0x24,
                   PCROP1ER = 0x28, WRP1AR = 0x2C, WRP1BR = 0x30, SEC1R = 0x70;
constexpr Register kRegisters[] = {
    {ACR, "ACR", 0x00040600, 0x00045F0F},
    {PDKEYR, "PDKEYR", 0, 0},
    {KEYR, "KEYR", 0, 0},
    {OPTKEYR, "OPTKEYR", 0, 0},
    {SR, "SR", 0, 0},
    {CR, "CR", 0xC0000000, 0},
    {ECCR, "ECCR", 0, 1u << 24},
    {OPTR, "OPTR", 0, 0x3FFFFFFF},
    {PCROP1SR, "PCROP1SR", 0, 0x7FFF},
    {PCROP1ER, "PCROP1ER", 0, 0x80007FFF},
    {WRP1AR, "WRP1AR", 0, 0x007F007F},
    {WRP1BR, "WRP1BR", 0, 0x007F007F},
    {SEC1R, "SEC1R", 0, 0x000100FF},
};
// SR
constexpr uint32_t EOP = 1, OPERR = 1u << 1, PROGERR = 1u << 3, WRPERR = 1u << 4, PGAERR = 1u << 5, SIZERR = 1u << 6, PGSERR = 1u << 7,
                   OPTVERR = 1u << 15, BSY = 1u << 16, kErrors = 0xC3FA;
// CR
constexpr uint32_t PG = 1, PER = 2, MER1 = 4, STRT = 1u << 16, OPTSTRT = 1u << 17, FSTPG = 1u << 18, EOPIE = 1u << 24, ERRIE = 1u << 25,
                   OBL_LAUNCH = 1u << 27, OPTLOCK = 1u << 30, LOCK = 1u << 31;
// ECCR
constexpr uint32_t ECCIE = 1u << 24, ECCC = 1u << 30, ECCD = 1u << 31, kSystemFlash = 1u << 22;

constexpr uint32_t kKeys[] = {0x45670123, 0xCDEF89AB}, kOptionKeys[] = {0x08192A3B, 0x4C5D6E7F},
                   kPowerDownKeys[] = {0x04152637, 0xFAFBFCFD};
constexpr double kErase_us = 22020.0, kProgram_us = 85.0;  // typical, DS12589 table "Flash memory characteristics"
constexpr uint32_t kPageBytes = 2048, kPages = kFlashBytes / kPageBytes, kLine = 4;
constexpr uint32_t kOtpBase = 0x1FFF7000, kOtpBytes = 1024, kOptionBase = 0x1FFF7800;
constexpr uint32_t kOptionRegisters[] = {OPTR, PCROP1SR, PCROP1ER, WRP1AR, WRP1BR, SEC1R};
constexpr uint32_t kUnprotected[] = {0xFFEFF8AA, 0x7FFF, 0, 0x7F, 0x7F, 0};  // as delivered: level 0, no page protected

// Offset in flash of an address there or at the boot alias; kFlashBytes: elsewhere.
uint32_t flash_offset(uint32_t address) {
  const uint32_t offset = address < kFlashBytes ? address : address - kFlashBase;
  return std::min(offset, kFlashBytes);
}

}  // namespace

Flash::Flash(Wires& wires) : RegisterBlock(wires, "FLASH", 0x40022000, 0x74, kRegisters, {0x48, 8}) {}

// What is in the cells outlives every reset; registers do not.
void Flash::reset(bool power_up) {
  const FlashMore before = s.more;
  RegisterBlock::reset(power_up);
  s.more.corrected = before.corrected;
  s.more.broken = before.broken;
  s.more.not_blank = before.not_blank;
  s.more.operations = before.operations;
  load_options();
  interrupt(kLine, false);
  wires_.watch_flash_loads(watches_loads());
}

uint32_t Flash::read(uint32_t offset) {
  advance(wires_.now());
  return offset == SR ? reg(SR) | (busy() ? BSY : 0) : reg(offset);
}

// Two keys in order. A wrong one locks until the next reset (3.3.5).
void Flash::unlock(uint8_t& step, bool& locked_out, uint32_t value, const uint32_t (&keys)[2], uint32_t register_offset,
                   uint32_t lock_bit) {
  if (value != keys[step]) locked_out = true;
  step = locked_out ? 0 : static_cast<uint8_t>(step + 1);
  if (step < 2) return;
  step = 0;
  reg(register_offset) &= ~lock_bit;
}

void Flash::write(uint32_t offset, uint32_t value, uint32_t mask) {
  advance(wires_.now());
  FlashMore& m = s.more;
  switch (offset) {
    case ACR:
      keep(offset, value, mask);
      wires_.set_wait_states(field(ACR, 0, 4));
      break;
    case PDKEYR: {
      bool unused = false;
      unlock(m.power_down_step, unused, value, kPowerDownKeys, ACR, 0);
      break;
    }
    case KEYR:
      unlock(m.key_step, m.locked_out, value, kKeys, CR, LOCK);
      break;
    case OPTKEYR:
      if (!bit(CR, 31)) unlock(m.option_step, m.options_locked_out, value, kOptionKeys, CR, OPTLOCK);
      break;
    case SR:
      reg(SR) &= ~(value & (kErrors | EOP));
      break;
    case CR:
      write_cr(value);
      break;
    case ECCR:
      keep(offset, value, mask);
      reg(ECCR) &= ~(value & (ECCC | ECCD));
      if ((reg(ECCR) & (ECCC | ECCD)) == 0) reg(ECCR) &= ECCIE;
      break;
    default:
      if (!bit(CR, 30)) keep(offset, value, mask);  // option registers, while OPTLOCK is off
  }
  update_line();
}

void Flash::write_cr(uint32_t value) {
  if (bit(CR, 31)) return;  // locked
  wait();                   // a write while BSY holds the bus
  constexpr uint32_t kPlain = PG | PER | MER1 | 0x3F8 | EOPIE | ERRIE | 1u << 26 | 1u << 28;
  const bool options_locked = bit(CR, 30);
  reg(CR) = (reg(CR) & (LOCK | OPTLOCK)) | (value & (kPlain | LOCK | OPTLOCK));
  if ((value & FSTPG) != 0) return wires_.refuse("fast programming is not built");
  if ((value & OBL_LAUNCH) != 0 && !options_locked) return wires_.reset_chip(kOptionReset);
  if ((value & OPTSTRT) != 0 && !options_locked) return store_options();
  if ((value & STRT) == 0) return;
  const uint32_t mode = value & (PG | PER | MER1), page = value >> 3 & 0x7F;
  if ((reg(SR) & kErrors) != 0 || (mode != PER && (mode & (PG | MER1)) != MER1)) return fail(PGSERR);
  if ((mode & MER1) != 0) return erase(0, kPages);
  if (page >= kPages) return wires_.refuse("the flash has pages 0 to 63");
  erase(page, 1);
}

void Flash::fail(uint32_t flags) {
  reg(SR) |= flags | (bit(CR, 25) ? OPERR : 0);
  s.more.has_first = false;
  update_line();
}

bool Flash::is_protected(uint32_t page) const {
  const auto inside = [&](uint32_t area) { return page >= field(area, 0, 7) && page <= field(area, 16, 7); };
  return inside(WRP1AR) || inside(WRP1BR);
}

bool Flash::power_is_cut() {
  FlashMore& m = s.more;
  if (++m.operations != m.cut_at) return false;
  m.cut_at = 0;
  wires_.stop_run();
  return true;
}

void Flash::erase(uint32_t first_page, uint32_t pages) {
  FlashMore& m = s.more;
  for (uint32_t p = first_page; p < first_page + pages; ++p)
    if (is_protected(p)) return fail(WRPERR);
  const uint32_t offset = first_page * kPageBytes, bytes = pages * kPageBytes;
  if (power_is_cut()) return tear(offset, bytes, ~uint64_t{0}, m.cut_leaves);
  std::fill_n(wires_.flash().begin() + offset, bytes, uint8_t{0xFF});
  for (uint32_t w = offset / 8; w < (offset + bytes) / 8; ++w) {
    m.corrected.reset(w);
    m.broken.reset(w);
    m.not_blank.reset(w);
  }
  wires_.flash_changed(kFlashBase + offset, bytes);
  start(kErase_us);
}

void Flash::store(uint32_t address, uint32_t bytes, uint32_t value) {
  FlashMore& m = s.more;
  advance(wires_.now());
  wait();
  if (!bit(CR, 0) || (reg(SR) & kErrors) != 0) return fail(PGSERR);
  if (bytes != 4) return fail(SIZERR);
  const bool first = address % 8 == 0;
  if (first == m.has_first || (!first && address != m.first_address + 4)) return fail(PGAERR);
  m.has_first = first;
  if (first) {
    m.first_word = value;
    m.first_address = address;
    return;
  }
  program(address - 4, m.first_word, value);
}

void Flash::program(uint32_t address, uint32_t low, uint32_t high) {
  FlashMore& m = s.more;
  const uint32_t offset = flash_offset(address);
  const bool main = offset < kFlashBytes;
  if (!main && address - kOtpBase >= kOtpBytes) return fail(WRPERR);
  if (main && is_protected(offset / kPageBytes)) return fail(WRPERR);
  uint8_t* place = main ? &wires_.flash()[offset] : &wires_.information()[address - kInformationBase];
  const uint64_t wanted = low | uint64_t{high} << 32;
  uint64_t present = 0;
  std::memcpy(&present, place, 8);
  if (wanted != 0 && (present != ~uint64_t{0} || (main && m.not_blank[offset / 8]))) return fail(PROGERR);
  if (power_is_cut() && main) return tear(offset, 8, wanted, m.cut_leaves);
  std::memcpy(place, &wanted, 8);
  if (main) wires_.flash_changed(kFlashBase + offset, 8);
  start(kProgram_us);
}

// What a cut leaves, in every double word of what was being erased or programmed: bits on their way from old to new.
void Flash::tear(uint32_t first_offset, uint32_t bytes, uint64_t wanted, TornWord how) {
  FlashMore& m = s.more;
  for (uint32_t offset = first_offset; offset < first_offset + bytes; offset += 8) {
    uint64_t old = 0;
    std::memcpy(&old, &wires_.flash()[offset], 8);
    if (how == TornWord::untouched || old == wanted) continue;
    const uint64_t halfway = (old & wanted) | ((old ^ wanted) & 0x5555555555555555);
    const uint64_t left = how == TornWord::all_ones ? ~uint64_t{0} : how == TornWord::single_error ? wanted : halfway;
    std::memcpy(&wires_.flash()[offset], &left, 8);
    m.not_blank.set(offset / 8, how == TornWord::all_ones);
    m.corrected.set(offset / 8, how == TornWord::single_error);
    m.broken.set(offset / 8, how == TornWord::double_error);
  }
  wires_.flash_changed(kFlashBase + first_offset, bytes);
  wires_.watch_flash_loads(watches_loads());
}

void Flash::damage(uint32_t address, TornWord how) {
  const uint32_t offset = flash_offset(address) & ~7u;
  uint64_t now = 0;
  std::memcpy(&now, &wires_.flash()[offset], 8);
  const uint64_t as_programmed = how == TornWord::single_error ? now : ~now;
  if (how == TornWord::single_error) std::fill_n(wires_.flash().begin() + offset, 8, uint8_t{0xFF});
  tear(offset, 8, as_programmed, how);
}

// The bank is busy: code in flash waits with it, code elsewhere goes on until it touches flash.
void Flash::start(double us) {
  FlashMore& m = s.more;
  m.done_at = wires_.now() + static_cast<uint64_t>(us * 1e-6 * wires_.clocks().hclk_Hz);
  if (flash_offset(wires_.program_counter()) < kFlashBytes)
    wires_.stall(m.done_at - wires_.now());
  else
    wires_.flash_changed(kFlashBase, kFlashBytes);  // what was decoded is fetched again, and waits
  wires_.watch_flash_loads(watches_loads());
}

void Flash::wait() {
  if (!busy()) return;
  const uint64_t end = s.more.done_at;
  if (end > wires_.now()) wires_.stall(end - wires_.now());
  advance(end);
}

void Flash::advance(uint64_t cycle) {
  if (cycle < s.more.done_at) return;
  s.more.done_at = kNever;
  if (bit(CR, 24)) reg(SR) |= EOP;  // EOP shows only with its interrupt enabled (3.7.5)
  update_line();
  wires_.watch_flash_loads(watches_loads());
}

// The first error is kept with its address until it is cleared (3.3.4).
void Flash::loaded(uint32_t address) {
  const uint32_t offset = flash_offset(address);
  if (offset >= kFlashBytes) return;
  wait();
  const bool broken = s.more.broken[offset / 8], corrected = s.more.corrected[offset / 8];
  if ((!broken && !corrected) || (reg(ECCR) & ECCD) != 0 || (!broken && (reg(ECCR) & ECCC) != 0)) return;
  reg(ECCR) = (reg(ECCR) & (ECCIE | ECCC)) | (broken ? ECCD : ECCC) | (offset & ~7u);
  if (broken) wires_.raise_nmi();
  update_line();
}

// Six registers, each with its complement; a pair that does not fit sets OPTVERR and protects nothing (3.4.2).
void Flash::load_options() {
  for (uint32_t n = 0; n < std::size(kOptionRegisters); ++n) {
    uint32_t pair[2];
    std::memcpy(pair, &wires_.information()[kOptionBase - kInformationBase + 8 * n], 8);
    const bool blank = pair[0] == ~0u && pair[1] == ~0u;
    if (!blank && pair[0] != ~pair[1]) reg(SR) |= OPTVERR;
    reg(kOptionRegisters[n]) = pair[0] == ~pair[1] ? pair[0] : kUnprotected[n];
  }
}

// Options take effect with OBL_LAUNCH or power. From read protection back to level 0 the flash is erased.
void Flash::store_options() {
  if ((reg(SR) & kErrors & ~OPTVERR) != 0) return fail(PGSERR);
  const uint8_t level_before = wires_.information()[kOptionBase - kInformationBase];
  if (power_is_cut()) return;  // old options stay
  for (uint32_t n = 0; n < std::size(kOptionRegisters); ++n) {
    const uint32_t pair[2] = {reg(kOptionRegisters[n]), ~reg(kOptionRegisters[n])};
    std::memcpy(&wires_.information()[kOptionBase - kInformationBase + 8 * n], pair, 8);
  }
  if (level_before != 0xAA && (reg(OPTR) & 0xFF) == 0xAA) erase(0, kPages);
  start(kErase_us + 6 * kProgram_us);
}

void Flash::update_line() {
  const bool operation = (bit(CR, 24) && (reg(SR) & EOP) != 0) || (bit(CR, 25) && (reg(SR) & OPERR) != 0);
  interrupt(kLine, operation || (bit(ECCR, 24) && (reg(ECCR) & ECCC) != 0));
}

}  // namespace rotorloop::mcu::g431
