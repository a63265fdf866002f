#include "cli/fit_options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <thread>

#include "host/base/text_file.hpp"
#include "host/effects/term_size.hpp"

namespace rotorloop::cli {

void FitOptions::apply(identify::IdentifyOptions& i) const {
  i.grid.rate_Hz = rate_Hz;
  i.grid.from_s = from_s;
  i.grid.to_s = to_s;
  for (const std::string& stream : use) {
    if (stream == "gyro") i.grid.use_gyro = true;
    if (stream == "accel") i.grid.use_accel = true;
    if (stream == "velocity") i.grid.use_velocity = true;
    if (stream == "load") i.grid.use_load = true;
  }
  i.wishes = {free, hold, per_flight};
  i.fit.threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

void FitOptions::use_what_all_have(const std::vector<identify::FlightToFit>& flights) {
  if (!use.empty()) return;
  const auto all_have = [&](auto log::FlightRecord::*stream) {
    return std::none_of(flights.begin(), flights.end(), [&](const identify::FlightToFit& f) { return (f.record.*stream).empty(); });
  };
  if (all_have(&log::FlightRecord::gyro_B_rad_s)) use.push_back("gyro");
  if (all_have(&log::FlightRecord::accel_B_m_s2)) use.push_back("accel");
}

void FitOptions::free_place_of_accelerometer(const host::VehicleFile& vehicle) {
  constexpr double kWithinArms = 0.3;
  const auto of_place = [](const std::string& name) { return name.starts_with("imu_place"); };
  const bool used = std::find(use.begin(), use.end(), "accel") != use.end();
  const bool said = std::any_of(free.begin(), free.end(), of_place) || std::any_of(hold.begin(), hold.end(), of_place);
  if (used && !said)
    free.push_back(fmt::format("imu_place={:.3g}", kWithinArms * host::arm_m(host::load_geometry(host::to_model(vehicle)))));
}

void add_fit_options(CLI::App& app, FitOptions& o, const std::string& rate_help, double least_rate_Hz) {
  app.add_option(
      "--free", o.free,
      "NAME or NAME=U: free a parameter or group, with a prior of U about its start value (`rotorloop identify --names` lists the names)");
  app.add_option("--hold", o.hold, "hold a parameter or group at its start value");
  app.add_option("--per-flight", o.per_flight, "one value of a parameter or group for each flight");
  app.add_option("--use", o.use,
                 "measurements beside the poses: gyro, accel, velocity; load: the place of a load on a string (payload_x[m] …); none: the "
                 "poses alone. Not given: gyro and accelerometer, where all logs have them")
      ->delimiter(',')
      ->check(CLI::IsMember({"gyro", "accel", "velocity", "load", "none"}));
  app.add_option("--rate", o.rate_Hz, rate_help)->check(CLI::Range(least_rate_Hz, 1000.0))->capture_default_str();
  app.add_option("--from", o.from_s, "leave out what lies before, s");
  app.add_option("--to", o.to_s, "leave out what lies after, s");
}

std::optional<Error> not_credible(const std::filesystem::path& path, const host::VehicleFile& v, const host::EffectCatalogue& catalogue) {
  try {
    (void)host::parse_vehicle(host::vehicle_text(v), path.empty() ? std::filesystem::path("the identified vehicle") : path, catalogue);
    return std::nullopt;
  } catch (const Error& e) {
    ErrorText text = e.text();
    // Line numbers are those of a file that nobody has.
    text.where = path.empty() ? "" : path.generic_string();
    text.what = std::string("the identified vehicle is not credible") + (path.empty() ? ": " : " and was not written: ") + text.what;
    text.likely =
        "the flights do not determine these parameters, the model lacks an effect that they show, or a stream is wrong (see the findings "
        "of the "
        "checks)";
    text.remedy =
        "hold what they do not determine (--hold torque_model.c_q where the figure of merit is off: c_q hangs on the rotors' own inertia), "
        "add the effect (--term; `rotorloop diagnose` names it), or fly the manoeuvres that "
        "excite it";
    return Error(text, ExitCode::data_quality);
  }
}

void write_checked(const std::filesystem::path& path, const host::VehicleFile& v, const host::EffectCatalogue& catalogue) {
  if (const auto problem = not_credible(path, v, catalogue)) throw *problem;
  write_text_file(path, host::vehicle_text(v));
}

}  // namespace rotorloop::cli
