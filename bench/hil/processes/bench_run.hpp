// Starts what is local of a bench, waits for the first that ends, and stops all the others: the controller first, as it disarms.
#pragma once
#include <atomic>
#include <filesystem>
#include <string>
#include <vector>

#include "bench/hil/processes/bench_file.hpp"
#include "host/base/error.hpp"

namespace rotorloop::hil {

struct BenchStart {
  std::filesystem::path program;           // rotorloop itself
  std::filesystem::path folder;            // there; what each process prints, recordings of both buses, bridge logs
  std::vector<std::string> fly_arguments;  // further ones: the answer about propellers
  const std::atomic<bool>* stop = nullptr;
};

struct BenchEnd {
  ExitCode code = ExitCode::ok;
  std::string first;     // who ended first, and how: "esc 22 was ended by signal 9"
  std::string airframe;  // what it printed: the figures of the flight
  std::string messages;  // of airframe and controller
};

// Returns when every process has ended. Throws Error when one cannot be started; those before it are ended then.
BenchEnd run_bench(const BenchFile& bench, const BenchStart& start);

}  // namespace rotorloop::hil
