#include "bench/hil/closed_loop/workspace.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "host/base/error.hpp"

namespace rotorloop::closed_loop {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void no_workspace(const fs::path& path, const std::string& why) {
  throw Error({path.generic_string(), "the folder of the sandbox cannot be made: " + why,
               "no space or no permission in the temporary folder", "set TMPDIR to a folder with some hundred megabytes free"},
              ExitCode::device);
}

}  // namespace

Workspace::Workspace(const std::vector<std::pair<fs::path, std::string>>& papers) {
  std::string place = (fs::temp_directory_path() / "workspace-XXXXXX").string();
  if (!::mkdtemp(place.data())) no_workspace(place, std::strerror(errno));
  place_ = place;
  path_ = place_ / "workspace";
  std::error_code ec;
  fs::create_directories(path_, ec);
  for (const auto& [from, name] : papers) {
    fs::create_directories((path_ / name).parent_path(), ec);
    if (!ec) fs::copy_file(from, path_ / name, ec);
    if (ec) no_workspace(from, ec.message());
  }
}

Workspace::~Workspace() {
  std::error_code ec;
  fs::remove_all(place_, ec);
}

const std::vector<IsolationProbeResult>& Workspace::isolate(const Prober& prober, const std::vector<fs::path>& secrets) {
  probes_ = find_sandbox(path_, prober, secrets);
  return probes_;
}

int Workspace::run(const fs::path& program, const std::vector<std::string>& arguments, const fs::path& output, const fs::path& errors,
                   const std::function<void(const std::string&)>& line, const std::atomic<bool>* stop) const {
  ProgramCall call;
  call.program = program;
  call.arguments = arguments;
  call.folder = path_;
  call.output = output;
  call.errors = errors;
  call.line = line;
  call.stop = stop;
  call.sandbox = probes_.empty() ? SandboxLayers{} : probes_.back().layers;
  return run_program(call);
}

std::size_t Workspace::take_back(const std::string& folder, const fs::path& to) const {
  std::size_t count = 0;
  std::error_code ec;
  const fs::path from = path_ / folder;
  if (!fs::is_directory(fs::symlink_status(from, ec))) return 0;
  for (const auto& entry : fs::recursive_directory_iterator(from, ec)) {
    if (entry.is_symlink() || !entry.is_regular_file() || entry.hard_link_count() != 1) continue;
    const fs::path target = to / entry.path().lexically_relative(from);
    fs::create_directories(target.parent_path());
    fs::copy_file(entry.path(), target, fs::copy_options::overwrite_existing);
    fs::permissions(target, fs::perms::owner_read | fs::perms::owner_write, ec);
    ++count;
  }
  return count;
}

}  // namespace rotorloop::closed_loop
