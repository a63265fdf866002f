// Options that every command that fits flights has: which parameters are free, which measurements count, at what rate, and from when to
// when. `identify` and `diagnose` fit the same model, so a word means the same in both.
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "bench/sysid/identify/identify.hpp"
#include "host/base/error.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::cli {

struct FitOptions {
  std::vector<std::string> free = {}, hold = {}, per_flight = {}, use = {};
  double rate_Hz = 0.0;  // 0, where the command allows it: as many as poses
  double from_s = -1e300, to_s = 1e300;

  // Grid, measurements and wishes of `i`; all else stays.
  void apply(identify::IdentifyOptions& i) const;
  // Where --use was not given: gyro and accelerometer, each where all of these logs have it.
  void use_what_all_have(const std::vector<identify::FlightToFit>& flights);
  // Where an accelerometer sits is hardly ever published, and an arm of a few centimetres reads like a residual force: it is looked for,
  // about the body's origin, unless the user said otherwise.
  void free_place_of_accelerometer(const host::VehicleFile& vehicle);
};

// --free, --hold, --per-flight, --use, --rate (`rate_help`, from `least_rate_Hz` to 1000), --from and --to.
void add_fit_options(CLI::App& app, FitOptions& o, const std::string& rate_help, double least_rate_Hz);

// Why a reader of vehicle files would refuse what a fit came to; none when it would take it. A fit of a poor flight must not become a
// vehicle. `path`: where it was to be written; empty: nowhere.
std::optional<Error> not_credible(const std::filesystem::path& path, const host::VehicleFile& v, const host::EffectCatalogue& catalogue);

// Writes what a reader of vehicle files accepts, else throws not_credible() (data quality).
void write_checked(const std::filesystem::path& path, const host::VehicleFile& v, const host::EffectCatalogue& catalogue);

}  // namespace rotorloop::cli
