// Time and size of one logged step; budget: 8 µs for a flight row (docs/benchmarks.md).
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>

#include "bench/sysid/log/log_reader.hpp"
#include "bench/sysid/log/log_writer.hpp"
#include "host/base/random.hpp"

namespace rotorloop::test {
namespace {

struct Fill {
  RandomStream random{1, 1};
  std::uint64_t n = 0;
  template <class Cell>
  void one(const char*, const char*, int decimals, Cell& v) {
    v = decimals == 0 ? 0.0 : random.gaussian(n++) * (decimals <= 2 ? 1000.0 : 3.0);
  }
  template <std::size_t N>
  void all(int d, std::array<double, N>& v) {
    for (auto& x : v) one("", "", d, x);
  }
  void xyz(const char*, const char*, int d, log::Cells3& v) { all(d, v); }
  void wxyz(const char*, const char*, int d, log::Cells4& v) { all(d, v); }
  void rotors(const char*, const char*, int d, log::Cells4& v) { all(d, v); }
};

std::filesystem::path scratch(const char* name) {
  return std::filesystem::temp_directory_path() / (std::string("rotorloop-bench-") + std::to_string(::getpid()) + name);
}

void flight_row(benchmark::State& state) {
  std::vector<log::FlightRow> rows(64);
  Fill fill;
  for (auto& r : rows) log::visit_flight_columns(r, fill);
  const auto path = scratch("flight.csv");
  log::FlightLogWriter writer(path, {});
  std::size_t k = 0;
  for (auto _ : state) writer.write(rows[k++ % rows.size()]);
  state.counters["bytes_per_row"] = static_cast<double>(writer.bytes()) / static_cast<double>(k);
  writer.close();
  std::filesystem::remove(path);
}
BENCHMARK(flight_row);

void truth_row(benchmark::State& state) {
  std::vector<log::TruthRow> rows(64);
  Fill fill;
  for (auto& r : rows) log::visit_truth_columns(r, fill);
  const auto path = scratch("truth.csv");
  log::TruthLogWriter writer(path, {});
  std::size_t k = 0;
  for (auto _ : state) writer.write(rows[k++ % rows.size()]);
  writer.close();
  std::filesystem::remove(path);
}
BENCHMARK(truth_row);

void read_flight_minute_three_columns(benchmark::State& state) {
  const auto path = scratch("minute.csv");
  {
    log::FlightLogWriter writer(path, {});
    log::FlightRow row;
    Fill fill;
    for (int i = 0; i < 60'000; ++i) {
      if (i % 64 == 0) log::visit_flight_columns(row, fill);
      writer.write(row);
    }
    writer.close();
  }
  for (auto _ : state) benchmark::DoNotOptimize(log::read_log(path, {"t[s]", "est_p_x[m]", "sp_p_x[m]"}).rows);
  std::filesystem::remove(path);
}
BENCHMARK(read_flight_minute_three_columns)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace rotorloop::test

BENCHMARK_MAIN();
