#include <cstdio>

#include "sim/mcu/g431/blocks.hpp"
#include "sim/mcu/g431/chip.hpp"

namespace rotorloop::mcu::g431 {

std::span<const NotBuilt> not_built() {
  static constexpr NotBuilt kNotBuilt[] = {
      {"CRS", 0x40002000, 0x400},   {"SPI2", 0x40003800, 0x400}, {"SPI3", 0x40003C00, 0x400}, {"I2C1", 0x40005400, 0x400},
      {"I2C2", 0x40005800, 0x400},  {"USB", 0x40005C00, 0x800},  {"I2C3", 0x40007800, 0x400}, {"LPTIM1", 0x40007C00, 0x400},
      {"UCPD1", 0x4000A000, 0x400}, {"SPI1", 0x40013000, 0x400}, {"SAI1", 0x40015400, 0x400}, {"FMAC", 0x40021400, 0x400},
      {"RNG", 0x50060800, 0x400},
  };
  return kNotBuilt;
}

std::string text(const Refused& r) {
  char line[200];
  std::snprintf(line, sizeof line, "%s%s%s at 0x%08X, %s of %u byte%s", r.block[0] != 0 ? r.block : "no block", r.reg[0] != 0 ? "_" : "",
                r.reg, r.address, r.write ? "write" : "read", r.bytes, r.bytes == 1 ? "" : "s");
  std::string out = line;
  if (r.write) {
    std::snprintf(line, sizeof line, " of 0x%X", r.value);
    out += line;
  }
  std::snprintf(line, sizeof line, ", by the instruction before 0x%08X, cycle %llu: %s", r.pc, static_cast<unsigned long long>(r.cycle),
                r.why);
  return out + line;
}

}  // namespace rotorloop::mcu::g431
