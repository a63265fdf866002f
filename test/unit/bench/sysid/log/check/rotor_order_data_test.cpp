// Columns of rotor speeds in every wrong order, on every measured flight that turns enough to tell: the order is found, and the right
// one is never doubted. The thresholds were set on the nano-drone's runs; all other sets judge them.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "bench/sysid/log/check/checks.hpp"
#include "bench/sysid/log/check/flight_content.hpp"
#include "test/unit/bench/sysid/identify/measured_flights.hpp"

namespace rotorloop::log {
namespace {

using identify::testing::flights_of;
using identify::testing::measured_flights;
using identify::testing::MeasuredFlight;
using identify::testing::read_measured;
using Order = std::array<std::size_t, 4>;

// Longer than 5 s, and more than 0.1 rad/s rms of roll rate and of pitch rate between 2 and 15 Hz.
bool turns_enough(const FlightRecord& flight, const CheckedFlight& checked) {
  const FlightContent c = flight_content(flight, checked.segments);
  return c.seconds > 5.0 && c.turning_rad_s && (*c.turning_rad_s)[0] > 0.1 && (*c.turning_rad_s)[1] > 0.1;
}

// "your column 1, 4, 2, 3" of the refusal when rotor k's speed stands in column order[k].
std::string columns_of(const Order& order) {
  std::string out;
  for (const std::size_t c : order) out += (out.empty() ? "column " : ", ") + std::to_string(c + 1);
  return out;
}

struct Count {
  std::size_t flights = 0, orders = 0, refused = 0, named = 0, false_alarms = 0;
  std::string missed = {};  // findings of the last one
};

void try_orders(const MeasuredFlight& f, Count& count) {
  Order order{0, 1, 2, 3};
  while (std::next_permutation(order.begin(), order.end())) {
    FlightRecord wrong = f.record;
    for (RotorValues& w : wrong.rotor_omega_rad_s.value) {
      const RotorValues right = w;
      for (std::size_t k = 0; k < 4; ++k) w[order[k]] = right[k];
    }
    const CheckedFlight c = check_flight(wrong, f.vehicle);
    ++count.orders;
    if (!c.refusal || c.refusal->what.find("the speeds turn the vehicle") == std::string::npos) {
      count.missed = columns_of(order) + "\n" + findings_table(c);
      continue;
    }
    ++count.refused;
    count.named += c.refusal->remedy.find(columns_of(order)) != std::string::npos;
  }
}

class RotorOrderOnMeasuredFlights : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Sets, RotorOrderOnMeasuredFlights,
                         ::testing::Values("idsia_nanodrone_cf21bl", "imrc_cf21bl_bare", "imrc_cf21bl_payload", "imrc_cf21_brushed",
                                           "neurobem_test", "undeclared_a", "undeclared_b", "undeclared_c", "undeclared_d", "undeclared_e",
                                           "undeclared_f"),
                         [](const auto& set) { return std::string(set.param); });

TEST_P(RotorOrderOnMeasuredFlights, EachOfThe23WrongOrdersIsRefusedWithTheRightOneNamedAndTheRightOneNever) {
  if (measured_flights().empty()) GTEST_SKIP() << "ROTORLOOP_DATA is not set";
  Count count;
  for (const auto& file : flights_of(GetParam())) {
    const MeasuredFlight f = read_measured(file);
    const CheckedFlight given = check_flight(f.record, f.vehicle);
    count.false_alarms += given.refusal && given.refusal->what.find("the speeds turn the vehicle") != std::string::npos;
    if (given.refusal || !turns_enough(f.record, given)) continue;
    ++count.flights;
    try_orders(f, count);
  }
  std::printf(
      "%s: %zu flights turn enough; %zu of %zu wrong orders refused, %zu with the right order named; right order refused %zu times\n",
      GetParam(), count.flights, count.refused, count.orders, count.named, count.false_alarms);
  EXPECT_EQ(count.false_alarms, 0u);
  EXPECT_GE(static_cast<double>(count.named), 0.99 * static_cast<double>(count.orders)) << count.missed;
}

}  // namespace
}  // namespace rotorloop::log
