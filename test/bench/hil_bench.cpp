// Speed of the whole loop: flies the scenario's first flight with its last variant and first seed, all logs written, and
// prints one JSON object. Twice: for the total without meters, then for the cost per module (meters cost a few per cent).
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "bench/hil/flight/flight.hpp"
#include "host/base/error.hpp"

namespace {

using namespace rotorloop;

double seconds_of(const std::function<void()>& f) {
  const auto start = std::chrono::steady_clock::now();
  f();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::uintmax_t bytes_in(const std::filesystem::path& folder) {
  std::uintmax_t sum = 0;
  for (const auto& e : std::filesystem::recursive_directory_iterator(folder))
    if (e.is_regular_file()) sum += e.file_size();
  return sum;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: bench_hil SCENARIO\n");
    return to_int(ExitCode::usage);
  }
  const auto folder = std::filesystem::temp_directory_path() / ("rotorloop_bench_" + std::to_string(::getpid()));
  try {
    const hil::Scenario scenario = hil::read_scenario(argv[1]);
    const hil::Inputs inputs = hil::read_inputs(scenario);
    hil::FlightRequest q{.flight = 0, .variant = scenario.variants.back(), .seed = scenario.seeds.front(), .folder = folder};
    std::filesystem::create_directories(folder);
    hil::FlightOutcome plain, metered;
    double wall_s = 1e9;
    for (int repetition = 0; repetition < 2; ++repetition)
      wall_s = std::min(wall_s, seconds_of([&] { plain = hil::fly(scenario, inputs, q, nullptr, {}, nullptr); }));
    const auto log_bytes = bytes_in(folder);
    q.measure_cost = true;
    metered = hil::fly(scenario, inputs, q, nullptr, {}, nullptr);
    std::filesystem::remove_all(folder);
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);

    const double flown_s = plain.result.duration_s;
    const hil::ModuleCost& c = metered.cost;
    const auto per_s = [&](std::int64_t ns) { return static_cast<double>(ns) * 1e-6 / flown_s; };
    const nlohmann::json out{{"flight", plain.result.flight},
                             {"variant", hil::variant_name(q.variant)},
                             {"end", hil::flight_end_name(plain.result.end)},
                             {"flown_s", flown_s},
                             {"wall_s", wall_s},
                             {"times_real_time", flown_s / wall_s},
                             {"log_bytes", log_bytes},
                             {"peak_resident_MB", static_cast<double>(usage.ru_maxrss) / 1024.0},
                             {"rotor_evaluations", plain.result.counters.at("rotor.evaluations")},
                             {"mixer_iterations_mean", plain.result.counters.at("control.mixer_iterations_mean")},
                             {"mixer_iterations_max", plain.result.counters.at("control.mixer_iterations_max")},
                             {"cost_ms_per_s",
                              {{"four ESCs", per_s(c.esc_ns)},
                               {"rotors", per_s(c.rotor_ns)},
                               {"computer", per_s(c.computer_ns)},
                               {"bus, candump", per_s(c.bus_ns)},
                               {"airframe", per_s(c.airframe_ns)},
                               {"sensors", per_s(c.sensor_ns)},
                               {"CSV logs", per_s(c.log_ns)}}}};
    std::printf("%s\n", out.dump(1).c_str());
    return plain.result.end == hil::FlightEnd::completed ? 0 : to_int(ExitCode::verdict);
  } catch (const Error& e) {
    std::filesystem::remove_all(folder);
    std::fprintf(stderr, "%s\n", e.what());
    return to_int(e.exit_code());
  }
}
