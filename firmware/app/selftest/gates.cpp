// The gates, first at the chip's own pins and then behind drivers and FETs. Never two gates of different legs, so that no current flows in
// a motor that somebody has left on.
#include <array>

#include "firmware/app/selftest/checks.hpp"
#include "firmware/board/g431/cortex.hpp"

namespace rotorloop::selftest {
namespace {

using b_g431b_esc1::kGates;
using firmware::PwmCompare;

constexpr std::uint16_t kTop = QuietEscBoard::kPwmTop;
// High sides on for the whole period, or never.
constexpr PwmCompare kAlways{{kTop + 1, kTop + 1, kTop + 1}}, kNever{};
constexpr std::uint32_t kLoaded_us = 100;  // two sample periods: new compares are in force

// Bits of kAllGates whose pins are high.
std::int32_t levels() {
  std::int32_t seen = 0;
  for (std::size_t k = 0; k < kGates.size(); ++k) seen |= g431::read_pin(kGates[k].pin) ? 1 << k : 0;
  return seen;
}

// One gate, on all the time. A low side that is alone follows the reference turned round: on where the high side would be off.
void hold(std::size_t gate) {
  the_board.set_compare(gate < 3 ? kAlways : kNever);
  wait_us(kLoaded_us);
  g431::write_gates(g431::gate_bits(static_cast<std::uint8_t>(1u << gate)));
}

// A free channel of the second converter, on request. The trough's trigger is taken from its regular group for good.
std::int32_t convert(std::uint32_t channel) {
  g431::AdcRegisters& adc = g431::adc2();
  if (adc.cr.has(g431::adc_bits::kStart)) {
    adc.cr.write(g431::adc_bits::kRegulator | g431::adc_bits::kStop);
    g431::wait_for([&] { return !adc.cr.has(g431::adc_bits::kStart); }, 10'000);
  }
  adc.cfgr.write(g431::adc_bits::kInjectedQueueOff | g431::adc_bits::kOverwrite);
  g431::Register& smpr = channel < 10 ? adc.smpr1 : adc.smpr2;
  const unsigned at = 3u * (channel % 10u);
  smpr.change(g431::field(7, at), g431::field(g431::kSlowSampling, at));
  adc.sqr1.write(g431::field(channel, 6));
  std::int32_t counts = 0;
  for (int n = 0; n < 2; ++n) {  // the first after a stop may be of channel 0 (errata)
    adc.cr.write(g431::adc_bits::kRegulator | g431::adc_bits::kStart);
    if (!g431::wait_for([&] { return adc.isr.has(g431::adc_bits::kEndOfConversion); }, 10'000)) return -1;
    counts = static_cast<std::int32_t>(adc.dr.read());
  }
  return counts;
}

constexpr const char* kGateNames[6]{"gate_high_u", "gate_high_v", "gate_high_w", "gate_low_u", "gate_low_v", "gate_low_w"};
constexpr const char* kPhaseNames[6]{"phase_high_u", "phase_high_v", "phase_high_w", "phase_low_u", "phase_low_v", "phase_low_w"};
constexpr const char* kBootstrapNames[3]{"bootstrap_u", "bootstrap_v", "bootstrap_w"};
constexpr const char* kDeadTimeNames[3]{"dead_time_u", "dead_time_v", "dead_time_w"};

// At a bus of 12 V the node behind 10 k is clamped to the chip's supply; what a FET that is on leaves at ground is less than its drop.
constexpr std::int32_t kNodeHigh = 3800, kNodeLow = 200, kFullScale = 4095;
constexpr std::uint32_t kSettled_us = 200, kHeld_us = 5000;

// Nanoseconds of a period in which neither gate of a leg is on, for one of its two edges, by counting at moments that fall everywhere in
// it; 0: both were seen on. The two pins are read one after the other, which lengthens what is seen of one edge by what it shortens of the
// other.
std::int32_t dead_time_ns(std::size_t leg) {
  constexpr std::uint32_t kSamples = 20'000, kApart_cycles = 61;  // prime against the period of 2 * kTop cycles
  std::uint32_t neither = 0, both = 0, next = g431::dwt().cyccnt.read();
  for (std::uint32_t n = 0; n < kSamples; ++n, next += kApart_cycles) {
    while (static_cast<std::int32_t>(g431::dwt().cyccnt.read() - next) < 0) {
    }
    const bool high = g431::read_pin(kGates[leg].pin), low = g431::read_pin(kGates[leg + 3].pin);
    neither += high || low ? 0u : 1u;
    both += high && low ? 1u : 0u;
    if (n % 256 == 0) g431::feed_iwdg();
  }
  constexpr std::uint32_t kPeriod_ns = 2u * kTop * 1000u / (g431::kCore_Hz / 1'000'000u);
  return both != 0 ? 0 : static_cast<std::int32_t>(neither * (kPeriod_ns / 2u) / kSamples);
}

}  // namespace

void check_gates(Report& report) {
  report.tell({"gates_off", levels(), 0, 0, "pins"});
  for (std::size_t k = 0; k < kGates.size(); ++k) {
    hold(k);
    wait_us(kSettled_us);
    const std::int32_t seen = levels();
    the_board.bridge_off();
    report.tell({kGateNames[k], seen, 1 << k, 1 << k, "pins"});
  }
}

void check_dead_time(Report& report) {
  the_board.set_compare({{kTop / 2, kTop / 2, kTop / 2}});
  wait_us(kLoaded_us);
  for (std::size_t leg = 0; leg < 3; ++leg) {
    g431::write_gates(g431::gate_bits(static_cast<std::uint8_t>(firmware::high_gate(leg) | firmware::low_gate(leg))));
    const std::int32_t ns = dead_time_ns(leg);
    the_board.bridge_off();
    report.tell({kDeadTimeNames[leg], ns, 700, 1000, "ns"});
  }
  the_board.set_compare(kNever);
}

// Low sides first: they charge what the high sides live on.
void check_phases(Report& report) {
  for (std::size_t gate : {3u, 4u, 5u, 0u, 1u, 2u}) {
    const std::size_t leg = gate % 3;
    hold(gate);
    wait_us(kSettled_us);
    const std::int32_t node = convert(b_g431b_esc1::kPhaseChannels[leg]);
    wait_us(kHeld_us);
    const std::int32_t later = convert(b_g431b_esc1::kPhaseChannels[leg]);
    the_board.bridge_off();
    const bool high = gate < 3;
    report.tell({kPhaseNames[gate], node, high ? kNodeHigh : 0, high ? kFullScale : kNodeLow, "counts"});
    if (high) report.tell({kBootstrapNames[leg], later, kNodeHigh, kFullScale, "counts"});
  }
}

}  // namespace rotorloop::selftest
