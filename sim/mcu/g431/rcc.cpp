#include "sim/mcu/g431/rcc.hpp"

#include <algorithm>

namespace rotorloop::mcu::g431 {
namespace {

constexpr uint32_t CR = 0x00, ICSCR = 0x04, CFGR = 0x08, PLLCFGR = 0x0C, CIER = 0x18, CIFR = 0x1C, CICR = 0x20, AHB1RSTR = 0x28,
                   APB2RSTR = 0x40, CCIPR = 0x88, BDCR = 0x90, CSR = 0x94, CRRCR = 0x98;
constexpr Register kRegisters[] = {
    {CR, "CR", 0x500, 0x010D0B00},
    {ICSCR, "ICSCR", 0x40880000, 0x7F000000},
    {CFGR, "CFGR", 0x5, 0x7F003FF3},
    {PLLCFGR, "PLLCFGR", 0x1000, 0xFF737FF3},
    {CIER, "CIER", 0, 0x63B},
    {CIFR, "CIFR", 0, 0},
    {CICR, "CICR", 0, 0},
    {AHB1RSTR, "AHB1RSTR", 0, 0x111F},
    {0x2C, "AHB2RSTR", 0, 0x0405207F},
    {0x30, "AHB3RSTR", 0, 0x101},
    {0x38, "APB1RSTR1", 0, 0xD2FEC137},
    {0x3C, "APB1RSTR2", 0, 0x103},
    {APB2RSTR, "APB2RSTR", 0, 0x0127F801},
    {0x48, "AHB1ENR", 0x100, 0x111F},
    {0x4C, "AHB2ENR", 0, 0x0405207F},
    {0x50, "AHB3ENR", 0, 0x101},
    {0x58, "APB1ENR1", 0x400, 0xD2FECD37},
    {0x5C, "APB1ENR2", 0, 0x103},
    {0x60, "APB2ENR", 0, 0x0127F801},
    {0x68, "AHB1SMENR", 0x130F, 0x130F},
    {0x6C, "AHB2SMENR", 0x0405667F, 0x0405667F},
    {0x70, "AHB3SMENR", 0x101, 0x101},
    {0x78, "APB1SMENR1", 0xD2FECD37, 0xD2FECD37},
    {0x7C, "APB1SMENR2", 0x103, 0x103},
    {0x80, "APB2SMENR", 0x0127F801, 0x0127F801},
    {CCIPR, "CCIPR", 0, 0x3F3FFFFF | 0x3u << 30},
    {BDCR, "BDCR", 0, 0x0301833D},
    {CSR, "CSR", 0x0C000000, 0x00000001},
    {CRRCR, "CRRCR", 0x8800, 0x1},
    {0x9C, "CCIPR2", 0, 0x00300003},
};
constexpr uint32_t HSION = 1u << 8, HSIRDY = 1u << 10, HSEON = 1u << 16, HSERDY = 1u << 17, CSSON = 1u << 19, PLLON = 1u << 24,
                   PLLRDY = 1u << 25;
constexpr uint32_t kFromHsi = 1, kFromHse = 2, kFromPll = 3;
constexpr uint32_t LSIRDYF = 1, LSERDYF = 2, HSIRDYF = 8, HSERDYF = 16, PLLRDYF = 32, CSSF = 256, HSI48RDYF = 1024;
constexpr uint32_t kInterrupt = 5;
// Start-up times, typical of DS12589 (5.3.8 and 5.3.9): what a driver waits for, not a promise.
constexpr double kHsi_us = 1.0, kHse_us = 2000.0, kPll_us = 15.0, kLsi_us = 100.0, kLse_us = 2e6, kHsi48_us = 3.0;

uint32_t ahb_divider(uint32_t hpre) { return hpre < 8 ? 1 : hpre < 12 ? 2u << (hpre - 8) : 64u << (hpre - 12); }
uint32_t apb_divider(uint32_t ppre) { return ppre < 4 ? 1 : 2u << (ppre - 4); }

}  // namespace

Rcc::Rcc(Wires& wires, const Pwr& pwr) : RegisterBlock(wires, "RCC", 0x40021000, 0x400, kRegisters), pwr_(pwr) {
  RegisterBlock::reset(true);
}

void Rcc::reset(bool power_up) {
  const uint32_t bdcr = reg(BDCR), csr = reg(CSR);
  const uint64_t lse_ready = s.more.lse_ready;
  RegisterBlock::reset(power_up);
  if (power_up) return;
  reg(BDCR) = bdcr;
  reg(CSR) = csr & 0xFF000000;  // LSION is cleared by a system reset only if no watchdog holds it; IWDG asks for LSI itself
  s.more.lse_ready = lse_ready;
}

void Rcc::add_reset_cause(uint32_t flags) { reg(CSR) |= flags; }

uint64_t Rcc::in_us(double us) const { return wires_.now() + static_cast<uint64_t>(us * 1e-6 * wires_.clocks().hclk_Hz) + 1; }

uint32_t Rcc::read(uint32_t offset) {
  advance(wires_.now());
  return reg(offset);
}

void Rcc::write_cr(uint32_t value, uint32_t mask) {
  const uint32_t old = reg(CR), in_use = field(CFGR, 2, 2);
  keep(CR, value, mask);
  uint32_t& cr = reg(CR);
  cr |= old & CSSON;  // set-only: a reset clears it
  // What drives the system, itself or through the PLL, cannot be switched off by software.
  const uint32_t pll_source = field(PLLCFGR, 0, 2);
  if (in_use == kFromHsi || (in_use == kFromPll && pll_source == 2)) cr |= old & HSION;
  if (in_use == kFromHse || (in_use == kFromPll && pll_source == 3)) cr |= old & HSEON;
  if (in_use == kFromPll) cr |= old & PLLON;
  const auto oscillator = [&](uint32_t on, uint32_t ready, uint64_t& at, double us, bool present) {
    if ((cr & on) == 0) {
      cr &= ~ready;
      at = kNever;
    } else if ((old & on) == 0 && present) {
      at = in_us(us);
    }
  };
  oscillator(HSION, HSIRDY, s.more.hsi_ready, kHsi_us, true);
  oscillator(HSEON, HSERDY, s.more.hse_ready, kHse_us, wires_.clocks().hse_Hz != 0);
  oscillator(PLLON, PLLRDY, s.more.pll_ready, kPll_us, true);
}

void Rcc::write(uint32_t offset, uint32_t value, uint32_t mask) {
  advance(wires_.now());
  switch (offset) {
    case CR:
      write_cr(value, mask);
      break;
    case CFGR:
      if ((mask & 3) != 0 && (value & 3) == 0) wires_.refuse("SW = 0 is reserved");
      keep(offset, value, mask);
      break;
    case PLLCFGR:  // source, M, N and R stand while the PLL runs
      keep(offset, value, (reg(CR) & PLLON) != 0 ? mask & 0xF9130000 : mask);
      break;
    case CICR:
      reg(CIFR) &= ~value;
      break;
    case BDCR: {
      if (!pwr_.backup_writable()) break;
      const bool lse_was_on = bit(BDCR, 0);
      const uint32_t select = field(BDCR, 8, 2);
      keep(offset, value, mask);
      if (select != 0) reg(BDCR) = (reg(BDCR) & ~0x300u) | select << 8;  // RTCSEL is written once
      if (bit(BDCR, 16)) reg(BDCR) &= 0x10000;
      if (!bit(BDCR, 0)) reg(BDCR) &= ~2u;
      if (bit(BDCR, 0) != lse_was_on) s.more.lse_ready = bit(BDCR, 0) && wires_.clocks().lse_Hz != 0 ? in_us(kLse_us) : kNever;
      break;
    }
    case CSR:
      keep(offset, value, mask);
      if ((value >> 23 & 1) != 0) reg(CSR) &= 0x00FFFFFF;  // RMVF
      if (!bit(CSR, 0)) reg(CSR) &= ~2u;
      s.more.lsi_ready = bit(CSR, 0) ? (bit(CSR, 1) ? kNever : in_us(kLsi_us)) : kNever;
      break;
    case CRRCR:
      keep(offset, value, mask);
      if (!bit(CRRCR, 0)) reg(CRRCR) &= ~2u;
      s.more.hsi48_ready = bit(CRRCR, 0) ? (bit(CRRCR, 1) ? kNever : in_us(kHsi48_us)) : kNever;
      break;
    default:
      keep(offset, value, mask);
      if (offset >= AHB1RSTR && offset <= APB2RSTR) wires_.reset_behind(static_cast<uint8_t>(offset + 0x20), reg(offset));
  }
  follow();
}

uint32_t Rcc::pll_vco_Hz() const {
  const uint32_t source = field(PLLCFGR, 0, 2), m = field(PLLCFGR, 4, 4) + 1, n = field(PLLCFGR, 8, 7);
  const uint64_t input = source == 2 ? kHsi_Hz : source == 3 ? wires_.clocks().hse_Hz : 0;
  return static_cast<uint32_t>(input / m * n);
}

uint32_t Rcc::source_Hz(uint32_t sw) const {
  if (sw == kFromHsi) return bit(CR, 10) ? kHsi_Hz : 0;
  if (sw == kFromHse) return bit(CR, 17) ? wires_.clocks().hse_Hz : 0;
  return sw == kFromPll && bit(CR, 25) && bit(PLLCFGR, 24) ? pll_vco_Hz() / (2 * (field(PLLCFGR, 25, 2) + 1)) : 0;
}

void Rcc::follow() {
  if (source_Hz(field(CFGR, 0, 2)) != 0) reg(CFGR) = (reg(CFGR) & ~0xCu) | field(CFGR, 0, 2) << 2;
  Clocks c = wires_.clocks();
  const bool pll = bit(CR, 25);
  const uint32_t vco = pll ? pll_vco_Hz() : 0, p = field(PLLCFGR, 27, 5);
  const uint32_t p_divider = p >= 2 ? p : bit(PLLCFGR, 17) ? 17 : 7;
  c.sysclk_Hz = std::max(source_Hz(field(CFGR, 2, 2)), 1u);
  c.hclk_Hz = std::max(c.sysclk_Hz / ahb_divider(field(CFGR, 4, 4)), 1u);
  const uint32_t apb1 = apb_divider(field(CFGR, 8, 3)), apb2 = apb_divider(field(CFGR, 11, 3));
  c.pclk1_Hz = c.hclk_Hz / apb1;
  c.pclk2_Hz = c.hclk_Hz / apb2;
  c.tim1_Hz = apb1 == 1 ? c.hclk_Hz : 2 * c.pclk1_Hz;
  c.tim2_Hz = apb2 == 1 ? c.hclk_Hz : 2 * c.pclk2_Hz;
  c.pll_p_Hz = bit(PLLCFGR, 16) ? vco / p_divider : 0;
  c.pll_q_Hz = bit(PLLCFGR, 20) ? vco / (2 * (field(PLLCFGR, 21, 2) + 1)) : 0;
  const uint32_t hse = bit(CR, 17) ? c.hse_Hz : 0;
  const uint32_t adc[] = {0, c.pll_p_Hz, c.sysclk_Hz, 0}, fdcan[] = {hse, c.pll_q_Hz, c.pclk1_Hz, 0};
  const uint32_t rtc[] = {0, bit(BDCR, 1) ? c.lse_Hz : 0, bit(CSR, 1) ? kLsi_Hz : 0, hse / 32};
  c.adc_Hz = adc[field(CCIPR, 28, 2)];
  c.fdcan_Hz = fdcan[field(CCIPR, 24, 2)];
  c.rtc_Hz = bit(BDCR, 15) ? rtc[field(BDCR, 8, 2)] : 0;
  for (uint32_t u = 0; u < 6; ++u) {
    const uint32_t pclk = u == 0 ? c.pclk2_Hz : c.pclk1_Hz, select = field(CCIPR, 2 * u, 2);
    c.usart_Hz[u] = select == 0 ? pclk : select == 1 ? c.sysclk_Hz : select == 2 ? kHsi_Hz : c.lse_Hz;
  }
  if (!(c == wires_.clocks())) wires_.change_clocks(c);
  interrupt(kInterrupt, (reg(CIFR) & reg(CIER)) != 0);
}

uint64_t Rcc::next_event() const {
  const RccMore& m = s.more;
  return std::min({m.hsi_ready, m.hse_ready, m.pll_ready, m.lsi_ready, m.lse_ready, m.hsi48_ready});
}

void Rcc::advance(uint64_t cycle) {
  bool changed = false;
  const auto due = [&](uint64_t& at, uint32_t offset, uint32_t ready, uint32_t flag) {
    if (cycle < at) return;
    at = kNever;
    reg(offset) |= ready;
    reg(CIFR) |= flag & reg(CIER);
    changed = true;
  };
  due(s.more.hsi_ready, CR, HSIRDY, HSIRDYF);
  due(s.more.hse_ready, CR, HSERDY, HSERDYF);
  due(s.more.lsi_ready, CSR, 2, LSIRDYF);
  due(s.more.lse_ready, BDCR, 2, LSERDYF);
  due(s.more.hsi48_ready, CRRCR, 2, HSI48RDYF);
  if (s.more.pll_ready <= cycle && pll_vco_Hz() == 0)
    s.more.pll_ready = kNever;  // without a source it never locks
  else
    due(s.more.pll_ready, CR, PLLRDY, PLLRDYF);
  if (changed) follow();
}

// The clock security system: HSE stops, HSI takes over, and the flag raises NMI until it is cleared.
void Rcc::on_signal(Signal, bool high) {
  if (!high || !bit(CR, 17)) return;
  const bool watched = bit(CR, 19), used = field(CFGR, 2, 2) == kFromHse || (field(CFGR, 2, 2) == kFromPll && field(PLLCFGR, 0, 2) == 3);
  reg(CR) &= ~(HSERDY | (watched ? HSEON : 0));
  if (!watched) return;
  reg(CIFR) |= CSSF;
  if (used) {
    reg(CR) = (reg(CR) & ~(PLLON | PLLRDY)) | HSION | HSIRDY;
    reg(CFGR) = (reg(CFGR) & ~0xFu) | kFromHsi | kFromHsi << 2;
  }
  follow();
  wires_.raise_nmi();
}

}  // namespace rotorloop::mcu::g431
