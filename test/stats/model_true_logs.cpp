// Logs of a vehicle that obeys the paper's equations 1 to 8 and nothing else: the clean control of scripts/stats diagnose.
//   model_true_logs --seed N --out DIR     vertical.csv, horizontal.csv, rotation.csv: 20 s each, pose, rotor speeds, gyro, accelerometer
// vehicles/paper.toml is the vehicle file that goes with them.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>

#include "bench/sysid/log/own_log.hpp"
#include "test/support/model_true_flight.hpp"

int main(int argc, char** argv) {
  using namespace rotorloop;
  model_true::FlightSettings settings;
  settings.imu_every_ms = 1;
  std::filesystem::path out;
  CLI::App app{"logs of flights that obey eq. 1 to 8"};
  app.add_option("--seed", settings.seed, "of all noise")->required();
  app.add_option("--out", out, "folder that the logs go to")->required();
  CLI11_PARSE(app, argc, argv);
  for (const auto& flight : model_true::fly_identification_set({}, settings)) {
    std::ofstream file(out / (flight.record.name + ".csv"));
    file << log::own_log_text(flight.record);
    if (!file.flush()) return 3;
  }
  return 0;
}
