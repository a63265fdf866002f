// Are the innovations white? Under the right model and noise they are independent of all that came before; what remains between
// them is what the model lacks, or what the sensor's software smoothed.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "bench/sysid/estimate/chain.hpp"

namespace rotorloop::identify {

// Sample autocorrelation at lags 0 … max_lag of a series whose mean is taken out; not-a-number marks a gap and pairs with nothing.
std::vector<double> autocorrelation(std::span<const double> series, std::size_t max_lag);

// Ljung and Box (1978): Q = n(n+2) Σ r_k²/(n-k) over the first `lags`, against χ² with as many degrees of freedom.
struct PortmanteauTest {
  std::size_t lags = 0;
  double q = 0.0, p = 1.0;  // p: chance of a Q as large or larger in white noise
};
PortmanteauTest ljung_box(std::span<const double> series, std::size_t lags);

// Wald and Wolfowitz: number of runs of one sign about the median; z is standard normal in white noise, negative: too few, so
// neighbours resemble each other.
struct RunsTest {
  std::size_t runs = 0;
  double z = 0.0, p = 1.0;  // two-sided
};
RunsTest runs_test(std::span<const double> series);

// One of the six numbers of the pose innovations of a flight.
struct ChannelWhiteness {
  std::string channel;              // "x", "roll"
  double rms = 0.0;                 // 1 under the model
  std::vector<double> correlation;  // lags 0 … 2 s
  std::vector<double> lag_s;
  std::vector<PortmanteauTest> ljung_box;  // at 0.1, 0.5, 2 s
  RunsTest runs;
  bool white = true;  // no test below its share of 1 % in all the tests of the flight
};
struct FlightWhiteness {
  std::string flight;
  double step_s = 0.0;
  std::vector<ChannelWhiteness> channels;
  std::vector<double> second_s, cost_per_number;  // mean square of the innovations in each second: 1 under the model
  bool white() const;
};

// `innovations` of one flight, as the sweep returns them. The first second is left out: there the states are still unknown.
FlightWhiteness whiteness_of(const std::string& flight, std::span<const estimate::Innovation> innovations);

}  // namespace rotorloop::identify
