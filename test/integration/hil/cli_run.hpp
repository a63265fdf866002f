// Runs the built `rotorloop` command as a user does: in a folder of its own, with a scenario written there.
#pragma once
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

namespace rotorloop::test {

inline std::string read_text(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

inline void write_text(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream out(path, std::ios::binary);
  out << text;
  if (!out.flush()) throw std::runtime_error("cannot write " + path.string());
}

// A new empty folder, removed at the end.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "rotorloop_test_XXXXXX").string();
    if (!mkdtemp(pattern.data())) throw std::runtime_error("cannot make " + pattern);
    path_ = pattern;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

struct CommandResult {
  int exit_code = -1;
  std::string out, err;
};

// `arguments` as typed in a shell.
inline CommandResult rotorloop_command(const std::string& arguments, const std::filesystem::path& working_directory) {
  const ScratchFolder streams;
  const std::string line = "cd '" + working_directory.string() + "' && '" ROTORLOOP_COMMAND "' " + arguments + " >'" +
                           (streams / "out").string() + "' 2>'" + (streams / "err").string() + "'";
  const int status = std::system(line.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read_text(streams / "out"), read_text(streams / "err")};
}

// Climbs by one metre within two seconds, at rest at both ends: 35t^4 - 84t^5 + 70t^6 - 20t^7 with t in units of 2 s.
inline constexpr const char* kShortClimb = R"(format = 1
name = "short climb"
[[segment]]
duration_s = 0.5
x_m = [0]
y_m = [0]
z_m = [2]
yaw_rad = [0]
[[segment]]
duration_s = 2
x_m = [0]
y_m = [0]
z_m = [2, 0, 0, 0, 2.1875, -2.625, 1.09375, -0.15625]
yaw_rad = [0]
[[segment]]
duration_s = 0.5
x_m = [0]
y_m = [0]
z_m = [3]
yaw_rad = [0]
)";

// A scenario of one flight with the shipped vehicle; `more` is appended.
inline std::filesystem::path write_short_scenario(const std::filesystem::path& folder, const std::string& more = "",
                                                  const std::string& seeds = "[1]") {
  const std::string source = ROTORLOOP_SOURCE_DIR;
  write_text(folder / "climb.toml", kShortClimb);
  write_text(folder / "short.toml", "format = 1\nname = \"short\"\nplant = \"" + source + "/vehicles/reference_plant.toml\"\nvehicle = \"" +
                                        source + "/vehicles/calibrated.toml\"\nseeds = " + seeds +
                                        "\nvariants = [\"pd_ff_thrust_drag\"]\n[controller]\ngains = \"" + source +
                                        "/vehicles/gains.toml\"\n[[flight]]\nname = \"climb\"\ntrajectory = \"climb.toml\"\n" + more);
  return folder / "short.toml";
}

inline nlohmann::json result_of(const std::filesystem::path& run_folder) {
  return nlohmann::json::parse(read_text(run_folder / "result.json"), nullptr, false);
}

}  // namespace rotorloop::test
