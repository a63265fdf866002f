#include "test/stats/esc_csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>

namespace rotorloop::stats {

using esc_lab::EscTrial;

std::string esc_csv_header() {
  return "seed,class,bus_V,top_rad_s,start_ms,start_peak_A,peak_A,start_trips,trips,causes,longest_gap_ms,latched,rise_ratio,"
         "settle_ratio,rise_ms,settle_ms,overshoot_percent,steady_percent,caught_from,caught_ms";
}

std::string esc_csv_line(const EscTrial& t) {
  return fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}", t.seed, t.motor_class, t.bus_V, t.top_rad_s, t.start_ms,
                     t.start_peak_A, t.peak_A, t.start_trips, t.trips, t.causes.empty() ? "-" : t.causes, t.longest_gap_ms,
                     t.latched ? 1 : 0, t.rise_ratio, t.settle_ratio, t.rise_ms, t.settle_ms, t.overshoot_percent, t.steady_percent,
                     t.caught_from, t.caught_ms);
}

std::vector<EscTrial> read_esc_trials(const std::string& path) {
  std::vector<EscTrial> trials;
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream s(line);
    EscTrial t;
    int latched = 0;
    if (s >> t.seed >> t.motor_class >> t.bus_V >> t.top_rad_s >> t.start_ms >> t.start_peak_A >> t.peak_A >> t.start_trips >> t.trips >>
        t.causes >> t.longest_gap_ms >> latched >> t.rise_ratio >> t.settle_ratio >> t.rise_ms >> t.settle_ms >> t.overshoot_percent >>
        t.steady_percent >> t.caught_from >> t.caught_ms) {
      t.latched = latched != 0;
      if (const esc_lab::MotorClass* c = esc_lab::find_motor_class(t.motor_class)) t.start_within_ms = c->start_within_ms;
      if (t.causes == "-") t.causes.clear();
      trials.push_back(t);
    }
  }
  return trials;
}

}  // namespace rotorloop::stats
