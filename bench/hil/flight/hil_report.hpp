// The page of a HIL run, from plain values: nothing here reads a file or knows the simulation. Series may be long, the plots
// thin them; times are in seconds of virtual time since take-off of the clock.
#pragma once
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "bench/render/outcome.hpp"
#include "bench/render/svg_plot.hpp"

namespace rotorloop::hil {

// A line of the tracking table, in cm; what was not measured is not-a-number and shown as "–".
struct ReportTableRow {
  std::string flight, axis;  // axis: "3-D" or "|z|", of all figures but `other`
  std::string variant;
  int colour = 0;
  double mean = 0.0, std = 0.0, min = 0.0, max = 0.0;
  int flown = 0, completed = 0;
  double reduction_percent = 0.0, reduction_std_percent = 0.0;  // not-a-number in the first row of a flight
  double from_estimate = 0.0;                                   // the same error as the estimate shows it
  double estimator_error = 0.0;
  std::string other_axis;
  double other = 0.0;
  double published = 0.0;  // not-a-number: none
  std::string published_source;
  std::vector<double> seeds;  // mean error of each seed, for the dots of the bar chart
  double limit = 0.0;         // not-a-number: none
};

struct ReportLimit {
  std::string name, unit;
  double value = 0.0, limit = 0.0;
  bool upper = true, pass = false;
};

// One flight of one variant, as shown.
struct ReportTrace {
  std::string variant;
  int colour = 0;
  std::string seed;
  std::vector<double> t_s;
  std::array<std::vector<double>, 3> position_m;                 // true
  std::vector<double> error_cm, error_z_cm, estimator_error_cm;  // error_z is signed
  std::array<std::vector<double>, 4> rpm, rpm_command;
  std::vector<render::TimelineRow> limiters;  // only those that acted
};

struct ReportBus {
  std::string name;  // "ESC bus"
  std::vector<double> t_s, load_percent;
  double limit_percent = 0.0;        // not-a-number: none
  std::vector<std::string> formula;  // lines that work out the worst case
};

struct ReportFlight {
  std::string name, axis;
  double first_motion_s = 0.0, last_motion_s = 0.0;
  std::vector<double> setpoint_t_s;
  std::array<std::vector<double>, 3> setpoint_m;
  std::vector<ReportTrace> traces;                         // one per variant
  std::vector<ReportBus> buses;                            // of the last trace
  std::vector<std::pair<std::string, std::string>> facts;  // "peak speed" -> "8.5 m/s"
};

struct HilReport {
  std::string title;  // scenario
  render::Outcome outcome;
  std::vector<std::pair<std::string, std::string>> facts;
  std::vector<std::string> warnings;
  std::vector<ReportTableRow> table;
  std::vector<ReportLimit> limits;
  std::vector<ReportFlight> flights;
  std::vector<std::pair<std::string, std::string>> inputs;  // path, sha256
  std::vector<std::pair<std::string, std::string>> provenance;
  std::string repeat_command;
};

// One self-contained HTML page: inline style, inline SVG, no script, nothing fetched.
std::string hil_report_html(const HilReport& report);

}  // namespace rotorloop::hil
