#include "bench/stand/run/run_files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>

#include "bench/stand/run_folder.hpp"
#include "host/base/error.hpp"

namespace rotorloop::stand_run {
namespace {
constexpr std::int64_t kFlush_ns = 10'000'000;  // a reading is 100 ms old at the latest when it is safe: room for a busy machine
}

RunFiles::RunFiles(const std::filesystem::path& folder) : folder_(folder) {
  std::error_code error;
  if (std::filesystem::exists(folder, error) &&
      (!std::filesystem::is_directory(folder, error) || !std::filesystem::is_empty(folder, error)))
    throw Error({folder.generic_string(), "is there already", "", "give a new folder with -o: samples of a run are never replaced"});
  std::filesystem::create_directories(folder, error);
  if (error)
    throw Error({folder.generic_string(), "cannot be made: " + error.message(), "", "give another folder with -o"}, ExitCode::device);
  open(readings_, stand::kReadingsFile, stand::kReadingsHeader);
  open(samples_, stand::kSamplesFile, stand::samples_header());
  open(steps_, stand::kStepsFile, stand::kStepsHeader);
  open(events_, stand::kEventsFile, "");
}

RunFiles::~RunFiles() {
  for (File* f : {&readings_, &samples_, &steps_, &events_}) {
    write(*f);
    if (f->fd >= 0) ::close(f->fd);
  }
}

void RunFiles::open(File& file, const char* name, std::string_view header) {
  const auto path = folder_ / name;
  file.fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0644);
  if (file.fd < 0)
    throw Error({path.generic_string(), fmt::format("cannot be made: {}", std::strerror(errno)), "", "give another folder with -o"},
                ExitCode::device);
  if (!header.empty()) file.waiting.append(header).push_back('\n');
  write(file);
}

void RunFiles::write(File& f) {
  std::size_t done = 0;
  while (f.fd >= 0 && done < f.waiting.size()) {
    const auto n = ::write(f.fd, f.waiting.data() + done, f.waiting.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      failed_ = true;
      break;
    }
    done += static_cast<std::size_t>(n);
  }
  f.waiting.clear();
}

void RunFiles::event(const nlohmann::ordered_json& event) { events_.waiting.append(event.dump()).push_back('\n'); }

void RunFiles::write_history(std::string_view text) {
  File f;
  f.fd = ::open((folder_ / stand::kTripFile).c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (f.fd < 0) {
    failed_ = true;
    return;
  }
  f.waiting = text;
  write(f);
  ::close(f.fd);
}

void RunFiles::flush(std::int64_t now_ns, bool at_once) {
  if (!at_once && now_ns - flushed_ns_ < kFlush_ns) return;
  flushed_ns_ = now_ns;
  for (File* f : {&readings_, &samples_, &steps_, &events_}) write(*f);
}

}  // namespace rotorloop::stand_run
