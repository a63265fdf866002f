// `rotorloop identify` as a call: files in, all that the command prints and writes out. Every choice of the command is made here; its
// defaults are the defaults of these structs. identify.hpp is the fit alone, without choices.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bench/sysid/identify/derived.hpp"
#include "bench/sysid/identify/file_comparison.hpp"
#include "bench/sysid/identify/held_out.hpp"
#include "bench/sysid/identify/homogeneity.hpp"
#include "bench/sysid/identify/identify.hpp"
#include "bench/sysid/identify/observability.hpp"
#include "bench/sysid/identify/solver_check.hpp"
#include "bench/sysid/identify/whiteness.hpp"
#include "bench/sysid/log/flight_set.hpp"
#include "host/base/error.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::identify {

// Which parameters are free, which measurements count, at what rate, and from when to when. `identify` and `diagnose` fit the same model,
// so a word means the same in both.
struct FitRequest {
  std::vector<std::string> free = {}, hold = {}, per_flight = {};  // names of `rotorloop identify --names`; free: also NAME=U
  std::vector<std::string> use = {};  // beside the poses: gyro, accel, velocity, load; none: the poses alone. Empty: see use_what_all_have
  double rate_Hz = 100.0;             // states per second; 0: as many as poses, between 100 and 500
  double from_s = -1e300, to_s = 1e300;

  // Grid, measurements and wishes of `i`; all else stays.
  void apply(IdentifyOptions& i) const;
  // Where `use` is empty: gyro and accelerometer, each where all of these logs have it.
  void use_what_all_have(const std::vector<FlightToFit>& flights);
  // Where an accelerometer sits is hardly ever published, and an arm of a few centimetres reads like a residual force: it is looked for,
  // about the body's origin, unless the user said otherwise.
  void free_place_of_accelerometer(const host::VehicleFile& vehicle);
};

enum class NoiseSearch { shared, per_flight, fixed };  // figures of all flights together, of each flight, or those built in
std::string_view name(NoiseSearch noise);              // "em", "em-per-flight", "fixed"

struct IdentificationRequest {
  std::filesystem::path vehicle = {};  // file with mass and geometry that are known, and start values
  log::FlightPaths flights = {};
  std::vector<std::filesystem::path> compare = {};  // vehicle files to compare the result with
  std::filesystem::path out = {};                   // where the caller writes the vehicle file, for messages; empty: nowhere
  FitRequest fit = {};
  host::TermList terms = {};  // effects that are added to the model
  NoiseSearch noise = NoiseSearch::shared;
  bool priors = true;           // what the vehicle file knows counts with its u; else it gives start values alone
  bool check_by_ceres = false;  // the joint fit by Ceres as well, and how far the two lie apart
  double drag_speed_m_s = 8.5;  // of the total drag that is derived
  double robust_scale = 0.0;    // standard deviations beyond which a pose counts less (Cauchy loss); 0: squares for all
  double block_s = 1.0;         // length of the blocks whose scatter gives robust u
  int iterations = 200;         // of each fit, at most
};

// All that is made of a fit, for text, JSON and the page.
struct IdentifyAnalysis {
  std::vector<DerivedQuantity> derived;
  std::vector<FlightWhiteness> whiteness;  // of flights with poses
  Homogeneity homogeneity;
  double inflation = 1.0;  // median ratio of robust to classical variance, at least 1: what correlated residuals add
  Observability observability;
  std::optional<SolverCheck> solver_check;       // when it was asked for
  std::optional<HeldOutScores> held_out;         // when flights were held out; analyse() has none
  std::vector<std::string> written_differences;  // of the vehicle file from the estimates (written_vehicle()); analyse() has none
};
IdentifyAnalysis analyse(const Identification& result, const host::VehicleModel& base, double drag_speed_m_s);

struct IdentificationRun {
  IdentificationRequest request;  // as given, with the measurements that were used and what was freed for them
  host::VehicleFile base;         // that the fit started from
  log::FlightSet flights;         // its inputs: vehicle file, mapping, flights, files compared
  Identification result;
  IdentifyAnalysis analysis;
  FileComparison comparison;
  bool stopped = false;          // asked to stop: what stands here was found before, and there is no vehicle
  host::VehicleFile vehicle;     // that the flights make of `base`
  std::optional<Error> problem;  // what keeps `vehicle` from being an answer; it must not be written then
};

// What a caller hears of a run, from the thread that called, and how it ends it early.
struct IdentificationWatch {
  log::ReadingWatch reading = {};
  std::function<void(const estimate::FitOptions&)> begins = {};  // fits with these options; `progress` is of them from here on
  std::function<void(const IdentifyProgress&)> progress = {};
  estimate::StopFit stop = {};
};

// Throws Error as identify(), read_flight_set() and read_vehicle() do. A fit without an end is no error: look at `problem`.
IdentificationRun run_identification(const IdentificationRequest& request, const IdentificationWatch& watch = {});

// Why a reader of vehicle files would refuse what a fit came to; none when it would take it. A fit of a poor flight must not become a
// vehicle. `path`: where it was to be written; empty: nowhere.
std::optional<Error> not_credible(const std::filesystem::path& path, const host::VehicleFile& v, const host::EffectCatalogue& catalogue);

}  // namespace rotorloop::identify
