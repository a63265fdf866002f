#include "sim/mcu/gdb/registers.hpp"

#include <fmt/format.h>

namespace rotorloop::mcu::gdb {
namespace {

// R0 to R15, XPSR, six of the system, D0 to D15, FPSCR.
constexpr uint32_t kXpsr = 16, kMsp = 17, kPsp = 18, kPrimask = 19, kBasepri = 20, kFaultmask = 21, kControl = 22, kD0 = 23, kFpscr = 39,
                   kCount = 40;
constexpr const char* kSystem[] = {"msp", "psp", "primask", "basepri", "faultmask", "control"};

std::string reg(const std::string& name, int bits, const char* type) {
  return fmt::format("<reg name=\"{}\" bitsize=\"{}\" type=\"{}\"/>", name, bits, type);
}

}  // namespace

std::string target_xml() {
  std::string xml =
      "<?xml version=\"1.0\"?><!DOCTYPE target SYSTEM \"gdb-target.dtd\"><target version=\"1.0\"><architecture>arm</architecture>"
      "<feature name=\"org.gnu.gdb.arm.m-profile\">";
  for (int n = 0; n < 13; ++n) xml += reg(fmt::format("r{}", n), 32, "int");
  xml += reg("sp", 32, "data_ptr") + reg("lr", 32, "int") + reg("pc", 32, "code_ptr") + reg("xpsr", 32, "int");
  xml += "</feature><feature name=\"org.gnu.gdb.arm.m-system\">";
  for (const char* name : kSystem) xml += reg(name, 32, "int");
  xml += "</feature><feature name=\"org.gnu.gdb.arm.vfp\">";
  for (int n = 0; n < 16; ++n) xml += reg(fmt::format("d{}", n), 64, "ieee_double");
  return xml + reg("fpscr", 32, "int") + "</feature></target>";
}

uint32_t register_count() { return kCount; }
uint32_t register_bytes(uint32_t n) { return n >= kD0 && n < kFpscr ? 8 : 4; }

uint64_t read_register(const Core& core, uint32_t n) {
  const CoreState& s = core.state;
  if (n < kXpsr) return s.r[n];
  if (n >= kD0 && n < kFpscr) return s.s[2 * (n - kD0)] | uint64_t{s.s[2 * (n - kD0) + 1]} << 32;
  switch (n) {
    case kXpsr:
      return core.xpsr();
    case kMsp:
      return core.main_sp();
    case kPsp:
      return core.process_sp();
    case kPrimask:
      return s.primask;
    case kBasepri:
      return s.basepri;
    case kFaultmask:
      return s.faultmask;
    case kControl:
      return s.control;
    default:
      return s.fpscr;
  }
}

void write_register(Core& core, uint32_t n, uint64_t wide) {
  CoreState& s = core.state;
  const auto value = static_cast<uint32_t>(wide);
  if (n == kPc)
    core.set_pc(value);
  else if (n < kXpsr)
    s.r[n] = n == kSp ? value & ~3u : value;
  else if (n >= kD0 && n < kFpscr) {
    s.s[2 * (n - kD0)] = value;
    s.s[2 * (n - kD0) + 1] = static_cast<uint32_t>(wide >> 32);
  } else if (n == kXpsr)
    core.set_xpsr(value);
  else if (n == kMsp || n == kPsp)
    ((n == kPsp) == core.uses_psp() ? s.r[kSp] : s.other_sp) = value & ~3u;
  else if (n == kPrimask)
    s.primask = value & 1;
  else if (n == kBasepri)
    s.basepri = value & kPriorityMask;
  else if (n == kFaultmask)
    s.faultmask = value & 1;
  else if (n == kFpscr)
    s.fpscr = value;
  else if (n == kControl) {
    const bool swaps = ((s.control ^ value) & 2) != 0 && s.ipsr == 0;
    if (swaps) std::swap(s.r[kSp], s.other_sp);
    s.control = value & 7;
  }
  core.restored();
}

}  // namespace rotorloop::mcu::gdb
