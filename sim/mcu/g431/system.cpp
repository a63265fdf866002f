#include "sim/mcu/g431/system.hpp"

#include <algorithm>

namespace rotorloop::mcu::g431 {
namespace {

// clang-format off
constexpr Register kPwr[] = {
    {0x00, "CR1", 0x200, 0x4707}, {0x04, "CR2", 0, 0xCF}, {0x08, "CR3", 0x8000, 0xE51F}, {0x0C, "CR4", 0, 0x31F}, {0x10, "SR1", 0, 0},
    {0x14, "SR2", 0x100, 0}, {0x18, "SCR", 0, 0}, {0x20, "PUCRA", 0, 0xFFFF}, {0x24, "PDCRA", 0, 0xFFFF}, {0x28, "PUCRB", 0, 0xFFFF},
    {0x2C, "PDCRB", 0, 0xFFFF}, {0x30, "PUCRC", 0, 0xFFFF}, {0x34, "PDCRC", 0, 0xFFFF}, {0x38, "PUCRD", 0, 0xFFFF},
    {0x3C, "PDCRD", 0, 0xFFFF}, {0x40, "PUCRE", 0, 0xFFFF}, {0x44, "PDCRE", 0, 0xFFFF}, {0x48, "PUCRF", 0, 0xFFFF},
    {0x4C, "PDCRF", 0, 0xFFFF}, {0x50, "PUCRG", 0, 0xFFFF}, {0x54, "PDCRG", 0, 0xFFFF}, {0x80, "CR5", 0x100, 0x100},
};
#define RL_BACKUP(N, NAME) {0x100 + 4 * N, NAME}
constexpr Register kTamp[] = {
    {0x00, "CR1", 0xFFFF0000}, {0x04, "CR2"}, {0x0C, "FLTCR"}, {0x2C, "IER"}, {0x30, "SR", 0, 0}, {0x34, "MISR", 0, 0},
    {0x3C, "SCR", 0, 0},
    RL_BACKUP(0, "BKP0R"), RL_BACKUP(1, "BKP1R"), RL_BACKUP(2, "BKP2R"), RL_BACKUP(3, "BKP3R"), RL_BACKUP(4, "BKP4R"),
    RL_BACKUP(5, "BKP5R"), RL_BACKUP(6, "BKP6R"), RL_BACKUP(7, "BKP7R"), RL_BACKUP(8, "BKP8R"), RL_BACKUP(9, "BKP9R"),
    RL_BACKUP(10, "BKP10R"), RL_BACKUP(11, "BKP11R"), RL_BACKUP(12, "BKP12R"), RL_BACKUP(13, "BKP13R"),
    RL_BACKUP(14, "BKP14R"), RL_BACKUP(15, "BKP15R"),
};
constexpr uint32_t TR = 0x00, DR = 0x04, SSR = 0x08, ICSR = 0x0C, PRER = 0x10, WPR = 0x24;
constexpr Register kRtc[] = {
    {TR, "TR", 0, 0x7F7F7F}, {DR, "DR", 0x2101, 0xFFFF3F}, {SSR, "SSR", 0, 0}, {ICSR, "ICSR", 7, 0x80}, {PRER, "PRER", 0x7F00FF, 0x7F7FFF},
    {0x14, "WUTR", 0xFFFF, 0xFFFF}, {0x18, "CR", 0, 0xE7FFFF7F}, {WPR, "WPR", 0, 0}, {0x28, "CALR", 0, 0xE1FF}, {0x2C, "SHIFTR", 0, 0},
    {0x30, "TSTR", 0, 0}, {0x34, "TSDR", 0, 0}, {0x38, "TSSSR", 0, 0}, {0x40, "ALRMAR"}, {0x44, "ALRMASSR"}, {0x48, "ALRMBR"},
    {0x4C, "ALRMBSSR"}, {0x50, "SR", 0, 0}, {0x54, "MISR", 0, 0}, {0x5C, "SCR", 0, 0},
};
constexpr Register kDbgmcu[] = {{0x00, "IDCODE", 0x20036468, 0}, {0x04, "CR", 0, 7}, {0x08, "APB1FZR1"}, {0x0C, "APB1FZR2"},
    {0x10, "APB2FZR"}};
constexpr uint32_t CRC_DR = 0x00, CRC_CR = 0x08, INIT = 0x10, POL = 0x14;
constexpr Register kCrc[] = {{CRC_DR, "DR", 0xFFFFFFFF}, {0x04, "IDR"}, {CRC_CR, "CR", 0, 0xF8}, {INIT, "INIT", 0xFFFFFFFF},
    {POL, "POL", 0x04C11DB7}};
// clang-format on

uint32_t reversed(uint32_t value, uint32_t bits) {
  uint32_t out = 0;
  for (uint32_t n = 0; n < bits; ++n) out |= (value >> n & 1) << (bits - 1 - n);
  return out;
}

// A count in BCD that steps within [first, last]; true: it came round.
bool step_bcd(uint32_t& word, uint32_t at, uint32_t bits, uint32_t first, uint32_t last) {
  const uint32_t mask = ((1u << bits) - 1) << at, bcd = (word & mask) >> at;
  uint32_t value = (bcd >> 4) * 10 + (bcd & 15) + 1;
  const bool round = value > last;
  if (round) value = first;
  word = (word & ~mask) | (value / 10 << 4 | value % 10) << at;
  return round;
}

}  // namespace

Pwr::Pwr(Wires& wires) : RegisterBlock(wires, "PWR", 0x40007000, 0x400, kPwr, {0x58, 28}) { RegisterBlock::reset(true); }

// The regulator follows at once: VOSF and REGLPF never stay set.
uint32_t Pwr::read(uint32_t offset) { return offset == 0x14 ? 0x100u | (bit(0x00, 14) ? 0x200u : 0) : reg(offset); }

Tamp::Tamp(Wires& wires, const Pwr& pwr) : RegisterBlock(wires, "TAMP", 0x40002400, 0x400, kTamp, {0x58, 10}), pwr_(pwr) {
  RegisterBlock::reset(true);
}

// The backup domain has its own reset (RCC_BDCR): a reset of the system leaves it.
void Tamp::reset(bool power_up) {
  if (power_up) RegisterBlock::reset(true);
}

void Tamp::write(uint32_t offset, uint32_t value, uint32_t mask) {
  if (pwr_.backup_writable()) keep(offset, value, mask);
}

Rtc::Rtc(Wires& wires, const Pwr& pwr) : RegisterBlock(wires, "RTC", 0x40002800, 0x400, kRtc, {0x58, 10}), pwr_(pwr) {
  RegisterBlock::reset(true);
}

void Rtc::reset(bool power_up) {
  if (power_up) RegisterBlock::reset(true);
}

uint64_t Rtc::second_cycles() const {
  const Clocks& c = wires_.clocks();
  const uint64_t ticks = uint64_t{field(PRER, 16, 7) + 1} * (field(PRER, 0, 15) + 1);
  return c.rtc_Hz == 0 ? 0 : std::max<uint64_t>(1, cycles_of(ticks, c.rtc_Hz, c.hclk_Hz));
}

void Rtc::advance(uint64_t cycle) {
  const uint64_t second = second_cycles();
  if (second == 0 || bit(ICSR, 7)) {  // no clock, or being set
    s.more.second_at = cycle;
    return;
  }
  while (cycle - s.more.second_at >= second) {
    s.more.second_at += second;
    next_second();
  }
}

void Rtc::next_second() {
  uint32_t &t = reg(TR), &d = reg(DR);
  if (!step_bcd(t, 0, 7, 0, 59) || !step_bcd(t, 8, 7, 0, 59) || !step_bcd(t, 16, 6, 0, 23)) return;
  constexpr uint8_t kDays[] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
  const uint32_t month = (d >> 12 & 1) * 10 + (d >> 8 & 15), year = (d >> 20 & 15) * 10 + (d >> 16 & 15);
  const uint32_t weekday = d >> 13 & 7;
  d = (d & ~0xE000u) | (weekday % 7 + 1) << 13;
  const uint32_t days = kDays[(month + 11) % 12] + (month == 2 && year % 4 == 0 ? 1u : 0u);
  if (step_bcd(d, 0, 6, 1, days) && step_bcd(d, 8, 5, 1, 12)) step_bcd(d, 16, 8, 0, 99);
}

uint32_t Rtc::read(uint32_t offset) {
  advance(wires_.now());
  if (offset == SSR) {
    const uint64_t second = std::max<uint64_t>(1, second_cycles());
    const uint64_t parts = field(PRER, 0, 15) + 1;
    return static_cast<uint32_t>(parts - 1 - std::min(parts - 1, (wires_.now() - s.more.second_at) * parts / second));
  }
  if (offset == ICSR) return reg(ICSR) | 0x27u | (bit(ICSR, 7) ? 0x40u : 0) | ((reg(DR) & 0xFF0000) != 0 ? 0x10u : 0);
  return reg(offset);
}

void Rtc::write(uint32_t offset, uint32_t value, uint32_t mask) {
  advance(wires_.now());
  if (!pwr_.backup_writable()) return;
  if (offset == WPR) {  // 0xCA, then 0x53 open; anything else closes
    s.more.keys = static_cast<uint8_t>(value == 0xCA ? 1 : value == 0x53 && s.more.keys == 1 ? 2 : 0);
    return;
  }
  if (s.more.keys != 2) return;
  if ((offset == TR || offset == DR || offset == PRER) && !bit(ICSR, 7)) return;
  keep(offset, value, mask);
}

Dbgmcu::Dbgmcu(Wires& wires) : RegisterBlock(wires, "DBGMCU", 0xE0042000, 0x400, kDbgmcu) { RegisterBlock::reset(true); }

Crc::Crc(Wires& wires) : RegisterBlock(wires, "CRC", 0x40023000, 0x400, kCrc, {0x48, 12}) { RegisterBlock::reset(true); }

uint32_t Crc::size() const {
  constexpr uint32_t kBits[] = {32, 16, 8, 7};
  return kBits[field(CRC_CR, 3, 2)];
}

void Crc::add(uint32_t value, uint32_t bits) {
  const uint32_t reverse = field(CRC_CR, 5, 2);  // by byte, halfword or word
  if (reverse != 0) {
    const uint32_t unit = std::min(bits, 4u << reverse);
    uint32_t out = 0;
    for (uint32_t at = 0; at < bits; at += unit) out |= reversed(value >> at & (unit == 32 ? ~0u : (1u << unit) - 1), unit) << at;
    value = out;
  }
  const uint32_t n = size(), top = 1u << (n - 1), all = n == 32 ? ~0u : (1u << n) - 1;
  uint32_t crc = reg(CRC_DR);
  for (uint32_t b = bits; b-- > 0;) {
    const bool carry = ((crc & top) != 0) != ((value >> b & 1) != 0);
    crc = (crc << 1 ^ (carry ? reg(POL) : 0)) & all;
  }
  reg(CRC_DR) = crc;
}

uint32_t Crc::read(uint32_t offset) {
  if (offset != CRC_DR) return reg(offset);
  return bit(CRC_CR, 7) ? reversed(reg(CRC_DR), size()) : reg(CRC_DR);
}

void Crc::write(uint32_t offset, uint32_t value, uint32_t mask) {
  if (offset == CRC_DR) {
    add(value, mask == ~0u ? 32 : mask == 0xFFFF ? 16 : 8);
    return;
  }
  keep(offset, value, mask);
  if (offset == INIT || (offset == CRC_CR && (value & 1) != 0)) reg(CRC_DR) = reg(INIT) & (size() == 32 ? ~0u : (1u << size()) - 1);
}

}  // namespace rotorloop::mcu::g431
