// Exchanges over a bad line: is ever a value accepted that the device did not have, or not then? Each register group of a made-up device
// says when it was sampled and proves it by a hash of that time, its slave and its address, so that an answer to another question, a late
// one and a damaged one are all recognised for certain.
#pragma once
#include <cstdint>
#include <string>

#include "bench/stand/instruments/serial_hub.hpp"

namespace rotorloop::test {

struct ModbusStudy {
  std::uint64_t exchanges = 100'000;
  std::uint64_t seed = 1;
  int baud = 115200;
  modbus::LineFaults faults{
      .byte_lost = 0.002, .frame_flipped = 0.1, .flips_max = 3, .reply_late = 0.05, .late_max_ns = 200'000'000, .seed = 1};
  double timeout_ms = 20.0;
  double late_max_ms = 200.0;  // what the master is told; the ablation tells it nothing
};

struct ModbusStudyResult {
  std::uint64_t exchanges = 0, accepted_values = 0, wrong_registers = 0, wrong_times = 0;
  modbus::SerialHub::Counts line;
  std::uint64_t failures = 0, stray_bytes = 0;
  double virtual_s = 0.0;
  std::string text() const;
};

// Two slaves with two groups of eight registers each, and one address where nobody answers, in rotation.
ModbusStudyResult run_modbus_study(const ModbusStudy& study);

}  // namespace rotorloop::test
