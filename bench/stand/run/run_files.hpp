// What a run leaves behind while it runs: files that are only ever appended to, written within 10 ms or so. A program that is killed leaves
// all but the last of them.
#pragma once
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace rotorloop::stand_run {

class RunFiles {
 public:
  // Makes the folder with readings.csv, samples.csv, steps.csv and events.jsonl. Throws Error: usage for a folder that is not empty, device
  // when it cannot be written.
  explicit RunFiles(const std::filesystem::path& folder);
  ~RunFiles();
  RunFiles(const RunFiles&) = delete;
  RunFiles& operator=(const RunFiles&) = delete;

  void reading(std::string_view line) { readings_.waiting.append(line).push_back('\n'); }
  void sample(std::string_view line) { samples_.waiting.append(line).push_back('\n'); }
  void step(std::string_view line) { steps_.waiting.append(line).push_back('\n'); }
  void event(const nlohmann::ordered_json& event);
  void write_history(std::string_view text);  // trip.csv: readings of the two seconds before a trip
  // To the system, when 10 ms have passed since the last time, or `now`.
  void flush(std::int64_t now_ns, bool at_once = false);
  bool failed() const { return failed_; }  // the disk refused: what comes after is lost
  const std::filesystem::path& folder() const { return folder_; }

 private:
  struct File {
    int fd = -1;
    std::string waiting;
  };
  void open(File& file, const char* name, std::string_view header);
  void write(File& file);
  std::filesystem::path folder_;
  File readings_, samples_, steps_, events_;
  std::int64_t flushed_ns_ = -(std::int64_t{1} << 60);
  bool failed_ = false;
};

}  // namespace rotorloop::stand_run
