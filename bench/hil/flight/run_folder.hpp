// A run folder holds all that is needed to repeat and to judge a run: copies of the inputs, the command, the logs, the
// result. Nothing in it depends on where it lies; nothing hashed in it depends on when or where it was made.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "bench/hil/flight/metrics.hpp"

namespace rotorloop::hil {

struct InputFile {
  std::string path;  // relative to <run>/inputs, '/' separated
  std::string sha256;
};

struct Figure {
  double value = kNotMeasured;
  double u = kNotMeasured;  // standard deviation over seeds
  std::string unit;
  int n = 0;
};

struct Warning {
  std::string where, what;
};

// result.json (contract result.schema.md, format 1).
struct RunResult {
  std::string command = "hil";
  std::string version, git;
  std::string scenario;  // its name
  std::string escs;      // which kind flew, where not all were native
  std::vector<InputFile> inputs;
  std::vector<std::uint64_t> seeds;
  std::string started_utc;  // ISO 8601; the only fields that differ between two runs are this and wall_s
  double wall_s = 0.0;
  Verdict verdict = Verdict::incomplete;
  std::vector<LimitResult> limits;
  std::map<std::string, Figure> figures;  // "horizontal/pd_ff/mean_error_3d"
  std::vector<FlightResult> flights;
  std::vector<PublishedError> published;
  std::map<std::string, std::string> log_hashes;  // relative path -> sha256
  std::string log_sha256;
  std::vector<Warning> warnings;
  std::vector<std::string> real_time;  // of a paced run: what the system granted
  std::vector<std::string> errors;     // why it did not pass (run_outcome.hpp)
  std::string next;                    // what to do now
};

std::string result_json_text(const RunResult& r);                // pretty, ends with a newline
RunResult read_result(const std::filesystem::path& run_folder);  // throws Error: no run folder, not readable, unknown format

// Figures of an assessment in the form of result.json.
std::map<std::string, Figure> figures_of(const Scenario& scenario, const Assessment& a, const std::vector<FlightResult>& flights);

// Hash over "path sha256\n" lines in order of path.
std::string hash_of_logs(const std::map<std::string, std::string>& path_to_sha256);

// "paper: horizontal" -> "paper-horizontal": lower case, [a-z0-9_-], never empty.
std::string folder_name(const std::string& scenario_name);

class RunFolder {
 public:
  // Makes runs_dir/name. An existing folder is refused unless `force`, and replaced only if it is a run folder (it holds
  // run.toml) or empty: --force never deletes anything else.
  static RunFolder create(const std::filesystem::path& runs_dir, const std::string& name, bool force);

  const std::filesystem::path& path() const { return path_; }

  // Copies the files to <run>/inputs, keeping how they lie to each other, so that the copied scenario finds its copied
  // inputs: `rotorloop hil <run>/inputs/…/scenario.toml` repeats the run. Returns them sorted by path. Call once.
  std::vector<InputFile> copy_inputs(const std::vector<std::filesystem::path>& files);

  // run.toml. `scenario_input` is the scenario's path below inputs/ (as returned by input_path_of()).
  void write_run_toml(const RunResult& r, const std::string& command_line, const Scenario& as_flown) const;
  std::string input_path_of(const std::filesystem::path& file) const;  // after copy_inputs; throws Error if unknown

  // <run>/<flight>/<variant>/<seed>, made on the way. Thread-safe, as is note_log().
  std::filesystem::path flight_folder(const std::string& flight, const Variant& variant, std::uint64_t seed);
  // Enters a closed log into the hash list; `sha256` empty: the file is read and hashed.
  void note_log(const std::filesystem::path& log, std::string sha256 = {});
  std::map<std::string, std::string> log_hashes() const;

  void write_result(const RunResult& r) const;  // result.json

  RunFolder(RunFolder&& other) noexcept : path_(std::move(other.path_)), inputs_(std::move(other.inputs_)), logs_(std::move(other.logs_)) {}

 private:
  explicit RunFolder(std::filesystem::path path) : path_(std::move(path)) {}
  std::filesystem::path path_;
  std::map<std::filesystem::path, std::string> inputs_;  // given path -> path below inputs/
  std::map<std::string, std::string> logs_;
  mutable std::mutex mutex_;
};

// Copies files into `folder`: below the deepest folder that holds them all they keep their places, so that relative paths inside them
// stay true. Returns where each came to lie, relative to `folder`, by its name as given. Throws Error (ExitCode::device).
std::map<std::filesystem::path, std::string> copy_together(const std::vector<std::filesystem::path>& files,
                                                           const std::filesystem::path& folder);

}  // namespace rotorloop::hil
