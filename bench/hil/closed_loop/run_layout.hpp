// Where things lie in a loop's run folder: written by the stages, read by result, report and the comparison with the truth.
#pragma once
#include <filesystem>

namespace rotorloop::closed_loop {

struct LoopLayout {
  std::filesystem::path run;
  std::filesystem::path run_toml() const { return run / "run.toml"; }
  std::filesystem::path inputs() const { return run / "inputs"; }
  std::filesystem::path scenario(const char* which) const { return inputs() / (std::string(which) + ".toml"); }  // learn, held_out, judged
  std::filesystem::path fly() const { return run / "1-fly"; }        // holds the runs "learn" and "held_out"
  std::filesystem::path before() const { return run / "2-before"; }  // these hold the run "judged"
  std::filesystem::path identify() const { return run / "3-identify"; }
  std::filesystem::path diagnose() const { return run / "4-diagnose"; }
  std::filesystem::path identified() const { return run / "5-identified"; }
  std::filesystem::path after() const { return run / "6-after"; }
  std::filesystem::path identified_vehicle() const { return identify() / "out" / "vehicle.toml"; }
  std::filesystem::path diagnosed_vehicle() const { return diagnose() / "out" / "vehicle.toml"; }
  std::filesystem::path diagnosis() const { return diagnose() / "out" / "report" / "result.json"; }
  std::filesystem::path result() const { return run / "result.json"; }
  std::filesystem::path truth() const { return run / "truth.json"; }
  std::filesystem::path report() const { return run / "report.html"; }
};

}  // namespace rotorloop::closed_loop
