// One counter per abnormal branch, so that "it never happened" differs from "nobody looked". Written, never read by control.
#pragma once
#include <cstdint>

#include "firmware/core/interface.hpp"

namespace rotorloop::firmware {

struct Counters {
  std::uint32_t overcurrent_trips = 0;
  std::uint32_t overvoltage_trips = 0;
  std::uint32_t undervoltage_trips = 0;
  std::uint32_t overtemperature_trips = 0;
  std::uint32_t sensor_trips = 0;          // phase currents do not sum to zero, or the converter is at its end
  std::uint32_t calibration_failures = 0;  // zero-current offset outside its tolerance
  std::uint32_t stalls = 0;                // lost rotor while running
  std::uint32_t start_failures = 0;
  std::uint32_t restarts = 0;
  std::uint32_t latched_faults = 0;      // gave up until the set-point returns to off
  std::uint32_t resistance_refused = 0;  // measured at start, too far from the parameter
  std::uint32_t catches = 0;             // took over a rotor that was already turning
  std::uint32_t reversals = 0;
  std::uint32_t setpoints_refused = 0;  // not finite
  std::uint32_t orders_expired = 0;     // motion stopped for want of a fresh set-point
  std::uint32_t samples_replaced = 0;   // a current sample that was none
  std::uint32_t bus_doubted = 0;        // a bus sample that the next one did not repeat
  std::uint32_t interrupts_late = 0;    // rounds of slots in which an interrupt came late or was missed
  std::uint32_t thermistor_lost = 0;    // became open or short
  std::uint32_t self_test_failures = 0;

  constexpr std::uint32_t errors() const {
    return overcurrent_trips + overvoltage_trips + undervoltage_trips + overtemperature_trips + sensor_trips + calibration_failures +
           self_test_failures + stalls + start_failures + setpoints_refused;
  }
};

constexpr void count_trip(Counters& c, Fault fault) {
  switch (fault) {
    case Fault::overcurrent:
      ++c.overcurrent_trips;
      break;
    case Fault::overvoltage:
      ++c.overvoltage_trips;
      break;
    case Fault::undervoltage:
      ++c.undervoltage_trips;
      break;
    case Fault::overtemperature:
      ++c.overtemperature_trips;
      break;
    case Fault::sensor:
      ++c.sensor_trips;
      break;
    case Fault::stall:
      ++c.stalls;
      break;
    case Fault::start_failed:
      ++c.start_failures;
      break;
    case Fault::self_test:  // no trip of a driven bridge
    case Fault::none:
      break;
  }
}

}  // namespace rotorloop::firmware
