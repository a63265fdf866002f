// The sandbox's folder, in the temporary folder: copies of what a diagnosis may know. Its program runs there, sandboxed, and only plain
// files are taken back.
#pragma once
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "bench/hil/closed_loop/isolation_probe.hpp"
#include "bench/hil/closed_loop/program_call.hpp"

namespace rotorloop::closed_loop {

class Workspace {
 public:
  // `papers`: file -> its name in the workspace ("flights/learn_1.csv"). The names give nothing away, nor does the workspace's.
  explicit Workspace(const std::vector<std::pair<std::filesystem::path, std::string>>& papers);
  ~Workspace();
  Workspace(const Workspace&) = delete;
  Workspace& operator=(const Workspace&) = delete;

  const std::filesystem::path& path() const { return path_; }

  // Chooses the sandbox that holds against `secrets`; the results of all that were tried, the chosen one last.
  const std::vector<IsolationProbeResult>& isolate(const Prober& prober, const std::vector<std::filesystem::path>& secrets);

  // The program in this folder, sandboxed as chosen. Its exit code.
  int run(const std::filesystem::path& program, const std::vector<std::string>& arguments, const std::filesystem::path& output,
          const std::filesystem::path& errors, const std::function<void(const std::string&)>& line, const std::atomic<bool>* stop) const;

  // Copies plain files of a folder in the workspace (links and devices are left) to `to`; how many.
  std::size_t take_back(const std::string& folder, const std::filesystem::path& to) const;

 private:
  std::filesystem::path place_, path_;
  std::vector<IsolationProbeResult> probes_;
};

}  // namespace rotorloop::closed_loop
