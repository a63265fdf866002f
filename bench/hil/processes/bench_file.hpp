// A bench file: which flight, and who sits on which bus. What is local is started; for the rest the airframe waits, by node id.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>

namespace rotorloop::hil {

struct BenchFile {
  std::filesystem::path path, scenario;
  std::string flight, variant;  // empty: the scenario's first
  std::uint64_t seed = 0;       // 0: the scenario's first
  std::string pace = "realtime";
  double wait_s = 30.0, silence_s = 2.0;
  struct Buses {
    std::string esc, state;
  };
  Buses airframe_buses, fly_buses;                            // as each of them names them
  bool airframe = true, fly = true;                           // are local
  std::array<std::uint8_t, 4> esc_nodes{21, 22, 23, 24};      // of esc_index 0 to 3; all different
  std::array<bool, 4> esc_simulated{true, true, true, true};  // local
  std::array<std::string, 4> esc_buses;
};

// Throws Error (ExitCode::usage) with file, line, key, value, range and remedy.
BenchFile read_bench(const std::filesystem::path& path);

}  // namespace rotorloop::hil
