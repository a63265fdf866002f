// Samples of several flights in one row: what every look at residuals works on, free of gaps because nodes that no step of the model
// ties are left out. Plain values; knows no model.
#pragma once
#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace rotorloop::diagnose {

// A stretch of one flight without a gap, at equal steps: samples first … first + count - 1 of the row.
struct Piece {
  std::size_t flight = 0, first = 0, count = 0;
  double start_s = 0.0, step_s = 0.0;
};

struct Samples {
  std::vector<std::string> flights;
  std::vector<Piece> pieces;  // in order, together all samples
  std::size_t size = 0;

  void add(std::size_t flight, double start_s, double step_s, std::size_t count) {
    pieces.push_back({flight, size, count, start_s, step_s});
    size += count;
  }
};

// One number for each sample.
struct Channel {
  std::string id, name, unit;  // "v_x", "forward speed", "m/s"
  std::vector<double> value;
  bool product = false;  // of two others: a regression takes it as a straight line, not as a curve
};

// Body axes: force x, y, z in N, torque x, y, z in N m.
inline constexpr std::size_t kAxes = 6;
inline constexpr std::array<const char*, kAxes> kAxisNames{"force x", "force y", "force z", "torque x", "torque y", "torque z"};
inline constexpr std::array<const char*, kAxes> kAxisUnits{"N", "N", "N", "N m", "N m", "N m"};
using Axes = std::array<std::vector<double>, kAxes>;

// Neighbouring samples that are drawn, left out or counted together, because they are not independent of each other.
struct SampleBlock {
  std::size_t flight = 0, first = 0, count = 0;
};
// Pieces cut into blocks as near to `block_s` as they divide; one shorter than half of it stays one block.
std::vector<SampleBlock> blocks_of(const Samples& samples, double block_s);

// What is predicted from the rest. Whole flights: a curve must hold on a flight that had no part in it; but what only one flight meets (a
// wall that one alone comes near) is then never seen. Runs of blocks within the flights: it is.
enum class LeftOut { flights, runs };

// A fold for each block: whole flights when there are three or more and `left_out` says so, else `folds` runs of blocks one after the other
// in turn.
std::vector<int> folds_of(const Samples& samples, std::span<const SampleBlock> blocks, int folds, LeftOut left_out = LeftOut::flights);

std::vector<double> times_s(const Samples& samples);

double mean_square(std::span<const double> v);
// Mean over `window_s` about each sample, within its piece.
std::vector<double> sliding_mean(const Samples& samples, std::span<const double> v, double window_s);

}  // namespace rotorloop::diagnose
