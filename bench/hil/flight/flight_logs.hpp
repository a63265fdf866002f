// What a flight leaves on disk: flight.csv, truth.csv and the frames of both buses.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>

#include "bench/hil/flight/loop.hpp"
#include "bench/hil/flight/run_folder.hpp"
#include "bench/hil/flight/scenario.hpp"
#include "bench/sysid/log/log_writer.hpp"
#include "host/bus/candump_log.hpp"

namespace rotorloop::hil {

unsigned limiter_bits(const host::Limiters& limiters);  // as control_limiter of flight.csv
log::LogHeader log_header(const Scenario& scenario, const sim::PlantFile& plant, std::size_t flight, Variant variant, std::uint64_t seed);
log::FlightRow flight_row(const host::FlightRecord& record);
log::TruthRow airframe_row(double t_s, const PlantTruth& truth);  // what an airframe knows without ESCs and buses in its own process
log::TruthRow truth_row(double t_s, const PlantTruth& truth, Loop& loop);

// Logs of one flight; empty when no folder was asked for.
struct FlightLogFiles {
  std::optional<log::FlightLogWriter> flight;
  std::optional<log::TruthLogWriter> truth;
  std::optional<CandumpWriter> esc, state;

  FlightLogFiles(const std::filesystem::path& folder, const log::LogHeader& header, Loop& loop);
  void close(const std::filesystem::path& folder, RunFolder* run);
};

}  // namespace rotorloop::hil
