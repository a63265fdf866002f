// A stage of the loop is a folder with a done-file that names what it was made from. A stage whose done-file names the same is not made
// again: a run that was stopped goes on where it was, and a changed input makes anew exactly what depends on it.
#pragma once
#include <filesystem>
#include <map>
#include <string>

namespace rotorloop::closed_loop {

using StageInputs = std::map<std::string, std::string>;  // name -> SHA-256 of a file, or a text such as arguments

class Stage {
 public:
  Stage(std::filesystem::path folder, StageInputs inputs) : folder_(std::move(folder)), inputs_(std::move(inputs)) {}
  const std::filesystem::path& folder() const { return folder_; }
  bool done() const;                              // made from exactly these inputs
  void begin() const;                             // an empty folder
  void finish(const std::string& made_by) const;  // the done-file, last of all
  std::string made_by() const;                    // of the done-file; empty: none

 private:
  std::filesystem::path done_file() const { return folder_ / "done.toml"; }
  std::filesystem::path folder_;
  StageInputs inputs_;
};

}  // namespace rotorloop::closed_loop
