// A run folder as the runner leaves it, with made-up flights of known error: what reports and comparisons are tested on.
#pragma once
#include <cmath>
#include <filesystem>
#include <string>

#include "bench/hil/flight/limiter_names.hpp"
#include "bench/hil/flight/run_folder.hpp"
#include "bench/sysid/log/log_writer.hpp"
#include "host/base/random.hpp"
#include "host/base/text_file.hpp"
#include "host/bus/candump_log.hpp"

namespace rotorloop::hil {

inline constexpr const char* kSyntheticScenario = R"(format = 1
name = "synthetic: a circle and a lift"
plant = "plant.toml"
vehicle = "vehicle.toml"
seeds = [1, 2, 3, 4, 5]
variants = ["pd_ff", "pd_ff_drag", "pd_ff_thrust_drag"]
[controller]
gains = "gains.toml"
[[flight]]
name = "horizontal"
trajectory = "h.toml"
[[flight]]
name = "vertical"
trajectory = "v.toml"
[limits]
mean_tracking_error_cm = [{ flight = "horizontal", variant = "pd_ff_thrust_drag", max = 5.5 }, { flight = "vertical", variant = "pd_ff_thrust_drag", max = 1.0, axis = "z" }]
reduction_percent = { flight = "horizontal", from = "pd_ff", to = "pd_ff_thrust_drag", min = 40 }
bus_load_percent = { max = 70 }
[[published]]
flight = "horizontal"
variant = "pd_ff"
error_cm = 10.5
source = "paper, Fig. 9"
[[published]]
flight = "horizontal"
variant = "pd_ff_thrust_drag"
error_cm = 5.1
source = "paper, Fig. 9"
)";

struct SyntheticRun {
  std::filesystem::path folder;
  double flight_s = 12.0;
  int rate_Hz = 1000;

  // Error amplitudes in cm by variant; every seed scatters about them.
  static double error_cm(Variant v) { return v == Variant::pd_ff ? 10.5 : v == Variant::pd_ff_drag ? 6.6 : 5.0; }

  void make(const std::filesystem::path& parent) {
    const auto kit = parent / "kit";
    std::filesystem::create_directories(kit);
    for (const auto* f : {"plant.toml", "vehicle.toml", "gains.toml", "h.toml", "v.toml"})
      write_text_file(kit / f, std::string("format = 1 # ") + f + "\n");
    write_text_file(kit / "scenario.toml", kSyntheticScenario);
    const auto s = read_scenario(kit / "scenario.toml");
    auto run = RunFolder::create(parent / "runs", folder_name(s.name), true);
    folder = run.path();
    RunResult r;
    r.scenario = s.name;
    r.version = "0.1.0";
    r.git = "0123456789ab";
    r.seeds = s.seeds;
    r.inputs = run.copy_inputs({s.path, s.plant, s.vehicle, s.gains, s.flights[0].trajectory, s.flights[1].trajectory});
    run.write_run_toml(r, "rotorloop hil scenario.toml", s);
    for (std::size_t f = 0; f < s.flights.size(); ++f)
      for (const auto& v : s.variants)
        for (const auto seed : s.seeds) r.flights.push_back(fly(run, f == 1, s.flights[f].name, v, seed, seed == s.seeds.front()));
    const auto a = assess(s, r.flights, r.flights.size());
    r.limits = a.limits;
    r.verdict = a.verdict;
    r.figures = figures_of(s, a, r.flights);
    r.published = s.published;
    r.log_hashes = run.log_hashes();
    r.log_sha256 = hash_of_logs(r.log_hashes);
    r.started_utc = "2001-02-03T04:05:06Z";
    r.wall_s = 20;
    r.warnings = {{"ablation", "none, but <this> is how a warning looks & reads"}};
    run.write_result(r);
  }

 private:
  FlightResult fly(RunFolder& run, bool vertical, const std::string& name, Variant v, std::uint64_t seed, bool logs) const {
    const RandomStream random(seed, static_cast<std::uint64_t>(v.own()) + (vertical ? 10u : 0u));
    const double scale = error_cm(v) / 100 * (vertical ? 0.25 : 1.0) * (1 + 0.06 * random.gaussian(1'000'000));
    FlightResult r;
    r.flight = name;
    r.variant = v;
    r.seed = seed;
    r.duration_s = flight_s;
    r.max_speed_m_s = vertical ? 3.1 : 8.5;
    r.max_accel_m_s2 = 10.8;
    r.bus_load_mean_percent = {61.2, 34.0};
    r.bus_load_max_percent = {63.0, 36.1};
    r.rpm_error_rms_rad_s = {3.1, 3.0, 3.3, 2.9};
    r.limited_share = 0.03;
    std::filesystem::path at;
    std::unique_ptr<log::FlightLogWriter> flight;
    std::unique_ptr<log::TruthLogWriter> truth;
    std::unique_ptr<CandumpWriter> esc;
    if (logs) {
      at = run.flight_folder(name, v, seed);
      const log::LogHeader header{{"start_utc", std::string(log::kVirtualEpochUtc)},
                                  {"control_limiter_bits", "1 tilt, 2 thrust"},
                                  {"esc_limiter_codes", esc_limiter_codes()}};
      flight = std::make_unique<log::FlightLogWriter>(at / "flight.csv", header);
      truth = std::make_unique<log::TruthLogWriter>(at / "truth.csv", header);
      esc = std::make_unique<CandumpWriter>((at / "esc.log").string(), "esc");
    }
    TrackingMeter meter;
    const int steps = static_cast<int>(flight_s * rate_Hz);
    double slow = 0;
    for (int k = 0; k < steps; ++k) {
      const double t = static_cast<double>(k) / rate_Hz, start = 1.0, end = flight_s - 1.0;
      const bool moving = t >= start && t <= end;
      const double phase = 2 * 3.14159265358979 * std::clamp((t - start) / (end - start), 0.0, 1.0);
      const double swing = std::sin(phase) * std::sin(phase);
      slow += 0.002 * (random.gaussian(static_cast<std::uint64_t>(k)) - slow);
      TrackingSample m;
      m.t_s = t;
      m.sp_p_W_m = vertical ? Eigen::Vector3d(0, 0, 2 + std::sin(3 * phase))
                            : Eigen::Vector3d(4 * std::sin(phase), 2.5 * std::sin(2 * phase), 2 + 0.3 * std::sin(phase));
      m.sp_v_W_m_s = {moving ? 1.0 : 0.0, 0, 0};
      const Eigen::Vector3d along = vertical ? Eigen::Vector3d(0.3, 0.2, 1) : Eigen::Vector3d(std::cos(phase), std::cos(2 * phase), 0.3);
      m.true_p_W_m = m.sp_p_W_m + scale * (0.6 + swing + 6 * slow) * along;
      m.est_p_W_m = m.true_p_W_m + 0.008 * Eigen::Vector3d(random.gaussian(static_cast<std::uint64_t>(k) / 40), slow * 8, 0.3);
      meter.add(m);
      if (!logs) continue;
      log::FlightRow row;
      log::TruthRow true_row;
      row.t_s = true_row.t_s = t;
      for (std::size_t i = 0; i < 3; ++i) {
        row.est_p_W_m[i] = m.est_p_W_m[static_cast<int>(i)];
        row.sp_p_W_m[i] = m.sp_p_W_m[static_cast<int>(i)];
        true_row.p_W_m[i] = m.true_p_W_m[static_cast<int>(i)];
      }
      row.control_limiter = swing > 0.97 ? 2 : 0;
      for (std::size_t i = 0; i < 4; ++i) {
        const double hover = 937, command = hover + 180 * swing * std::sin(25 * phase + static_cast<double>(i)) +
                                            4 * random.gaussian(static_cast<std::uint64_t>(4 * k) + i);
        row.omega_cmd_rad_s[i] = command;
        row.omega_rad_s[i] = true_row.omega_rad_s[i] = hover + 180 * swing * std::sin(25 * (phase - 0.006) + static_cast<double>(i));
        set_limiter(row, true_row, i, i == 1 && command > 1100 ? 4 : 0);
      }
      flight->write(row);
      truth->write(true_row);
      for (std::uint32_t n = 0; n < 5; ++n)
        esc->write(static_cast<std::int64_t>(k) * 1'000'000 + n * 120'000,
                   CanFrame{.id = 0x100 + n, .length = 8, .data = {1, 2, 3, 4, 5, 6, 7, static_cast<std::uint8_t>(k)}});
    }
    if (logs) {
      run.note_log(at / "flight.csv", flight->close());
      run.note_log(at / "truth.csv", truth->close());
      esc->close();
      run.note_log(at / "esc.log");
    }
    r.tracking = meter.figures();
    return r;
  }
  // Whichever of the two logs holds the ESCs' limiters.
  template <class F, class T>
  static void set_limiter(F& flight, T& truth, std::size_t esc, double code) {
    if constexpr (requires { flight.esc_limiter; })
      flight.esc_limiter[esc] = code;
    else
      truth.esc_limiter[esc] = code;
  }
};

}  // namespace rotorloop::hil
