// The laboratory: batteries of trials of one ESC, its firmware core on drawn boards, each judged by the limits of docs/acceptance. The
// same trials as the studies of test/stats, over as few or as many draws as one likes.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bench/hil/esc_lab/closed_loop.hpp"
#include "bench/hil/esc_lab/esc_trace.hpp"
#include "bench/hil/esc_lab/subject.hpp"

namespace rotorloop::esc_lab {

enum class Battery : std::uint8_t { step, chirp, start, catch_rotor, sag, commission, fault };
inline constexpr std::array<std::string_view, 7> kBatteryNames = {"step", "chirp", "start", "catch", "sag", "commission", "fault"};

// One judged figure. A count of trials that failed has the limit 0 and the unit "of N".
struct LabRow {
  Battery battery;
  std::string what, unit;
  double value = 0.0, limit = 0.0;
  bool at_least = false;  // else at most
  std::string note = {};  // seeds, worst case, cause
  bool met() const { return at_least ? value >= limit : value <= limit; }
};

// What the page draws, by battery; empty where it was not run. Of steps, starts and catches the first draw and the first that misses.
struct LabFigures {
  struct Traced {
    std::uint64_t seed = 0;
    double from_s = 0.0, to_s = 1e9;  // the part to look at
    EscTrace trace;
    std::string what;     // of faults their names, of catches the speed
    bool missed = false;  // a limit
  };
  std::vector<Traced> steps, starts, catches, sags, faults;
  std::vector<GainPoint> gains;
  struct Quantity {
    std::string name, unit;
    double limit = 0.0;
    std::vector<double> errors;  // of each draw that measured it, signed
  };
  std::vector<Quantity> commissioned;
  struct FaultCount {
    std::string kind;
    int flown = 0, tripped = 0, latched = 0, failed = 0;
  };
  std::vector<FaultCount> fault_counts;  // of schedules in which this one broke
};

struct LabResult {
  std::string name;
  std::vector<std::pair<std::string, std::string>> facts;
  std::uint64_t seed = 1, draws = 0, schedules = 0;
  std::vector<LabRow> rows;
  LabFigures figures;
  bool met() const;
};

struct LabSettings {
  std::uint64_t seed = 1, draws = 8, schedules = 300;
  std::vector<Battery> only;  // empty: all
  std::function<void(std::string_view battery, std::uint64_t done, std::uint64_t of)> progress = {};
};

LabResult run_lab(const Subject& subject, const LabSettings& settings);

}  // namespace rotorloop::esc_lab
